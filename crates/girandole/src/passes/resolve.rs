//! From sums over lights to the radiance of pixels.

use super::{Band, Groups, Kernel, Layouts};
use crate::bind::Slot;
use crate::{shaders, timers::Timers};

pub(crate) struct Resolve {
    kernel: Kernel,
    /// Whether it was compiled for textures.
    pub textures: bool,
}

/// What resolving reads and writes.
#[derive(Clone, Copy)]
pub(crate) struct ResolveInputs<'a> {
    pub ids: &'a wgpu::TextureView,
    pub sums: &'a wgpu::Buffer,
    pub pixels: &'a wgpu::Buffer,
    pub radiance: &'a wgpu::TextureView,
}

impl Resolve {
    pub fn new(device: &wgpu::Device, layouts: &Layouts, textures: bool) -> Self {
        let slots = [Slot::Ids, Slot::Read, Slot::Write, Slot::Radiance];
        let constants = [("TEXTURES", f64::from(u8::from(textures)))];
        Self { kernel: Kernel::new(device, layouts, &shaders::RESOLVE, "main", &slots, &constants), textures }
    }

    pub fn record(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        timers: &Timers,
        band: Band,
        inputs: ResolveInputs,
    ) {
        let resources = [
            wgpu::BindingResource::TextureView(inputs.ids),
            inputs.sums.as_entire_binding(),
            inputs.pixels.as_entire_binding(),
            wgpu::BindingResource::TextureView(inputs.radiance),
        ];
        let time = timers.compute("resolve_gpu_ms");
        self.kernel.record(device, encoder, time, band, &resources, Groups::tiles(band.size));
    }
}
