//! From what pixels receive to the radiance that they send, averaged over their samples.

use super::visibility_buffer::Seen;
use super::{BandSample, Compiler, GridView};
use crate::device::kernel::{Groups, Kernel, Shared, buffer, texture};
use crate::device::recorder::Recorder;
use crate::shaders;

pub(crate) struct Resolve {
    kernel: Kernel,
}

impl Resolve {
    pub fn new(compiler: &Compiler) -> Self {
        Self { kernel: compiler.kernel(&shaders::RESOLVE, "resolve") }
    }

    /// See [`Kernel::order`].
    pub fn order(&self, shared: &Shared) -> bool {
        self.kernel.order(shared)
    }

    /// Adds a sample to the picture.
    pub fn record(&self, recorder: &mut Recorder, band: &BandSample, seen: Seen, lit: GridView) {
        let mut resources = vec![
            texture("triangle_ids", seen.triangle_ids),
            texture("irradiance", lit.irradiance),
            texture("directional", lit.directional),
            buffer("partial_sums", &band.targets.partial_sums),
            texture("picture", &band.targets.picture_view),
        ];
        resources.extend(band.reflected_environment());
        let groups = Groups::tiles(band.size());
        self.kernel.record(recorder, band.groups(), "resolve_gpu_ms", &resources, groups);
    }
}
