//! Light samples that are kept while things move.

use super::emission::Emissions;
use super::{LightSample, LightSet, Profile, Rectangle, SampleOrigin, punctual};
use crate::scene::{Geometry, ObjectRange, Scene, Triangle};
use glam::{DAffine3, DMat3, DVec3, Vec3};

/// Where objects were when light was sampled, and how much everything emitted.
#[derive(Clone, Debug)]
pub(crate) struct Placement {
    origin: DVec3,
    objects: Vec<ObjectRange>,
    world_from_object: Vec<DAffine3>,
    emissions: Emissions,
    /// Of objects that are deformed; the others have none.
    positions: Vec<Option<Vec<Vec3>>>,
    /// Of all of those.
    deformed: Vec<Triangle>,
    /// Samples of all punctual lights.
    punctual: Vec<LightSample>,
}

impl Placement {
    pub fn of(scene: &Scene, geometry: &Geometry) -> Self {
        let objects = scene.objects.iter().zip(&geometry.objects);
        let positions = objects.clone().map(|(object, range)| {
            let vertices = range.vertices.start as usize..range.vertices.end as usize;
            scene.is_deformed(object).then(|| geometry.positions[vertices].to_vec())
        });
        let deformed = objects.filter(|(object, _)| scene.is_deformed(object)).flat_map(|(_, range)| {
            &geometry.triangles[range.triangles.start as usize..range.triangles.end as usize]
        });
        let world_from_nodes = scene.world_from_nodes();
        Self {
            emissions: Emissions::of(scene),
            positions: positions.collect(),
            deformed: deformed.copied().collect(),
            origin: geometry.origin,
            objects: geometry.objects.clone(),
            world_from_object: scene.objects.iter().map(|o| world_from_nodes[o.node.index()]).collect(),
            punctual: punctual::all(scene, geometry),
        }
    }

    /// Whether there are the same objects, triangles and punctual lights in the same frame of reference, and all that emits there
    /// did so here, in each channel.
    pub(super) fn leads_to(&self, to: &Self) -> bool {
        to.origin == self.origin
            && to.objects == self.objects
            && to.deformed == self.deformed
            && self.emissions.cover(&to.emissions)
    }

    /// Objects that are elsewhere or of another shape there.
    pub(super) fn moved_objects(&self, to: &Self) -> Vec<bool> {
        let place = |p: &Self, object: usize| (p.world_from_object[object], p.positions[object].clone());
        (0..self.objects.len()).map(|object| place(self, object) != place(to, object)).collect()
    }

    /// Punctual lights that are elsewhere there.
    pub(super) fn moved_lights(&self, to: &Self) -> Vec<bool> {
        let mut moved = vec![false; self.emissions.punctual_lights()];
        for (before, after) in self.punctual.iter().zip(&to.punctual) {
            if let Some(light) = before.punctual() {
                moved[light.index()] |= punctual::has_moved(before, after);
            }
        }
        moved
    }

    /// How much everything emitted.
    pub(super) fn emissions(&self) -> &Emissions {
        &self.emissions
    }

    /// A sample on a surface, or of a punctual light, after that went from here to there; `None` where its triangle has no area
    /// here or there.
    pub(super) fn carry(&self, to: &Self, geometry: &Geometry, sample: &LightSample) -> Option<LightSample> {
        if let Some(key) = punctual::key(sample) {
            let found = to.punctual.binary_search_by_key(&Some(key), punctual::key).ok()?;
            return Some(LightSample { intensity: sample.intensity, ..to.punctual[found] });
        }
        match self.motion(to, geometry, sample.triangle()) {
            Motion::None => Some(*sample),
            Motion::Affine(map) => Some(carried(sample, map, to.origin)),
            Motion::Collapsed => None,
        }
    }

    /// How a triangle went from there to here, in the world: with its object, or, where that is deformed, by itself.
    fn motion(&self, to: &Self, geometry: &Geometry, triangle: u32) -> Motion {
        // What comes from infinitely far away lies on none.
        let Some(triangle) = geometry.triangles.get(triangle as usize) else { return Motion::None };
        let object = triangle.object as usize;
        let corners = |at: &Self| {
            let first = at.objects[object].vertices.start;
            let positions = at.positions[object].as_ref()?;
            let world = |v: u32| positions[(v - first) as usize].as_dvec3() + at.origin;
            Some(triangle.vertices.map(world))
        };
        match (corners(self), corners(to)) {
            (Some(before), Some(after)) if before == after => Motion::None,
            (Some(before), Some(after)) => match (frame(before), frame(after)) {
                (Some(before), Some(after)) => Motion::Affine(after * before.inverse()),
                _ => Motion::Collapsed,
            },
            _ => {
                let [before, after] = [self, to].map(|p| p.world_from_object[object]);
                if before == after { Motion::None } else { Motion::Affine(after * before.inverse()) }
            }
        }
    }
}

/// What became of a triangle.
enum Motion {
    None,
    Affine(DAffine3),
    /// It has no area, or had none.
    Collapsed,
}

/// A triangle's edges and unit normal, at its first corner; `None` where it has no area.
fn frame([a, b, c]: [DVec3; 3]) -> Option<DAffine3> {
    let normal = (b - a).cross(c - a).try_normalize()?;
    Some(DAffine3 { matrix3: DMat3::from_cols(b - a, c - a, normal), translation: a })
}

impl LightSet {
    /// The same samples after objects and punctual lights moved, and lights of all kinds were dimmed or coloured: those on a
    /// surface or of a punctual light go with it, emitters shine as their area changes, each sample is as bright as what its light
    /// comes from, and all else stays. `None` where there are other objects, triangles or punctual lights than when they were sampled, or
    /// another frame of reference; where something emits in a channel in which it did not; where a deformed triangle is turned
    /// inside out, or has no area and one is on it.
    pub(crate) fn moved(&self, scene: &Scene, geometry: &Geometry, from: &Placement) -> Option<Self> {
        let to = Placement::of(scene, geometry);
        if !from.leads_to(&to) {
            return None;
        }
        let mut samples = Vec::with_capacity(self.len());
        for (sample, shares) in self.samples.iter().zip(&self.shares) {
            let intensity = from.emissions.carried(&to.emissions, sample.intensity, shares)?;
            samples.push(from.carry(&to, geometry, &LightSample { intensity, ..*sample })?);
        }
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
        Rectangle { center: place(r.center), half_axes, ..r }
    });
    let mut profile = sample.profile;
    if let Profile::Lobe { axis, .. } = &mut profile {
        *axis = along(*axis).normalize().as_vec3() * axis.length();
    }
    let is_emitter = matches!(sample.origin, SampleOrigin::Emitter { .. });
    LightSample {
        position: place(sample.position),
        normal: normal.as_vec3(),
        intensity: sample.intensity * if is_emitter { stretch } else { 1.0 },
        profile,
        rectangle,
        ..*sample
    }
}
