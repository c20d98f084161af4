//! Shows radiance on the caller's target.

use crate::bind::{self, Slot};
use crate::layout::Display;
use crate::settings::RenderSettings;
use crate::shader_constants::{ACES, AGX, NO_CURVE};
use crate::shaders;
use girandole_core::tonemap::{Exposure, Tonemap};
use wgpu::util::DeviceExt;

/// A pipeline for each format of target and curve that were asked for so far.
pub(crate) struct ToneMapping {
    layout: wgpu::BindGroupLayout,
    module: wgpu::ShaderModule,
    pipelines: Vec<(Key, wgpu::RenderPipeline)>,
}

type Key = (wgpu::TextureFormat, Tonemap);

impl ToneMapping {
    pub fn new(device: &wgpu::Device, tuning: &crate::DeviceTuning) -> Self {
        let slots = [Slot::Uniform, Slot::Ids, Slot::Read];
        Self {
            layout: bind::layout(device, "tonemap", wgpu::ShaderStages::VERTEX_FRAGMENT, &slots),
            module: shaders::TONEMAP.module(device, tuning),
            pipelines: Vec::new(),
        }
    }

    /// Makes a pipeline unless it exists, and returns its index.
    fn pipeline(&mut self, device: &wgpu::Device, key: Key) -> usize {
        if let Some(index) = self.pipelines.iter().position(|(k, _)| *k == key) {
            return index;
        }
        let (format, tonemap) = key;
        let curve = match tonemap {
            Tonemap::Agx => AGX,
            Tonemap::Aces => ACES,
            Tonemap::None => NO_CURVE,
        };
        // A target with an sRGB format encodes by itself; floating-point targets stay linear.
        let float = format.has_color_aspect()
            && format.sample_type(None, None).is_some_and(|t| {
                matches!(t, wgpu::TextureSampleType::Float { .. })
                    && format.target_component_alignment() != Some(1)
            });
        let encode = !format.is_srgb() && !float;
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("tonemap"),
            layout: Some(&bind::pipeline_layout(device, &[Some(&self.layout)])),
            vertex: wgpu::VertexState {
                module: &self.module,
                entry_point: Some("fullscreen"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &self.module,
                entry_point: Some("show"),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants: &[("CURVE", f64::from(curve)), ("ENCODE", f64::from(u8::from(encode)))],
                    ..Default::default()
                },
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        self.pipelines.push((key, pipeline));
        self.pipelines.len() - 1
    }

    #[allow(clippy::too_many_arguments)]
    pub fn record(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        picture: &wgpu::TextureView,
        stops: &wgpu::Buffer,
        settings: &RenderSettings,
        size: [u32; 2],
        (target, format): (&wgpu::TextureView, wgpu::TextureFormat),
    ) {
        let index = self.pipeline(device, (format, settings.tonemap));
        let display = Display {
            size,
            exposure: match settings.exposure {
                Exposure::Ev(ev) => ev,
                Exposure::Auto => 0.0,
            },
            automatic: u32::from(settings.exposure == Exposure::Auto),
        };
        let uniform = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("display"),
            contents: bytemuck::bytes_of(&display),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let group = bind::group(
            device,
            &self.layout,
            &[
                uniform.as_entire_binding(),
                wgpu::BindingResource::TextureView(picture),
                stops.as_entire_binding(),
            ],
        );
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("tonemap"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(Default::default()),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: None,
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_pipeline(&self.pipelines[index].1);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
    }
}
