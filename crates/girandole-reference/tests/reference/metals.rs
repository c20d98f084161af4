//! Light that metals and plastics throw on others: light samples against the path tracer, which knows nothing of them.

use crate::common::{Stage, look};
use girandole_core::glam::{DVec3, Vec2, Vec3};
use girandole_core::image::Image;
use girandole_core::lights::{Clamp, LightSample, LightSet, LightSettings, SampleOrigin};
use girandole_core::scene::builtin::{self, MovingObject, shapes};
use girandole_core::scene::{Geometry, Material, NONE, Scene, View};
use girandole_core::trace::SceneTracer;
use girandole_reference::metrics::{CompareOptions, compare};
use girandole_reference::{OracleSettings, PathSettings, oracle, path_trace};

const SIZE: [u32; 2] = [112, 64];
const BOUNCES: u32 = 5;
const ROUGHNESSES: [f32; 5] = [0.15, 0.3, 0.5, 0.75, 1.0];
const GOLD: Vec3 = Vec3::new(1.0, 0.7, 0.3);

fn shiny(metallic: f32, roughness: f32, color: Vec3) -> Material {
    Material { metallic, roughness, specular: 1.0, ..Material::diffuse("", color) }
}

/// A closed room under a ceiling panel, with a row of gold spheres, rougher and rougher, and one of plastic before it.
fn spheres() -> (Scene, View) {
    let mut stage = Stage::default();
    let walls = stage.material(Material::diffuse("", Vec3::splat(0.75)));
    let lamp = stage.material(Material::emitter("", Vec3::splat(10.0)));
    stage.room(Vec3::new(-2.0, 0.0, -1.2), Vec3::new(2.0, 2.0, 2.4), walls);
    stage.quad(Vec3::new(-0.5, 1.99, 0.0), Vec3::X, Vec3::Z * 0.8, lamp);
    for (row, (metallic, color)) in [(1.0, GOLD), (0.0, Vec3::new(0.2, 0.4, 0.7))].into_iter().enumerate() {
        for (column, roughness) in ROUGHNESSES.into_iter().enumerate() {
            let material = stage.material(shiny(metallic, roughness, color));
            let at = Vec3::new(column as f32 * 0.75 - 1.5, 0.34, row as f32 * 0.8 - 0.6);
            let mut sphere = shapes::sphere(0.33, 48, 24, material);
            sphere.positions.iter_mut().for_each(|p| *p += at);
            stage.mesh(sphere);
        }
    }
    let view = View {
        half_extent: Vec2::new(0.84, 0.48),
        ..look(Vec3::new(0.0, 1.7, 2.2), Vec3::new(0.0, 0.3, -0.1), 0.8)
    };
    (stage.scene, view)
}

/// By pixel, the object that it shows, if those beside it show the same.
fn objects(tracer: &SceneTracer, (view, size): (&View, [u32; 2])) -> Vec<u32> {
    let geometry = tracer.geometry();
    let view = view.relative_to(geometry.origin);
    let shown = |x: u32, y: u32| {
        let (origin, direction) = view.pixel_ray(Vec2::new(x as f32, y as f32), size);
        let hit = tracer.closest_visible(origin, direction);
        hit.map_or(NONE, |hit| geometry.triangles[hit.triangle as usize].object)
    };
    let of = |i: u32| {
        let (x, y) = (i % size[0], i / size[0]);
        let corners = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| shown(x + dx, y + dy));
        if corners.iter().all(|&object| object == corners[0]) { corners[0] } else { NONE }
    };
    (0..size[0] * size[1]).map(of).collect()
}

/// The mean of what some pixels show.
fn mean(picture: &Image, counts: impl Fn(usize) -> bool) -> DVec3 {
    let pixels = picture.pixels.iter().enumerate().filter(|(i, _)| counts(*i));
    let (sum, count) = pixels.fold((DVec3::ZERO, 0.0), |(sum, n), (_, p)| (sum + p.as_dvec3(), n + 1.0));
    assert!(count > 30.0, "{count} pixels");
    sum / count
}

