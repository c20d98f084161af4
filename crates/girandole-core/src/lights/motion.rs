//! Light samples that are kept while things move.

use super::{LightSample, LightSet, Rectangle, SampleOrigin, direct};
use crate::scene::{Geometry, ObjectRange, Scene};
use glam::{DAffine3, DVec3, Vec3};

/// Where objects were when light was sampled.
#[derive(Clone, Debug)]
pub(crate) struct Placement {
    origin: DVec3,
    objects: Vec<ObjectRange>,
    world_from_object: Vec<DAffine3>,
}

impl Placement {
    pub fn of(scene: &Scene, geometry: &Geometry) -> Self {
        Self {
            origin: geometry.origin,
            objects: geometry.objects.clone(),
            world_from_object: scene.objects.iter().map(|o| scene.world_from_node(o.node)).collect(),
        }
    }
}

impl LightSet {
    /// The same samples after objects and punctual lights moved: those on a surface go with it, emitters shine as their area
    /// changes, and all else stays. `None` where there are other objects, triangles or punctual lights than when they were
    /// sampled, or another frame of reference.
    pub(crate) fn moved(&self, scene: &Scene, geometry: &Geometry, from: &Placement) -> Option<Self> {
        let to = Placement::of(scene, geometry);
        if to.origin != from.origin || to.objects != from.objects {
            return None;
        }
        let is_punctual = |s: &&LightSample| matches!(s.origin, SampleOrigin::Punctual { .. });
        let mut samples = direct::punctual(scene, geometry);
        let before = self.samples.iter().filter(is_punctual);
        if !before.map(|s| s.origin).eq(samples.iter().map(|s| s.origin)) {
            return None;
        }
        samples.extend(self.samples.iter().filter(|s| !is_punctual(s)).map(|sample| {
            let object = geometry.triangles[sample.triangle() as usize].object as usize;
            let [before, after] = [from, &to].map(|p| p.world_from_object[object]);
            if before == after { *sample } else { carried(sample, after * before.inverse(), to.origin) }
        }));
        let Self { direct, paths, ref warnings, .. } = *self;
        Some(Self { direct, paths, warnings: warnings.clone(), ..Self::from_samples(geometry, samples) })
    }
}

/// A sample on a surface that an affine map of the world moves.
fn carried(sample: &LightSample, map: DAffine3, origin: DVec3) -> LightSample {
    let place = |p: Vec3| (map.transform_point3(p.as_dvec3() + origin) - origin).as_vec3();
    // What a right-handed frame spans; mirrored surfaces keep the side that they shine from.
    let along = |v: Vec3| map.transform_vector3(v.as_dvec3());
    let normal_matrix = map.matrix3.inverse().transpose();
    let normal = (normal_matrix * sample.normal.as_dvec3()).normalize();
    let (u, v) = sample.normal.any_orthonormal_pair();
    let stretch = along(u).cross(along(v)).length() as f32;
    let rectangle = sample.rectangle.map(|r| {
        let [u, v] = r.half_axes.map(along);
        // Perpendicular to each other again, of the area that the map makes of it.
        let across = normal.cross(u.normalize_or_zero());
        let half_axes = [u, across * across.dot(v).abs()].map(|axis| axis.as_vec3());
        Rectangle { center: place(r.center), half_axes }
    });
    let is_emitter = matches!(sample.origin, SampleOrigin::Emitter { .. });
    LightSample {
        position: place(sample.position),
        normal: normal.as_vec3(),
        intensity: sample.intensity * if is_emitter { stretch } else { 1.0 },
        rectangle,
        ..*sample
    }
}
