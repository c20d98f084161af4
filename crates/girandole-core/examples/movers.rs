//! What visibility costs where many small things move at once: updates with 1 to 200 movers, beside a determination from scratch.
//!
//! ```text
//! cargo run --release -p girandole-core --example movers -- [room] [lights] [frames] [torus|box|large]
//! ```

use girandole_core::Result;
use girandole_core::glam::{Quat, Vec3, vec3};
use girandole_core::illumination::{Illumination, IlluminationSettings, Rewalk};
use girandole_core::lights::LightSettings;
use girandole_core::math::sequence;
use girandole_core::scene::builtin::{self, MovingObject, shapes};
use girandole_core::scene::{Geometry, Mesh, Scene, Transform};
use girandole_core::visibility::VisibilityDatabase;
use std::time::Instant;

/// Metres that each mover is away from where it started, and metres that it goes in a frame.
const CIRCLE: f32 = 0.25;
const STEP: f32 = 0.03;

/// One small object.
fn small(kind: &str) -> Mesh {
    let mut mesh = Mesh::default();
    match kind {
        "box" => mesh.add_box(Vec3::splat(-0.03), Vec3::splat(0.03), 0),
        "large" => mesh.add_box(Vec3::splat(-0.1), Vec3::splat(0.1), 0),
        _ => return shapes::torus(0.05, 0.02, 12, 8, 0),
    }
    mesh
}

/// Places in a room that are clear of what stands there.
fn places(scene: &Scene, count: usize) -> Vec<Vec3> {
    let geometry = Geometry::new(scene);
    let [low, high] = geometry
        .positions
        .iter()
        .fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], p| [low.min(*p), high.max(*p)]);
    let room = CIRCLE + 0.15;
    let is_clear = |at: &Vec3| {
        (0..geometry.triangles.len() as u32).all(|triangle| {
            let corners = geometry.corners(triangle);
            let (from, to) = (corners[0].min(corners[1]).min(corners[2]), corners[0].max(corners[1]).max(corners[2]));
            at.distance(at.clamp(from, to)) > room
        })
    };
    let number = |i: u32, axis: u32| sequence::sample(i, axis, 7);
    let at = |i: u32| low + (high - low) * vec3(number(i, 0), number(i, 1), number(i, 2));
    (0..).map(at).filter(is_clear).take(count).collect()
}

fn place(at: Vec3, index: usize, frame: usize) -> Transform {
    let angle = frame as f32 * STEP / CIRCLE + index as f32;
    let axis = vec3((index as f32).sin(), 1.0, (index as f32 * 1.7).cos()).normalize();
    let turn = Quat::from_axis_angle(axis, angle);
    Transform::rigid(turn, at + turn * axis.any_orthonormal_vector() * CIRCLE)
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or_default()
}

/// Updates with so many movers: milliseconds of an update, and tests made for one.
fn measure(room: &str, kind: &str, count: usize, (lights, frames): (u32, usize)) -> Result<[f64; 2]> {
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
    scene.take_changes();
    let mut illumination = Illumination::new(&scene, &settings)?;
    let (mut times, mut flat, mut tests) = (Vec::new(), Vec::new(), 0);
    for frame in 1..=frames {
        for (index, (at, node)) in centers.iter().zip(&nodes).enumerate() {
            scene.set_transform(*node, place(*at, index, frame))?;
        }
        let changes = scene.take_changes();
        let start = Instant::now();
        Geometry::new(&scene);
        flat.push(start.elapsed().as_secs_f64() * 1e3);
        let start = Instant::now();
        illumination.update(&scene, &changes)?;
        times.push(start.elapsed().as_secs_f64() * 1e3);
        tests += illumination.visibility().map_or(0, |v| v.counts().tests.total());
    }
    let start = Instant::now();
    let database = VisibilityDatabase::build(&scene, illumination.geometry(), illumination.lights(), &Default::default())?;
    let scratch = start.elapsed().as_secs_f64() * 1e3;
    let (update, tests) = (median(times), tests as f64 / frames as f64);
    println!(
        "{count:4} movers: update {update:7.2} ms (geometry {:5.2} ms), {tests:9.0} tests, {:5.1} % of {scratch:6.1} ms and of {} tests from scratch; {} nodes",
        median(flat),
        update / scratch * 100.0,
        database.counts().tests.total(),
        database.counts().nodes,
    );
    Ok([update, tests])
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let argument = |i: usize| arguments.get(i).map(String::as_str);
    let room = argument(0).unwrap_or("block");
    let number = |i: usize, other: usize| argument(i).and_then(|a| a.parse().ok()).unwrap_or(other);
    let size = (number(1, 300) as u32, number(2, 16));
    let kind = argument(3).unwrap_or("torus");
    let counts: Vec<usize> = argument(4).map_or(vec![1, 10, 50, 200], |list| list.split(',').filter_map(|n| n.parse().ok()).collect());
    let results = counts.iter().map(|&count| measure(room, kind, count, size)).collect::<Result<Vec<_>>>()?;
    if let (Some(first), Some(last)) = (results.first(), results.last()) {
        println!("{room}, {kind}: {:.1} x the time, {:.1} x the tests", last[0] / first[0], last[1] / first[1]);
    }
    Ok(())
}
