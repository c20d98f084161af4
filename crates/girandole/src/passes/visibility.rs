//! The visibility buffer: which triangle each pixel shows.

use super::{Band, Layouts};
use crate::bind::{self, Slot};
use crate::gpu_scene::GpuScene;
use crate::{shaders, timers::Timers};

/// Format of the triangle ids.
pub(crate) const IDS: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;
/// Format of keys and materials.
pub(crate) const KEYS: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Uint;
/// Format of the camera's depth.
pub(crate) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

pub(crate) struct Visibility {
    layout: wgpu::BindGroupLayout,
    opaque: wgpu::RenderPipeline,
    masked: wgpu::RenderPipeline,
}

impl Visibility {
    pub fn new(device: &wgpu::Device, layouts: &Layouts) -> Self {
        let layout =
            bind::layout(device, "visibility", wgpu::ShaderStages::VERTEX, &[Slot::Read, Slot::Read]);
        let module = shaders::VISIBILITY_BUFFER.module(device, &layouts.tuning);
        let groups =
            bind::pipeline_layout(device, &[Some(&layouts.frame), Some(&layouts.scene), Some(&layout)]);
        let pipeline = |entry| {
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some("visibility"),
                layout: Some(&groups),
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some("project_triangle"),
                    compilation_options: Default::default(),
                    buffers: &[],
                },
                primitive: Default::default(),
                depth_stencil: Some(wgpu::DepthStencilState {
                    format: DEPTH,
                    depth_write_enabled: Some(true),
                    depth_compare: Some(wgpu::CompareFunction::Greater),
                    stencil: Default::default(),
                    bias: Default::default(),
                }),
                multisample: Default::default(),
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some(entry),
                    compilation_options: Default::default(),
                    targets: &[Some(IDS.into()), Some(KEYS.into())],
                }),
                multiview_mask: None,
                cache: None,
            })
        };
        Self { opaque: pipeline("opaque"), masked: pipeline("masked"), layout }
    }

    pub fn record(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        timers: &Timers,
        band: Band,
        scene: &GpuScene,
        [ids, keys, depth]: [&wgpu::TextureView; 3],
    ) {
        let group = bind::group(
            device,
            &self.layout,
            &[scene.triangle_order.as_entire_binding(), scene.triangle_surfaces.as_entire_binding()],
        );
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("visibility"),
            color_attachments: &[ids, keys].map(|view| {
                Some(wgpu::RenderPassColorAttachment {
                    view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(Default::default()),
                        store: wgpu::StoreOp::Store,
                    },
                })
            }),
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            timestamp_writes: timers.render("visibility_buffer_gpu_ms"),
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_bind_group(0, band.frame, &[band.frame_offset]);
        pass.set_bind_group(1, band.scene, &[]);
        pass.set_bind_group(2, &group, &[]);
        let [opaque, masked] = scene.counts;
        if opaque > 0 {
            pass.set_pipeline(&self.opaque);
            pass.draw(0..3 * opaque, 0..1);
        }
        if masked > 0 {
            pass.set_pipeline(&self.masked);
            pass.draw(3 * opaque..3 * (opaque + masked), 0..1);
        }
    }
}
