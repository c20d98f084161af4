//! Statistics of visibility determination: leaves, states, tests and time, for each built-in room or a file.
//!
//! ```text
//! cargo run --release -p girandole-core --example visibility_counts -- [lights] [split] [file]
//! ```

use girandole_core::Result;
use girandole_core::glam::Vec2;
use girandole_core::lights::{Clamp, LightSet, LightSettings};
use girandole_core::math::sequence;
use girandole_core::scene::{Geometry, Scene, builtin};
use girandole_core::trace::SceneTracer;
use girandole_core::visibility::{State, VisibilityDatabase, VisibilitySettings};
use std::path::Path;
use std::time::Instant;

fn report(scene: &Scene, count: u32, settings: &VisibilitySettings) -> Result<()> {
    let geometry = Geometry::new(scene);
    let lights = LightSet::sample(scene, &geometry, &LightSettings { count, ..LightSettings::default() })?;
    let mut best = f64::INFINITY;
    let mut database = None;
    for _ in 0..5 {
        let start = Instant::now();
        database = Some(VisibilityDatabase::build(scene, &geometry, &lights, settings)?);
        best = best.min(start.elapsed().as_secs_f64() * 1e3);
    }
    let Some(database) = database else { return Ok(()) };
    let c = database.counts();
    let per_pair = [c.tests.total(), c.tests.blockers].map(|n| n as f64 / (c.nodes * lights.len()) as f64);
    let [n, p, f] = c.area_shares.map(|s| s * 100.0);
    println!(
        "{:12} {:6} nodes {:6} leaves  N {n:5.1} % P {p:5.1} % F {f:5.1} %  {best:6.1} ms  {per_pair:.2?} tests a pair (all, of blockers)",
        scene.name, c.nodes, c.leaves
    );
    let [free, blocked, mixed] = partial_by_rays(scene, &geometry, &lights, &database);
    println!("{:12} of P rays find {free:.1} % free, {blocked:.1} % blocked, {mixed:.1} % both", "");
    Ok(())
}

/// Partially occluded pairs by traced rays: percent by area that are unoccluded, occluded, and truly partial.
fn partial_by_rays(
    scene: &Scene,
    geometry: &Geometry,
    lights: &LightSet,
    database: &VisibilityDatabase,
) -> [f64; 3] {
    let tracer = SceneTracer::new(scene, geometry);
    let receivers = database.receivers();
    // By leaf: some points, with triangle and normal.
    let mut points = vec![Vec::new(); receivers.leaves.len()];
    for triangle in 0..geometry.triangles.len() as u32 {
        let share = geometry.area(triangle) / geometry.diagonal().powi(2);
        for i in 0..(share * 3e5) as u32 + 2 {
            let [u, v] = [0, 1].map(|d| sequence::sample(i, d, triangle));
            let at = if u + v > 1.0 { Vec2::new(1.0 - u, 1.0 - v) } else { Vec2::new(u, v) };
            let (position, normal) = (geometry.point(triangle, at), geometry.normal(triangle));
            if let Some(leaf) = receivers.leaf_at(triangle, position, true)
                && points[leaf as usize].len() < 64
            {
                points[leaf as usize].push((position, normal, triangle));
            }
        }
    }
    let mut shares = [0.0; 3];
    for (index, points) in points.iter().enumerate() {
        for (light, &state) in lights.samples().iter().zip(database.leaf_states(index as u32)) {
            if state != State::Partial {
                continue;
            }
            let (mut free, mut blocked) = (false, false);
            for &(position, normal, triangle) in points {
                if light.geometric_factor(position, normal, normal, Clamp::Off).is_some() {
                    let from = tracer.offset_ray_origin(position, normal);
                    let hit = tracer.occluded(from, triangle, light.position, light.triangle());
                    blocked |= hit;
                    free |= !hit;
                }
            }
            let kind = if free && blocked { 2 } else { usize::from(!free) };
            shares[kind] += f64::from(receivers.leaves[index].area);
        }
    }
    let total: f64 = shares.iter().sum::<f64>().max(1e-30);
    shares.map(|s| s / total * 100.0)
}

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let lights = arguments.next().and_then(|a| a.parse().ok()).unwrap_or(300);
    let mut settings = VisibilitySettings::default();
    if let Some(split) = arguments.next().and_then(|a| a.parse().ok()) {
        settings.split = split;
    }
    match arguments.next() {
        Some(file) => report(&Scene::load(Path::new(&file))?, lights, &settings),
        None => builtin::EXPERIMENTS.iter().try_for_each(|name| {
            report(&builtin::build(name, builtin::default_object(name))?, lights, &settings)
        }),
    }
}
