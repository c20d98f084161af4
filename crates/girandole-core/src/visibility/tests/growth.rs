//! How the number of tests grows with the scene.

use super::*;
use crate::scene::builtin::{self, MovingObject, shapes};
use crate::scene::{MeshTriangle, mark_patches};
use std::collections::HashMap;

/// What grows fourfold when `count` doubles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Growth {
    /// The number of boxes in a room.
    Boxes,
    /// The triangles of a mesh.
    Mesh,
    /// A room's area with the number of boxes in it.
    Hall,
}

pub fn grown(growth: Growth, count: u32) -> Scene {
    let mut scene = empty_scene();
    let half = if growth == Growth::Hall { count as f32 } else { 4.0 };
    add(&mut scene, room(vec3(-half, 0.0, -half), vec3(half, 3.0, half)));
    if growth == Growth::Mesh {
        let mut torus = shapes::torus(1.0, 0.4, 10 * count, 5 * count, MaterialId(0));
        torus.positions.iter_mut().for_each(|p| p.y += 1.4);
        add(&mut scene, torus);
    } else {
        for i in 0..count * count {
            let step = half * 1.5 / count as f32;
            let at = vec3((i % count) as f32, 0.0, (i / count) as f32) * step - vec3(half, 0.0, half) * 0.75;
            let mut furniture = Mesh::default();
            let size = step * 0.5;
            furniture.add_box(at, at + vec3(size, size, size), MaterialId(0));
            add(&mut scene, furniture);
        }
    }
    scene
}

/// On the shell only.
pub fn lights_on_shell(scene: &Scene, geometry: &Geometry) -> Vec<LightSample> {
    let tracer = SceneTracer::new(scene, geometry);
    let mut numbers = Numbers(9);
    (0..60).map(|i| bounce(&tracer, i % 12, barycentric(&mut numbers))).collect()
}

/// Tests a pair of node and light: all, and those of blockers.
fn tests_of(growth: Growth, count: u32) -> [f64; 2] {
    let scene = grown(growth, count);
    let geometry = Geometry::new(&scene);
    let lights = lights_on_shell(&scene, &geometry);
    let counts = build(&scene, &geometry, lights.clone()).counts();
    [counts.tests.total(), counts.tests.blockers].map(|n| n as f64 / (counts.nodes * lights.len()) as f64)
}

#[test]
fn tests_grow_slower_than_the_scene() {
    // With all blockers against all nodes and lights each step would be 4. A mesh's clusters share the
    // results of their parents' tests, so tests of blockers fall. For boxes that stand close enough to shade each other they do not: each of
    // their sides has to find what stands before it, in a hierarchy that grows.
    for (growth, all, blockers) in [
        (Growth::Boxes, [1.75, 1.7], [1.35, 1.1]),
        (Growth::Mesh, [1.1, 0.9], [0.95, 0.8]),
        (Growth::Hall, [1.8, 2.3], [1.3, 1.4]),
    ] {
        let found = [4, 8, 16].map(|count| tests_of(growth, count));
        println!(
            "{growth:?}: {found:.2?} tests a pair with 1, 4 and 16 times the geometry, all and of blockers"
        );
        for (step, most) in all.into_iter().zip(blockers).map(|(a, b)| [a, b]).enumerate() {
            for (kind, most) in most.into_iter().enumerate() {
                let [before, after] = [found[step][kind], found[step + 1][kind]];
                let least = [1.0, 0.5][kind];
                assert!(after < before * most && before > least, "{growth:?}: {found:?}");
            }
        }
    }
}

/// With each triangle cut into four, so many times. What is flat is found to be so again, as when a file is read.
fn refined(scene: &Scene, times: u32) -> Scene {
    let mut scene = scene.clone();
    for mesh in &mut scene.meshes {
        for _ in 0..times {
            let mut middles = HashMap::new();
            let mut middle_of = |mesh: &mut Mesh, a: u32, b: u32| {
                *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                    let (a, b) = (a as usize, b as usize);
                    mesh.positions.push(mesh.positions[a].midpoint(mesh.positions[b]));
                    mesh.normals.push((mesh.normals[a] + mesh.normals[b]).normalize());
                    mesh.positions.len() as u32 - 1
                })
            };
            for MeshTriangle { vertices: [a, b, c], material } in std::mem::take(&mut mesh.triangles) {
                let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[a, b]| middle_of(mesh, a, b));
                let parts = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
                mesh.triangles.extend(parts.map(|vertices| MeshTriangle { vertices, material }));
            }
        }
        let flat = !mesh.patches.is_empty();
        mesh.patches.clear();
        if flat {
            mark_patches(mesh, 0.0);
        }
    }
    scene
}

#[test]
fn fewer_tests_a_pair_where_a_room_has_four_times_as_many_triangles() {
    for (name, object) in [
        ("area-lights", MovingObject::None),
        ("area-lights", MovingObject::Torus),
        ("table", MovingObject::Torus),
        ("pillars", MovingObject::Torus),
        // Nothing but patches.
        ("pillars", MovingObject::None),
    ] {
        let scene = builtin::build(name, object).expect("it is built in");
        // The same ones throughout, just off their surfaces.
        let lights: Vec<LightSample> = sampled(&scene, &Geometry::new(&scene), 100)
            .samples()
            .iter()
            .map(|l| light(l.position + l.normal * 1e-3, l.normal, l.profile))
            .collect();
        let (mut last, mut patches) = (None, 0);
        for times in 0..4 {
            let scene = refined(&scene, times);
            let geometry = Geometry::new(&scene);
            let counts = build(&scene, &geometry, lights.clone()).counts();
            let tests = counts.tests.total() as f64 / (counts.nodes * lights.len()) as f64;
            let triangles = geometry.triangles.len();
            println!("{name}: {triangles} triangles, {} nodes, {tests:.3} tests a pair", counts.nodes);
            if let Some((before, fewer)) = last {
                assert_eq!(triangles, 4 * fewer, "{name}");
                assert_eq!(geometry.patches.len(), patches, "{name}: what is flat is one patch");
                // Those of a room of patches stay what they are.
                let meshes = geometry.patches.iter().map(|p| p.triangles.len()).sum::<usize>() < triangles;
                assert!(if meshes { tests < before } else { tests == before }, "{name}: {before} {tests}");
            }
            (last, patches) = (Some((tests, triangles)), geometry.patches.len());
        }
    }
}
