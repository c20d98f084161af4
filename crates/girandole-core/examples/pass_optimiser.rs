//! How long the pass optimiser takes, and how many passes it saves.
//!
//! ```text
//! cargo run --release -p girandole-core --example pass_optimiser -- [objects] [lights] [lights per pass]
//! ```
//!
//! Times are the best of five. `room`: objects and lights strewn over a floor with discs that block light; an object
//! needs a light if a disc blocks part of the way between them, widened by the object's radius, but not all of it.
//! `random`: each object needs each light with a probability of one half, which no room comes close to. `same`: all
//! objects need all lights.

use girandole_core::elements::{LightSets, optimise, passes, unmerged};
use std::time::Instant;

/// Numbers from 0 to 1, always the same.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1_u64 << 24) as f32
    }

    fn point(&mut self) -> [f32; 2] {
        [self.next(), self.next()]
    }
}

/// Objects of one radius in a room of 1 × 1 with discs of another radius.
fn room(objects: u32, lights: u32, discs: usize, disc: f32, radius: f32) -> LightSets {
    let mut numbers = Numbers(1);
    let discs: Vec<_> = (0..discs).map(|_| numbers.point()).collect();
    let lights: Vec<_> = (0..lights).map(|_| numbers.point()).collect();
    let mut sets = LightSets::new(objects as usize, lights.len());
    for object in 0..objects {
        let at = numbers.point();
        for (light, from) in (0..).zip(&lights) {
            let way = [at[0] - from[0], at[1] - from[1]];
            let length2 = way[0] * way[0] + way[1] * way[1];
            let partial = discs.iter().any(|c| {
                let to = [c[0] - from[0], c[1] - from[1]];
                let along = (to[0] * way[0] + to[1] * way[1]) / length2;
                let aside = (to[0] * way[1] - to[1] * way[0]).abs() / length2.sqrt();
                // The way is as wide as the object at its end, and a point at the light.
                let wide = radius * along;
                (0.0..1.0).contains(&along) && aside < disc + wide && aside > disc - wide
            });
            if partial {
                sets.insert(object, light);
            }
        }
    }
    sets
}

fn main() -> Result<(), std::num::ParseIntError> {
    let numbers: Vec<u32> = std::env::args().skip(1).map(|a| a.parse()).collect::<Result<_, _>>()?;
    let number = |i: usize, default| numbers.get(i).copied().unwrap_or(default);
    let (objects, lights, per_pass) = (number(0, 1000), number(1, 300), number(2, 7));
    let mut half = Numbers(2);
    let pairs = || (0..objects).flat_map(|o| (0..lights).map(move |l| (o, l)));
    let cases: [(&str, LightSets); 6] = [
        ("room, 4 pillars, small objects", room(objects, lights, 4, 0.05, 0.01)),
        ("room, 4 pillars, large objects", room(objects, lights, 4, 0.05, 0.1)),
        ("room, 30 discs", room(objects, lights, 30, 0.02, 0.03)),
        ("room, 200 discs", room(objects, lights, 200, 0.01, 0.03)),
        ("random", pairs().filter(|_| half.next() < 0.5).collect()),
        ("same", pairs().collect()),
    ];
    println!("{objects} objects, {lights} lights, {per_pass} a pass");
    for (name, sets) in cases {
        let before = unmerged(&sets);
        let pairs: usize = before.iter().map(|e| e.lights.len()).sum();
        let mut seconds = f64::INFINITY;
        let mut elements = Vec::new();
        for _ in 0..5 {
            let start = Instant::now();
            elements = optimise(&sets, per_pass);
            seconds = seconds.min(start.elapsed().as_secs_f64());
        }
        println!(
            "{name:32} {:5.1} % of pairs, {:6} passes -> {:5}, {:5} elements, {:7.2} ms",
            100.0 * pairs as f64 / (f64::from(objects) * f64::from(lights)),
            passes(&before, per_pass),
            passes(&elements, per_pass),
            elements.len(),
            1e3 * seconds,
        );
    }
    Ok(())
}
