//! The visibility buffer: which triangle each pixel shows, and of which surface it is.

use super::BandSample;
use super::caller_depth::CallerDepth;
use crate::device::kernel::{Binding, Draw, RenderKernel, Shared, buffer, texture};
use crate::device::recorder::Recorder;
use crate::points::targets::{DEPTH, LayerTargets, SURFACE_IDS, TRIANGLE_IDS};
use crate::shaders;
use girandole_core::image::Region;
use std::ops::Range;

pub(crate) struct VisibilityBuffer {
    opaque: RenderKernel,
    masked: RenderKernel,
    layer: RenderKernel,
}

/// What the pixels of a sample show.
#[derive(Clone, Copy)]
pub(crate) struct Seen<'a> {
    /// Triangle, plus one; 0 = none.
    pub triangle_ids: &'a wgpu::TextureView,
    /// Surface and material.
    pub surface_ids: &'a wgpu::TextureView,
    /// Reversed depth, near / distance; any texture where pixels show the ends of rays.
    pub depth: &'a wgpu::TextureView,
    /// Where mirrored rays ended, if that is what pixels show.
    pub mirror_hits: Option<&'a wgpu::TextureView>,
}

impl<'a> Seen<'a> {
    /// Where mirrored rays ended; where there are none, a texture that no kernel reads.
    pub fn ends(&self) -> &'a wgpu::TextureView {
        self.mirror_hits.unwrap_or(self.triangle_ids)
    }
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
        let pipeline = |vertex, fragment| {
            let draw = Draw {
                vertex,
                fragment: Some(fragment),
                topology: wgpu::PrimitiveTopology::TriangleList,
                depth: Some((DEPTH, wgpu::CompareFunction::Greater)),
                targets: vec![Some(TRIANGLE_IDS.into()), Some(SURFACE_IDS.into())],
            };
            RenderKernel::new(device, shared, (&shaders::VISIBILITY_BUFFER, &shared.kernels), draw, &[])
        };
        Self {
            opaque: pipeline("project_triangle", "opaque"),
            masked: pipeline("project_triangle", "masked"),
            layer: pipeline("project_layer", "layer"),
        }
    }

    /// Orders what every scene needs, see [`RenderKernel::order`].
    pub fn order(&self, shared: &Shared) -> bool {
        self.opaque.order(shared)
    }

    /// Rasterises the scene, but for what lets light through.
    pub fn record<'a>(&self, recorder: &mut Recorder, band: &BandSample<'a>, depth: DepthUse) -> Seen<'a> {
        let [opaque, masked, _] = band.scene.counts;
        let kernels =
            [(&self.opaque, 0..3 * opaque, &[][..]), (&self.masked, 3 * opaque..3 * (opaque + masked), &[])];
        let (load, store) = match depth {
            DepthUse::Discard => (wgpu::LoadOp::Clear(0.0), wgpu::StoreOp::Discard),
            DepthUse::Keep => (wgpu::LoadOp::Clear(0.0), wgpu::StoreOp::Store),
            DepthUse::Behind(pass, callers) => {
                pass.import(recorder, band, callers);
                (wgpu::LoadOp::Load, wgpu::StoreOp::Store)
            }
        };
        let attachment = (&band.targets.depth, wgpu::Operations { load, store });
        rasterise(recorder, band, attachment, &kernels)
    }

    /// Rasterises what lets light through: the nearest such surfaces beyond those of the layer before, as far as they are not
    /// hidden. [`VisibilityBuffer::record`] has kept its depth.
    pub fn record_layer<'a>(
        &self,
        recorder: &mut Recorder,
        band: &BandSample<'a>,
        layers: &'a LayerTargets,
        layer: u32,
    ) -> Seen<'a> {
        let [opaque, masked, transparent] = band.scene.counts;
        let first = 3 * (opaque + masked);
        let [ours, nearer] = [layer, layer + 1].map(|index| &layers.depth[index as usize % 2]);
        let (from, to) = (band.targets.depth.texture(), ours.texture());
        recorder.encoder().copy_texture_to_texture(from.as_image_copy(), to.as_image_copy(), from.size());
        if layer == 0 {
            clear_depth(recorder, nearer);
        }
        let resources = [texture("nearer_depth", nearer)];
        let kernels = [(&self.layer, first..first + 3 * transparent, &resources[..])];
        let operations = wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store };
        rasterise(recorder, band, (ours, operations), &kernels)
    }
}

/// Clears a depth texture to the nearest depth.
fn clear_depth(recorder: &mut Recorder, view: &wgpu::TextureView) {
    let operations = wgpu::Operations { load: wgpu::LoadOp::Clear(1.0), store: wgpu::StoreOp::Store };
    recorder.encoder().begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("nearest depth"),
        color_attachments: &[],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view,
            depth_ops: Some(operations),
            stencil_ops: None,
        }),
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
}

/// Draws these vertices with these kernels and what they bind besides the scene's triangles.
fn rasterise<'a>(
    recorder: &mut Recorder,
    band: &BandSample<'a>,
    (depth, operations): (&'a wgpu::TextureView, wgpu::Operations<f32>),
    kernels: &[(&RenderKernel, Range<u32>, &[Binding])],
) -> Seen<'a> {
    let (scene, targets) = (band.scene, band.targets);
    let triangles = [
        buffer("triangle_order", &scene.triangle_order),
        buffer("triangle_surfaces", &scene.triangle_surfaces),
    ];
    let drawn = || kernels.iter().filter(|(_, vertices, _)| !vertices.is_empty());
    let groups: Vec<_> = drawn()
        .map(|(kernel, _, resources)| kernel.group(recorder.device, &[&triangles, *resources].concat()))
        .collect();
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
    let (timestamps, is_rehearsal) =
        (recorder.timers.render("visibility_buffer_gpu_ms"), recorder.is_rehearsal);
    let mut pass = recorder.encoder().begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("visibility buffer"),
        color_attachments: &[color(&targets.triangle_ids), color(&targets.surface_ids)],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: depth,
            depth_ops: Some(operations),
            stencil_ops: None,
        }),
        timestamp_writes: timestamps,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    if let Some(Region { first: [x, y], size: [width, height] }) = targets.drawn.rasterised(targets.size) {
        pass.set_scissor_rect(x, y, width, height);
    }
    for ((kernel, vertices, _), group) in drawn().zip(&groups) {
        kernel.set(&mut pass, (Some(&uniform), Some(&scene.group)), group);
        let end = if is_rehearsal { vertices.start + 3 } else { vertices.end };
        pass.draw(vertices.start..end, 0..1);
    }
    Seen { triangle_ids: &targets.triangle_ids, surface_ids: &targets.surface_ids, depth, mirror_hits: None }
}
