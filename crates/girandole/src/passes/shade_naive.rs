//! Naive shading: every pixel, every light, every shadow map.

use super::visibility_buffer::Seen;
use super::{BandSample, Compiler, GridView, MapsView};
use crate::device::kernel::{Groups, Kernel, Shared, buffer, texture};
use crate::device::recorder::Recorder;
use crate::shaders;

pub(crate) struct ShadeNaive {
    kernel: Kernel,
}

impl ShadeNaive {
    pub fn new(compiler: &Compiler) -> Self {
        Self { kernel: compiler.kernel(&shaders::SHADE_NAIVE, "shade_naive") }
    }

    /// See [`Kernel::order`].
    pub fn order(&self, shared: &Shared) -> bool {
        self.kernel.order(shared)
    }

    /// Sums the band's batch of lights at all pixels; the last one completes `grid`.
    pub fn record<'a>(
        &self,
        recorder: &mut Recorder,
        band: &BandSample,
        seen: Seen,
        maps: MapsView,
        lights: wgpu::BufferBinding,
        grid: GridView<'a>,
    ) -> GridView<'a> {
        let resources = [
            texture("triangle_ids", seen.triangle_ids),
            texture("mirror_hits", seen.ends()),
            texture("atlas", maps.atlas),
            buffer("maps", maps.maps),
            ("lights", wgpu::BindingResource::Buffer(lights)),
            buffer("partial_sums", &band.targets.partial_sums),
            texture("fine_irradiance", grid.irradiance),
            texture("fine_directional", grid.directional),
        ];
        let groups = Groups::tiles(band.size());
        self.kernel.record(recorder, band.groups(), "shade_gpu_ms", &resources, groups);
        grid
    }
}
