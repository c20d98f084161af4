//! From sums over lights to the radiance of pixels.

use super::{Band, Groups, Kernel, Layouts};
use crate::bind::Slot;
use crate::{shaders, timers::Timers};

pub(crate) struct Resolve {
    kernel: Kernel,
    /// What it was compiled for: textures, specular lobes.
    pub key: [bool; 2],
}

/// What resolving reads and writes.
#[derive(Clone, Copy)]
pub(crate) struct ResolveInputs<'a> {
    pub ids: &'a wgpu::TextureView,
    pub grid: &'a [wgpu::TextureView; 2],
    pub sums: &'a wgpu::Buffer,
    pub picture: &'a wgpu::TextureView,
}

impl Resolve {
    pub fn new(device: &wgpu::Device, layouts: &Layouts, key: [bool; 2]) -> Self {
        let slots = [Slot::Ids, Slot::Float, Slot::Write, Slot::Picture, Slot::Float];
        let [textures, specular] = key.map(|k| f64::from(u8::from(k)));
        let constants = [("HAS_TEXTURES", textures), ("HAS_SPECULAR", specular)];
        Self { kernel: Kernel::new(device, layouts, &shaders::RESOLVE, "resolve", &slots, &constants), key }
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
            wgpu::BindingResource::TextureView(&inputs.grid[0]),
            inputs.sums.as_entire_binding(),
            wgpu::BindingResource::TextureView(inputs.picture),
            wgpu::BindingResource::TextureView(&inputs.grid[1]),
        ];
        let time = timers.compute("resolve_gpu_ms");
        self.kernel.record(device, encoder, time, band, &resources, Groups::tiles(band.size));
    }
}
