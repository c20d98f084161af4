//! Light samples placed for a view.

use super::*;
use crate::scene::builtin::{self, MovingObject};
use glam::{Vec2, vec2};
use std::collections::BTreeSet;

/// Closed rooms of 1 m, 0.2 m apart, each with a lamp; the first one is about (0.5, 0.5, 0.5).
fn rooms(count: u32) -> (Scene, Geometry) {
    let mut mesh = closed_box();
    square(&mut mesh, vec3(0.5, 0.9, 0.5), 0.2, false, MaterialId(2));
    let mut scene = Scene::default();
    scene.materials = vec![
        Material::diffuse("floor", Vec3::splat(0.5)),
        Material::diffuse("wall", Vec3::splat(0.7)),
        Material { base_color: Vec3::ZERO, ..Material::emitter("lamp", vec3(3.0, 2.0, 1.0)) },
    ];
    for i in 0..count {
        scene.add_object("room", mesh.clone(), Transform::translation(Vec3::X * (1.2 * i as f32)));
    }
    let geometry = Geometry::new(&scene);
    (scene, geometry)
}

/// From a corner of the first room into it.
fn into_the_first_room(shift: f64) -> View {
    let eye = DVec3::new(0.1 + shift, 0.6, 0.9);
    let forward = DVec3::new(1.0, -0.4, -1.2).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    View {
        eye,
        right: right.as_vec3(),
        up: right.cross(forward).as_vec3(),
        forward: forward.as_vec3(),
        half_extent: vec2(0.8, 0.6),
        center: Vec2::ZERO,
        orthographic: false,
        depth: None,
        clip: Default::default(),
    }
}

fn settings(seed: u32) -> LightSettings {
    LightSettings { count: 60, seed, ..LightSettings::default() }
}

#[test]
fn samples_lie_where_the_view_needs_them() {
    let (scene, geometry) = rooms(2);
    let middle = (1.1 - geometry.origin.x) as f32;
    let share = |views: &[View]| {
        let set = LightSet::sample_for(&scene, &geometry, &settings(1), views).unwrap();
        assert_eq!(set.len(), 60);
        set.samples().iter().filter(|s| s.position.x < middle).count() as f32 / 60.0
    };
    assert!(share(&[into_the_first_room(0.0)]) > 0.8, "{}", share(&[into_the_first_room(0.0)]));
    let both = [into_the_first_room(0.0), into_the_first_room(1.2)];
    for views in [&[], &both[..]] {
        assert!((0.35..0.65).contains(&share(views)), "{} views: {}", views.len(), share(views));
    }
    // A view of nothing is none.
    let away = View { eye: DVec3::splat(50.0), ..into_the_first_room(0.0) };
    let away = LightSet::sample_for(&scene, &geometry, &settings(1), &[away]).unwrap();
    assert_eq!(away, LightSet::sample(&scene, &geometry, &settings(1)).unwrap());
}

/// Light that arrives at a few points of both rooms, shadows traced and with a fixed bound.
fn probe(scene: &Scene, geometry: &Geometry, samples: &[LightSample]) -> DVec3 {
    let tracer = SceneTracer::new(scene, geometry);
    let points = [vec3(0.3, 0.001, 0.4), vec3(0.7, 0.001, 0.2), vec3(1.6, 0.001, 0.7)];
    let at = |point: Vec3| -> DVec3 {
        let x = (point.as_dvec3() - geometry.origin).as_vec3();
        let arrives = |s: &LightSample| -> DVec3 {
            match s.geometric_factor(x, Vec3::Y, Vec3::Y, Clamp::At(1.0)) {
                Some((g, _)) if !tracer.occluded(x, crate::scene::NONE, s.position, s.triangle()) => {
                    (s.intensity * g).as_dvec3()
                }
                _ => DVec3::ZERO,
            }
        };
        samples.iter().map(arrives).sum()
    };
    // Those of the second room, which the view does not see, have a channel of their own.
    let [a, b, c] = points.map(at);
    DVec3::new(a.x, b.x, c.x)
}

