//! Pairs of pixel and light a second: the naive kernel on `table` beside a bare loop without a scene, in one run.
//!
//! The bare loop sums 300 lights over a plane, each tested against a map of 256² in one atlas of 8192², with nothing
//! skipped; the renderer's pairs are counted only where both cosines are positive. Give an adapter's name to choose one.

use girandole::glam::Vec2;
use girandole::scene::View;
use girandole::scene::builtin::{self, MovingObject};
use girandole::{Gpu, Mode, RenderSettings, Renderer, RendererOptions, Viewport};
use girandole_core::lights::{LightSet, LightSettings};
use girandole_core::scene::Geometry;
use girandole_core::trace::SceneTracer;
use std::time::Instant;
use wgpu::util::DeviceExt;

const SIZE: [u32; 2] = [1024, 768];
const LIGHTS: u32 = 300;

const BARE: &str = "
struct Light { position: vec4f, normal: vec4f, tangent: vec4f, intensity: vec4f }
@group(0) @binding(0) var<storage, read> lights: array<Light>;
@group(0) @binding(1) var atlas: texture_depth_2d;
@group(0) @binding(2) var<storage, read_write> image: array<vec4f>;
@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
  let p = vec3f(f32(id.x) * 0.01, 0.0, f32(id.y) * 0.01);
  var sum = vec3f(0.0);
  for (var i = 0u; i < 300u; i++) {
    let light = lights[i];
    let d = light.position.xyz - p;
    let r2 = max(dot(d, d), 0.01);
    let wi = d * inverseSqrt(r2);
    let g = max(wi.y, 0.0) * max(-dot(light.normal.xyz, wi), 0.0) / r2;
    if g <= 0.0 { continue; }
    let b = cross(light.normal.xyz, light.tangent.xyz);
    let local = -vec3f(dot(d, light.tangent.xyz), dot(d, b), dot(d, light.normal.xyz));
    let norm = abs(local.x) + abs(local.y) + local.z;
    let q = local.xy / norm;
    let uv = vec2f(q.x + q.y, q.x - q.y) * 0.5 + 0.5;
    let texel = vec2u(i % 32u, i / 32u) * 256u + vec2u(uv * 255.0);
    let lit = 0.0101 / norm >= textureLoad(atlas, texel, 0);
    sum += light.intensity.xyz * select(0.0, g, lit);
  }
  image[id.y * 1024u + id.x] = vec4f(sum, 1.0);
}";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let gpu = pollster::block_on(Gpu::new(std::env::args().nth(1).as_deref()))?;
    let scene = builtin::build("table", MovingObject::Torus)?;
    let geometry = Geometry::new(&scene);
    let lights = LightSet::sample(&scene, &geometry, &LightSettings { count: LIGHTS, ..Default::default() })?;
    let view = View::new(&scene, &scene.cameras[0], SIZE[0] as f32 / SIZE[1] as f32);
    let mut renderer = Renderer::new(
        &gpu.device,
        &gpu.queue,
        RendererOptions { map_size: Some(256), ..Default::default() },
    )?;
    let mut viewport = Viewport::default();
    renderer.load(&scene, &geometry, &lights)?;

    // How many pairs face each other: counted on every fourth pixel in x and y.
    let tracer = SceneTracer::new(&scene, &geometry);
    let mut facing = 0u64;
    for y in (2..SIZE[1]).step_by(4) {
        for x in (2..SIZE[0]).step_by(4) {
            let (origin, direction) =
                view.relative_to(geometry.origin).pixel_ray(Vec2::new(x as f32, y as f32) + 0.5, SIZE);
            let Some(hit) = tracer.closest_visible(origin, direction) else { continue };
            let s = geometry.surface(&scene, hit.triangle, hit.barycentric, -direction.normalize());
            let pair = |l: &&_| {
                girandole_core::lights::LightSample::geometric_factor(
                    l,
                    s.position,
                    s.geometric_normal,
                    s.shading_normal,
                    girandole_core::lights::Clamp::Off,
                )
                .is_some()
            };
            facing += 16 * lights.samples().iter().filter(pair).count() as u64;
        }
    }

    let bare = Bare::new(&gpu);
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..6 {
        let start = Instant::now();
        renderer.render(
            &mut viewport,
            &view,
            SIZE,
            &RenderSettings { mode: Mode::Naive, ..Default::default() },
        )?;
        gpu.wait()?;
        times[0].push(start.elapsed().as_secs_f64());
        let start = Instant::now();
        bare.run(&gpu)?;
        times[1].push(start.elapsed().as_secs_f64());
    }
    let [naive, loop_] = times.map(|mut t| {
        // The first run compiles.
        t.remove(0);
        t.sort_by(f64::total_cmp);
        t[t.len() / 2]
    });
    let all = u64::from(SIZE[0] * SIZE[1] * LIGHTS);
    let rate = |pairs: u64, seconds: f64| pairs as f64 / seconds / 1e9;
    println!("{}", gpu.info.name);
    println!("bare loop: {:.0} ms, {:.3} G pairs/s", loop_ * 1e3, rate(all, loop_));
    println!(
        "naive frame: {:.0} ms, {:.3} G pairs/s, {:.3} G of them facing each other ({:.0} %)",
        naive * 1e3,
        rate(all, naive),
        rate(facing, naive),
        100.0 * facing as f64 / all as f64
    );
    println!("ratio, counting facing pairs only: {:.2}", rate(facing, naive) / rate(all, loop_));
    Ok(())
}

struct Bare {
    pipeline: wgpu::ComputePipeline,
    group: wgpu::BindGroup,
}

impl Bare {
    fn new(gpu: &Gpu) -> Self {
        let device = &gpu.device;
        let lights: Vec<u8> = (0..LIGHTS)
            .flat_map(|i| {
                let f = i as f32;
                [
                    (f * 0.37) % 10.0,
                    3.0,
                    (f * 0.71) % 7.0,
                    0.0,
                    0.0,
                    -1.0,
                    0.0,
                    0.0,
                    1.0,
                    0.0,
                    0.0,
                    0.0,
                    0.1,
                    0.1,
                    0.1,
                    0.0,
                ]
            })
            .flat_map(f32::to_le_bytes)
            .collect();
        let lights = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: None,
            contents: &lights,
            usage: wgpu::BufferUsages::STORAGE,
        });
        let image = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(SIZE[0] * SIZE[1] * 16),
            usage: wgpu::BufferUsages::STORAGE,
            mapped_at_creation: false,
        });
        let atlas = device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: 8192, height: 8192, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Depth32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(BARE.into()),
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: None,
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            cache: None,
        });
        let view = atlas.create_view(&Default::default());
        let resources = [
            lights.as_entire_binding(),
            wgpu::BindingResource::TextureView(&view),
            image.as_entire_binding(),
        ];
        let entries: Vec<_> = resources
            .into_iter()
            .zip(0..)
            .map(|(resource, binding)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let layout = pipeline.get_bind_group_layout(0);
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &layout,
            entries: &entries,
        });
        Self { pipeline, group }
    }

    fn run(&self, gpu: &Gpu) -> girandole::Result<()> {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.dispatch_workgroups(SIZE[0] / 8, SIZE[1] / 8, 1);
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
        gpu.wait()
    }
}
