//! Punctual lights are candidates like all others.

use super::*;
use crate::scene::{PunctualKind, PunctualLight};
use glam::Quat;
use std::collections::BTreeSet;

const PANEL: f32 = 3.0;

/// A room with a panel, and punctual lights of every kind, colour and strength all over it, their places by a seed.
fn room(lights: u32, kinds: &[PunctualKind], panel: bool) -> Scene {
    let mut mesh = closed_box();
    if panel {
        square(&mut mesh, vec3(0.5, 0.95, 0.5), 0.3, false, MaterialId(1));
        square(&mut mesh, vec3(0.5, 0.9, 0.5), 0.3, false, MaterialId(2));
    }
    let gray = Material::diffuse("gray", Vec3::splat(0.5));
    let materials = vec![gray.clone(), gray, Material::emitter("panel", Vec3::splat(PANEL))];
    let (mut scene, _) = scene_of(mesh, materials);
    for light in 0..lights {
        let s = |d| sequence::sample(light, d, 7);
        let turn = Quat::from_rotation_x(6.3 * s(3)) * Quat::from_rotation_y(6.3 * s(4));
        let at = Vec3::splat(0.1) + 0.8 * vec3(s(0), s(1), s(2));
        let node = scene.add_node("lamp", Transform::rigid(turn, at));
        let kind = kinds[light as usize % kinds.len()];
        let colour = vec3(s(5), s(6), 1.0 - s(5)) * (0.01 + s(7) * s(7));
        let unit = if kind == PunctualKind::Directional { 0.05 } else { 1.0 };
        scene.lights.push(PunctualLight { name: String::new(), node, kind, intensity: colour * unit });
    }
    scene
}

const KINDS: [PunctualKind; 4] = [
    PunctualKind::Point,
    PunctualKind::Spot { inner: 0.2, outer: 0.9 },
    PunctualKind::Point,
    PunctualKind::Directional,
];

fn settings(count: u32, bounces: u32, seed: u32) -> LightSettings {
    LightSettings { count, bounces, seed, candidates: 4, ..LightSettings::default() }
}

fn of_lights(set: &LightSet) -> Vec<LightSample> {
    set.samples().iter().filter(|s| s.punctual().is_some()).copied().collect()
}

/// Irradiance without shadows at a place that sees the lower and the upper half of all.
fn irradiance<'a>(samples: impl IntoIterator<Item = &'a LightSample>, up: Vec3) -> DVec3 {
    let at = vec3(0.1, -0.5 * up.y, -0.2);
    let from = |s: &LightSample| {
        s.geometric_factor(at, up, up, Clamp::At(2.0))
            .map_or(DVec3::ZERO, |(g, _)| (s.intensity * g).as_dvec3())
    };
    samples.into_iter().map(from).sum()
}

#[test]
fn few_are_as_they_are_whatever_else_there_is() {
    for (lights, count) in [(8, 64), (1, 12), (20, 150)] {
        let scene = room(lights, &KINDS, true);
        let geometry = Geometry::new(&scene);
        let expected = punctual::shining(&scene, &geometry);
        for seed in 0..4 {
            let set = LightSet::sample(&scene, &geometry, &settings(count, 3, seed)).unwrap();
            let mut found = of_lights(&set);
            found.sort_by_key(punctual::key);
            assert_eq!(found, expected);
            assert_eq!((set.len() as u32, set.warnings.len()), (count, 0), "{:?}", set.warnings);
        }
    }
    // The control: many are not.
    let scene = room(200, &KINDS, true);
    let geometry = Geometry::new(&scene);
    let set = LightSet::sample(&scene, &geometry, &settings(150, 3, 0)).unwrap();
    assert!(of_lights(&set).len() < punctual::shining(&scene, &geometry).len());
}

