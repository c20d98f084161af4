//! One encoder, two renderers: a triangle of the program's own with depth, then a lit room round it, into an HDR target.
//! `own_frame.png` shows both.

mod shared;

use girandole::glam::{DVec3, Vec3, camera::rh::proj::directx::perspective_infinite_reverse};
use girandole::image::{Exposure, Tonemap};
use girandole::light::IlluminationSettings;
use girandole::scene::builtin::{self, MovingObject};
use girandole::scene::{Transform, View};
use girandole::{Gpu, RenderSettings, Renderer, RendererOptions, Target, Viewport, wgpu};
use wgpu::{TextureFormat, TextureUsages};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let gpu = pollster::block_on(Gpu::new(None))?;
    let (device, queue) = (&gpu.device, &gpu.queue);
    let texture = |format, usage| {
        device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: 640, height: 480, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: usage | TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        })
    };
    let hdr = texture(TextureFormat::Rgba32Float, TextureUsages::COPY_SRC);
    let depth = texture(TextureFormat::Depth32Float, TextureUsages::TEXTURE_BINDING);
    let (color, depth) = (hdr.create_view(&Default::default()), depth.create_view(&Default::default()));

    // The program's own camera, with reversed depth, and its triangle.
    let eye = Transform::looking_at(Vec3::new(0.5, 1.65, 2.85), Vec3::new(0.0, 0.8, -0.7));
    let view_from_world = eye.affine().inverse();
    let clip_from_view = perspective_infinite_reverse(0.9, 4.0 / 3.0, 0.05);
    let corners = [(-1.6, 0.3, -1.2), (1.2, 0.3, 0.0), (-0.3, 2.3, -0.6)].map(|(x, y, z)| {
        let seen = view_from_world.transform_point3(DVec3::new(x, y, z)).as_vec3();
        let [x, y, z, w] = (clip_from_view * seen.extend(1.0)).to_array();
        format!("vec4f({x:?}, {y:?}, {z:?}, {w:?})")
    });
    let shader = format!(
        "@vertex fn corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {{
           var corners = array({}); return corners[i]; }}
         @fragment fn color() -> @location(0) vec4f {{ return vec4f(0.1, 1.5, 0.4, 1.0); }}",
        corners.join(", ")
    );
    let source = wgpu::ShaderSource::Wgsl(shader.into());
    let module = &device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source });
    let (entry_point, compilation_options) = (None, wgpu::PipelineCompilationOptions::default());
    let options = compilation_options.clone();
    let vertex = wgpu::VertexState { module, entry_point, compilation_options: options, buffers: &[] };
    let targets = &[Some(TextureFormat::Rgba32Float.into())];
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: None,
        vertex,
        primitive: Default::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: TextureFormat::Depth32Float,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState { module, entry_point, compilation_options, targets }),
        multiview_mask: None,
        cache: None,
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let (depth_slice, resolve_target, ops) = (None, None, wgpu::Operations::default());
    let attachment = wgpu::RenderPassColorAttachment { view: &color, depth_slice, resolve_target, ops };
    let depth_ops = Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store });
    let behind = wgpu::RenderPassDepthStencilAttachment { view: &depth, depth_ops, stencil_ops: None };
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(attachment)],
        depth_stencil_attachment: Some(behind),
        ..Default::default()
    });
    pass.set_pipeline(&pipeline);
    pass.draw(0..3, 0..1);
    drop(pass);

    // Our picture round it, through the same camera: where the triangle is nearer, it stays.
    let mut renderer = Renderer::new(device, queue, RendererOptions::default())?;
    let mut viewport = Viewport::default();
    renderer.open(&builtin::build("table", MovingObject::Torus)?, &IlluminationSettings::default())?;
    let view = View::from_matrices(view_from_world, clip_from_view)?;
    let target = Target::new(&color, hdr.format(), [640, 480]);
    let target = Target { keep_background: true, depth_in: Some(&depth), ..target };
    let settings =
        RenderSettings { exposure: Exposure::Ev(0.0), tonemap: Tonemap::None, ..Default::default() };
    renderer.record(&mut viewport, &mut encoder, &view, &target, &settings)?;

    // One submit for both.
    queue.submit([encoder.finish()]);
    Ok(shared::write_png("own_frame.png", &shared::read_back(&gpu, &hdr)?)?)
}
