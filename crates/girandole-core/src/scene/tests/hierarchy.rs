//! Where nodes are in the world, and what that takes.

use super::*;
use crate::lights::{LightSet, LightSettings};
use glam::{DAffine3, Quat};
use std::time::{Duration, Instant};

#[test]
fn all_nodes_at_once_are_where_each_is() {
    let mut scene = Scene::default();
    for i in 0..60_usize {
        let turn = Quat::from_rotation_y(0.1 * i as f32) * Quat::from_rotation_x(0.37);
        let local = Transform::Parts {
            translation: vec3(0.3, i as f32 * 0.01, -0.2),
            rotation: turn,
            scale: Vec3::splat(0.99),
        };
        let node = scene.add_node("", local);
        scene.nodes[node].parent = (i % 13 > 0).then(|| (i - i % 13 + (i % 13 - 1) / 2).into());
    }
    let all = scene.world_from_nodes();
    let above = |scene: &Scene, node: usize| {
        scene.nodes[node].parent.map_or(DAffine3::IDENTITY, |parent| scene.world_from_node(parent))
    };
    for (node, world) in all.iter().enumerate() {
        assert_eq!(*world, scene.world_from_node(node.into()));
        assert_eq!(*world, above(&scene, node) * scene.nodes[node].local.affine());
    }
    // What is below a node that moves moves, and nothing else.
    scene.set_transform(NodeId(1), Transform::translation(Vec3::Y)).unwrap();
    let moved: Vec<usize> = (0..60).filter(|&node| scene.world_from_node(node.into()) != all[node]).collect();
    let is_below: Vec<bool> = scene.at_or_below(|node| node == NodeId(1));
    assert_eq!(moved, (0..60).filter(|&node| is_below[node]).collect::<Vec<_>>());
    assert!(moved.len() > 5 && moved.iter().all(|node| (1..13).contains(node)), "{moved:?}");
    assert!(scene.world_from_nodes().iter().enumerate().all(|(i, w)| *w == scene.world_from_node(i.into())));
    // Whatever their order: under a node that is added last.
    let last = scene.add_node("", Transform::translation(Vec3::X));
    (0..60).filter(|i| i % 13 == 0).for_each(|root| scene.nodes[root].parent = Some(last));
    let all = scene.world_from_nodes();
    assert!(all.iter().enumerate().all(|(i, world)| *world == scene.world_from_node(i.into())));
    assert!(scene.at_or_below(|node| node == last).iter().all(|is_below| *is_below));
}

/// A triangle on each of many objects, and a lamp on each of a hundred, at the end of a chain of so many nodes; as many nodes stand
/// alone as 4000 leaves.
fn at_the_end_of(chain: usize) -> Scene {
    let mut scene = Scene::default();
    let material = scene.add_material(Material::default());
    scene.meshes.push(shapes::cuboid(Vec3::ZERO, Vec3::ONE, material));
    for node in 0..4000 {
        scene.add_node("", Transform::translation(vec3(0.0, 1e-3, 0.0)));
        scene.nodes[node].parent = (1..chain).contains(&node).then(|| (node - 1).into());
    }
    for i in 0..4000 {
        let node =
            scene.add_node("", Transform::translation(vec3((i % 64) as f32 * 2.0, 0.0, (i / 64) as f32)));
        scene.nodes[node].parent = Some((chain - 1).into());
        scene.objects.push(Object {
            name: String::new(),
            node,
            mesh: 0,
            skin: None,
            dynamic: false,
            removed: false,
        });
        if i % 40 == 0 {
            scene.lights.push(PunctualLight {
                name: String::new(),
                node,
                kind: PunctualKind::Point,
                intensity: Vec3::ONE,
            });
        }
    }
    scene
}

/// What opening a scene, moving it, flattening it and placing light in it takes: the shortest of three.
fn time(scene: &Scene) -> Duration {
    let once = || {
        let mut scene = scene.clone();
        let start = Instant::now();
        scene.open();
        scene.set_transform(NodeId(0), Transform::translation(vec3(0.0, 2e-3, 0.0))).expect("it moves");
        let geometry = Geometry::new(&scene);
        let settings = LightSettings { count: 300, ..LightSettings::default() };
        LightSet::sample(&scene, &geometry, &settings).expect("light");
        start.elapsed()
    };
    (0..3).map(|_| once()).min().expect("three")
}

#[test]
fn what_is_nested_deep_takes_no_longer_than_what_is_not() {
    let [flat, deep] = [1, 4000].map(at_the_end_of);
    let [before, after] = [&flat, &deep].map(time);
    // Each object that walked up its chain took 4000 steps for one.
    assert!(after < before * 3, "{before:?} -> {after:?}");
}
