//! A room that the sky lights through a window alone, by itself and as one of a building's, against the path tracer.

#[path = "../../examples/light_quality/window.rs"]
mod scene;

use girandole_core::glam::{DVec3, Vec2, Vec3};
use girandole_core::image::Image;
use girandole_core::lights::{Clamp, LightSet, LightSettings};
use girandole_core::scene::{Environment, Geometry, View};
use girandole_core::trace::SceneTracer;
use girandole_reference::metrics::{CompareOptions, Comparison, compare};
use girandole_reference::{Estimate, OracleSettings, PathSettings, oracle, path_trace, path_trace_through};

const SIZE: [u32; 2] = [48, 36];
const BOUNCES: u32 = 5;
const SEEDS: u32 = 8;

/// What is left out where only the room counts: pixels that show some of what is outside.
fn outside(tracer: &SceneTracer, view: &View) -> Image {
    let view = view.relative_to(tracer.geometry().origin);
    let is_open = |x: f32, y: f32| {
        let (origin, direction) = view.pixel_ray(Vec2::new(x, y), SIZE);
        tracer.closest_visible(origin, direction).is_none()
    };
    let pixel = |i: u32| {
        let (x, y) = ((i % SIZE[0]) as f32, (i / SIZE[0]) as f32);
        let shows =
            [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].iter().any(|(dx, dy)| is_open(x + dx, y + dy));
        if shows { Vec3::Y } else { Vec3::ZERO }
    };
    Image { width: SIZE[0], height: SIZE[1], pixels: (0..SIZE[0] * SIZE[1]).map(pixel).collect() }
}

/// Sets of 1024 samples against the path tracer, of which directions through the window are known: by seed, and one that is placed for
/// no view. Each the whole picture, in which the window itself is most of the light, and the room alone.
fn compared(in_building: bool, environment: Environment) -> (Vec<[Comparison; 2]>, [Comparison; 2]) {
    let scene = scene::room(in_building, environment);
    let geometry = Geometry::new(&scene);
    let tracer = SceneTracer::new(&scene, &geometry);
    let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
    let openings = [scene::opening(&geometry)];
    let settings = PathSettings { paths: 512, bounces: Some(BOUNCES), seed: 1 };
    let truth = path_trace_through(&openings, &tracer, &view, SIZE, &settings, &|_| {}).mean;
    let found = |seed: u32, views: &[View]| {
        let lights = LightSettings { count: 1024, bounces: BOUNCES, seed, ..LightSettings::default() };
        let set = LightSet::sample_for(&scene, &geometry, &lights, views).expect("light");
        assert!(set.len() == 1024);
        let settings = OracleSettings { samples_per_axis: 2, clamp: Clamp::Own, ..OracleSettings::default() };
        let sum = oracle(&tracer, &set, &view, SIZE, &settings, &|_| {});
        [None, Some(outside(&tracer, &view))].map(|mask| {
            let options = CompareOptions { mask, keep_edges: true, ..CompareOptions::default() };
            compare(&truth, &sum, &options).expect("comparable")
        })
    };
    ((0..SEEDS).map(|seed| found(seed, &[view])).collect(), found(0, &[]))
}

#[test]
fn a_room_lit_through_a_window_agrees_with_the_path_tracer() {
    let cases =
        [("alone, gradient", false, scene::gradient()), ("in a building, clear sky", true, scene::sky())];
    for (name, in_building, environment) in cases {
        let (found, by_power) = compared(in_building, environment);
        let mean = |which: usize, f: &dyn Fn(&Comparison) -> f64| {
            found.iter().map(|found| f(&found[which])).sum::<f64>() / f64::from(SEEDS)
        };
        let [picture, room] = [0, 1].map(|which| {
            let [energy, flip] = [mean(which, &|c| c.energy_ratio), mean(which, &|c| c.flip)];
            println!("{name}: energy {energy:.4}, FLIP {flip:.4}, relMSE {:.4}", mean(which, &|c| c.rel_mse));
            [energy, flip]
        });
        println!("  by power {:.4} {:.4}", by_power[0].flip, by_power[1].flip);
        assert!((picture[0] - 1.0).abs() < 0.02 && picture[1] <= 0.08, "{name}: {picture:?}, {found:?}");
        assert!((room[0] - 1.0).abs() < 0.05 && room[1] < 0.13, "{name}: {room:?}, {found:?}");
        // Where paths start everywhere before the scene, few come in.
        assert!(by_power[0].flip > 0.085 && by_power[1].flip > 0.2, "negative control: {by_power:?}");
    }
}

/// The mean of all pixels and channels, and its variance.
fn mean(estimate: &Estimate) -> (f64, f64) {
    let count = estimate.mean.pixels.len() as f64 * 3.0;
    let sum = |pixels: &[Vec3]| pixels.iter().map(|p| p.as_dvec3()).sum::<DVec3>().element_sum();
    (sum(&estimate.mean.pixels) / count, sum(&estimate.variance.pixels) / (count * count))
}

#[test]
fn paths_towards_openings_see_the_same_light_with_less_noise() {
    let scene = scene::room(false, scene::gradient());
    let geometry = Geometry::new(&scene);
    let tracer = SceneTracer::new(&scene, &geometry);
    let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
    let settings = PathSettings { paths: 512, bounces: Some(2), seed: 3 };
    let plain = path_trace(&tracer, &view, [24, 18], &settings, &|_| {});
    let openings = [scene::opening(&geometry)];
    let through = path_trace_through(&openings, &tracer, &view, [24, 18], &settings, &|_| {});
    let ((expected, noise), (found, own)) = (mean(&plain), mean(&through));
    let agrees = |found: f64| (found - expected).abs() < 4.0 * (noise + own).sqrt();
    assert!(agrees(found), "{found} for {expected} ± {}", noise.sqrt());
    assert!(own < 0.8 * noise, "{own} {noise}");
    assert!(!agrees(found * 1.06), "negative control: {found} for {expected} ± {}", noise.sqrt());
}
