//! What is promised to the bit, and holes in maps.

use crate::common::{Context, Stage, Test, camera, exact, mean, room};
use girandole::{Error, MapUpdates, Mode, RenderSettings, RendererOptions, ShadowMap, Tier};
use girandole_core::glam::Vec3;
use girandole_core::lights::{LightSample, LightSet, Profile, SampleOrigin};
use girandole_core::math::{sequence, warp};
use girandole_core::scene::{Geometry, LightId, Material, Scene};

pub fn tests() -> Vec<Test> {
    vec![
        ("same_bytes_twice_and_in_any_batch", same_bytes),
        ("what_emits_is_read_back_in_any_unit", emission),
        ("maps_of_a_closed_box_have_no_hole", no_holes),
        ("filters_stay_within_their_map", filters_stay),
        ("wide_filters_over_many_lights_lose_none", wide_filters),
    ]
}

fn same_bytes(context: &Context) {
    let size = [120, 90];
    let stage = Stage::builtin("table", 700);
    let view = stage.view(0, size);
    let mut renderer = context.renderer(RendererOptions::default());
    renderer.load(&stage.scene, &stage.geometry, &stage.lights).expect("load");
    let settings = |lights_per_batch| RenderSettings { lights_per_batch, samples_per_axis: 2, ..exact() };
    let first = context.frame(&mut renderer, &view, size, &settings(None));
    for batch in [None, Some(1), Some(7), Some(200), Some(5000)] {
        let again = context.frame(&mut renderer, &view, size, &settings(batch));
        assert!(again.pixels == first.pixels, "batches of {batch:?}");
    }
    let mut fresh = context.renderer(RendererOptions::default());
    fresh.load(&stage.scene, &stage.geometry, &stage.lights).expect("load");
    assert!(context.frame(&mut fresh, &view, size, &settings(None)).pixels == first.pixels);
    // All batches arrive: the whole is what the parts are.
    let energy = |from: usize, to: usize| {
        let part = LightSet::from_samples(&stage.geometry, stage.lights.samples()[from..to].to_vec());
        let mut renderer = context.renderer(RendererOptions { map_size: Some(128), ..Default::default() });
        renderer.load(&stage.scene, &stage.geometry, &part).expect("load");
        mean(&context.frame(&mut renderer, &view, size, &exact()))
    };
    let emitted = energy(0, 0);
    let (whole, parts) = (energy(0, 700) - emitted, energy(0, 500) + energy(500, 700) - 2.0 * emitted);
    assert!((whole / parts - 1.0).abs() < 1e-3, "{whole} {parts}");
    // The control: the sum in another order of lights differs somewhere.
    let reversed = stage.lights.samples().iter().rev().copied().collect();
    let reversed = LightSet::from_samples(&stage.geometry, reversed);
    fresh.load(&stage.scene, &stage.geometry, &reversed).expect("load");
    assert!(context.frame(&mut fresh, &view, size, &settings(None)).pixels != first.pixels);
}

fn emission(context: &Context) {
    let size = [9, 7];
    for color in
        [Vec3::new(1.0, 1e-4, 0.333), Vec3::new(3e-20, 7e-20, 0.0), Vec3::new(2e25, 1.999_999e30, 1e30)]
    {
        let mut scene = Scene::default();
        let material = scene.add_material(Material::emitter("wall", color));
        room(&mut scene, Vec3::splat(4.0), material, None);
        camera(&mut scene, Vec3::new(0.0, 2.0, 1.0), Vec3::new(0.2, 1.0, -2.0), 1.2);
        let geometry = Geometry::new(&scene);
        let lights = LightSet::from_samples(&geometry, Vec::new());
        let stage = Stage { scene, geometry, lights };
        let view = stage.view(0, size);
        for samples_per_axis in [1, 2] {
            let mut renderer = context.renderer(RendererOptions::default());
            renderer.load(&stage.scene, &stage.geometry, &stage.lights).expect("load");
            let settings = RenderSettings { samples_per_axis, ..exact() };
            for shown in context.frame(&mut renderer, &view, size, &settings).pixels {
                let error = |color: Vec3| (shown - color).abs().max_element() / color.max_element();
                assert!(error(color) <= 2f32.powi(-17), "{shown} for {color}: {}", error(color));
                let brighter = color * (1.0 + 2f32.powi(-15));
                assert!(error(brighter) > 2f32.powi(-17), "the control: {shown} for {brighter}");
            }
        }
    }
}

/// Samples anywhere in a box, in any direction.
fn scattered(count: u32, half: Vec3) -> Vec<LightSample> {
    (0..count)
        .map(|i| {
            let s = |d| sequence::sample(i, d, 7);
            let position = (Vec3::new(s(0), s(1), s(2)) * 2.0 - 1.0) * half * 0.98;
            LightSample {
                position,
                normal: warp::sphere(girandole_core::glam::Vec2::new(s(3), s(4))),
                intensity: Vec3::ONE,
                profile: Profile::Cosine,
                origin: SampleOrigin::Punctual { light: LightId(0) },
                rectangle: None,
            }
        })
        .collect()
}

