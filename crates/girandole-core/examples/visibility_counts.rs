//! How well visibility determination does: leaves, states, tests and time, for each built-in room or a file.
//!
//! ```text
//! cargo run --release -p girandole-core --example visibility_counts -- [lights] [split] [file]
//! ```

use girandole_core::Result;
use girandole_core::lights::{LightSet, LightSettings};
use girandole_core::scene::{Geometry, Scene, builtin};
use girandole_core::visibility::{VisibilityDatabase, VisibilitySettings};
use std::path::Path;
use std::time::Instant;

fn report(scene: &Scene, count: u32, settings: &VisibilitySettings) -> Result<()> {
    let geometry = Geometry::new(scene);
    let lights = LightSet::sample(scene, &geometry, &LightSettings { count, ..LightSettings::default() })?;
    let mut best = f64::INFINITY;
    let mut database = None;
    for _ in 0..5 {
        let start = Instant::now();
        database = Some(VisibilityDatabase::build(scene, &geometry, &lights, settings));
        best = best.min(start.elapsed().as_secs_f64() * 1e3);
    }
    let Some(c) = database.map(|d| d.counts()) else { return Ok(()) };
    let per_pair = c.tests as f64 / (c.nodes * lights.samples.len()) as f64;
    let [n, p, f] = c.area_shares.map(|s| s * 100.0);
    println!(
        "{:12} {:6} nodes {:6} leaves  N {n:5.1} % P {p:5.1} % F {f:5.1} %  {best:6.1} ms  {per_pair:5.2} tests a pair, \
         {} blockers",
        scene.name, c.nodes, c.leaves, c.blockers
    );
    Ok(())
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
        None => builtin::NAMES.iter().try_for_each(|name| {
            report(&builtin::build(name, builtin::default_object(name))?, lights, &settings)
        }),
    }
}
