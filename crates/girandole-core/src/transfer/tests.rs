use super::*;
use crate::scene::builtin::shapes;
use crate::scene::{Material, MaterialId, Mesh, Transform};

use std::f32::consts::PI;

mod furnace;
mod places;

/// An object alone.
fn alone(mesh: Mesh, material: Material, local: Transform) -> Scene {
    let mut scene = Scene::default();
    scene.add_material(material);
    scene.add_object("object", mesh, local);
    scene
}

fn torus(albedo: Vec3, local: Transform) -> Scene {
    alone(shapes::torus(0.36, 0.14, 24, 12, MaterialId(0)), Material::diffuse("", albedo), local)
}

fn few(bounces: u32) -> TransferSettings {
    TransferSettings { directions: 256, bounces, ..TransferSettings::default() }
}

fn simulate(scene: &Scene, settings: &TransferSettings) -> ObjectTransfer {
    ObjectTransfer::simulate(scene, ObjectId(0), settings, &|_| {}).expect("transfer")
}

/// Coefficients of the same radiance from everywhere.
fn constant(radiance: Vec3) -> Vec<Vec3> {
    let mut environment = vec![Vec3::ZERO; coefficient_count(5)];
    environment[0] = radiance * (4.0 * PI).sqrt();
    environment
}
