//! How long it takes to draw all shadow maps of a scene, and of a heavy one: the median of several rounds, each with maps that are all stale.
//!
//! `cargo run --release -p girandole --example shadow_maps -- [SCENE|heavy] [LIGHTS] [TEXELS] [ROUNDS] [ADAPTER]`

use girandole::glam::Vec3;
use girandole::scene::builtin::{self, MovingObject, shapes};
use girandole::scene::{MaterialId, Scene, Transform};
use girandole::{Gpu, MapUpdates, Renderer, RendererOptions};
use girandole_core::lights::{LightSet, LightSettings};
use girandole_core::scene::Geometry;
use std::time::Instant;

/// The table's room with a torus of 250 000 triangles.
fn heavy() -> Result<Scene, Box<dyn std::error::Error>> {
    let mut scene = builtin::build("table", MovingObject::None)?;
    let torus = shapes::torus(0.35, 0.14, 500, 250, MaterialId(0));
    scene.add_object("torus", torus, Transform::translation(Vec3::new(0.0, 1.2, 0.0)));
    Ok(scene)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().collect();
    let number = |at: usize, default: u32| args.get(at).map_or(Ok(default), |text| text.parse());
    let name = args.get(1).map_or("table", String::as_str);
    let (count, map_size, rounds) = (number(2, 300)?, number(3, 256)?, number(4, 7)?);
    let gpu = pollster::block_on(Gpu::new(args.get(5).map(String::as_str)))?;
    let scene = match name {
        "heavy" => heavy()?,
        _ => builtin::build(name, MovingObject::Torus)?,
    };
    let geometry = Geometry::new(&scene);
    let lights = LightSet::sample(&scene, &geometry, &LightSettings { count, ..Default::default() })?;
    let options = RendererOptions { map_size: Some(map_size), memory_mib: 2048, ..Default::default() };
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, options)?;
    let mut times = Vec::new();
    for round in 0..=rounds {
        renderer.load(&scene, &geometry, &lights)?;
        let start = Instant::now();
        renderer.draw_shadow_maps(&MapUpdates::default())?;
        gpu.device.poll(wgpu::PollType::wait_indefinitely())?;
        if round > 0 {
            times.push(start.elapsed().as_secs_f64() * 1e3);
        }
    }
    times.sort_by(f64::total_cmp);
    let triangles = geometry.triangles.len();
    println!(
        "{name}: {triangles} triangles, {count} lights, {map_size} texels across: {:.1} ms ({:.1} to {:.1}) on {}",
        times[times.len() / 2],
        times[0],
        times[times.len() - 1],
        gpu.info.name
    );
    Ok(())
}
