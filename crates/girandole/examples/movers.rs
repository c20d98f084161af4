//! What frames cost in which many small things move: visibility, the renderer's update and the frame, beside one in which nothing
//! does.
//!
//! ```text
//! cargo run --release -p girandole --example movers -- [room] [lights] [frames] [torus|box|large] [counts, as 1,200]
//! ```

use girandole::glam::{Quat, Vec3, vec3};
use girandole::light::LightSettings;
use girandole::light::{Illumination, IlluminationSettings, Rewalk};
use girandole::scene::builtin::{self, MovingObject, shapes};
use girandole::scene::{MaterialId, Mesh, Scene, Transform, View};
use girandole::{Gpu, MapUpdates, RenderSettings, Renderer, RendererOptions, Viewport};
use girandole_core::math::sequence;
use girandole_core::scene::Geometry;
use girandole_core::visibility::VisibilityDatabase;
use std::time::Instant;

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

const SIZE: [u32; 2] = [320, 240];
/// Metres that each mover is away from the middle of its way, and metres that it goes in a frame.
const CIRCLE: f32 = 0.25;
const STEP: f32 = 0.03;

/// One small object.
fn small(kind: &str) -> Mesh {
    let mut mesh = Mesh::default();
    match kind {
        "box" => mesh.add_box(Vec3::splat(-0.03), Vec3::splat(0.03), MaterialId(0)),
        "large" => mesh.add_box(Vec3::splat(-0.1), Vec3::splat(0.1), MaterialId(0)),
        _ => return shapes::torus(0.05, 0.02, 12, 8, MaterialId(0)),
    }
    mesh
}

/// Places in a room that are clear of what stands there.
fn places(scene: &Scene, count: usize) -> Vec<Vec3> {
    let geometry = Geometry::new(scene);
    let positions = || geometry.positions.iter().copied();
    let low = positions().fold(Vec3::INFINITY, Vec3::min);
    let high = positions().fold(Vec3::NEG_INFINITY, Vec3::max);
    let is_clear = |at: &Vec3| {
        (0..geometry.triangles.len() as u32).all(|triangle| {
            let [a, b, c] = geometry.corners(triangle);
            at.distance(at.clamp(a.min(b).min(c), a.max(b).max(c))) > CIRCLE + 0.15
        })
    };
    let at = |i: u32| low + (high - low) * Vec3::from([0, 1, 2].map(|axis| sequence::sample(i, axis, 7)));
    (0..).map(at).filter(is_clear).take(count).collect()
}

fn place(at: Vec3, index: usize, frame: usize) -> Transform {
    let about =
        vec3(sequence::sample(index as u32, 0, 1) - 0.5, 1.0, sequence::sample(index as u32, 1, 1) - 0.5);
    let axis = about.normalize();
    let turn = Quat::from_axis_angle(axis, frame as f32 * STEP / CIRCLE + index as f32);
    Transform::rigid(turn, at + turn * axis.any_orthonormal_vector() * CIRCLE)
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or_default()
}

/// Frames with so many movers: the milliseconds of updates of what needs no GPU, and what a frame takes longer than one in which
/// nothing moves.
fn measure(
    gpu: &Gpu,
    (room, kind): (&str, &str),
    count: usize,
    (lights, frames): (u32, usize),
) -> Result<[f64; 2]> {
    let mut scene = builtin::build(room, MovingObject::None)?;
    let centers = places(&scene, count);
    let mut nodes = Vec::new();
    for (index, at) in centers.iter().enumerate() {
        let object = scene.add_object("mover", small(kind), place(*at, index, 0));
        scene.objects[object].dynamic = true;
        nodes.push(scene.objects[object].node);
    }
    let settings = IlluminationSettings {
        lights: LightSettings { count: lights, walk_dynamic: false, ..LightSettings::default() },
        rewalk: Rewalk::Off,
        ..IlluminationSettings::default()
    };
    let view = View::new(&scene, &scene.cameras[0], SIZE[0] as f32 / SIZE[1] as f32);
    let options = RendererOptions { map_size: Some(64), ..RendererOptions::default() };
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, options)?;
    let mut viewport = Viewport::default();
    scene.take_changes();
    renderer.open(&scene, &settings)?;
    let mut illumination = Illumination::new(&scene, &settings)?;
    let moving = RenderSettings { updates: MapUpdates::default(), ..RenderSettings::default() };
    let mut times = [const { Vec::new() }; 4];
    let mut tests = 0;
    // The first two warm up.
    for number in 1..=frames + 2 {
        for (index, (at, node)) in centers.iter().zip(&nodes).enumerate() {
            scene.set_transform(*node, place(*at, index, number))?;
        }
        let changes = scene.take_changes();
        let start = Instant::now();
        illumination.update(&scene, &changes)?;
        let light_ms = milliseconds(start);
        let start = Instant::now();
        renderer.update(&scene, &changes)?;
        gpu.wait()?;
        let update_ms = milliseconds(start);
        let mut frame = || -> Result<f64> {
            let start = Instant::now();
            renderer.render(&mut viewport, &view, SIZE, &moving)?;
            gpu.wait()?;
            Ok(milliseconds(start))
        };
        let (moved, still) = (frame()?, frame()?);
        if number > 2 {
            let values = [light_ms, update_ms - light_ms, moved - still, update_ms + moved - still];
            times.iter_mut().zip(values).for_each(|(times, value)| times.push(value));
            tests += illumination.visibility().map_or(0, |v| v.counts().tests.total());
        }
    }
    let start = Instant::now();
    let database = VisibilityDatabase::build(
        &scene,
        illumination.geometry(),
        illumination.lights(),
        &Default::default(),
    )?;
    let scratch = milliseconds(start);
    let [light, update, frame, extra] = times.map(|mut times| median(&mut times));
    println!(
        "{count:4} movers: {light:7.2} ms for visibility and geometry ({} tests; {scratch:.1} ms and {} from scratch), \
         {update:6.2} ms for the rest of the update, {frame:6.2} ms more for the frame: {extra:7.2} ms more than at rest",
        tests / frames as u64,
        database.counts().tests.total(),
    );
    Ok([light, extra])
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let argument = |i: usize, other: &'static str| arguments.get(i).map_or(other, String::as_str).to_owned();
    let (room, kind) = (argument(0, "block"), argument(3, "torus"));
    let size = (argument(1, "300").parse()?, argument(2, "8").parse()?);
    let gpu = pollster::block_on(Gpu::new(None))?;
    let counts: Vec<usize> =
        argument(4, "1,10,50,200").split(',').map(str::parse).collect::<std::result::Result<_, _>>()?;
    let results =
        counts.iter().map(|&count| measure(&gpu, (&room, &kind), count, size)).collect::<Result<Vec<_>>>()?;
    if let (Some(first), Some(last)) = (results.first(), results.last()) {
        let [light, extra] = [0, 1].map(|i| last[i] / first[i]);
        println!(
            "{room}, {kind}, {}: {light:.1} x the time for visibility, {extra:.1} x the frame's",
            gpu.info.name
        );
    }
    Ok(())
}