/// The mean picture of some light sets of which `keep` says what is kept.
fn summed(
    scene: &Scene,
    (view, size): (&View, [u32; 2]),
    (count, sets): (u32, u32),
    keep: impl Fn(&Geometry, &LightSample) -> bool,
) -> Image {
    let geometry = Geometry::new(scene);
    let tracer = SceneTracer::new(scene, &geometry);
    let mut sum = Image::new(size[0], size[1]);
    for seed in 0..sets {
        let settings = LightSettings { count, bounces: BOUNCES, seed, ..LightSettings::default() };
        let lights = LightSet::sample_for(scene, &geometry, &settings, &[*view]).expect("light");
        let kept = lights.samples().iter().filter(|sample| keep(&geometry, sample)).copied().collect();
        let kept = LightSet::from_samples(&geometry, kept);
        let settings = OracleSettings { clamp: Clamp::Own, ..OracleSettings::default() };
        let picture = oracle(&tracer, &kept, view, size, &settings, &|_| {});
        sum.pixels.iter_mut().zip(&picture.pixels).for_each(|(sum, p)| *sum += *p / sets as f32);
    }
    sum
}

fn truth(scene: &Scene, (view, size): (&View, [u32; 2]), paths: u32) -> Image {
    let geometry = Geometry::new(scene);
    let tracer = SceneTracer::new(scene, &geometry);
    let settings = PathSettings { paths, bounces: Some(BOUNCES), seed: 2 };
    path_trace(&tracer, view, size, &settings, &|_| {}).mean
}

fn all(_: &Geometry, _: &LightSample) -> bool {
    true
}

/// Without what shiny surfaces throw.
fn by_matte_surfaces(scene: &Scene) -> impl Fn(&Geometry, &LightSample) -> bool {
    let is_shiny: Vec<bool> = scene.materials.iter().map(|m| m.specular > 0.0).collect();
    move |geometry, sample| {
        let of = |triangle: u32| is_shiny[geometry.triangles[triangle as usize].material.index()];
        !matches!(sample.origin, SampleOrigin::Bounce { triangle, .. } if of(triangle))
    }
}

#[test]
fn rows_of_spheres_in_a_closed_room_have_the_energy_of_the_path_tracer() {
    let (scene, view) = spheres();
    let geometry = Geometry::new(&scene);
    let shown = objects(&SceneTracer::new(&scene, &geometry), (&view, SIZE));
    let truth = truth(&scene, (&view, SIZE), 128);
    let ratio = |found: &Image, counts: &dyn Fn(u32) -> bool| {
        mean(found, |i| counts(shown[i])) / mean(&truth, |i| counts(shown[i]))
    };
    let is_within = |ratio: DVec3, most: f64| (ratio - 1.0).abs().max_element() < most;
    // What the walls show is the light that they get; what gold throws on them is golden.
    let found = summed(&scene, (&view, SIZE), (512, 3), all);
    let [whole, walls] = [ratio(&found, &|_| true), ratio(&found, &|object| object == 0)];
    assert!(is_within(whole, 0.03) && is_within(walls, 0.02), "{whole} {walls}");
    for (column, roughness) in (0..).zip(ROUGHNESSES) {
        let [gold, plastic] =
            [0, ROUGHNESSES.len() as u32].map(|row| ratio(&found, &|object| object == 2 + row + column));
        // Narrow lobes are widened where they see what a few samples stand for.
        let most = if roughness < 0.2 {
            0.3
        } else if roughness < 0.4 {
            0.12
        } else {
            0.05
        };
        assert!(is_within(gold, most) && is_within(plastic, 0.05), "{roughness}: {gold} {plastic}");
    }
    // Negative control: spheres that throw no light on others.
    let without = summed(&scene, (&view, SIZE), (512, 1), by_matte_surfaces(&scene));
    let walls = ratio(&without, &|object| object == 0);
    assert!(!is_within(ratio(&without, &|_| true), 0.06) && !is_within(walls, 0.06), "{walls}");
}

