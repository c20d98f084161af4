//! How many rays a second are answered, by kernels and by the CPU's tracer on all cores, and how long hierarchies take to build.
//!
//! `cargo run --release -p girandole --example rays -- [SCENE|heavy] [RAYS] [ROUNDS] [ADAPTER]`; `heavy` has a million triangles.
//!
//! Rays start on what the first camera sees, once as a mirror reflects them, once in all directions, and end where they meet something.

use girandole::scene::builtin::{self, MovingObject, shapes};
use girandole::scene::{MaterialId, Scene, Transform, View};
use girandole::{Gpu, Renderer, RendererOptions, Viewport};
use girandole_core::lights::{LightSet, LightSettings};
use girandole_core::math::warp;
use girandole_core::scene::Geometry;
use girandole_core::trace::{Hit, Ray, SceneTracer, ray_offset_distance};
use girandole_core::{glam::Vec2, glam::Vec3};
use rayon::prelude::*;
use std::time::Instant;

fn scene(name: &str) -> Result<Scene, Box<dyn std::error::Error>> {
    if name != "heavy" {
        return Ok(builtin::build(name, MovingObject::Torus)?);
    }
    let mut scene = builtin::build("table", MovingObject::None)?;
    let torus = shapes::torus(0.35, 0.14, 1000, 500, MaterialId(0));
    scene.add_object("torus", torus, Transform::translation(Vec3::new(0.0, 1.2, 0.0)));
    Ok(scene)
}

/// Bounces of what a camera sees: as mirrors reflect, or in random directions above the surface. Pixels follow one another in squares of 8
/// by 8.
fn bounces(tracer: &SceneTracer, view: &View, count: u32, is_mirrored: bool) -> Vec<Ray> {
    let geometry = tracer.geometry();
    let local = view.relative_to(geometry.origin);
    let tiles = (f64::from(count).sqrt() / 8.0).ceil() as u32;
    let side = 8 * tiles;
    let bounce = |i: u32| {
        let (tile, within) = (i / 64, i % 64);
        let at = [8 * (tile % tiles) + within % 8, 8 * (tile / tiles) + within / 8];
        let at = Vec2::new(at[0] as f32 + 0.5, at[1] as f32 + 0.5);
        let (origin, direction) = local.pixel_ray(at, [side; 2]);
        let hit = tracer.closest_visible(origin, direction)?;
        let random = Vec2::new((i as f32 * 0.618_034).fract(), (i as f32 * 0.754_878).fract());
        let (out, point) = (warp::sphere(random), geometry.point(hit.triangle, hit.barycentric));
        let normal = geometry.normal(hit.triangle);
        let normal = normal * -normal.dot(direction).signum();
        let direction = match is_mirrored {
            true => (direction - normal * (2.0 * direction.dot(normal))).normalize(),
            false => out * out.dot(normal).signum(),
        };
        let origin = point + normal * ray_offset_distance(geometry, point);
        Some(Ray { origin, direction, t_max: f32::INFINITY, ignored: hit.triangle })
    };
    (0..count).filter_map(bounce).collect()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().collect();
    let number = |at: usize, default: u32| args.get(at).map_or(Ok(default), |text| text.parse());
    let name = args.get(1).map_or("living-room", String::as_str);
    let (count, rounds) = (number(2, 1 << 20)?, number(3, 5)?);
    let gpu = pollster::block_on(Gpu::new(args.get(4).map(String::as_str)))?;
    let scene = scene(name)?;
    let geometry = Geometry::new(&scene);
    let start = Instant::now();
    let tracer = SceneTracer::new(&scene, &geometry);
    let built = start.elapsed().as_secs_f64();
    let view = View::new(&scene, &scene.cameras[0], 1.0);
    let lights = LightSet::sample(&scene, &geometry, &LightSettings { count: 1, ..Default::default() })?;
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, RendererOptions::default())?;
    renderer.load(&scene, &geometry, &lights)?;
    let start = Instant::now();
    let first =
        gpu.block_on(renderer.closest_hits(&scene, &geometry, &bounces(&tracer, &view, 1, true))?)??;
    println!(
        "{name}: {} triangles, hierarchies in {:.2} s (the tracer's: {built:.2} s), first answer {}",
        geometry.triangles.len(),
        start.elapsed().as_secs_f64(),
        if first[0].is_some() { "hit" } else { "miss" },
    );
    for is_mirrored in [true, false] {
        let rays = bounces(&tracer, &view, count, is_mirrored);
        let millions = |seconds: f64| rays.len() as f64 / seconds * 1e-6;
        for _ in 0..rounds {
            let start = Instant::now();
            let hits = gpu.block_on(renderer.closest_hits(&scene, &geometry, &rays)?)??;
            let by_kernels = start.elapsed().as_secs_f64();
            let in_kernels =
                gpu.block_on(renderer.stats(&Viewport::default()))??.gpu_ms.get("rays_gpu_ms").copied();
            let start = Instant::now();
            let trace = |r: &Ray| tracer.closest_hit(r.origin, r.direction, r.t_max, r.ignored);
            let expected: Vec<_> = rays.par_iter().map(trace).collect();
            let by_tracer = start.elapsed().as_secs_f64();
            let triangle = |hit: &Option<Hit>| hit.map(|hit| hit.triangle);
            let differ = hits.iter().zip(&expected).filter(|(a, b)| triangle(a) != triangle(b)).count();
            println!(
                "{}: {:.2} million rays a second by {}{}, {:.2} by the tracer; {differ} of {} differ",
                if is_mirrored { "mirrored" } else { "random" },
                millions(by_kernels),
                gpu.info.name,
                in_kernels.map_or(String::new(), |ms| format!(" ({:.2} in the kernel)", millions(ms * 1e-3))),
                millions(by_tracer),
                rays.len()
            );
        }
    }
    Ok(())
}
