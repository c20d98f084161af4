//! The visibility buffer: which triangle each pixel shows, and of which surface it is.

use super::BandSample;
use super::caller_depth::CallerDepth;
use crate::device::kernel::{Draw, RenderKernel, Shared, buffer};
use crate::device::recorder::Recorder;
use crate::points::targets::{DEPTH, SURFACE_IDS, TRIANGLE_IDS};
use crate::shaders;

pub(crate) struct VisibilityBuffer {
    opaque: RenderKernel,
    masked: RenderKernel,
}

/// What the pixels of a sample show.
#[derive(Clone, Copy)]
pub(crate) struct Seen<'a> {
    /// Triangle, plus one; 0 = none.
    pub triangle_ids: &'a wgpu::TextureView,
    /// Surface and material.
    pub surface_ids: &'a wgpu::TextureView,
    /// Reversed depth, near / distance.
    pub depth: &'a wgpu::TextureView,
}

/// What becomes of depth, beside deciding what is seen.
#[derive(Clone, Copy)]
pub(crate) enum DepthUse<'a> {
    /// Nothing.
    Discard,
    /// Somebody reads it.
    Keep,
    /// The caller's depth hides what lies behind it; somebody may read the result.
    Behind(&'a CallerDepth, &'a wgpu::TextureView),
}

impl VisibilityBuffer {
    pub fn new(device: &wgpu::Device, shared: &Shared) -> Self {
        let pipeline = |fragment| {
            let draw = Draw {
                vertex: "project_triangle",
                fragment: Some(fragment),
                topology: wgpu::PrimitiveTopology::TriangleList,
                depth: Some((DEPTH, wgpu::CompareFunction::Greater)),
                targets: &[Some(TRIANGLE_IDS.into()), Some(SURFACE_IDS.into())],
            };
            RenderKernel::new(device, shared, &shaders::VISIBILITY_BUFFER, &draw, &[])
        };
        Self { opaque: pipeline("opaque"), masked: pipeline("masked") }
    }

    /// Rasterises the scene.
    pub fn record<'a>(&self, recorder: &mut Recorder, band: &BandSample<'a>, depth: DepthUse) -> Seen<'a> {
        let (scene, targets) = (band.scene, band.targets);
        let resources = [
            buffer("triangle_order", &scene.triangle_order),
            buffer("triangle_surfaces", &scene.triangle_surfaces),
        ];
        let kernels = [&self.opaque, &self.masked];
        let groups = kernels.map(|k| k.group(recorder.device, &resources));
        let uniform = recorder.uniform(&band.frame);
        let color = |view| {
            Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(Default::default()),
                    store: wgpu::StoreOp::Store,
                },
            })
        };
        let (load, store) = match depth {
            DepthUse::Discard => (wgpu::LoadOp::Clear(0.0), wgpu::StoreOp::Discard),
            DepthUse::Keep => (wgpu::LoadOp::Clear(0.0), wgpu::StoreOp::Store),
            DepthUse::Behind(pass, callers) => {
                pass.import(recorder, band, callers);
                (wgpu::LoadOp::Load, wgpu::StoreOp::Store)
            }
        };
        let timestamps = recorder.timers.render("visibility_buffer_gpu_ms");
        let mut pass = recorder.encoder().begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("visibility buffer"),
            color_attachments: &[color(&targets.triangle_ids), color(&targets.surface_ids)],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &targets.depth,
                depth_ops: Some(wgpu::Operations { load, store }),
                stencil_ops: None,
            }),
            timestamp_writes: timestamps,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        let [opaque, masked] = scene.counts;
        for ((kernel, group), vertices) in
            kernels.iter().zip(&groups).zip([0..3 * opaque, 3 * opaque..3 * (opaque + masked)])
        {
            if !vertices.is_empty() {
                kernel.set(&mut pass, (Some(&uniform), Some(&scene.group)), group);
                pass.draw(vertices, 0..1);
            }
        }
        Seen { triangle_ids: &targets.triangle_ids, surface_ids: &targets.surface_ids, depth: &targets.depth }
    }
}
