//! Light from infinitely far away: the path tracer against closed forms, and light samples against the path tracer.

use crate::common::{Stage, assert_constant, look, trace};
use girandole_core::glam::{Vec2, Vec3};
use girandole_core::image::Image;
use girandole_core::lights::{Clamp, LightSet, LightSettings, SampleOrigin};
use girandole_core::scene::builtin::shapes;
use girandole_core::scene::{Environment, Geometry, Material, Mesh, Scene, Sky, View};
use girandole_core::trace::SceneTracer;
use girandole_reference::metrics::{CompareOptions, Comparison, compare};
use girandole_reference::{OracleSettings, PathSettings, oracle, path_trace};

const SKY: Vec3 = Vec3::new(0.5, 0.8, 1.5);

fn constant() -> Environment {
    Environment::constant(SKY).expect("an environment")
}

/// Brighter above, and to one side.
fn gradient() -> Environment {
    let pixel = |i: u32| {
        let (x, y) = ((i % 64) as f32 / 64.0, (i / 64) as f32 / 32.0);
        Vec3::new(1.2 - y, 1.0 - y * y, 0.3 + x)
    };
    let map = Image { width: 64, height: 32, pixels: (0..64 * 32).map(pixel).collect() };
    Environment { rotation: 0.4, ..Environment::new(map).expect("an environment") }
}

/// A dim sky with a sun a thousand times as bright, as much as a degree across.
fn sunny() -> Environment {
    let pixel = |i: u32| {
        let (x, y) = (i % 512, i / 512);
        let is_sun = (150..153).contains(&x) && (70..72).contains(&y);
        if is_sun { Vec3::new(2500.0, 2200.0, 1800.0) } else { SKY * if y < 128 { 1.0 } else { 0.2 } }
    };
    let map = Image { width: 512, height: 256, pixels: (0..512 * 256).map(pixel).collect() };
    Environment::new(map).expect("an environment")
}

/// A white sphere and a box on a floor.
fn outdoors(environment: Environment) -> (Scene, View) {
    let mut stage = Stage::default();
    let white = stage.material(Material::diffuse("", Vec3::splat(0.8)));
    let red = stage.material(Material::diffuse("", Vec3::new(0.7, 0.2, 0.1)));
    stage.quad(Vec3::new(-3.0, 0.0, -3.0), Vec3::Z * 6.0, Vec3::X * 6.0, white);
    let mut sphere = shapes::sphere(0.5, 48, 24, white);
    sphere.positions.iter_mut().for_each(|p| *p += Vec3::new(-0.7, 0.5, 0.0));
    stage.mesh(sphere);
    let mut block = Mesh::default();
    block.add_box(Vec3::new(0.3, 0.0, -0.4), Vec3::new(1.0, 0.9, 0.4), red);
    stage.mesh(block);
    stage.scene.environment = Some(environment);
    (stage.scene, look(Vec3::new(0.6, 1.4, 3.2), Vec3::new(0.0, 0.4, 0.0), 0.8))
}

/// The many-light sum against the path tracer with so many bounces.
fn compared(environment: Environment, (lights, bounces): (&LightSettings, u32), paths: u32) -> Comparison {
    let (scene, view) = outdoors(environment);
    let geometry = Geometry::new(&scene);
    let tracer = SceneTracer::new(&scene, &geometry);
    let size = [48, 36];
    let settings = PathSettings { paths, bounces: Some(bounces), seed: 2 };
    let truth = path_trace(&tracer, &view, size, &settings, &|_| {}).mean;
    let samples = LightSet::sample_for(&scene, &geometry, lights, &[view]).expect("light");
    assert!(samples.len() == lights.count as usize && samples.warnings.is_empty(), "{:?}", samples.warnings);
    let oracle_settings = OracleSettings { samples_per_axis: 4, ..OracleSettings::default() };
    let sum = oracle(&tracer, &samples, &view, size, &oracle_settings, &|_| {});
    compare(&truth, &sum, &CompareOptions::default()).expect("comparable")
}

