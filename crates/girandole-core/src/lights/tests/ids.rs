//! Identities of light samples.

use super::*;
use crate::scene::builtin::{self, MovingObject};
use std::collections::{BTreeMap, BTreeSet};

fn settings() -> LightSettings {
    LightSettings { count: 200, direct_share: Some(0.25), ..LightSettings::default() }
}

fn by_id(set: &LightSet) -> BTreeMap<SampleId, LightSample> {
    let all: BTreeMap<SampleId, LightSample> =
        set.ids().iter().copied().zip(set.samples().iter().copied()).collect();
    assert_eq!((all.len(), set.ids().len()), (set.len(), set.len()), "no two are equal");
    all
}

#[test]
fn no_two_samples_have_the_same_id() {
    for name in builtin::EXPERIMENTS {
        let scene = builtin::build(name, MovingObject::Torus).unwrap();
        let geometry = Geometry::new(&scene);
        for (count, candidates) in [(3, 1), (50, 16), (1000, 2)] {
            let settings = LightSettings { count, candidates, ..settings() };
            by_id(&LightSet::sample(&scene, &geometry, &settings).unwrap());
        }
    }
    // Samples made by hand, all of one origin.
    let (_, geometry) = scene_of(closed_box(), vec![Material::default(), Material::default()]);
    let origin = SampleOrigin::Emitter { triangle: 0, point: 0 };
    let profile = Profile::Cosine;
    let sample = LightSample {
        position: Vec3::ONE,
        normal: Vec3::Y,
        intensity: Vec3::ONE,
        profile,
        origin,
        rectangle: None,
    };
    let unknown = LightSample { origin: SampleOrigin::Emitter { triangle: 1 << 30, point: 0 }, ..sample };
    by_id(&LightSet::from_samples(&geometry, vec![sample, unknown, sample, unknown]));
}

#[test]
fn ids_say_where_samples_come_from() {
    let mut mesh = closed_box();
    square(&mut mesh, Vec3::splat(0.5), 0.1, false, MaterialId(2));
    let lamp = Material { double_sided: true, ..Material::emitter("lamp", Vec3::ONE) };
    let (mut scene, _) =
        scene_of(mesh, vec![Material::emitter("floor", Vec3::ONE), Material::default(), lamp]);
    let node = scene.add_node("lamp", Transform::translation(Vec3::splat(0.3)));
    let kind = crate::scene::PunctualKind::Point;
    scene.lights.push(crate::scene::PunctualLight { name: String::new(), node, kind, intensity: Vec3::ONE });
    let geometry = Geometry::new(&scene);
    let set = LightSet::sample(&scene, &geometry, &settings()).unwrap();
    let mut sides = BTreeSet::new();
    for (id, sample) in by_id(&set) {
        match (id, sample.origin) {
            (
                SampleId::Punctual { light: LightId(0), index },
                SampleOrigin::Punctual { light: LightId(0) },
            ) => {
                assert_eq!(sample.normal.y > 0.0, index == 0);
            }
            (SampleId::Emitter { object: 0, material, back, .. }, SampleOrigin::Emitter { triangle, .. }) => {
                assert_eq!(geometry.triangles[triangle as usize].material, material);
                sides.insert((material.0, back));
            }
            (SampleId::Bounce { path, bounce, .. }, SampleOrigin::Bounce { path: p, bounce: b, .. }) => {
                assert_eq!((path, bounce), (p, b));
            }
            other => panic!("{other:?}"),
        }
    }
    assert_eq!(sides, BTreeSet::from([(0, false), (2, false), (2, true)]));
}

#[test]
fn ids_survive_changes_elsewhere() {
    let mut scene = builtin::build("table", MovingObject::Torus).unwrap();
    let geometry = Geometry::new(&scene);
    let before = by_id(&LightSet::sample(&scene, &geometry, &settings()).unwrap());
    let torus = scene.objects.iter().position(|o| o.dynamic).unwrap();
    let node = scene.objects[torus].node;
    let moved =
        glam::DAffine3::from_translation(DVec3::new(0.1, 0.05, 0.0)) * scene.nodes[node].local.affine();
    scene.set_transform(node, Transform::Affine(moved)).unwrap();
    let geometry = Geometry::new(&scene);
    let set = LightSet::sample(&scene, &geometry, &settings()).unwrap();
    let after = by_id(&set);
    // All direct ones, to the bit; and half of the walk's, as each is chosen among all of its paths.
    let direct = |id: &SampleId| !matches!(id, SampleId::Bounce { .. });
    assert_eq!(set.direct, 50);
    for (id, sample) in before.iter().filter(|(id, _)| direct(id)) {
        assert_eq!(after.get(id), Some(sample));
    }
    let kept = |a: &BTreeMap<SampleId, LightSample>| {
        let bounces = before.iter().filter(|(id, _)| !direct(id));
        let both = bounces.filter_map(|(id, s)| Some((s, a.get(id)?)));
        both.filter(|(a, b)| a.position == b.position && a.normal == b.normal).count()
    };
    println!("{} of 150 bounces stay", kept(&after));
    assert!(kept(&after) > 50, "{}", kept(&after));
    // The control: other paths have the same ids and are elsewhere.
    let other = LightSet::sample(&scene, &geometry, &LightSettings { seed: 1, ..settings() }).unwrap();
    let other = by_id(&other);
    assert_eq!(kept(&other), 0);
}

#[test]
fn what_does_not_belong_together_is_refused() {
    let mut scene = builtin::build("gap", MovingObject::None).unwrap();
    let geometry = Geometry::new(&scene);
    let set = LightSet::sample(&scene, &geometry, &settings()).unwrap();
    let again = LightSet::sample(&scene, &geometry, &settings()).unwrap();
    assert!(set.belongs_to(&geometry).is_ok() && set.belongs_to(&geometry.clone()).is_ok());
    assert!(set == again && set.generation() != again.generation());
    assert_eq!(set.clone().generation(), set.generation());
    scene.set_emission(MaterialId(0), Vec3::splat(2.0)).unwrap();
    assert!(set.belongs_to(&Geometry::new(&scene)).unwrap_err().to_string().contains("earlier version"));
    assert!(LightSet::sample(&scene, &geometry, &settings()).unwrap_err().to_string().contains("geometry"));
    // Another scene that is the same to the bit is another one.
    let twin = builtin::build("gap", MovingObject::None).unwrap();
    assert!(set.belongs_to(&Geometry::new(&twin)).is_err());
    let other = LightSet::sample(&twin, &Geometry::new(&twin), &settings()).unwrap();
    assert!(set == other, "though its samples are equal");
}
