//! Random rooms: unoccluded and fully occluded pairs against traced rays.

use super::*;
use crate::scene::builtin::shapes;
use proptest::prelude::*;

/// A room with boxes, tilted boards and meshes; some of them double-sided, cut out or dynamic.
pub fn random_room(numbers: &mut Numbers) -> Scene {
    let mut scene = empty_scene();
    let half = vec3(1.0 + 3.0 * numbers.unit(), 1.0 + numbers.unit(), 1.0 + 3.0 * numbers.unit());
    let turn = if numbers.unit() < 0.5 { Quat::IDENTITY } else { numbers.rotation() };
    let far = if numbers.unit() < 0.5 { Vec3::ZERO } else { numbers.vector() * 50.0 };
    let mut shell = room(-half, half);
    // Sometimes it has no ceiling.
    if numbers.unit() < 0.3 {
        let keep = shell.patches.iter().position(|p| shell.normals[p.outline[0] as usize].y < -0.9);
        if let Some(ceiling) = keep {
            let range = shell.patches.remove(ceiling).triangles;
            let count = range.end - range.start;
            shell.triangles.drain(range.start as usize..range.end as usize);
            for patch in &mut shell.patches[ceiling..] {
                patch.triangles = patch.triangles.start - count..patch.triangles.end - count;
            }
        }
    }
    let place = |scene: &mut Scene, mesh: Mesh, local: Quat, at: Vec3, dynamic: bool| {
        let index = scene.add_object("", mesh, Transform::rigid(turn * local, turn * at + far));
        scene.objects[index].dynamic = dynamic;
    };
    place(&mut scene, shell, Quat::IDENTITY, Vec3::ZERO, false);
    for _ in 0..numbers.below(8) + 1 {
        let material = [0, 0, 0, 1, 2][numbers.below(5)];
        let dynamic = numbers.unit() < 0.25;
        let size = (numbers.vector().abs() + 0.05) * 0.5;
        let mut at = numbers.vector() * half * 0.8;
        match numbers.below(5) {
            0 => {
                // Furniture stands on the floor or against a wall.
                at.y = -half.y;
                if numbers.unit() < 0.3 {
                    at.x = -half.x;
                }
                let mut mesh = Mesh::default();
                mesh.add_box(
                    vec3(-size.x, 0.0, -size.z),
                    vec3(size.x, size.y * 3.0, size.z),
                    material.into(),
                );
                place(&mut scene, mesh, Quat::IDENTITY, at, dynamic);
            }
            1 => {
                let (x, y) = (size.x * 2.0, size.y * 2.0);
                let corners = [
                    vec3(-x, -y, 0.),
                    vec3(x, -y, 0.),
                    vec3(x, y, 0.),
                    vec3(0., y * 1.5, 0.),
                    vec3(-x, y, 0.),
                ];
                place(&mut scene, polygon(&corners, material.into()), numbers.rotation(), at, dynamic);
            }
            2 => {
                // Two large triangles in different planes.
                let corner = |x: f32, z: f32, y: f32| vec3(x * size.x * 3.0, y, z * size.z * 3.0);
                let mut mesh = Mesh::default();
                let (a, b, c, d) =
                    (corner(-1., -1., 0.), corner(-1., 1., 0.3), corner(1., 1., 0.), corner(1., -1., 0.2));
                mesh.add_polygon(&[a, b, c], material.into());
                mesh.add_polygon(&[a, c, d], material.into());
                mesh.patches.clear();
                place(&mut scene, mesh, numbers.rotation(), at, dynamic);
            }
            3 => {
                let mesh = shapes::torus(size.x, size.x * 0.4, 14, 9, material.into());
                place(&mut scene, mesh, numbers.rotation(), at, dynamic);
            }
            _ => {
                let mesh = shapes::cylinder(size.x * 0.5, size.y, 11, material.into());
                place(&mut scene, mesh, numbers.rotation(), at, dynamic);
            }
        }
    }
    scene
}

/// On surfaces, in the air and parallel.
pub fn random_lights(
    scene: &Scene,
    geometry: &Geometry,
    numbers: &mut Numbers,
    count: usize,
) -> Vec<LightSample> {
    let tracer = SceneTracer::new(scene, geometry);
    (0..count)
        .map(|i| {
            let position = numbers.vector() * geometry.bounds.1 * 0.9;
            let normal = numbers.vector().normalize();
            match i % 8 {
                0 => light(position, normal, Profile::Hemisphere),
                1 => light(position, normal, Profile::Spot { scale: 3.0, offset: -1.5 }),
                2 => light(-normal * 3.0 * geometry.diagonal(), normal, Profile::Directional),
                _ => bounce(&tracer, numbers.below(geometry.triangles.len()) as u32, barycentric(numbers)),
            }
        })
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn rays_agree(seed in any::<u64>()) {
        let mut numbers = Numbers(seed);
        let scene = random_room(&mut numbers);
        let geometry = Geometry::new(&scene);
        let lights = random_lights(&scene, &geometry, &mut numbers, 32);
        let database = build(&scene, &geometry, lights.clone());
        check_receivers(&geometry, &database, &mut numbers);
        let verdict = verify(&scene, &geometry, &lights, &database, 400, &mut numbers);
        prop_assert_eq!(verdict.wrong, 0, "{:?}", verdict);
        prop_assert!(verdict.seams * 50 < verdict.rays.iter().sum(), "{:?}", verdict);
        prop_assert!(verdict.wrong_if_swapped > 0, "{:?}", verdict);
    }
}
