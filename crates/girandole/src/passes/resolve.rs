//! From sums over lights to the radiance of pixels.

use super::{Band, Layouts};
use crate::bind::{self, Slot};
use crate::{shaders, timers::Timers};

pub(crate) struct Resolve {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
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
    pub fn new(device: &wgpu::Device, layouts: &Layouts) -> Self {
        let slots = [Slot::Ids, Slot::Read, Slot::Write, Slot::Radiance];
        let layout = bind::layout(device, "resolve", wgpu::ShaderStages::COMPUTE, &slots);
        let pipeline = bind::compute_pipeline(
            device,
            &shaders::RESOLVE.module(device),
            "main",
            &[Some(&layouts.frame), Some(&layouts.scene), Some(&layout)],
            &[],
        );
        Self { layout, pipeline }
    }

    pub fn record(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        timers: &Timers,
        band: Band,
        inputs: ResolveInputs,
    ) {
        let group = bind::group(
            device,
            &self.layout,
            &[
                wgpu::BindingResource::TextureView(inputs.ids),
                inputs.sums.as_entire_binding(),
                inputs.pixels.as_entire_binding(),
                wgpu::BindingResource::TextureView(inputs.radiance),
            ],
        );
        band.dispatch(encoder, "resolve", timers.compute("resolve_gpu_ms"), &self.pipeline, &group);
    }
}
