//! What smooth and rough surfaces reflect of an environment.

use crate::common::{Context, Stage, Test, camera};
use crate::selected::{bounded, flip};
use crate::spheres::{Surroundings, gradient, spheres};
use girandole::{Mode, RenderSettings, RendererOptions, Shading};
use girandole_core::glam::Vec3;
use girandole_core::image::Image;
use girandole_core::lights::{Clamp, LightSettings};
use girandole_core::scene::{Material, Mesh, Scene, Transform, View};
use girandole_reference::metrics::{CompareOptions, Comparison, compare};
use girandole_reference::{OracleSettings, Reflected};

pub fn tests() -> Vec<Test> {
    vec![
        ("reflections_of_an_environment_are_the_oracles", oracle),
        ("reflections_by_rays_are_the_oracles", mirrored),
        ("reflections_in_all_modes", modes),
        ("panes_reflect_the_sky", panes),
    ]
}

pub fn with_float_blending() -> (wgpu::Features, Test) {
    (wgpu::Features::FLOAT32_BLENDABLE, ("reflections_in_several_passes", passes))
}

const SIZE: [u32; 2] = [160, 40];

fn row(surroundings: Surroundings, count: u32) -> (Stage, View) {
    let (scene, view) = spheres(surroundings);
    (Stage::new(scene, &LightSettings { count, bounces: 2, ..LightSettings::default() }), view)
}

fn summed(stage: &Stage, view: &View, size: [u32; 2], reflected: Reflected) -> Image {
    let settings = OracleSettings { clamp: Clamp::Own, reflected, mirrors: 0, ..OracleSettings::default() };
    girandole_reference::oracle(&stage.tracer(), &stage.lights, view, size, &settings, &|_| {})
}

/// Without mirrored rays: what samples of the environment and its own maps show.
fn by_samples(mode: Mode) -> RenderSettings {
    RenderSettings { mirrors: 0, ..bounded(mode) }
}

fn compared(a: &Image, b: &Image) -> Comparison {
    compare(a, b, &CompareOptions { trim: 0.002, ..CompareOptions::default() }).expect("comparable")
}

fn oracle(context: &Context) {
    for surroundings in [Surroundings::Gradient, Surroundings::Sky] {
        let (stage, view) = row(surroundings, 160);
        let mut renderer = context.renderer(RendererOptions::default());
        renderer.load(&stage.scene, &stage.geometry, &stage.lights).expect("load");
        let picture = context.frame(&mut renderer, &view, SIZE, &by_samples(Mode::Naive));
        let sum = summed(&stage, &view, SIZE, Reflected::Samples);
        let found = compared(&sum, &picture);
        assert!(
            (found.energy_ratio - 1.0).abs() < 0.005 && found.rel_mse < 2e-3,
            "{surroundings:?}: {found:?}"
        );
        // With rays instead of samples it looks nearly the same.
        let traced = compared(&summed(&stage, &view, SIZE, Reflected::Rays), &picture);
        assert!(
            (traced.energy_ratio - 1.0).abs() < 0.03 && traced.flip < 0.06,
            "{surroundings:?}: {traced:?}"
        );
        // The control: points of light are spots.
        let bare = RenderSettings { clamp: Clamp::At(1e6), ..by_samples(Mode::Naive) };
        let points = compared(&sum, &context.frame(&mut renderer, &view, SIZE, &bare));
        assert!(points.rel_mse > 10.0 * found.rel_mse, "{surroundings:?}: {points:?}");
    }
}

/// With rays it is nearer to what the path tracer says of mirrors under a sky.
fn mirrored(context: &Context) {
    let (stage, view) = row(Surroundings::Sky, 160);
    let mut renderer = context.renderer(RendererOptions::default());
    renderer.load(&stage.scene, &stage.geometry, &stage.lights).expect("load");
    let settings = OracleSettings { clamp: Clamp::Own, ..OracleSettings::default() };
    let sum = girandole_reference::oracle(&stage.tracer(), &stage.lights, &view, SIZE, &settings, &|_| {});
    let mut frame = |settings| compared(&sum, &context.frame(&mut renderer, &view, SIZE, &settings));
    let found = frame(bounded(Mode::Naive));
    assert!((found.energy_ratio - 1.0).abs() < 0.01 && found.flip < 0.03, "{found:?}");
    // The control.
    let without = frame(by_samples(Mode::Naive));
    assert!(without.flip > 1.5 * found.flip, "{without:?}");
}

