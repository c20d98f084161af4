//! Multipass shading (Barczak §4.3.4): a few lights a pass, added by the blending unit. All passes over a set of points are
//! one draw, in which each pass is a range of point primitives.

use super::sort_points::SortedPoints;
use super::visibility_buffer::Seen;
use super::{BandSample, Compiler, GridView, LightMapsView, MapsView};
use crate::device::kernel::{Draw, Groups, Kernel, RenderKernel, buffer, texture};
use crate::device::recorder::Recorder;
use crate::gpu_scene::lights::GpuLights;
use crate::points::lists::CHUNKS_AT;
use crate::points::multipass_plan::MultipassPlan;
use crate::shaders;

pub(crate) struct Multipass {
    arguments: Kernel,
    shade: RenderKernel,
    collect: Kernel,
    format: wgpu::TextureFormat,
}

impl Multipass {
    pub fn new(compiler: &Compiler) -> Self {
        let Compiler { device, shared, .. } = *compiler;
        // Sums of hundreds of lights want 32 bits; where the device cannot blend those, 16 have to do.
        let format = if device.features().contains(wgpu::Features::FLOAT32_BLENDABLE) {
            wgpu::TextureFormat::Rgba32Float
        } else {
            wgpu::TextureFormat::Rgba16Float
        };
        let add = wgpu::BlendComponent {
            src_factor: wgpu::BlendFactor::One,
            dst_factor: wgpu::BlendFactor::One,
            operation: wgpu::BlendOperation::Add,
        };
        let target = Some(wgpu::ColorTargetState {
            format,
            blend: Some(wgpu::BlendState { color: add, alpha: add }),
            write_mask: wgpu::ColorWrites::ALL,
        });
        let constants = compiler.constants();
        let draw = Draw {
            vertex: "project_point",
            fragment: Some("sum_lights"),
            topology: wgpu::PrimitiveTopology::PointList,
            depth: None,
            targets: vec![target.clone(), target],
        };
        let source = &shaders::MULTIPASS;
        Self {
            arguments: compiler.kernel(&shaders::MULTIPASS_ARGUMENTS, "multipass_arguments"),
            shade: RenderKernel::new(device, shared, (source, &compiler.kernels), draw, &constants),
            collect: compiler.kernel(&shaders::MULTIPASS_COLLECT, "multipass_collect"),
            format,
        }
    }

    /// Sums all lights at the points into `grid`.
    #[allow(clippy::too_many_arguments)]
    pub fn record<'a>(
        &self,
        recorder: &mut Recorder,
        band: &BandSample,
        seen: Seen,
        (maps, light_maps): (MapsView, LightMapsView),
        (plan, lights): (&MultipassPlan, &GpuLights),
        points: SortedPoints,
        grid: GridView<'a>,
    ) -> GridView<'a> {
        let (device, lists) = (recorder.device, points.lists);
        // Grids end within the picture.
        let [width, _] = band.size();
        let last_row = band.frame.last_row - band.frame.band[0];
        let points_across = |n: u32| n.div_ceil(band.frame.step) + 1;
        let size = [points_across(width - 1), points_across(last_row)];
        let [irradiance, directional] =
            ["summed irradiance", "summed directional"].map(|label| self.sums(device, label, size));
        let resources = [
            texture("triangle_ids", seen.triangle_ids),
            texture("surface_ids", seen.surface_ids),
            texture("mirror_hits", seen.ends()),
            texture("atlas", maps.atlas),
            buffer("maps", maps.maps),
            buffer("lights", &lights.buffer),
            buffer("point_queue", &lists.point_queue),
            buffer("offsets", lists.offsets(light_maps.used)),
            buffer("light_lists", light_maps.receivers.light_lists()),
            buffer("light_maps", &light_maps.receivers.light_maps.maps),
            buffer("parts", &plan.parts),
            buffer("elements", &plan.elements),
            buffer("multipass", &plan.params),
            buffer("draw_arguments", &plan.arguments),
            texture("summed_irradiance", &irradiance),
            texture("summed_directional", &directional),
            texture("fine_irradiance", grid.irradiance),
            texture("fine_directional", grid.directional),
        ];
        // How many points each element has.
        let one = Groups::Count([1, 1]);
        self.arguments.record(recorder, band.groups(), "sort_gpu_ms", &resources, one);

        let group = self.shade.group(device, &resources);
        let uniform = recorder.uniform(&band.frame);
        let color = |view| {
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
        let timestamps = recorder.timers.render("shade_gpu_ms");
        let mut pass = recorder.encoder().begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("multipass"),
            color_attachments: &[color(&irradiance), color(&directional)],
            depth_stencil_attachment: None,
            timestamp_writes: timestamps,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        self.shade.set(&mut pass, (Some(&uniform), Some(&band.scene.group)), &group);
        pass.draw_indirect(&plan.arguments, 0);
        drop(pass);

        let groups = Groups::Indirect(&lists.dispatch_arguments, CHUNKS_AT);
        self.collect.record(recorder, band.groups(), "collect_gpu_ms", &resources, groups);
        grid
    }

    /// A texture of a grid's size that is added to.
    fn sums(&self, device: &wgpu::Device, label: &str, [width, height]: [u32; 2]) -> wgpu::TextureView {
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
    }
}
