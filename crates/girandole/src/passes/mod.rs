//! One file a pass: `new` makes pipelines, `record` records. None owns scene state.

pub(crate) mod exposure;
pub(crate) mod resolve;
pub(crate) mod shade;
pub(crate) mod shadow_maps;
pub(crate) mod tonemap;
pub(crate) mod visibility;

use crate::bind::{self, Slot};

/// Bind group layouts that passes share: 0 the frame, 1 the scene.
pub(crate) struct Layouts {
    pub frame: wgpu::BindGroupLayout,
    pub scene: wgpu::BindGroupLayout,
}

impl Layouts {
    pub fn new(device: &wgpu::Device) -> Self {
        let all = wgpu::ShaderStages::VERTEX_FRAGMENT | wgpu::ShaderStages::COMPUTE;
        Self {
            frame: bind::layout(device, "frame", all, &[Slot::UniformAt]),
            scene: bind::layout(device, "scene", all, &crate::gpu_scene::SCENE_SLOTS),
        }
    }
}

/// What every pass over a band of pixels needs: where it stands in the frame.
#[derive(Clone, Copy)]
pub(crate) struct Band<'a> {
    /// Bind group 0.
    pub frame: &'a wgpu::BindGroup,
    /// Its dynamic offset.
    pub frame_offset: u32,
    /// Bind group 1.
    pub scene: &'a wgpu::BindGroup,
    /// Pixels in x, and rows of the band.
    pub size: [u32; 2],
}

impl Band<'_> {
    /// Dispatches 8 × 8 pixels a group over the band.
    pub fn dispatch(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        label: &str,
        timestamps: Option<wgpu::ComputePassTimestampWrites>,
        pipeline: &wgpu::ComputePipeline,
        group: &wgpu::BindGroup,
    ) {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(label),
            timestamp_writes: timestamps,
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, self.frame, &[self.frame_offset]);
        pass.set_bind_group(1, self.scene, &[]);
        pass.set_bind_group(2, group, &[]);
        pass.dispatch_workgroups(self.size[0].div_ceil(8), self.size[1].div_ceil(8), 1);
    }
}
