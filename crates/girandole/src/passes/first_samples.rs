//! The radiance of pixels' first samples, where further ones store theirs at once.

use super::edges::samples;
use super::visibility_buffer::Seen;
use super::{BandSample, Compiler, GridView};
use crate::device::kernel::{Groups, Kernel, Shared};
use crate::device::recorder::Recorder;
use crate::shader_constants::EDGE_RUN;
use crate::shaders;

pub(crate) struct FirstSamples {
    kernel: Kernel,
    /// Pixels of an invocation.
    run: u32,
}

impl FirstSamples {
    pub fn new(compiler: &Compiler) -> Self {
        let kernels = &compiler.shared.kernels;
        Self {
            kernel: compiler.kernel(shaders::edges(kernels), "resolve_first_samples"),
            run: kernels.tier.choose(1, EDGE_RUN),
        }
    }

    /// See [`Kernel::order`].
    pub fn order(&self, shared: &Shared) -> bool {
        self.kernel.order(shared)
    }

    /// Writes the radiance of first samples.
    pub fn record(&self, recorder: &mut Recorder, band: &BandSample, seen: Seen, first: GridView) {
        let [width, rows] = band.size();
        let groups = Groups::rows([width.div_ceil(self.run), rows]);
        let resources = samples(band, seen, first, band.targets.sample_grid());
        self.kernel.record(recorder, band.groups(), "resolve_gpu_ms", &resources, groups);
    }
}
