//! One file a pass: `new` makes pipelines, `record` records. None owns scene state.

pub(crate) mod debug;
pub(crate) mod exposure;
pub(crate) mod multipass;
pub(crate) mod resolve;
pub(crate) mod select;
pub(crate) mod shade;
pub(crate) mod shadow_maps;
pub(crate) mod tonemap;
pub(crate) mod visibility;

use crate::bind::{self, Slot};
use crate::device_tuning::DeviceTuning;
use crate::shader_constants::{TILE, WORKGROUP};
use crate::shaders;

/// Bind group layouts that passes share: 0 the frame, 1 the scene.
pub(crate) struct Layouts {
    pub tuning: DeviceTuning,
    pub frame: wgpu::BindGroupLayout,
    pub scene: wgpu::BindGroupLayout,
}

impl Layouts {
    pub fn new(device: &wgpu::Device, tuning: DeviceTuning) -> Self {
        let all = wgpu::ShaderStages::VERTEX_FRAGMENT | wgpu::ShaderStages::COMPUTE;
        Self {
            tuning,
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

/// How many workgroups.
#[derive(Clone, Copy)]
pub(crate) enum Groups<'a> {
    /// These.
    Count([u32; 2]),
    /// What the device finds at an offset in a buffer.
    Indirect(&'a wgpu::Buffer, u64),
}

impl Groups<'_> {
    /// Groups of 8 × 8 over so many points.
    pub fn tiles(points: [u32; 2]) -> Self {
        Self::Count(points.map(|n| n.div_ceil(TILE)))
    }

    /// Groups of 64 × 1 over so many points, for kernels that store them all: rows fill whole pages of memory.
    pub fn rows([width, height]: [u32; 2]) -> Self {
        Self::Count([width.div_ceil(WORKGROUP), height])
    }
}

/// A compute pipeline with bind groups 0 (frame), 1 (scene) and 2 (its own).
pub(crate) struct Kernel {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
    label: &'static str,
    sees_scene: bool,
}

impl Kernel {
    pub fn new(
        device: &wgpu::Device,
        layouts: &Layouts,
        source: &shaders::Source,
        entry: &'static str,
        slots: &[Slot],
        constants: &[(&str, f64)],
    ) -> Self {
        let layout = bind::layout(device, source.name, wgpu::ShaderStages::COMPUTE, slots);
        // A pass that does not look at the scene has that many storage buffers more for itself.
        let sees_scene = source.uses.contains(&"scene");
        let groups = [Some(&layouts.frame), sees_scene.then_some(&layouts.scene), Some(&layout)];
        let pipeline = bind::compute_pipeline(
            device,
            &source.module(device, &layouts.tuning),
            entry,
            &groups,
            constants,
        );
        Self { layout, pipeline, label: source.name, sees_scene }
    }

    /// Records one dispatch with these resources as bind group 2.
    pub fn record(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        timestamps: Option<wgpu::ComputePassTimestampWrites>,
        band: Band,
        resources: &[wgpu::BindingResource],
        groups: Groups,
    ) {
        let group = bind::group(device, &self.layout, resources);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(self.label),
            timestamp_writes: timestamps,
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, band.frame, &[band.frame_offset]);
        if self.sees_scene {
            pass.set_bind_group(1, band.scene, &[]);
        }
        pass.set_bind_group(2, &group, &[]);
        match groups {
            Groups::Count([x, y]) => pass.dispatch_workgroups(x, y, 1),
            Groups::Indirect(buffer, offset) => pass.dispatch_workgroups_indirect(buffer, offset),
        }
    }
}
