//! Any number of punctual lights against the path tracer.

use crate::common::{Stage, look, trace};
use girandole_core::glam::Vec3;
use girandole_core::lights::{LightSet, LightSettings};
use girandole_core::scene::{Material, PunctualKind};
use girandole_core::trace::SceneTracer;
use girandole_reference::{OracleSettings, PathSettings, oracle};

const SIZE: u32 = 16;
const BOUNCES: u32 = 3;

/// A room with so many lamps below its ceiling, of the same light in all, and a glowing panel if there is to be one.
fn room(lamps: u32, panel: bool) -> Stage {
    let mut stage = Stage::default();
    let wall = stage.material(Material::diffuse("", Vec3::new(0.75, 0.73, 0.7)));
    stage.room(Vec3::new(-3.0, 0.0, -3.0), Vec3::new(3.0, 3.0, 3.0), wall);
    if panel {
        let glow = stage.material(Material::emitter("", Vec3::splat(12.0)));
        stage.quad(Vec3::new(0.6, 2.0, -1.0), Vec3::X, Vec3::Z, glow);
    }
    let side = f64::from(lamps).sqrt().ceil() as u32;
    let at = |i: u32| 5.6 * (i as f32 + 0.5) / side as f32 - 2.8;
    for lamp in 0..lamps {
        let place = Vec3::new(at(lamp % side), 2.7, at(lamp / side));
        let intensity = Vec3::new(60.0, 50.0, 40.0) / lamps as f32;
        stage.punctual(PunctualKind::Point, intensity, place, Vec3::ZERO);
    }
    stage
}

#[test]
fn energy_is_the_path_tracers_at_any_number_of_lamps() {
    let view = look(Vec3::new(-2.7, 1.6, 2.7), Vec3::new(0.5, 1.2, -0.6), 0.64);
    for (lamps, panel) in [(1, false), (10, false), (150, false), (148, true), (600, false)] {
        let stage = room(lamps, panel);
        let geometry = stage.geometry();
        let tracer = SceneTracer::new(&stage.scene, &geometry);
        let paths = PathSettings { paths: 256, bounces: Some(BOUNCES), seed: 1 };
        let estimate = trace(&stage.scene, &geometry, &view, SIZE, paths);
        let pixels = f64::from(SIZE * SIZE);
        let variance: f64 = estimate.variance.pixels.iter().map(|v| f64::from(v.element_sum() / 3.0)).sum();
        let truth = f64::from(estimate.mean.mean().element_sum() / 3.0);
        let noise = (variance / pixels / pixels).sqrt() / truth;
        assert!(noise < 0.01, "{lamps}: the path tracer's own error is {noise}");
        let energy = |count: u32, bounces: u32| {
            let settings = LightSettings { count, bounces, ..LightSettings::default() };
            let lights = LightSet::sample_for(&stage.scene, &geometry, &settings, &[view]).expect("light");
            assert_eq!(lights.len(), count as usize);
            // Above one lamp the ceiling is brighter by far than beside it.
            let settings = OracleSettings { samples_per_axis: 4, ..OracleSettings::default() };
            let sum = oracle(&tracer, &lights, &view, [SIZE; 2], &settings, &|_| ());
            f64::from(sum.mean().element_sum() / 3.0) / truth
        };
        let ratio = energy(300, BOUNCES);
        println!("{lamps} {panel}: {ratio:.4} ± {noise:.4}");
        assert!((0.97..1.03).contains(&ratio), "{lamps}: {ratio}");
        // The control: what comes by way of walls is no small part of it.
        let direct = energy(if lamps > 100 { 200 } else { 2 * lamps }, 0);
        assert!(direct < 0.8, "{lamps}: {direct}");
    }
}