#[test]
fn lights_at_one_place_are_told_apart() {
    // Red, green and blue ones, and spots of two widths, all at one place.
    let mut scene = room(0, &KINDS, true);
    let node = scene.add_node("lamp", Transform::translation(Vec3::splat(0.4)));
    let kinds = [PunctualKind::Point, KINDS[1], PunctualKind::Spot { inner: 0.2, outer: 0.3 }];
    for (kind, intensity) in kinds.into_iter().flat_map(|kind| Vec3::AXES.map(|axis| (kind, axis))) {
        scene.lights.push(PunctualLight { name: String::new(), node, kind, intensity });
    }
    let geometry = Geometry::new(&scene);
    let set = LightSet::sample(&scene, &geometry, &settings(60, 2, 0)).unwrap();
    let keys: BTreeSet<_> = of_lights(&set).iter().filter_map(punctual::key).collect();
    assert_eq!((keys.len(), of_lights(&set).len()), (12, 12));
    let ids: BTreeSet<SampleId> = set.ids().iter().copied().collect();
    assert_eq!(ids.len(), set.len());
}

#[test]
fn there_are_never_more_samples_than_asked_for() {
    for (lights, panel) in [(1, false), (1, true), (10, true), (150, false), (150, true)] {
        let scene = room(lights, &KINDS, panel);
        let geometry = Geometry::new(&scene);
        let all = punctual::shining(&scene, &geometry).len();
        for count in [1, 2, 3, 5, 40, 300] {
            for bounces in [0, 3] {
                for direct_share in [None, Some(0.0), Some(0.3), Some(1.0)] {
                    let settings = LightSettings { direct_share, ..settings(count, bounces, 1) };
                    let what = format!("{lights} {panel} {settings:?}");
                    match LightSet::sample(&scene, &geometry, &settings) {
                        Ok(set) => {
                            let least = if panel || bounces > 0 { count as usize } else { all };
                            assert!(set.len() <= count as usize, "{what}: {}", set.len());
                            assert!(set.len() >= least.min(count as usize), "{what}: {}", set.len());
                        }
                        // No direct light and no bounces is no light.
                        Err(_) => assert_eq!((bounces, direct_share), (0, Some(0.0)), "{what}"),
                    }
                }
            }
        }
    }
}

#[test]
fn each_shines_as_it_does_in_the_mean_however_few_samples_there_are() {
    let scene = room(60, &KINDS, true);
    let geometry = Geometry::new(&scene);
    let lights = punctual::shining(&scene, &geometry);
    let panel = f64::from(PANEL * 0.3 * 0.3);
    let view = View {
        eye: DVec3::new(0.1, 0.5, 0.1),
        right: vec3(0.7, 0.0, -0.7).normalize(),
        up: Vec3::Y,
        forward: vec3(0.7, 0.0, 0.7).normalize(),
        half_extent: glam::Vec2::splat(0.8),
        center: glam::Vec2::ZERO,
        orthographic: false,
        depth: None,
        clip: Default::default(),
    };
    for (count, direct_share, views) in
        [(1, None, &[][..]), (6, None, &[view]), (30, None, &[]), (30, None, &[view]), (9, Some(0.5), &[])]
    {
        for up in [Vec3::Y, Vec3::NEG_Y] {
            let of = |seed, only: &dyn Fn(&&LightSample) -> bool| {
                let settings = LightSettings { direct_share, ..settings(count, 0, seed) };
                let set = LightSet::sample_for(&scene, &geometry, &settings, views).unwrap();
                irradiance(set.samples().iter().filter(only), up)
            };
            let expected = irradiance(&lights, up);
            let mean = over_seeds(400, |seed| of(seed, &|s| s.punctual().is_some()));
            assert!(agrees(mean, expected, 0.0), "{count} {mean:?} against {expected}");
            assert!(count == 1 || !agrees(mean, expected * 1.5, 0.0), "negative control: {mean:?}");
        }
        // And so does what is no punctual light.
        let mean = over_seeds(400, |seed| {
            let settings = LightSettings { direct_share, ..settings(count, 0, seed) };
            let set = LightSet::sample_for(&scene, &geometry, &settings, views).unwrap();
            flux(set.samples().iter().filter(|s| s.punctual().is_none())) / std::f64::consts::PI
        });
        assert!(agrees(mean, DVec3::splat(panel), 0.0), "{count} {mean:?} against {panel}");
    }
}