fn no_holes(context: &Context) {
    let closed = |leave_out| {
        let mut scene = Scene::default();
        let white = scene.add_material(Material::default());
        room(&mut scene, Vec3::new(5.0, 3.0, 4.0), white, leave_out);
        scene
    };
    let lights = scattered(48, Vec3::new(2.5, 1.5, 2.0));
    let holes = |scene: &Scene, shadow_map| {
        let options = RendererOptions {
            shadow_map,
            map_size: Some(128),
            skip_non_blockers: false,
            ..Default::default()
        };
        let mut renderer = context.renderer(options);
        let geometry = Geometry::new(scene);
        renderer.load(scene, &geometry, &LightSet::from_samples(&geometry, lights.clone())).expect("load");
        renderer.draw_shadow_maps(&MapUpdates::default()).expect("maps");
        (0..lights.len())
            .map(|i| {
                let map = context.wait(renderer.shadow_map(i)).expect("a map");
                assert_eq!(map.len(), 128 * 128);
                let mapped = |t: &usize| {
                    let (u, v) = ((t % 128) as f32 + 0.5, (t / 128) as f32 + 0.5);
                    shadow_map != ShadowMap::Cube
                        || (u / 128.0 - 0.5).abs().min((v / 128.0 - 0.5).abs()) <= 0.25
                };
                (0..map.len()).filter(mapped).filter(|&t| map[t] <= 0.0).count()
            })
            .sum::<usize>()
    };
    assert_eq!(holes(&closed(None), ShadowMap::Octahedral), 0);
    assert_eq!(holes(&closed(None), ShadowMap::Cube), 0);
    // The control: a wall that is missing is seen as a hole.
    for shadow_map in [ShadowMap::Octahedral, ShadowMap::Cube] {
        assert!(holes(&closed(Some(3)), shadow_map) > 1000, "{shadow_map:?}");
    }
}

fn filters_stay(context: &Context) {
    let size = [96, 72];
    let stage = Stage::builtin("block", 12);
    let view = stage.view(0, size);
    // What cannot block depends on all lights; it is in the maps here.
    let alone = |index: usize, pcf: u32| {
        let set = LightSet::from_samples(&stage.geometry, vec![stage.lights.samples()[index]]);
        let options =
            RendererOptions { map_size: Some(64), pcf, skip_non_blockers: false, ..Default::default() };
        let mut renderer = context.renderer(options);
        renderer.load(&stage.scene, &stage.geometry, &set).expect("load");
        context.frame(&mut renderer, &view, size, &exact())
    };
    // The first light has the same map turned the same way, alone or among others.
    let mut dark = stage.lights.samples().to_vec();
    for sample in &mut dark[1..] {
        sample.intensity = Vec3::ZERO;
    }
    let dark = LightSet::from_samples(&stage.geometry, dark);
    let options =
        RendererOptions { map_size: Some(64), pcf: 8, skip_non_blockers: false, ..Default::default() };
    let mut renderer = context.renderer(options);
    renderer.load(&stage.scene, &stage.geometry, &dark).expect("load");
    let among = context.frame(&mut renderer, &view, size, &exact());
    assert!(among.pixels == alone(0, 8).pixels);
    assert!(among.pixels != alone(0, 0).pixels, "the control: the filter does something");
}

/// Mesa's software driver ends an invocation in silence after 65 535 steps of its loops: of kernels with a work queue, those of many items.
fn wide_filters(context: &Context) {
    let size = [96, 72];
    let stage = Stage::builtin("table", 512);
    let view = stage.view(0, size);
    let settings = RenderSettings { mode: Mode::Visibility, ..exact() };
    let picture = |tier| {
        let options = RendererOptions { map_size: Some(64), pcf: 4, tier, ..Default::default() };
        context.frame(&mut context.loaded(&stage, options), &view, size, &settings)
    };
    let (asked, control) = (picture(None), picture(Some(Tier::Gpu)));
    let is_same = |(a, b): (&Vec3, &Vec3)| (*a - *b).length() <= 1e-3 * b.length();
    let differ = asked.pixels.iter().zip(&control.pixels).filter(|pair| !is_same(*pair)).count();
    assert!(differ == 0 && mean(&control) > 0.0, "{differ} pixels");
    // What cannot be done there is refused.
    let options = RendererOptions { pcf: 16, tier: Some(Tier::Software), ..Default::default() };
    let refused = context.loaded(&stage, options).render(&view, size, &settings);
    assert!(matches!(refused, Err(Error::TooLarge { .. })), "{refused:?}");
}
