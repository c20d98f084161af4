//! One encoder, two renderers: a triangle of the program's own with depth, then a lit room round it, into an HDR target.
//! `own_frame.ppm` shows both.

use girandole::core::glam::{Vec3, camera::rh::proj::directx::perspective_infinite_reverse};
use girandole::core::illumination::IlluminationSettings;
use girandole::core::image::Image;
use girandole::core::scene::builtin::{self, MovingObject};
use girandole::core::scene::{Transform, View};
use girandole::core::tonemap::{Exposure, Tonemap, to_srgb8};
use girandole::{Gpu, RenderSettings, Renderer, RendererOptions, Target, wgpu};

const WIDTH: u32 = 640;
const HEIGHT: u32 = 480;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
const COLOR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;
const SHADER: &str = "
@group(0) @binding(0) var<uniform> clip_from_world: mat4x4f;
@vertex fn corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
  var corners = array(vec3f(-1.6, 0.3, -1.2), vec3f(1.2, 0.3, 0.0), vec3f(-0.3, 2.3, -0.6));
  return clip_from_world * vec4f(corners[i], 1.0);
}
@fragment fn color() -> @location(0) vec4f { return vec4f(0.1, 1.5, 0.4, 1.0); }";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let gpu = pollster::block_on(Gpu::new(None))?;
    let (device, queue) = (&gpu.device, &gpu.queue);
    let texture = |format, usage| {
        let size = wgpu::Extent3d { width: WIDTH, height: HEIGHT, depth_or_array_layers: 1 };
        let (mip_level_count, sample_count, dimension) = (1, 1, wgpu::TextureDimension::D2);
        let usage = usage | wgpu::TextureUsages::RENDER_ATTACHMENT;
        device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size,
            mip_level_count,
            sample_count,
            dimension,
            format,
            usage,
            view_formats: &[],
        })
    };
    let hdr = texture(COLOR, wgpu::TextureUsages::COPY_SRC);
    let depth = texture(DEPTH, wgpu::TextureUsages::TEXTURE_BINDING).create_view(&Default::default());
    let color = hdr.create_view(&Default::default());

    // The program's own camera, with reversed depth, and its triangle.
    let view_from_world =
        Transform::looking_at(Vec3::new(0.5, 1.65, 2.85), Vec3::new(0.0, 0.8, -0.7)).affine().inverse();
    let clip_from_view = perspective_infinite_reverse(0.9, WIDTH as f32 / HEIGHT as f32, 0.05);
    let clip_from_world = clip_from_view * view_from_world.as_affine3();
    let uniform = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: 64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let bytes: Vec<u8> = clip_from_world.to_cols_array().iter().flat_map(|x| x.to_le_bytes()).collect();
    queue.write_buffer(&uniform, 0, &bytes);
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(SHADER.into()),
    });
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: None,
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
            entry_point: None,
            compilation_options: Default::default(),
            targets: &[Some(COLOR.into())],
        }),
        multiview_mask: None,
        cache: None,
    });
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() }],
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &color,
            depth_slice: None,
            resolve_target: None,
            ops: Default::default(),
        })],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &depth,
            depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        }),
        ..Default::default()
    });
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.draw(0..3, 0..1);
    drop(pass);

    // Our picture round it, through the same camera: behind the triangle nothing is drawn, and our depth goes out.
    let scene = builtin::build("table", MovingObject::Torus)?;
    let mut renderer = Renderer::new(device, queue, RendererOptions::default())?;
    renderer.open(&scene, &IlluminationSettings::default())?;
    let view = View::from_matrices(view_from_world, clip_from_view)?;
    let target = Target {
        keep_background: true,
        depth_in: Some(&depth),
        depth_out: Some((&depth, DEPTH)),
        ..Target::new(&color, COLOR, [WIDTH, HEIGHT])
    };
    let settings =
        RenderSettings { exposure: Exposure::Ev(0.0), tonemap: Tonemap::None, ..Default::default() };
    renderer.record(&mut encoder, &view, &target, &settings)?;

    // One submit; then the target is read back and shown.
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(WIDTH * HEIGHT * 16),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let layout =
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(WIDTH * 16), rows_per_image: None };
    encoder.copy_texture_to_buffer(
        hdr.as_image_copy(),
        wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
        hdr.size(),
    );
    queue.submit([encoder.finish()]);
    buffer.map_async(wgpu::MapMode::Read, .., |result| result.expect("the target can be mapped"));
    gpu.wait()?;
    let texels = buffer.get_mapped_range(..)?;
    let channel = |p: &[u8], i: usize| f32::from_le_bytes([p[i], p[i + 1], p[i + 2], p[i + 3]]);
    let pixels =
        texels.chunks_exact(16).map(|p| Vec3::new(channel(p, 0), channel(p, 4), channel(p, 8))).collect();
    let image = Image { width: WIDTH, height: HEIGHT, pixels };
    let mut file = format!("P6 {WIDTH} {HEIGHT} 255\n").into_bytes();
    file.extend(to_srgb8(&image, Exposure::Auto.ev(&image), Tonemap::Agx));
    Ok(std::fs::write("own_frame.ppm", file)?)
}