#[test]
fn a_furnace_open_to_all_sides_stays_one() {
    let mut stage = Stage::default();
    let grey = Vec3::new(0.7, 0.5, 0.3);
    let material = stage.material(Material::diffuse("", grey));
    stage.mesh(shapes::sphere(1.0, 96, 48, material));
    stage.scene.environment = Some(constant());
    let geometry = stage.geometry();
    let on_it = look(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 0.05);
    for bounces in [Some(0), Some(3), None] {
        let settings = PathSettings { paths: 64, bounces, seed: 1 };
        let estimate = trace(&stage.scene, &geometry, &on_it, 16, settings);
        assert_constant(&estimate, SKY * grey, &format!("a convex body in a furnace, bounces {bounces:?}"));
        let beside = look(Vec3::new(0.0, 0.0, 4.0), Vec3::new(0.0, 4.0, 0.0), 0.05);
        let background = trace(&stage.scene, &geometry, &beside, 8, settings);
        assert!(background.mean.pixels.iter().all(|p| p.abs_diff_eq(SKY, 1e-5)));
    }
}

#[test]
fn samples_of_an_environment_agree_with_the_path_tracer() {
    for (name, environment) in [("constant", constant()), ("gradient", gradient()), ("sunny", sunny())] {
        for (bounces, most) in [(0, 0.003), (3, 0.006)] {
            let lights = LightSettings { count: 1024, bounces, ..LightSettings::default() };
            let found = compared(environment.clone(), (&lights, bounces), 512);
            let energy = (found.energy_ratio - 1.0).abs();
            assert!(energy < 0.01 && found.rel_mse < most, "{name}, {bounces} bounces: {found:?}");
        }
    }
    // The control: without the light that the scene reflects, some is missed.
    let lights = LightSettings { count: 256, bounces: 0, ..LightSettings::default() };
    let found = compared(constant(), (&lights, 3), 64);
    assert!(found.energy_ratio < 0.99, "{found:?}");
}

#[test]
fn light_is_the_same_in_the_mean_whatever_is_seen() {
    let (scene, view) = outdoors(sunny());
    let geometry = Geometry::new(&scene);
    let irradiance = |views: &[View]| {
        let (mut sum, seeds) = (Vec3::ZERO, 40);
        for seed in 0..seeds {
            let lights = LightSettings { count: 64, bounces: 0, seed, ..LightSettings::default() };
            let set = LightSet::sample_for(&scene, &geometry, &lights, views).expect("light");
            assert!(set.samples().iter().all(|s| matches!(s.origin, SampleOrigin::Environment { .. })));
            // On a floor that sees all of the sky.
            let up = |s: &girandole_core::lights::LightSample| s.intensity * (-s.normal.y).max(0.0);
            sum += set.samples().iter().map(up).sum::<Vec3>() / seeds as f32;
        }
        sum
    };
    let (by_power, by_view) = (irradiance(&[]), irradiance(&[view]));
    let environment = sunny();
    let each = environment.cell_solid_angle() as f32;
    let exact: Vec3 = (0..environment.cells())
        .map(|cell| {
            let up = environment.cell_direction(cell, girandole_core::glam::DVec2::splat(0.5)).y.max(0.0);
            environment.cell_radiance(cell) * up * each
        })
        .sum();
    for found in [by_power, by_view] {
        assert!(((found - exact) / exact).abs().max_element() < 0.03, "{found} for {exact}");
    }
}

/// A sphere of metal on a matte floor fills the picture.
#[test]
fn metals_reflect_what_lies_between_samples() {
    for (roughness, energy, most) in [(0.05, 0.1, 0.2), (0.2, 0.06, 0.2), (0.5, 0.05, 0.1)] {
        let mut stage = Stage::default();
        let white = stage.material(Material::diffuse("", Vec3::splat(0.8)));
        let gold = Material {
            metallic: 1.0,
            roughness,
            specular: 1.0,
            ..Material::diffuse("", Vec3::new(0.9, 0.6, 0.3))
        };
        let gold = stage.material(gold);
        stage.quad(Vec3::new(-3.0, -0.5, -3.0), Vec3::Z * 6.0, Vec3::X * 6.0, white);
        stage.mesh(shapes::sphere(0.5, 96, 48, gold));
        stage.scene.environment = Some(gradient());
        let view = look(Vec3::new(0.0, 0.6, 4.0), Vec3::ZERO, 0.17);
        let geometry = Geometry::new(&stage.scene);
        let tracer = SceneTracer::new(&stage.scene, &geometry);
        let size = [32, 32];
        let settings = PathSettings { paths: 512, bounces: Some(2), seed: 2 };
        let truth = path_trace(&tracer, &view, size, &settings, &|_| {}).mean;
        let lights = LightSettings { count: 512, bounces: 1, ..LightSettings::default() };
        let samples = LightSet::sample_for(&stage.scene, &geometry, &lights, &[view]).expect("light");
        let error = |clamp| {
            let settings = OracleSettings { samples_per_axis: 2, clamp, ..OracleSettings::default() };
            let sum = oracle(&tracer, &samples, &view, size, &settings, &|_| {});
            compare(&truth, &sum, &CompareOptions::default()).expect("comparable")
        };
        let (found, points) = (error(Clamp::Own), error(Clamp::Off));
        assert!((found.energy_ratio - 1.0).abs() < energy && found.rel_mse < most, "{roughness}: {found:?}");
        // Points without extent are spots on a dark sphere.
        assert!(roughness > 0.3 || points.rel_mse > 3.0 * found.rel_mse, "{roughness}: {points:?}");
    }
}

