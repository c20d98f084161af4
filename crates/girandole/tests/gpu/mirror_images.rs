//! What mirrors show.

use crate::common::{Context, Stage, Test, camera, with_object};
use crate::motion::{held, updated};
use crate::selected::{bounded, flip};
use girandole::{MapUpdates, Mode, RenderSettings, RendererOptions, Shading};
use girandole_core::glam::{DAffine3, DVec3, vec3};
use girandole_core::image::Image;
use girandole_core::lights::{Clamp, LightSettings};
use girandole_core::scene::builtin::MovingObject;
use girandole_core::scene::{PunctualKind, PunctualLight, Transform, View};
use girandole_reference::OracleSettings;
use girandole_reference::metrics::{CompareOptions, compare};

pub fn tests() -> Vec<Test> {
    vec![
        ("mirror_images_are_the_oracles", oracle),
        ("mirror_images_in_all_modes", modes),
        ("mirror_images_follow_what_moves", follow),
        ("what_is_polished_is_shaded_as_seldom_as_what_is_matt", polished),
    ]
}

pub fn with_timestamps() -> (wgpu::Features, Test) {
    (wgpu::Features::TIMESTAMP_QUERY, ("no_rays_where_no_mirror_is_in_view", none_in_view))
}

pub fn with_float_blending() -> (wgpu::Features, Test) {
    (wgpu::Features::FLOAT32_BLENDABLE, ("mirror_images_in_several_passes", passes))
}

const SIZE: [u32; 2] = [160, 120];

fn stage(name: &str, count: u32) -> (Stage, View) {
    let settings = LightSettings { count, bounces: 2, ..LightSettings::default() };
    let stage = Stage::new(with_object(name, MovingObject::Torus), &settings);
    let view = stage.view(0, SIZE);
    (stage, view)
}

fn mirrored(mode: Mode, mirrors: u32) -> RenderSettings {
    RenderSettings { mirrors, ..bounded(mode) }
}

fn smoothed(mode: Mode) -> RenderSettings {
    RenderSettings { samples_per_axis: 2, ..mirrored(mode, 2) }
}

/// Every light at every pixel and at every end of a ray, as the CPU finds them.
fn oracle(context: &Context) {
    for (name, mirrors) in [("mirrors", 2), ("mirror-corridor", 4)] {
        let (stage, view) = stage(name, 150);
        let mut renderer = context.renderer(RendererOptions::default());
        renderer.load(&stage.scene, &stage.geometry, &stage.lights).expect("load");
        let mut picture =
            |mirrors| context.frame(&mut renderer, &view, SIZE, &mirrored(Mode::Naive, mirrors));
        let settings = OracleSettings { clamp: Clamp::Own, mirrors, ..OracleSettings::default() };
        let sum =
            girandole_reference::oracle(&stage.tracer(), &stage.lights, &view, SIZE, &settings, &|_| {});
        let compared = |picture: &Image| {
            compare(&sum, picture, &CompareOptions { trim: 0.002, ..CompareOptions::default() })
                .expect("comparable")
        };
        let found = compared(&picture(mirrors));
        assert!((found.energy_ratio - 1.0).abs() < 0.01 && found.flip < 0.03, "{name}: {found:?}");
        // The controls: blurs of light samples in their place, and rays that end too early.
        let [none, fewer] = [0, mirrors - 1].map(|mirrors| compared(&picture(mirrors)));
        assert!(none.flip > 3.0 * found.flip, "{name}: {none:?}");
        assert!(fewer.rel_mse > 1.2 * found.rel_mse, "{name}: {fewer:?}");
    }
}

fn modes(context: &Context) {
    let (stage, view) = stage("mirrors", 150);
    let mut renderer = context.loaded(&stage, RendererOptions::default());
    let naive = context.frame(&mut renderer, &view, SIZE, &mirrored(Mode::Naive, 2));
    for (mode, most) in [(Mode::Visibility, 0.003), (Mode::LowResolution, 0.03), (Mode::Full, 0.03)] {
        let picture = context.frame(&mut renderer, &view, SIZE, &mirrored(mode, 2));
        assert!(flip(&naive, &picture) < most, "{mode:?}: {}", flip(&naive, &picture));
        // The same bits once more.
        assert_eq!(context.frame(&mut renderer, &view, SIZE, &mirrored(mode, 2)), picture, "{mode:?}");
    }
    let [smooth, full] =
        [Mode::Naive, Mode::Full].map(|mode| context.frame(&mut renderer, &view, SIZE, &smoothed(mode)));
    assert!(flip(&smooth, &full) < 0.03, "{}", flip(&smooth, &full));
    // The control: without mirrors.
    let blurred = context.frame(&mut renderer, &view, SIZE, &mirrored(Mode::Full, 0));
    assert!(flip(&naive, &blurred) > 0.06, "{}", flip(&naive, &blurred));
}

