//! Physics of light samples. Stochastic comparisons are z-tests from the variance over seeds.

mod direct;
mod ids;
mod metals;
mod placement;
mod prefix;
mod punctual_lights;
mod rectangle;
mod settings;
mod sun;
mod walk;

use super::emission::{Emission, Emissions};
use super::resample::Candidates;
use super::walk::{Pilot, Walk, walk};
use super::*;
use crate::math::sequence;
use crate::scene::{Material, MaterialId, Mesh, Texture, Transform};
use crate::trace::SceneTracer;
use glam::{DVec3, vec3};

/// A scene of one object: patches of the given materials.
pub(super) fn scene_of(mesh: Mesh, materials: Vec<Material>) -> (Scene, Geometry) {
    let mut scene = Scene::default();
    scene.materials = materials;
    scene.add_object("object", mesh, Transform::IDENTITY);
    let geometry = Geometry::new(&scene);
    (scene, geometry)
}

/// A unit cube that faces inwards; its floor has material 0, the rest material 1.
pub(super) fn closed_box() -> Mesh {
    let mut outside = Mesh::default();
    outside.add_box(Vec3::ZERO, Vec3::ONE, MaterialId(1));
    let mut mesh = Mesh::default();
    for patch in &outside.patches {
        let corners: Vec<Vec3> = patch.outline.iter().rev().map(|&v| outside.positions[v as usize]).collect();
        let floor = corners.iter().all(|p| p.y == 0.0);
        mesh.add_polygon(&corners, MaterialId(u32::from(!floor)));
    }
    mesh
}

/// A horizontal square of side `size` about `center` that faces up, or down.
pub(super) fn square(mesh: &mut Mesh, center: Vec3, size: f32, up: bool, material: MaterialId) {
    let h = size * 0.5;
    let mut corners =
        [vec3(-h, 0.0, h), vec3(h, 0.0, h), vec3(h, 0.0, -h), vec3(-h, 0.0, -h)].map(|p| p + center);
    if !up {
        corners.reverse();
    }
    mesh.add_polygon(&corners, material);
}

/// Mean and standard error over seeds.
pub(super) fn over_seeds(seeds: u32, f: impl Fn(u32) -> DVec3) -> (DVec3, DVec3) {
    let values: Vec<DVec3> = (0..seeds).map(f).collect();
    let n = f64::from(seeds);
    let mean = values.iter().sum::<DVec3>() / n;
    let variance = values.iter().map(|v| (*v - mean) * (*v - mean)).sum::<DVec3>() / (n - 1.0);
    (mean, (variance / n).map(f64::sqrt))
}

/// Whether a mean is what it should be: within 4 standard errors, and `slack` (relative) for what is approximate.
pub(super) fn agrees((mean, error): (DVec3, DVec3), expected: DVec3, slack: f64) -> bool {
    (mean - expected).abs().cmple(error * 4.0 + expected.abs() * (slack + 1e-6)).all()
}

/// Flux of cosine-shaped samples, W.
pub(super) fn flux<'a>(samples: impl IntoIterator<Item = &'a LightSample>) -> DVec3 {
    samples.into_iter().map(|s| s.intensity.as_dvec3() * std::f64::consts::PI).sum()
}

pub(super) fn indirect(set: &LightSet) -> &[LightSample] {
    &set.samples[set.direct as usize..]
}
