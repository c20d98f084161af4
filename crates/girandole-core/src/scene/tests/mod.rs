mod changes;
mod clips;
mod coincident;
mod deformation;
#[cfg(feature = "import")]
mod edits;
mod fingerprint;
mod frame;
mod ground;
mod hierarchy;
mod motion;
mod view;
mod viewpoint;

use super::builtin::shapes;
use super::*;
use glam::{DVec3, Vec3, vec3};

/// A room of 4 × 3 × 4 m about the world's origin with a box in it, which moves, in another material.
fn room() -> Scene {
    let mut scene = Scene::default();
    let white = scene.add_material(Material::default());
    let lamp = scene.add_material(Material::emitter("lamp", Vec3::ONE));
    let mut shell = Mesh::default();
    shell.add_box(vec3(-2.0, 0.0, -2.0), vec3(2.0, 3.0, 2.0), white);
    scene.add_object("room", shell, Transform::IDENTITY);
    let index = scene.add_object("box", cube(lamp), Transform::translation(vec3(0.5, 1.0, 0.0)));
    scene.objects[index].dynamic = true;
    scene
}

/// A cube with sides of 0.4 m.
fn cube(material: MaterialId) -> Mesh {
    shapes::cuboid(Vec3::splat(-0.2), Vec3::splat(0.2), material)
}

fn place(scene: &Scene, object: usize) -> DVec3 {
    scene.world_from_node(scene.objects[object].node).translation
}
