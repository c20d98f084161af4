//! Automatic exposure: a histogram of luminance, and the stops that follow from it.

use crate::bind::{self, Slot};
use crate::shader_constants::{HISTOGRAM_BINS, TILE};
use crate::shaders;

pub(crate) struct Exposure {
    layout: wgpu::BindGroupLayout,
    clear: wgpu::ComputePipeline,
    count: wgpu::ComputePipeline,
    choose: wgpu::ComputePipeline,
    histogram: wgpu::Buffer,
    /// The stops, one float.
    pub stops: wgpu::Buffer,
}

impl Exposure {
    pub fn new(device: &wgpu::Device, tuning: &crate::DeviceTuning) -> Self {
        let slots = [Slot::Ids, Slot::Write, Slot::Write];
        let layout = bind::layout(device, "exposure", wgpu::ShaderStages::COMPUTE, &slots);
        let module = shaders::EXPOSURE.module(device, tuning);
        let pipeline = |entry| bind::compute_pipeline(device, &module, entry, &[Some(&layout)], &[]);
        let buffer = |label, size| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: wgpu::BufferUsages::STORAGE,
                mapped_at_creation: false,
            })
        };
        Self {
            clear: pipeline("clear"),
            count: pipeline("count"),
            choose: pipeline("choose"),
            histogram: buffer("histogram", u64::from(HISTOGRAM_BINS) * 4),
            stops: buffer("exposure", 4),
            layout,
        }
    }

    pub fn record(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        picture: &wgpu::TextureView,
        size: [u32; 2],
    ) {
        let group = bind::group(
            device,
            &self.layout,
            &[
                wgpu::BindingResource::TextureView(picture),
                self.histogram.as_entire_binding(),
                self.stops.as_entire_binding(),
            ],
        );
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_bind_group(0, &group, &[]);
        for (pipeline, [x, y]) in
            [(&self.clear, [1, 1]), (&self.count, size.map(|n| n.div_ceil(TILE))), (&self.choose, [1, 1])]
        {
            pass.set_pipeline(pipeline);
            pass.dispatch_workgroups(x, y, 1);
        }
    }
}
