//! The light that arrives about an object, but for what the object itself hides or sends.

use super::TransferFrame;
use crate::lights::{Clamp, LightSample, LightSet};
use crate::math::sh;
use crate::scene::{NONE, ObjectId};
use crate::trace::SceneTracer;
use crate::visibility::{LeafKind, State, VisibilityDatabase};
use glam::{DVec3, Vec3};

/// Where the light is gathered that transfer vectors turn into irradiance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gathering {
    /// At the centre of the object's bounding sphere (Barczak §4.4.1): the same light for all of its vertices, so that no edge of a
    /// shadow lies across it. Visibility by traced rays, where the visibility database does not know it.
    Center,
    /// At so many points along each axis of the object's box, between which it is interpolated (§4.4.2 suggests it). Visibility from
    /// shadow maps on the GPU, by traced rays on the CPU.
    Grid {
        /// 1 to [`Gathering::MOST_POINTS`].
        points: u32,
    },
}

impl Gathering {
    /// Points along each axis of a grid at most.
    pub const MOST_POINTS: u32 = 16;

    /// Four points along each axis.
    pub const GRID: Self = Self::Grid { points: 4 };

    /// Points along each axis.
    pub fn points(self) -> u32 {
        match self {
            Self::Center => 1,
            Self::Grid { points } => points,
        }
    }
}

/// Gathers the light of a set of samples at points about an object. What the object itself hides is part of its transfer and does
/// not hide anything here, and samples that lie on it are left out: so nothing counts twice.
pub struct IncidentLight<'a> {
    tracer: &'a SceneTracer<'a>,
    lights: &'a [LightSample],
    object: ObjectId,
    clamp: Clamp,
    known: Vec<Option<bool>>,
}

impl<'a> IncidentLight<'a> {
    /// With a visibility database for the same lights, rays are traced only where that leaves a light open.
    pub fn new(
        tracer: &'a SceneTracer<'a>,
        lights: &'a LightSet,
        database: Option<&VisibilityDatabase>,
        object: ObjectId,
        clamp: Clamp,
    ) -> Self {
        let lights = lights.samples();
        let known = database.map(|database| known(tracer, database, object));
        let known = known.unwrap_or_else(|| vec![None; lights.len()]);
        Self { tracer, lights, object, clamp, known }
    }

    /// How many lights need a ray at each point.
    pub fn traced(&self) -> usize {
        let open = |(light, known): &(&LightSample, &Option<bool>)| known.is_none() && !self.is_own(light);
        self.lights.iter().zip(&self.known).filter(open).count()
    }

    /// The coefficients of the radiance that arrives at a point, relative to the geometry's origin, in transfer space: each sample is
    /// a directional light of `I · G` there, for a surface that faces it.
    pub fn at(&self, position: Vec3, frame: &TransferFrame, bands: u32) -> Vec<Vec3> {
        let mut basis = vec![0.0; sh::coefficient_count(bands)];
        let mut sums = vec![DVec3::ZERO; basis.len()];
        for (light, known) in self.lights.iter().zip(&self.known) {
            if *known == Some(false) || self.is_own(light) {
                continue;
            }
            let to_light =
                if light.profile.is_parallel() { -light.normal } else { light.position - position };
            let facing = to_light.normalize_or_zero();
            let Some((g, wi)) = light.geometric_factor(position, facing, facing, self.clamp) else {
                continue;
            };
            if light.intensity * g == Vec3::ZERO || (known.is_none() && !self.sees(position, light)) {
                continue;
            }
            sh::basis(frame.transfer_from_world_direction * wi, bands, &mut basis);
            for (sum, value) in sums.iter_mut().zip(&basis) {
                *sum += (light.intensity * g).as_dvec3() * f64::from(*value);
            }
        }
        sums.into_iter().map(DVec3::as_vec3).collect()
    }

    /// Whether a sample lies on the object.
    fn is_own(&self, light: &LightSample) -> bool {
        let triangle = light.triangle();
        triangle != NONE && self.tracer.geometry().triangles[triangle as usize].object == self.object.0
    }

    fn sees(&self, position: Vec3, light: &LightSample) -> bool {
        let geometry = self.tracer.geometry();
        let own = geometry.objects[self.object.index()].triangles.clone();
        let ray = light.shadow_ray_end(position, geometry) - position;
        let accept = |triangle: u32, _| !own.contains(&triangle) && triangle != light.triangle();
        self.tracer.closest_hit_where(position, ray, 1.0, accept).is_none()
    }
}

/// For each light, whether all of an object is seen from it but for what the object itself hides (`true`), or nothing is (`false`), where a
/// visibility database knows.
fn known(tracer: &SceneTracer, database: &VisibilityDatabase, object: ObjectId) -> Vec<Option<bool>> {
    let receivers = database.receivers();
    let is_own = |leaf: &u32| match receivers.leaves[*leaf as usize].kind {
        LeafKind::Patch { grid, .. } => receivers.grids[grid as usize].object == object.0,
        LeafKind::Cluster { object: of } => of == object.0,
        LeafKind::Undetermined => false,
    };
    let leaves: Vec<u32> = (0..receivers.leaves.len() as u32).filter(is_own).collect();
    let is_mover = |o: &&crate::scene::Object| o.dynamic && !o.removed;
    let moves_alone = tracer.scene().objects[object.index()].dynamic
        && tracer.scene().objects.iter().filter(is_mover).count() == 1;
    // What static objects leave is all there is, where nothing else moves; and the object itself is none of them.
    let rows: Vec<&[State]> = leaves
        .iter()
        .map(|&leaf| if moves_alone { database.standing_states(leaf) } else { database.leaf_states(leaf) })
        .collect();
    let hidden = database.hidden_from(object);
    let answer = |light: usize| {
        let count = |state| rows.iter().filter(|row| row[light] == state).count();
        // Leaves that turn away from a light are fully occluded too.
        let is_seen = count(State::Unoccluded) > 0 && count(State::Partial) == 0;
        if hidden[light] { Some(false) } else { is_seen.then_some(true) }
    };
    (0..database.lights()).map(answer).collect()
}
