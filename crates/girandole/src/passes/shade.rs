//! Naive shading: every pixel, every light, every shadow map.

use super::{Band, Groups, Kernel, Layouts};
use crate::bind::Slot;
use crate::settings::RendererOptions;
use crate::{passes::shadow_maps, shaders, timers::Timers};

pub(crate) struct Shade {
    kernel: Kernel,
    /// What it was compiled for.
    pub needs: SceneFeatures,
}

/// What a scene and its lights need of shading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SceneFeatures {
    /// Some material has a specular lobe.
    pub specular: bool,
    /// All lights fall off with the cosine.
    pub plain_lights: bool,
    /// Some material has a texture.
    pub textures: bool,
    /// Some surface has normals that vary.
    pub curved: bool,
}

pub(crate) use crate::shader_constants::{BATCH, GROUP};

/// What shading reads and writes.
#[derive(Clone)]
pub(crate) struct ShadeInputs<'a> {
    pub ids: &'a wgpu::TextureView,
    pub atlas: &'a wgpu::TextureView,
    /// Lights from the first one of the batch on: [`BATCH`] of them at least, used or not.
    pub lights: wgpu::BufferBinding<'a>,
    pub maps: &'a wgpu::Buffer,
    pub sums: &'a wgpu::Buffer,
    /// Where the last batch leaves what it all came to.
    pub grid: [&'a wgpu::TextureView; 2],
}

impl Shade {
    /// Compiles shading for what a scene and its lights need.
    pub fn new(
        device: &wgpu::Device,
        layouts: &Layouts,
        options: &RendererOptions,
        needs: SceneFeatures,
    ) -> Self {
        let (source, maps) = (&shaders::SHADE_NAIVE, shadow_maps::slot(&layouts.tuning));
        let slots = [Slot::Ids, maps, Slot::Uniform, Slot::Write, Slot::Uniform, Slot::Grid, Slot::Grid];
        let constants = constants(options, needs);
        Self { kernel: Kernel::new(device, layouts, source, "shade_naive", &slots, &constants), needs }
    }

    /// Adds the lights of the frame's batch to the sums of the band.
    pub fn record(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        timers: &Timers,
        band: Band,
        inputs: ShadeInputs,
    ) {
        let resources = [
            wgpu::BindingResource::TextureView(inputs.ids),
            wgpu::BindingResource::TextureView(inputs.atlas),
            wgpu::BindingResource::Buffer(inputs.lights),
            inputs.sums.as_entire_binding(),
            inputs.maps.as_entire_binding(),
            wgpu::BindingResource::TextureView(inputs.grid[0]),
            wgpu::BindingResource::TextureView(inputs.grid[1]),
        ];
        let time = timers.compute("shade_gpu_ms");
        self.kernel.record(device, encoder, time, band, &resources, Groups::tiles(band.size));
    }
}

/// What every kernel that looks at shadow maps is compiled with.
pub(crate) fn constants(options: &RendererOptions, needs: SceneFeatures) -> [(&'static str, f64); 6] {
    [
        shadow_maps::parameterisation(options),
        ("NEAR", shadow_maps::NEAR),
        ("FILTER", f64::from(options.pcf)),
        ("HAS_SPECULAR", f64::from(u8::from(needs.specular))),
        ("ONLY_COSINE_LIGHTS", f64::from(u8::from(needs.plain_lights))),
        ("HAS_TEXTURES", f64::from(u8::from(needs.textures))),
    ]
}
