//! Two rooms with mirrors.

use super::rooms::Room;
use super::{MovingObject, shapes};
use crate::Result;
use crate::scene::{Material, Mesh, Scene};
use glam::{Vec3, vec3};

const WHITE: Vec3 = Vec3::new(0.74, 0.73, 0.7);
const RED: Vec3 = Vec3::new(0.62, 0.08, 0.06);
const BLUE: Vec3 = Vec3::new(0.08, 0.14, 0.62);
const WOOD: Vec3 = Vec3::new(0.5, 0.34, 0.21);
const GREY: Vec3 = Vec3::new(0.5, 0.5, 0.5);
const WARM: Vec3 = Vec3::new(1.0, 0.93, 0.82);

/// A metal that reflects this share, like a mirror.
fn mirror(name: &str, reflectance: f32) -> Material {
    Material { metallic: 1.0, roughness: 0.0, ..Material::diffuse(name, Vec3::splat(reflectance)) }
}

/// A mirror in a wall: corners as those of a patch.
fn hang(room: &mut Room, name: &str, corners: [Vec3; 4]) {
    let material = room.scene.add_material(mirror(name, 0.9));
    let mut mesh = Mesh::default();
    mesh.add_polygon(&corners, material);
    room.add(name, mesh, Vec3::ZERO);
}

/// A mirror in the back wall, a polished floor, a sphere of chrome; the moving object goes round it.
pub(super) fn room(object: MovingObject) -> Result<Scene> {
    let mut room = Room::new("mirrors", 2.6, 2.8, 2.4, [RED, BLUE, WHITE, WHITE]);
    room.light("light", [0.0, 0.3], [1.4, 1.0], WARM * 16.0);
    let (floor, wood) = (room.scene.objects[0].mesh, room.diffuse(WOOD));
    let polished = Material { roughness: 0.08, specular: 1.0, ..room.scene.materials[wood].clone() };
    let polished = room.scene.add_material(Material { name: "polished wood".into(), ..polished });
    let mesh = &mut room.scene.meshes[floor];
    mesh.triangles.iter_mut().for_each(|triangle| triangle.material = polished);
    let z = 0.01 - room.half.z;
    let mirror_at = [vec3(-1.7, 0.3, z), vec3(1.5, 0.3, z), vec3(1.5, 2.3, z), vec3(-1.7, 2.3, z)];
    hang(&mut room, "mirror", mirror_at);
    let chrome = room.scene.add_material(mirror("chrome", 0.95));
    room.add("chrome sphere", shapes::sphere(0.4, 64, 32, chrome), vec3(0.75, 0.401, -0.5));
    room.boxes("box", GREY, vec3(-0.9, 0.0, -0.6), 25.0, &[(vec3(-0.3, 0.0, -0.3), vec3(0.6, 0.9, 0.6))]);
    let path = [
        vec3(0.2, 0.4, 0.9),
        vec3(1.3, 0.5, 0.6),
        vec3(1.7, 0.8, -0.6),
        vec3(0.9, 1.2, -1.6),
        vec3(-0.3, 1.0, -1.6),
        vec3(-1.7, 0.8, -1.0),
        vec3(-1.2, 0.5, 0.6),
    ];
    room.moving(object, vec3(-0.2, 0.001, 0.5), 20.0, 0.5, path)?;
    room.camera("mirrors", vec3(-0.9, 1.5, 2.25), vec3(0.15, 0.9, -1.2), 62.0);
    room.camera("sphere", vec3(1.7, 1.1, 1.0), vec3(0.7, 0.4, -0.5), 45.0);
    Ok(room.scene)
}

/// Two mirrors that face each other along a corridor.
pub(super) fn corridor(object: MovingObject) -> Result<Scene> {
    let mut room = Room::new("mirror-corridor", 1.2, 2.5, 3.0, [WHITE, WHITE, RED, BLUE]);
    for (i, z) in [-1.8, 0.0, 1.8].into_iter().enumerate() {
        room.light(&format!("light {}", i + 1), [0.0, z], [0.5, 0.5], WARM * 14.0);
    }
    let x = room.half.x - 0.01;
    let left = [vec3(-x, 0.2, 2.4), vec3(-x, 0.2, -2.4), vec3(-x, 2.2, -2.4), vec3(-x, 2.2, 2.4)];
    hang(&mut room, "left mirror", left);
    let right = [vec3(x, 0.2, -2.4), vec3(x, 0.2, 2.4), vec3(x, 2.2, 2.4), vec3(x, 2.2, -2.4)];
    hang(&mut room, "right mirror", right);
    room.boxes("bench", WOOD, vec3(0.1, 0.0, -1.6), 0.0, &[(vec3(-0.25, 0.0, -0.6), vec3(0.5, 0.45, 1.2))]);
    let path = [
        vec3(0.4, 0.5, 0.4),
        vec3(0.5, 0.7, 0.0),
        vec3(0.3, 0.9, -0.6),
        vec3(-0.3, 1.0, -0.8),
        vec3(-0.5, 0.8, -0.2),
        vec3(-0.4, 0.6, 0.3),
        vec3(0.0, 0.5, 0.6),
    ];
    room.moving(object, vec3(-0.2, 0.001, 0.2), 20.0, 0.4, path)?;
    room.camera("mirror-corridor", vec3(0.55, 1.5, 2.2), vec3(-0.9, 1.1, -0.6), 65.0);
    room.camera("across", vec3(0.7, 1.4, 0.3), vec3(-1.0, 1.2, -0.1), 70.0);
    Ok(room.scene)
}
