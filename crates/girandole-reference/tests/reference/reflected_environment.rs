//! Spheres from smooth to rough under skies and in a room, the sum over light samples against the path tracer.

use crate::sphere_rows::{Row, rows, seen};
use crate::spheres::{ROUGHNESS, Surroundings, spheres};
use girandole_core::lights::{Clamp, LightSet, LightSettings};
use girandole_core::scene::Geometry;
use girandole_core::trace::SceneTracer;
use girandole_reference::{OracleSettings, PathSettings, Reflected, oracle, path_trace};

const SIZE: [u32; 2] = [160, 40];
const BOUNCES: u32 = 3;

/// So many sets of samples: a single one may be unlucky at a sphere; four may where walls and a lamp are near.
fn seeds(surroundings: Surroundings) -> u32 {
    if matches!(surroundings, Surroundings::Room) { 8 } else { 4 }
}

/// How well spheres are rendered with few samples, in the mean over seeds: by rays, by samples as the renderer does it, and where samples
/// are points.
fn rendered(surroundings: Surroundings) -> [[Row; 2]; 3] {
    let (scene, view) = spheres(surroundings);
    let geometry = Geometry::new(&scene);
    let tracer = SceneTracer::new(&scene, &geometry);
    let seen = seen(&tracer, &view, SIZE);
    let settings = PathSettings { paths: 400, bounces: Some(BOUNCES), seed: 7 };
    let truth = path_trace(&tracer, &view, SIZE, &settings, &|_| {}).mean;
    let sets = (0..seeds(surroundings)).map(|seed| {
        let lights = LightSettings { count: 1024, bounces: BOUNCES, seed, ..LightSettings::default() };
        LightSet::sample_for(&scene, &geometry, &lights, &[view]).expect("light")
    });
    let sets: Vec<LightSet> = sets.collect();
    let ways =
        [(Clamp::Own, Reflected::Rays), (Clamp::Own, Reflected::Samples), (Clamp::Off, Reflected::Rays)];
    ways.map(|(clamp, reflected)| {
        let settings = OracleSettings { samples_per_axis: 2, clamp, reflected, mirrors: 0 };
        let of = |set| rows(&truth, &oracle(&tracer, set, &view, SIZE, &settings, &|_| {}), &seen);
        let all: Vec<[Row; 2]> = sets.iter().map(of).collect();
        std::array::from_fn(|row| mean(all.iter().map(|rows| &rows[row])))
    })
}

/// The mean of rows.
fn mean<'a>(rows: impl Iterator<Item = &'a Row> + Clone) -> Row {
    let n = rows.clone().count() as f64;
    let of = |value: &dyn Fn(&Row) -> f64| rows.clone().map(value).sum::<f64>() / n;
    Row {
        is_metal: rows.clone().any(|row| row.is_metal),
        energy: (0..ROUGHNESS.len()).map(|i| of(&|row| row.energy[i])).collect(),
        flip: (0..ROUGHNESS.len()).map(|i| of(&|row| row.flip[i])).collect(),
    }
}

/// Largest distance of the energy of rough spheres from 1, and largest FLIP from a roughness of 0.3 on.
fn worst(row: &Row) -> (f64, f64) {
    let from = |least: f32, values: &[f64], f: &dyn Fn(f64) -> f64| {
        let rough = values.iter().zip(ROUGHNESS).filter(|(_, roughness)| *roughness >= least);
        rough.map(|(value, _)| f(*value)).fold(0.0, f64::max)
    };
    (from(0.15, &row.energy, &|e| (e - 1.0).abs()), from(0.3, &row.flip, &|f| f))
}

fn check(surroundings: Surroundings, most_energy: f64, most_flip: f64) {
    let [rays, samples, points] = rendered(surroundings);
    for row in rays.iter().chain(&samples) {
        let (energy, flip) = worst(row);
        assert!(energy < most_energy && flip < most_flip, "{surroundings:?}: {energy} {flip} {row:?}");
        // Mirrors have about the right brightness at least.
        assert!(row.energy.iter().all(|e| (0.5..2.0).contains(e)), "{surroundings:?}: {row:?}");
    }
    // The control: reflected as points, samples are spots.
    let [points, rays] = [&points, &rays].map(|rows| rows.iter().find(|row| row.is_metal).expect("metal"));
    assert!(points.flip[0] > 1.3 * rays.flip[0], "{surroundings:?}: {points:?} {rays:?}");
}

#[test]
fn spheres_under_a_gradient() {
    check(Surroundings::Gradient, 0.05, 0.1);
}

#[test]
fn spheres_under_a_sky() {
    // A highlight of the sun is less than a pixel wide.
    check(Surroundings::Sky, 0.09, 0.1);
}

#[test]
fn spheres_in_a_room() {
    check(Surroundings::Room, 0.07, 0.12);
}
