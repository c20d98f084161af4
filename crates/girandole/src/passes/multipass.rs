//! Multipass shading (Barczak §4.3.4): a few lights a draw, added by the blending unit.

use super::shade::{SceneFeatures, ShadeInputs, constants};
use super::{Band, Groups, Kernel, Layouts, shadow_maps};
use crate::bind::{self, Slot};
use crate::elements::MultipassPlan;
use crate::receivers::Receivers;
use crate::selection::{CHUNKS_AT, PointLists};
use crate::settings::RendererOptions;
use crate::targets::Targets;
use crate::{shaders, timers::Timers};

pub(crate) struct Multipass {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::RenderPipeline,
    batch: Kernel,
    collect: Kernel,
    format: wgpu::TextureFormat,
    /// What it was compiled for.
    pub needs: SceneFeatures,
}

/// The targets that draws add to, for one size of grid.
struct Sums {
    light: wgpu::TextureView,
    second: wgpu::TextureView,
}

impl Multipass {
    pub fn new(
        device: &wgpu::Device,
        layouts: &Layouts,
        options: &RendererOptions,
        needs: SceneFeatures,
    ) -> Self {
        use Slot::{Float, Grid, Ids, Read, Uniform};
        // Sums of hundreds of lights want 32 bits; where the device cannot blend those, 16 have to do.
        let format = if device.features().contains(wgpu::Features::FLOAT32_BLENDABLE) {
            wgpu::TextureFormat::Rgba32Float
        } else {
            wgpu::TextureFormat::Rgba16Float
        };
        let (source, maps) = (&shaders::MULTIPASS, shadow_maps::slot(&layouts.tuning));
        let slots = [Ids, maps, Read, Uniform, Read, Uniform, Read, Read, Uniform];
        let stages = wgpu::ShaderStages::VERTEX_FRAGMENT;
        let layout = bind::layout(device, "multipass", stages, &slots);
        let module = source.module(device, &layouts.tuning);
        let mut constants = constants(options, needs).to_vec();
        let flag = |name, value: bool| (name, f64::from(u8::from(value)));
        constants.push(flag("HAS_CURVED", needs.curved));
        let compilation_options =
            wgpu::PipelineCompilationOptions { constants: &constants, ..Default::default() };
        let adds = wgpu::BlendComponent {
            src_factor: wgpu::BlendFactor::One,
            dst_factor: wgpu::BlendFactor::One,
            operation: wgpu::BlendOperation::Add,
        };
        let target = Some(wgpu::ColorTargetState {
            format,
            blend: Some(wgpu::BlendState { color: adds, alpha: adds }),
            write_mask: wgpu::ColorWrites::ALL,
        });
        let groups = [Some(&layouts.frame), Some(&layouts.scene), Some(&layout)];
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("multipass"),
            layout: Some(&bind::pipeline_layout(device, &groups)),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("project_point"),
                compilation_options: compilation_options.clone(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState {
                topology: wgpu::PrimitiveTopology::PointList,
                ..Default::default()
            },
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("sum_lights"),
                compilation_options,
                targets: &[target.clone(), target],
            }),
            multiview_mask: None,
            cache: None,
        });
        let collect = [Ids, Read, Read, Read, Uniform, Ids, Float, Float, Grid, Grid];
        let constants = [
            flag("HAS_CURVED", needs.curved),
            flag("HAS_SPECULAR", needs.specular),
            flag("HAS_TEXTURES", needs.textures),
        ];
        let collect = Kernel::new(
            device,
            layouts,
            &shaders::MULTIPASS_COLLECT,
            "multipass_collect",
            &collect,
            &constants,
        );
        let batch = [Read, Slot::Write, Slot::Write, Uniform, Uniform];
        let batch =
            Kernel::new(device, layouts, &shaders::MULTIPASS_ARGUMENTS, "multipass_arguments", &batch, &[]);
        Self { layout, pipeline, batch, collect, format, needs }
    }

    /// Textures of a grid's size that start at 0.
    fn sums(&self, device: &wgpu::Device, [width, height]: [u32; 2]) -> Sums {
        let texture = |label| {
            let descriptor = wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: self.format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            };
            device.create_texture(&descriptor).create_view(&Default::default())
        };
        Sums { light: texture("sums"), second: texture("second sums") }
    }

    /// Shades the points that were chosen last, with all lights. `rows` are those of the band's grids.
    #[allow(clippy::too_many_arguments)]
    pub fn record(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        timers: &Timers,
        (band, step, rows): (Band, u32, u32),
        inputs: ShadeInputs,
        (receivers, selection, targets): (&Receivers, &PointLists, &Targets),
        (draws, lights): (&MultipassPlan, &wgpu::Buffer),
    ) {
        // How many points each element has.
        let buffers = [
            &selection.point_queue,
            &draws.elements,
            &draws.arguments,
            selection.offsets_buffer(),
            &draws.passes,
        ];
        let time = timers.compute("sort_gpu_ms");
        let resources = buffers.map(|b| b.as_entire_binding());
        self.batch.record(device, encoder, time, band, &resources, Groups::Count([1, 1]));

        let sums = self.sums(device, [band.size[0], rows].map(|n| (n - 1).div_ceil(step) + 1));
        let group = bind::group(
            device,
            &self.layout,
            &[
                wgpu::BindingResource::TextureView(inputs.ids),
                wgpu::BindingResource::TextureView(inputs.atlas),
                lights.as_entire_binding(),
                inputs.maps.as_entire_binding(),
                selection.point_queue.as_entire_binding(),
                selection.offsets_buffer().as_entire_binding(),
                draws.parts.as_entire_binding(),
                draws.elements.as_entire_binding(),
                draws.passes.as_entire_binding(),
            ],
        );
        let attachment = |view| {
            Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })
        };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("multipass"),
            color_attachments: &[attachment(&sums.light), attachment(&sums.second)],
            depth_stencil_attachment: None,
            timestamp_writes: timers.render("shade_gpu_ms"),
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, band.frame, &[band.frame_offset]);
        pass.set_bind_group(1, band.scene, &[]);
        pass.set_bind_group(2, &group, &[]);
        pass.draw_indirect(&draws.arguments, 0);
        drop(pass);

        let resources = [
            wgpu::BindingResource::TextureView(inputs.ids),
            selection.point_queue.as_entire_binding(),
            receivers.lists.as_entire_binding(),
            receivers.light_maps.as_entire_binding(),
            selection.offsets_buffer().as_entire_binding(),
            wgpu::BindingResource::TextureView(&targets.keys),
            wgpu::BindingResource::TextureView(&sums.light),
            wgpu::BindingResource::TextureView(&sums.second),
            wgpu::BindingResource::TextureView(inputs.grid[0]),
            wgpu::BindingResource::TextureView(inputs.grid[1]),
        ];
        let groups = Groups::Indirect(&selection.dispatch_arguments, CHUNKS_AT);
        self.collect.record(device, encoder, timers.compute("collect_gpu_ms"), band, &resources, groups);
    }
}
