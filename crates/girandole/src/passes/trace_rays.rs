//! Rays of the caller's; see `shaders/lib/rays.wgsl`.

use super::Compiler;
use crate::Result;
use crate::device::buffers::storage;
use crate::device::kernel::{Groups, Kernel, buffer, texture};
use crate::device::readback;
use crate::device::recorder::Recorder;
use crate::gpu_scene::geometry::GpuScene;
use crate::layout::{CallersRay, Frame};
use crate::rays::RayHierarchies;
use crate::shader_constants::{GROUPS_PER_ROW, WORKGROUP};
use crate::shaders;
use girandole_core::trace::Hit;

pub(crate) struct TraceRays {
    closest: Kernel,
    any: Kernel,
}

impl TraceRays {
    pub fn new(compiler: &Compiler) -> Self {
        let kernel = |entry| compiler.kernel(&shaders::TRACE_RAYS, entry);
        Self { closest: kernel("closest_hits"), any: kernel("any_hits") }
    }

    /// Traces rays against a scene: the closest hits, or any.
    ///
    /// # Errors
    /// [`crate::Error::TooLarge`] beyond the device's limits.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &GpuScene,
        hierarchies: &RayHierarchies,
        rays: &[CallersRay],
        is_any: bool,
    ) -> Result<TracedRays> {
        let device = recorder.device;
        let rays_buffer = storage(device, "rays", rays)?;
        let size = (rays.len().max(1) * size_of::<[u32; 4]>()) as u64;
        let make = |label, usage| {
            let usage = usage | wgpu::BufferUsages::COPY_DST;
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        let hits = make("hits", wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
        let copy = make("read-back", wgpu::BufferUsages::MAP_READ);
        let resources = [
            texture("ray_texels", &hierarchies.texels),
            buffer("callers_rays", &rays_buffer),
            buffer("hits", &hits),
        ];
        let groups = (rays.len() as u32).div_ceil(WORKGROUP);
        let groups = Groups::Count([groups.min(GROUPS_PER_ROW), groups.div_ceil(GROUPS_PER_ROW)]);
        let kernel = if is_any { &self.any } else { &self.closest };
        kernel.record(recorder, (&Frame::default(), Some(&scene.group)), "rays_gpu_ms", &resources, groups);
        recorder.encoder().copy_buffer_to_buffer(&hits, 0, &copy, 0, size);
        Ok(TracedRays { copy, count: rays.len() })
    }
}

/// What rays met, on its way back.
pub(crate) struct TracedRays {
    copy: wgpu::Buffer,
    count: usize,
}

impl TracedRays {
    /// One for each ray.
    pub async fn hits(self) -> Result<Vec<Option<Hit>>> {
        let bytes = readback::bytes(&self.copy).await?;
        let words = bytemuck::pod_collect_to_vec::<u8, [u32; 4]>(&bytes);
        Ok(words.into_iter().take(self.count).map(hit).collect())
    }
}

fn hit([t, triangle, u, v]: [u32; 4]) -> Option<Hit> {
    let [t, u, v] = [t, u, v].map(f32::from_bits);
    (triangle != girandole_core::scene::NONE).then_some(Hit { t, triangle, barycentric: [u, v].into() })
}