/// A closed room of which all walls glow alike: light is the same everywhere, and so is what is made of it.
#[test]
fn furnaces_of_gold_hold_their_light() {
    // Whether a sample stands for what a wall emits or for what it reflects is left to chance: many sets of light, and few pixels.
    let size = SIZE.map(|side| side / 4);
    for roughness in [0.3, 0.8] {
        let mut stage = Stage::default();
        let walls = Material { emission: Vec3::ONE, ..shiny(1.0, roughness, GOLD) };
        let walls = stage.material(walls);
        let white = stage.material(Material::diffuse("", Vec3::splat(0.8)));
        stage.room(Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 2.0, 1.0), walls);
        // A matte plate over the floor shows what light there is.
        stage.quad(Vec3::new(-0.8, 0.01, -0.8), Vec3::Z * 1.6, Vec3::X * 1.6, white);
        let half_extent = Vec2::new(0.7, 0.4);
        let view = View { half_extent, ..look(Vec3::new(0.0, 1.6, 0.9), Vec3::ZERO, 0.8) };
        let scene = stage.scene;
        let geometry = Geometry::new(&scene);
        let shown = objects(&SceneTracer::new(&scene, &geometry), (&view, size));
        let truth = mean(&truth(&scene, (&view, size), 512), |i| shown[i] == 1);
        let found = mean(&summed(&scene, (&view, size), (256, 48), all), |i| shown[i] == 1);
        let error = (found / truth - 1.0).abs().max_element();
        assert!(error < 0.02, "{roughness}: {found} for {truth}");
        // Negative control: what walls emit alone, of which gold reflects most in red and a third in blue.
        let emitted =
            mean(&summed(&scene, (&view, size), (256, 1), by_matte_surfaces(&scene)), |i| shown[i] == 1);
        let share = emitted / truth;
        assert!(
            share.min_element() < 0.6 && share.max_element() < 0.85,
            "{roughness}: {emitted} for {truth}"
        );
    }
}

#[test]
fn mirrors_throw_light_to_where_they_mirror_it() {
    let scene = |roughness: f32| {
        let mut scene = builtin::build("mirror-corridor", MovingObject::None).expect("a scene");
        let metals = scene.materials.iter_mut().filter(|m| m.metallic == 1.0);
        metals.for_each(|m| m.roughness = roughness);
        scene
    };
    let mirrors = scene(0.0);
    let view = View::new(&mirrors, &mirrors.cameras[0], SIZE[0] as f32 / SIZE[1] as f32);
    let truth = truth(&mirrors, (&view, SIZE), 256);
    let geometry = Geometry::new(&mirrors);
    let tracer = SceneTracer::new(&mirrors, &geometry);
    // Lit as mirrors light it, and, for a negative control, as rough metal does; but for edges of lamps.
    let error = |by: &Scene| {
        let settings = LightSettings { count: 1024, bounces: BOUNCES, ..LightSettings::default() };
        let lights = LightSet::sample_for(by, &Geometry::new(by), &settings, &[view]).expect("light");
        let settings = OracleSettings { clamp: Clamp::Own, samples_per_axis: 2, ..Default::default() };
        let found = oracle(&tracer, &lights, &view, SIZE, &settings, &|_| {});
        let options = CompareOptions { trim: 0.05, ..CompareOptions::default() };
        compare(&truth, &found, &options).expect("pictures").rel_mse
    };
    let [smooth, rough] = [error(&mirrors), error(&scene(0.8))];
    assert!(smooth < 0.75 * rough, "relMSE {smooth} lit by mirrors, {rough} by rough metal");
}