#[test]
fn placement_changes_no_expected_light() {
    let (scene, geometry) = rooms(2);
    let view = [into_the_first_room(0.0)];
    let mean = |views: &[View], reweight: &dyn Fn(&[LightSample]) -> Vec<LightSample>| {
        over_seeds(400, |seed| {
            let set = LightSet::sample_for(&scene, &geometry, &settings(seed), views).unwrap();
            probe(&scene, &geometry, &reweight(set.samples()))
        })
    };
    let as_they_are = |samples: &[LightSample]| samples.to_vec();
    let (by_power, error) = mean(&[], &as_they_are);
    let for_view = mean(&view, &as_they_are);
    let both = (for_view.0, (for_view.1 * for_view.1 + error * error).map(f64::sqrt));
    assert!(agrees(both, by_power, 0.0), "{for_view:?} against {by_power} ± {error}");
    // The view's room has less error than by power, and the standard error is small enough to tell.
    assert!(for_view.1.x < error.x && error.x < 0.01 * by_power.x, "{for_view:?}, {error}");
    // The control leaves out the weights: all samples are equally strong, with the same power altogether.
    let equal = |samples: &[LightSample]| {
        let total: f32 = samples.iter().map(|s| s.intensity.max_element()).sum();
        let each = total / samples.len() as f32;
        let even = |s: &LightSample| LightSample {
            intensity: s.intensity * (each / s.intensity.max_element()),
            ..*s
        };
        samples.iter().map(even).collect::<Vec<_>>()
    };
    assert!(!agrees(mean(&view, &equal), by_power, 0.0), "negative control");
}

#[test]
fn what_is_far_away_takes_no_samples() {
    let mut scene = builtin::build("table", MovingObject::None).unwrap();
    scene.ensure_camera();
    let mut far = Mesh::default();
    far.add_box(Vec3::splat(-0.2), Vec3::splat(0.2), MaterialId(0));
    scene.add_object("far", far, Transform::translation(vec3(100.0, 0.0, 0.0)));
    let geometry = Geometry::new(&scene);
    let view = View::new(&scene, &scene.cameras[0], 1.3);
    let set = LightSet::sample_for(&scene, &geometry, &LightSettings::default(), &[view]).unwrap();
    let origin = geometry.origin.x as f32;
    assert!(set.samples().iter().all(|s| s.position.x + origin < 50.0));
    // Samples stand for what they would without it.
    let alone = builtin::build("table", MovingObject::None).unwrap();
    let geometry = Geometry::new(&alone);
    let other = LightSet::sample_for(&alone, &geometry, &LightSettings::default(), &[view]).unwrap();
    let area =
        |set: &LightSet| set.samples().iter().filter_map(|s| s.rectangle).map(|r| r.area()).sum::<f32>();
    assert!((area(&set) / area(&other) - 1.0).abs() < 0.05, "{} {}", area(&set), area(&other));
}

#[test]
fn most_samples_stay_when_the_view_moves_a_little() {
    let (scene, geometry) = rooms(2);
    let sample = |shift, seed| {
        let settings = LightSettings { count: 300, ..settings(seed) };
        let set = LightSet::sample_for(&scene, &geometry, &settings, &[into_the_first_room(shift)]).unwrap();
        set.ids()
            .iter()
            .copied()
            .zip(set.samples().iter().map(|s| s.position.to_array().map(f32::to_bits)))
            .collect()
    };
    let kept = |a: &BTreeSet<(SampleId, [u32; 3])>, b: &BTreeSet<_>| a.intersection(b).count();
    let first: BTreeSet<_> = sample(0.0, 1);
    let (moved, other) = (sample(0.02, 1), sample(0.0, 2));
    println!("{} of 300 stay", kept(&first, &moved));
    assert!(kept(&first, &moved) > 100, "{}", kept(&first, &moved));
    assert!(kept(&first, &other) == 0, "negative control");
    assert_eq!(first, sample(0.0, 1));
}

#[test]
fn views_share_the_samples() {
    // Of three rooms two have a view.
    let (scene, geometry) = rooms(3);
    let shares = |views: &[View]| {
        let settings = LightSettings { count: 120, ..settings(3) };
        let set = LightSet::sample_for(&scene, &geometry, &settings, views).unwrap();
        [0.5, 1.7, 2.9].map(|x| {
            let at = (x - geometry.origin.x) as f32;
            set.samples().iter().filter(|s| (s.position.x - at).abs() < 0.55).count() as f32 / 120.0
        })
    };
    let [first, second] = [0.0, 1.2].map(into_the_first_room);
    let both = shares(&[first, second]);
    assert!(both[0] > 0.3 && both[1] > 0.3 && both[2] < 0.2, "{both:?}");
    // The controls: one view, and none.
    let one = shares(&[second]);
    assert!(one[0] < 0.2 && one[1] > 0.6 && one[2] < 0.2, "{one:?}");
    let none = shares(&[]);
    assert!(none.iter().all(|share| (0.25..0.42).contains(share)), "{none:?}");
}