#[test]
fn what_they_light_shines_by_its_right_amount() {
    // In a closed room all of 4πI arrives, and all of what that is reflected to.
    for (lights, count) in [(150, 40), (150, 300)] {
        let scene = room(lights, &KINDS[..1], false);
        let geometry = Geometry::new(&scene);
        let all: DVec3 = scene.lights.iter().map(|l| l.intensity.as_dvec3()).sum();
        let expected = all * 4.0 * std::f64::consts::PI * (0.5 + 0.25 + 0.125);
        let mean = over_seeds(20, |seed| {
            let set = LightSet::sample(&scene, &geometry, &settings(count, 3, seed)).unwrap();
            flux(set.samples().iter().filter(|s| s.punctual().is_none()))
        });
        assert!(agrees(mean, expected, 0.0), "{count}: {mean:?} for {expected}");
        assert!(!agrees(mean, expected * 0.9, 0.0), "negative control");
        assert!(mean.1.max_element() < 0.05 * mean.0.max_element(), "{mean:?}");
    }
}

#[test]
fn dark_ones_take_nothing_and_those_that_share_a_sample_are_dimmed_there() {
    let mut scene = room(100, &KINDS[..1], true);
    let lit: Vec<Vec3> = scene.lights.iter().map(|light| light.intensity).collect();
    let sample = |scene: &Scene| {
        let geometry = Geometry::new(scene);
        (LightSet::sample(scene, &geometry, &settings(60, 2, 3)).unwrap(), geometry)
    };
    let (set, geometry) = sample(&scene);
    let from = Placement::of(&scene, &geometry);
    let dimmed = |scene: &mut Scene, lights: &dyn Fn(usize) -> f32| {
        for (index, &lit) in lit.iter().enumerate() {
            scene.set_intensity(index.into(), lit * lights(index)).unwrap();
        }
        let geometry = Geometry::new(scene);
        irradiance(set.moved(scene, &geometry, &from).unwrap().samples(), Vec3::Y)
    };
    let all = dimmed(&mut scene, &|_| 1.0);
    assert_eq!(all, irradiance(set.samples(), Vec3::Y), "to the bit");
    // Light is linear in what each emits.
    let [odd, even] = [1, 0].map(|rest| dimmed(&mut scene, &|i| if i % 2 == rest { 1.0 } else { 0.0 }));
    let panel = dimmed(&mut scene, &|_| 0.0);
    assert!((odd + even - panel - all).abs().max_element() < 1e-4 * all.max_element());
    // Their own samples, where all are dark but a few.
    dimmed(&mut scene, &|i| if i < 5 { 1.0 } else { 0.0 });
    let (few, _) = sample(&scene);
    assert_eq!(of_lights(&few).len(), 10);
    assert!((of_lights(&set).len()) > 15);
}

#[test]
fn a_sentence_says_where_samples_are_too_few_and_how_many_are_enough() {
    for (lights, count, is_rough) in [(150, 4, true), (150, 20, true), (3, 2, true), (3, 300, false)] {
        let scene = room(lights, &KINDS[..1], true);
        let geometry = Geometry::new(&scene);
        for direct_share in [None, Some(0.5)] {
            let settings = LightSettings { direct_share, ..settings(count, 2, 0) };
            let set = LightSet::sample(&scene, &geometry, &settings).unwrap();
            let said = set.warnings.iter().find(|w| w.contains("punctual"));
            assert_eq!(said.is_some(), is_rough, "{lights} {count} {said:?}");
            let Some(said) = said else { continue };
            let enough = said.split("ask for ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap();
            let enough: u32 = enough.parse().unwrap();
            assert!(enough > count, "{said}");
            let more = LightSettings { count: enough, direct_share: None, ..settings };
            let set = LightSet::sample(&scene, &geometry, &more).unwrap();
            assert!(direct_share.is_some() || set.warnings.is_empty(), "{said} {:?}", set.warnings);
        }
    }
}
