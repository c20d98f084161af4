//! Identities of leaves, and what belongs to what.

use super::*;
use crate::scene::builtin::{self, MovingObject};
use crate::visibility::{LeafId, LeafKind, MOST_LIGHTS};
use std::collections::BTreeMap;

/// Centre, radius and area of each leaf by its id.
fn by_id(database: &VisibilityDatabase) -> BTreeMap<LeafId, (Vec3, f32, f32)> {
    let leaves = &database.receivers().leaves;
    let all: BTreeMap<_, _> = (0..leaves.len() as u32)
        .map(|i| (database.leaf_id(i), &leaves[i as usize]))
        .map(|(id, l)| (id, (l.center, l.radius, l.area)))
        .collect();
    assert_eq!(all.len(), leaves.len(), "no two are equal");
    all
}

fn object_of(id: LeafId) -> u32 {
    match id {
        LeafId::Patch { object, .. } | LeafId::Cluster { object, .. } => object,
        LeafId::Undetermined => NONE,
    }
}

#[test]
fn ids_survive_other_objects_and_lights() {
    let mut scene = builtin::build("pillars", MovingObject::Teapot).expect("it is built in");
    // A triangle that is part of no patch and large enough to be one; and a patch that moves too.
    let mut lone = polygon(&[vec3(0.0, 1.0, 0.0), vec3(1.0, 1.0, 0.0), vec3(0.0, 2.0, 0.3)], MaterialId(0));
    lone.patches.clear();
    let lone = add(&mut scene, lone);
    let board = add(
        &mut scene,
        polygon(&[Vec3::ZERO, Vec3::X, vec3(1.0, 0.6, 0.0), vec3(0.0, 0.6, 0.0)], MaterialId(0)),
    );
    scene.objects[board].dynamic = true;
    scene.set_transform(scene.objects[board].node, Transform::translation(vec3(0.2, 0.4, 0.1))).unwrap();
    let settings = VisibilitySettings::default();
    let make = |scene: &Scene, seed: u32| {
        let geometry = Geometry::new(scene);
        let lights = LightSettings { count: 80, seed, ..LightSettings::default() };
        let lights = LightSet::sample(scene, &geometry, &lights).expect("there is light");
        let database = VisibilityDatabase::build(scene, &geometry, &lights, &settings).expect("a database");
        for (leaf, id) in database.receivers().leaves.iter().zip(database.receivers().ids()) {
            match leaf.kind {
                LeafKind::Cluster { object } => assert_eq!(object_of(*id), object),
                LeafKind::Undetermined => panic!("all is determined"),
                LeafKind::Patch { grid, .. } => {
                    assert_eq!(object_of(*id), database.receivers().grids[grid as usize].object);
                }
            }
        }
        by_id(&database)
    };
    let before = make(&scene, 0);
    assert!(before.keys().any(|id| object_of(*id) == lone.0));
    // Another object moves: what is left of the hierarchy is the same surface; most of it is left.
    scene.set_transform(scene.objects[board].node, Transform::translation(vec3(-0.6, 0.9, 0.3))).unwrap();
    let after = make(&scene, 0);
    let movers: Vec<u32> = scene.placed_objects().filter(|(_, o)| o.dynamic).map(|(i, _)| i.0).collect();
    let kept = |after: &BTreeMap<LeafId, _>| {
        before
            .iter()
            .filter(|(id, leaf)| {
                let same = after.get(id).is_some_and(|other| other == *leaf);
                assert!(same || !after.contains_key(id) || movers.contains(&object_of(**id)), "{id:?}");
                same
            })
            .count()
    };
    println!("{} of {} leaves stay when a board moves", kept(&after), before.len());
    assert!(kept(&after) * 10 > before.len() * 8, "{} of {}", kept(&after), before.len());
    // The control: what moves is elsewhere, under the same ids if it is a mesh.
    let teapot = scene.objects.iter().position(|o| o.dynamic).expect("the teapot");
    let node = scene.objects[teapot].node;
    let place =
        glam::DAffine3::from_translation(glam::dvec3(0.3, 0.0, 0.2)) * scene.nodes[node].local.affine();
    scene.set_transform(node, Transform::Affine(place)).unwrap();
    let elsewhere = make(&scene, 0);
    let of_teapot = || after.iter().filter(|(id, _)| object_of(**id) == teapot as u32);
    assert!(of_teapot().count() > 3);
    assert!(of_teapot().all(|(id, leaf)| elsewhere.get(id).is_some_and(|other| other.0 != leaf.0)));
    // Other lights.
    let other = make(&scene, 1);
    println!("{} with other lights", kept(&other));
    assert!(kept(&other) * 10 > before.len() * 3, "{} of {}", kept(&other), before.len());
    // An object that comes and goes.
    let ball = builtin::shapes::sphere(0.1, 8, 6, MaterialId(0));
    let ball = scene.insert_object("ball", ball, Transform::translation(Vec3::Y), false).unwrap();
    assert!(make(&scene, 0).keys().any(|id| object_of(*id) == ball.0));
    scene.remove_object(ball).unwrap();
    assert_eq!(make(&scene, 0), elsewhere);
}

#[test]
fn what_does_not_belong_together_is_refused() {
    let mut scene = builtin::build("gap", MovingObject::None).expect("it is built in");
    let geometry = Geometry::new(&scene);
    let settings = VisibilitySettings::default();
    let lights = sampled(&scene, &geometry, 20);
    let database = VisibilityDatabase::build(&scene, &geometry, &lights, &settings).expect("a database");
    assert!(database.belongs_to(&geometry, &lights).is_ok());
    // As many lights, of another seed.
    let other = LightSettings { count: 20, seed: 1, ..LightSettings::default() };
    let other = LightSet::sample(&scene, &geometry, &other).expect("there is light");
    let refused = database.belongs_to(&geometry, &other).expect_err("they are others").to_string();
    assert!(refused.contains("other lights"), "{refused}");
    let many = vec![lights.samples()[0]; MOST_LIGHTS + 1];
    let many = VisibilityDatabase::build(&scene, &geometry, &set(&geometry, many), &settings);
    let sentence = many.expect_err("too many").to_string();
    assert!(
        sentence.contains("65536") && sentence.contains("65537") && !sentence.contains("--"),
        "{sentence}"
    );
    scene.set_emission(MaterialId(0), Vec3::ONE).unwrap();
    let moved = Geometry::new(&scene);
    assert!(database.belongs_to(&moved, &lights).is_err());
    assert!(VisibilityDatabase::build(&scene, &moved, &lights, &settings).is_err());
    assert!(VisibilityDatabase::build(&scene, &geometry, &lights, &settings).is_err());
}
