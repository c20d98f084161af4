//! A hall lit by hundreds of small lamps, between pillars and tables.

use girandole_core::glam::{Vec3, vec3};
use girandole_core::scene::{Camera, Material, Mesh, Projection, Scene, Transform};

/// Lamps along each side.
const LAMPS: i32 = 20;
const HALF: Vec3 = vec3(12.0, 2.0, 9.0);

pub fn hall() -> Scene {
    let mut scene = Scene::default();
    let white = scene.add_material(Material::diffuse("white", Vec3::splat(0.7)));
    let wood = scene.add_material(Material::diffuse("wood", vec3(0.5, 0.33, 0.2)));
    let lamp = scene.add_material(Material::emitter("lamp", vec3(1.0, 0.9, 0.7) * 60.0));

    // A box that faces inwards.
    let (mut outside, mut shell) = (Mesh::default(), Mesh::default());
    outside.add_box(-HALF, HALF, white);
    for patch in &outside.patches {
        let corners: Vec<Vec3> = patch.outline.iter().rev().map(|&v| outside.positions[v as usize]).collect();
        shell.add_polygon(&corners, white);
    }
    scene.add_object("shell", shell, Transform::translation(vec3(0.0, HALF.y, 0.0)));
    let mut add_box = |name: String, material, center: Vec3, half: Vec3| {
        let mut mesh = Mesh::default();
        mesh.add_box(-half, half, material);
        scene.add_object(&name, mesh, Transform::translation(center));
    };
    for (i, j) in (0..5).flat_map(|i| (0..4).map(move |j| (i, j))) {
        let at = vec3(4.8 * (i as f32 - 2.0), 0.0, 4.6 * (j as f32 - 1.5));
        add_box(format!("pillar {i} {j}"), white, at + Vec3::Y * HALF.y, vec3(0.25, HALF.y - 0.001, 0.25));
        let top = at + vec3(2.2, 0.74, 1.0);
        add_box(format!("table {i} {j}"), wood, top, vec3(0.8, 0.03, 0.5));
    }
    for (i, j) in (0..LAMPS).flat_map(|i| (0..LAMPS).map(move |j| (i, j))) {
        let at = |i: i32, half: f32| (i as f32 + 0.5) * 2.0 * half / LAMPS as f32 - half;
        let mut mesh = Mesh::default();
        let corners =
            [vec3(-0.06, 0.0, -0.06), vec3(0.06, 0.0, -0.06), vec3(0.06, 0.0, 0.06), vec3(-0.06, 0.0, 0.06)];
        mesh.add_polygon(&corners, lamp);
        let place = vec3(at(i, HALF.x), 2.0 * HALF.y - 0.05, at(j, HALF.z));
        scene.add_object(&format!("lamp {i} {j}"), mesh, Transform::translation(place));
    }
    let node = scene.add_node("camera", Transform::looking_at(vec3(9.0, 2.5, 7.5), vec3(2.0, 0.0, 1.0)));
    // The ceiling is out of sight: lamps smaller than a pixel are not what is compared.
    let projection = Projection::Perspective { yfov: 0.6 };
    scene.cameras.push(Camera { name: "camera".into(), node, projection, clip: Default::default() });
    scene
}