/// Under a sky with its sun.
#[test]
fn a_clear_sky_agrees_with_the_path_tracer() {
    for (elevation, azimuth) in [(25.0_f32, 120.0_f32), (60.0, 300.0)] {
        let sky = Sky { elevation: elevation.to_radians(), azimuth: azimuth.to_radians(), turbidity: 3.0 };
        let lights = LightSettings { count: 512, bounces: 2, ..LightSettings::default() };
        let found = compared(Environment::sky(&sky).expect("a sky"), (&lights, 2), 256);
        let energy = (found.energy_ratio - 1.0).abs();
        assert!(energy < 0.01 && found.rel_mse < 0.006, "{elevation}: {found:?}");
    }
}

/// The shadow of a wall 1 m high, on the floor 1 m behind it.
#[test]
fn shadows_are_as_soft_as_the_sun_makes_them() {
    let mut stage = Stage::default();
    let white = stage.material(Material::diffuse("", Vec3::splat(0.8)));
    stage.quad(Vec3::new(-3.0, 0.0, -3.0), Vec3::Z * 6.0, Vec3::X * 6.0, white);
    stage.quad(Vec3::new(-1.0, 0.0, -3.0), Vec3::Z * 6.0, Vec3::Y, white);
    let quarter = std::f32::consts::FRAC_PI_2;
    let sky = Sky { elevation: 0.5 * quarter, azimuth: 3.0 * quarter, turbidity: 3.0 };
    stage.scene.environment = Some(Environment::sky(&sky).expect("a sky"));
    let geometry = stage.geometry();
    let tracer = SceneTracer::new(&stage.scene, &geometry);
    let half_width = 0.02;
    let view = View {
        orthographic: true,
        half_extent: Vec2::splat(half_width),
        ..look(Vec3::new(0.0, 2.0, 0.0), Vec3::ZERO, half_width)
    };
    let size = [64, 2];
    let edge = |count: u32| {
        let lights = LightSettings { count, bounces: 0, ..LightSettings::default() };
        let samples = LightSet::sample_for(&stage.scene, &geometry, &lights, &[view]).expect("light");
        let sum = oracle(&tracer, &samples, &view, size, &OracleSettings::default(), &|_| {});
        // Where light rises, and how far about there.
        let (mut all, mut mean, mut square) = (0.0, 0.0, 0.0);
        for (x, pair) in (0..).zip(sum.pixels[..64].windows(2)) {
            let (rise, at) = ((pair[1].x - pair[0].x).abs(), (x as f32 - 31.0) * half_width / 32.0);
            all += rise;
            mean += rise * at;
            square += rise * at * at;
        }
        (square / all - (mean / all).powi(2)).sqrt()
    };
    // The sun is 0.533° wide, its projection on a line has a fourth of that as its deviation; it comes from √2 m away, and falls on
    // the floor at 45°.
    let expected = 2.0 * 0.25 * 0.533_f32.to_radians();
    let [found, hard] = [edge(400), edge(8)];
    assert!((found / expected - 1.0).abs() < 0.15, "{found} for {expected}");
    // Negative control: a single sample has a hard edge.
    assert!(hard < 0.3 * expected, "{hard}");
}
