//! Naive shading: every pixel, every light, every shadow map.

use super::{Band, Layouts};
use crate::bind::{self, Slot};
use crate::settings::RendererOptions;
use crate::{passes::shadow_maps, shaders, timers::Timers};

pub(crate) struct Shade {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

/// What shading reads and writes.
#[derive(Clone, Copy)]
pub(crate) struct ShadeInputs<'a> {
    pub ids: &'a wgpu::TextureView,
    pub atlas: &'a wgpu::TextureView,
    pub lights: &'a wgpu::Buffer,
    pub sums: &'a wgpu::Buffer,
}

impl Shade {
    pub fn new(device: &wgpu::Device, layouts: &Layouts, options: &RendererOptions) -> Self {
        let slots = [Slot::Ids, Slot::DepthArray, Slot::Read, Slot::Write];
        let layout = bind::layout(device, "shade", wgpu::ShaderStages::COMPUTE, &slots);
        let pipeline = bind::compute_pipeline(
            device,
            &shaders::SHADE.module(device),
            "main",
            &[Some(&layouts.frame), Some(&layouts.scene), Some(&layout)],
            &[
                shadow_maps::parameterisation(options),
                ("NEAR", shadow_maps::NEAR),
                ("FILTER", f64::from(options.pcf)),
            ],
        );
        Self { layout, pipeline }
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
        let group = bind::group(
            device,
            &self.layout,
            &[
                wgpu::BindingResource::TextureView(inputs.ids),
                wgpu::BindingResource::TextureView(inputs.atlas),
                inputs.lights.as_entire_binding(),
                inputs.sums.as_entire_binding(),
            ],
        );
        band.dispatch(encoder, "shade", timers.compute("shade_gpu_ms"), &self.pipeline, &group);
    }
}