/// Spheres, and a floor that is rough enough for its points to be interpolated between.
fn modes(context: &Context) {
    let (mut scene, view) = spheres(Surroundings::Sky);
    for material in &mut scene.materials {
        if material.specular == 0.0 {
            (material.specular, material.roughness) = (1.0, 0.6);
        }
    }
    // More than one batch.
    let stage = Stage::new(scene, &LightSettings { count: 520, bounces: 1, ..LightSettings::default() });
    let mut renderer = context.loaded(&stage, RendererOptions::default());
    let naive = context.frame(&mut renderer, &view, SIZE, &by_samples(Mode::Naive));
    let parted = RenderSettings { lights_per_batch: Some(128), ..by_samples(Mode::Naive) };
    assert_eq!(context.frame(&mut renderer, &view, SIZE, &parted), naive);
    for (mode, most) in [(Mode::Visibility, 0.002), (Mode::LowResolution, 0.03), (Mode::Full, 0.03)] {
        let difference = flip(&naive, &context.frame(&mut renderer, &view, SIZE, &by_samples(mode)));
        assert!(difference < most, "{mode:?}: {difference}");
    }
    let smoothed = |mode| RenderSettings { samples_per_axis: 2, ..by_samples(mode) };
    let [smooth, full] =
        [Mode::Naive, Mode::Full].map(|mode| context.frame(&mut renderer, &view, SIZE, &smoothed(mode)));
    assert!(flip(&smooth, &full) < 0.03, "{}", flip(&smooth, &full));
    // The control: without the environment's own maps.
    let bare = context.frame(
        &mut renderer,
        &view,
        SIZE,
        &RenderSettings { clamp: Clamp::At(1e6), ..by_samples(Mode::Full) },
    );
    assert!(flip(&naive, &bare) > 0.05);
}

fn passes(context: &Context) {
    let (stage, view) = row(Surroundings::Gradient, 64);
    let mut renderer = context.loaded(&stage, RendererOptions::default());
    let naive = context.frame(&mut renderer, &view, SIZE, &bounded(Mode::Naive));
    let shading = Shading::Multipass { lights_per_pass: 16 };
    let passes = RenderSettings { shading, ..bounded(Mode::Visibility) };
    let difference = flip(&naive, &context.frame(&mut renderer, &view, SIZE, &passes));
    assert!(difference < 0.002, "{difference}");
}

/// A pane of smooth glass before a dark wall, and the sky in it.
fn panes(context: &Context) {
    let glass = |specular| {
        let mut scene = Scene::default();
        scene.environment = Some(gradient());
        let dark = scene.add_material(Material::diffuse("dark", Vec3::splat(0.02)));
        let glass = Material {
            transmission: 1.0,
            specular,
            roughness: 0.1,
            double_sided: true,
            ..Material::diffuse("glass", Vec3::ONE)
        };
        let glass = scene.add_material(glass);
        for (material, z, half) in [(dark, -1.0, 3.0), (glass, 0.0, 1.0)] {
            let mut mesh = Mesh::default();
            let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
            mesh.add_polygon(&corners.map(|[x, y]| Vec3::new(x * half, y * half, z)), material);
            scene.add_object("", mesh, Transform::IDENTITY);
        }
        camera(&mut scene, Vec3::new(1.5, 0.3, 2.0), Vec3::ZERO, 0.6);
        let stage = Stage::new(scene, &LightSettings { count: 100, bounces: 1, ..LightSettings::default() });
        let view = stage.view(0, [64, 64]);
        let mut renderer = context.loaded(&stage, RendererOptions::default());
        let picture = context.frame(&mut renderer, &view, [64, 64], &bounded(Mode::Full));
        (summed(&stage, &view, [64, 64], Reflected::Samples), picture)
    };
    let ((sum, picture), (_, bare)) = (glass(1.0), glass(0.0));
    let found = compared(&sum, &picture);
    assert!((found.energy_ratio - 1.0).abs() < 0.01 && found.rel_mse < 2e-3, "{found:?}");
    // The control: without the sky in it.
    let bare = compared(&sum, &bare);
    assert!(bare.energy_ratio < 0.8, "{bare:?}");
}