/// Light samples show nothing of what a polished plane reflects, unless some are punctual: then each of its pixels is shaded.
fn polished(context: &Context) {
    let (mut stage, view) = stage("mirrors", 150);
    let points_of = |stage: &Stage| {
        let mut renderer = context.loaded(stage, RendererOptions::default());
        let [naive, full] =
            [Mode::Naive, Mode::Full].map(|mode| context.frame(&mut renderer, &view, SIZE, &smoothed(mode)));
        assert!(flip(&naive, &full) < 0.03, "{}", flip(&naive, &full));
        context.wait(renderer.stats()).expect("stats").points.iter().sum::<u64>()
    };
    let few = points_of(&stage);
    let node = stage.scene.add_node("spark", Transform::translation(vec3(0.0, 1.5, 0.0)));
    let (name, intensity) = (String::new(), vec3(1e-3, 1e-3, 1e-3));
    stage.scene.lights.push(PunctualLight { name, node, kind: PunctualKind::Point, intensity });
    let settings = LightSettings { count: 150, bounces: 2, ..LightSettings::default() };
    let many = points_of(&Stage::new(stage.scene, &settings));
    assert!(few > 0 && 2 * few < many, "{few} {many}");
}

/// The ceiling alone is in view: no rays are sent, and the same maps are drawn as without mirrors.
fn none_in_view(context: &Context) {
    let (mut stage, towards_mirrors) = stage("mirrors", 64);
    camera(&mut stage.scene, vec3(0.0, 1.9, 0.0), vec3(0.5, 2.8, 0.4), 0.6);
    let ceiling = stage.view(stage.scene.cameras.len() - 1, SIZE);
    for mode in [Mode::Naive, Mode::Full] {
        let frames = [(&ceiling, 2), (&ceiling, 0), (&towards_mirrors, 2)].map(|(view, mirrors)| {
            let mut renderer = context.loaded(&stage, RendererOptions::default());
            renderer.time_passes(true);
            let picture = context.frame(&mut renderer, view, SIZE, &mirrored(mode, mirrors));
            let stats = context.wait(renderer.stats()).expect("stats");
            (picture, stats.maps_drawn, stats.gpu_ms.contains_key("mirrors_gpu_ms"))
        });
        let [(with, maps, traced), (without, maps_without, _), (_, maps_towards, traced_towards)] = frames;
        assert!(with == without && maps == maps_without && !traced, "{mode:?}");
        // The controls: towards mirrors rays are sent, and modes that know what is seen draw other maps.
        assert!(
            traced_towards && (mode == Mode::Naive || maps < maps_towards),
            "{mode:?}: {maps} {maps_towards}"
        );
    }
    // Having seen none, a renderer sees the next ones.
    let mut renderer = context.loaded(&stage, RendererOptions::default());
    let settings = mirrored(Mode::Full, 2);
    let [before, between, after] = [&towards_mirrors, &ceiling, &towards_mirrors]
        .map(|view| context.frame(&mut renderer, view, SIZE, &settings));
    assert!(before == after && between != after);
}

fn passes(context: &Context) {
    let (stage, view) = stage("mirrors", 64);
    let mut renderer = context.loaded(&stage, RendererOptions::default());
    let naive = context.frame(&mut renderer, &view, SIZE, &mirrored(Mode::Naive, 2));
    let shading = Shading::Multipass { lights_per_pass: 16 };
    let passes = RenderSettings { shading, ..mirrored(Mode::Visibility, 2) };
    let difference = flip(&naive, &context.frame(&mut renderer, &view, SIZE, &passes));
    assert!(difference < 0.003, "{difference}");
}

/// What moves is in the mirror where it is, not where it was a frame ago, as if the scene had been loaded so.
fn follow(context: &Context) {
    let mut scene = with_object("mirrors", MovingObject::Torus);
    let torus = scene.objects.iter().find(|object| object.dynamic).expect("a torus").node;
    scene.take_changes();
    let mut renderer = context.renderer(RendererOptions { map_size: Some(64), ..Default::default() });
    let mut other = context.renderer(RendererOptions { map_size: Some(64), ..Default::default() });
    renderer.open(&scene, &held(40, false)).expect("open");
    let mut before = Vec::new();
    for step in 0..3 {
        let shift = DAffine3::from_translation(DVec3::new(0.1, 0.1, -0.2) * f64::from(step));
        scene.set_transform(torus, Transform::Affine(shift * scene.world_from_node(torus))).expect("a move");
        let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
        let settings = mirrored(Mode::Full, 2);
        let ([after, anew], _) =
            updated(context, [&mut renderer, &mut other], (&mut scene, &view), &settings);
        assert!(after == anew, "step {step}");
        assert!(after != before, "the control: step {step}");
        before = after;
    }
    // Where maps are left stale, too, frames are recorded.
    let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
    let shift = DAffine3::from_translation(DVec3::new(-0.2, 0.1, 0.1));
    scene.set_transform(torus, Transform::Affine(shift * scene.world_from_node(torus))).expect("a move");
    let changes = scene.take_changes();
    renderer.update(&scene, &changes).expect("an update");
    let updates = MapUpdates { most: Some(4), ..MapUpdates::default() };
    let late = RenderSettings { updates, ..mirrored(Mode::Full, 2) };
    assert!(context.frame(&mut renderer, &view, SIZE, &late).pixels != before);
}
