//! How a leaf receiver and a light lie to each other: near or not, and whether the leaf's light map holds the light. That is
//! decided by static geometry and the lights alone, so that what moves changes no more of a light map than the lights that it
//! blocks as a whole.

use super::exact_sum::ExactSum;
use crate::gpu_scene::pairs::{IsCut, Pair, Relation};
use crate::gpu_scene::previous_transforms::mover_of;
use crate::records::LeafRecord;
use crate::shader_constants::{NONE, SIDE};
use girandole_core::glam::Vec3;
use girandole_core::image::luminance;
use girandole_core::lights::{Clamp, LightSample, Profile};
use girandole_core::scene::{Geometry, Scene};
use girandole_core::visibility::{Joint, Leaf, LeafId, LeafKind, State, VisibilityDatabase};

/// Largest error of interpolating a light's contribution in a light map, as a share of what the leaf receives.
const INTERPOLATION_ERROR: f32 = 5e-4;
/// Sums of light maps have no more bits, in their units.
const SUM_BITS: i32 = 62;

/// Which piece of surface a leaf is, and where.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LeafPlace {
    id: LeafId,
    /// What a patch covers.
    rectangle: Option<LeafRectangle>,
    center: Vec3,
    radius: f32,
    joints: Vec<Joint>,
    /// Which of the dynamic objects it is on, or [`NONE`].
    mover: u32,
    pub has_map: bool,
}

impl LeafPlace {
    pub fn of((scene, geometry): (&Scene, &Geometry), database: &VisibilityDatabase, leaf: usize) -> Self {
        let place = Self::of_geometry(geometry, database, leaf);
        let has_map = place.rectangle.is_some() && is_plain(scene, geometry, database, leaf);
        let mover = match place.id {
            LeafId::Patch { object, .. } | LeafId::Cluster { object, .. } => mover_of(scene, object as usize),
            LeafId::Undetermined => NONE,
        };
        Self { has_map, mover, ..place }
    }

    /// Without what the scene says.
    fn of_geometry(geometry: &Geometry, database: &VisibilityDatabase, leaf: usize) -> Self {
        let &Leaf { center, radius, .. } = &database.receivers().leaves[leaf];
        Self {
            id: database.leaf_id(leaf as u32),
            rectangle: LeafRectangle::of(geometry, database, leaf),
            center,
            radius,
            joints: database.joints(leaf as u32),
            mover: NONE,
            has_map: false,
        }
    }

    /// Whether a leaf of another database is the same, in the same place.
    pub fn stays(&self, geometry: &Geometry, database: &VisibilityDatabase, leaf: usize) -> bool {
        let &Self { mover, has_map, .. } = self;
        Self { mover, has_map, ..Self::of_geometry(geometry, database, leaf) } == *self
    }

    /// Centre and radius of a sphere around it.
    pub fn bounds(&self) -> (Vec3, f32) {
        (self.center, self.radius)
    }

    pub fn record(&self, light_map: u32) -> LeafRecord {
        let light_map = if self.has_map { light_map } else { NONE };
        let Some(r) = &self.rectangle else {
            return LeafRecord { light_map, mover: self.mover, ..LeafRecord::default() };
        };
        let texel = |axis: Vec3| {
            let scaled = axis / axis.length_squared() * (SIDE - 1) as f32;
            scaled.extend(-scaled.dot(r.corner)).to_array()
        };
        LeafRecord {
            light_map,
            texel_u: texel(r.across),
            texel_v: texel(r.up),
            corner: r.corner.to_array(),
            across: r.across.to_array(),
            up: r.up.to_array(),
            normal: r.normal.to_array(),
            mover: self.mover,
            split: u32::from(r.is_split[0]) | u32::from(r.is_split[1]) << 1,
        }
    }

    /// What its light map covers, if it has one.
    fn mapped(&self) -> Option<&LeafRectangle> {
        self.rectangle.as_ref().filter(|_| self.has_map)
    }

    /// How it lies to a light that static blockers leave in this state.
    fn relation(&self, light: &LightSample, standing: State) -> Relation {
        if is_dark(light) {
            return Relation::default();
        }
        // Of parallel light, texels that look past a plane are asked in another way.
        let is_looked_up = standing == State::Partial && !light.profile.is_parallel();
        let is_jointed = is_looked_up && self.joints.iter().any(|joint| joint.is_between(light));
        let is_near = self.is_near(light);
        let is_cut = if is_near { self.is_cut(light) } else { IsCut::No };
        Relation { in_map: false, is_near, is_jointed, is_cut }
    }

    /// Whether its plane cuts what a light stands for, with the light behind it.
    fn is_cut(&self, light: &LightSample) -> IsCut {
        let Some(lit) = light.rectangle.as_ref().filter(|lit| lit.is_open) else { return IsCut::No };
        let Some(leaf) = &self.rectangle else {
            let is_lit = (self.center - light.position).dot(light.normal) > -self.radius;
            return if is_lit { IsCut::Somewhere } else { IsCut::No };
        };
        let over = |point: Vec3| (point - leaf.corner).dot(leaf.normal);
        let highest =
            over(lit.center) + lit.half_axes.iter().map(|axis| axis.dot(leaf.normal).abs()).sum::<f32>();
        let corners = [Vec3::ZERO, leaf.across, leaf.up, leaf.across + leaf.up].map(|at| leaf.corner + at);
        let is_lit = corners.iter().any(|corner| (corner - light.position).dot(light.normal) > 0.0);
        let slack = 1e-5 * lit.radius();
        if is_lit && over(light.position) <= slack && highest > -slack {
            IsCut::Everywhere
        } else {
            IsCut::No
        }
    }

    /// Whether some point of it may be near to what a light stands for.
    fn is_near(&self, light: &LightSample) -> bool {
        const SLACK: f32 = 1.001;
        light.rectangle.is_some_and(|lit| {
            let distance = match &self.rectangle {
                Some(leaf) => leaf.nearest(lit.center).distance(lit.center),
                None => self.center.distance(lit.center) - self.radius,
            };
            distance < SLACK * lit.reach()
        })
    }
}

/// Light samples as they were and as they are.
#[derive(Clone, Copy)]
pub(super) struct LightsThenNow<'a> {
    pub then: &'a [LightSample],
    pub now: &'a [LightSample],
}

/// What decides which lights a leaf's light map holds, and in which units: a function of the lights, however they came there.
#[derive(Clone, Debug, Default)]
pub(super) struct LeafLight {
    /// W/m² at the leaf's centre, from all lights that static objects do not hide.
    received: ExactSum,
    /// What the map holds at most at any point, W/m².
    most: ExactSum,
    /// No error of a light that the map holds is above this.
    held_error: f32,
    /// No error of one that it does not hold is below this.
    excluded_error: f32,
}

impl LeafLight {
    /// With the states of the leaf's pairs that static blockers leave. Writes their relations.
    pub fn new(place: &LeafPlace, lights: &[LightSample], pairs: &mut [Pair]) -> Self {
        let mut result = Self::default();
        for (pair, light) in pairs.iter_mut().zip(lights) {
            pair.set_relation(place.relation(light, pair.standing()));
        }
        if let Some(map) = place.mapped() {
            let visible = lights
                .iter()
                .zip(&*pairs)
                .filter(|(light, pair)| !is_dark(light) && pair.standing() != State::Full);
            result.received = visible.map(|(light, _)| map.received(light)).collect();
            result.fill(map, lights, pairs);
        }
        result
    }

    /// Follows lights that changed, or their states, which are in the pairs as they were, with the leaf where it was. Whether the
    /// relations of any others changed.
    pub fn follow(
        &mut self,
        place: &LeafPlace,
        lights: LightsThenNow,
        standing: &[State],
        changed: &[usize],
        pairs: &mut [Pair],
    ) -> bool {
        let map = place.mapped();
        for &index in changed {
            let (then, now) = (&lights.then[index], &lights.now[index]);
            let pair = &mut pairs[index];
            if let Some(map) = map {
                if pair.standing() != State::Full {
                    self.received.subtract(map.received(then));
                }
                if standing[index] != State::Full {
                    self.received.add(map.received(now));
                }
                if pair.relation().is_summed() {
                    self.most.subtract(map.most(then));
                }
            }
            pair.set_relation(place.relation(now, standing[index]));
        }
        let Some(map) = map else { return false };
        let bound = self.largest_error();
        if self.held_error > bound || self.excluded_error <= bound {
            return self.fill(map, lights.now, pairs);
        }
        for &index in changed {
            self.decide(map, &lights.now[index], bound, &mut pairs[index]);
        }
        false
    }

    /// Decides for all lights whether the map holds them. Whether any did not have that relation before.
    fn fill(&mut self, map: &LeafRectangle, lights: &[LightSample], pairs: &mut [Pair]) -> bool {
        (self.most, self.held_error, self.excluded_error) =
            (ExactSum::default(), f32::NEG_INFINITY, f32::INFINITY);
        let (bound, mut differ) = (self.largest_error(), false);
        for (light, pair) in lights.iter().zip(pairs) {
            let before = *pair;
            self.decide(map, light, bound, pair);
            differ |= before != *pair;
        }
        differ
    }

    fn decide(&mut self, map: &LeafRectangle, light: &LightSample, bound: f32, pair: &mut Pair) {
        if is_dark(light) {
            return;
        }
        let error = map.error(light);
        let relation = Relation { in_map: error <= bound, ..pair.relation() };
        pair.set_relation(relation);
        if relation.in_map {
            self.held_error = self.held_error.max(error);
        } else {
            self.excluded_error = self.excluded_error.min(error);
        }
        if relation.is_summed() {
            self.most.add(map.most(light));
        }
    }

    fn largest_error(&self) -> f32 {
        INTERPOLATION_ERROR * self.received.value()
    }

    /// Units of the light map's sums in 1 W/m²: a power of two, so that all that it may hold stays below 2⁶². They are the same
    /// for all sums from 2⁻¹⁹ to 2¹³ W/m², lest a light that changes a little make all others be summed again.
    pub fn units(&self) -> f32 {
        const TOP: i32 = 13;
        const STEP: i32 = 32;
        let exponent = ((1.001 * self.most.value()).to_bits() >> 23) as i32 - 126;
        let steps = (exponent - TOP + STEP - 1).div_euclid(STEP).clamp(-1, 2);
        2f32.powi(SUM_BITS - TOP - STEP * steps)
    }
}

/// Whether nothing comes from it: while a picture grows, that is so of most.
pub(super) fn is_dark(light: &LightSample) -> bool {
    light.intensity == Vec3::ZERO
}

/// A leaf patch in world space.
#[derive(Clone, Debug, PartialEq)]
struct LeafRectangle {
    corner: Vec3,
    across: Vec3,
    up: Vec3,
    normal: Vec3,
    /// Whether it is shorter than its patch along either axis.
    is_split: [bool; 2],
}

impl LeafRectangle {
    /// Its point that is nearest to another one.
    fn nearest(&self, point: Vec3) -> Vec3 {
        let along =
            |axis: Vec3| axis * ((point - self.corner).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
        self.corner + along(self.across) + along(self.up)
    }

    /// W/m² at its centre from an unoccluded light.
    fn received(&self, light: &LightSample) -> f32 {
        let center = self.corner + (self.across + self.up) * 0.5;
        let factor = light.geometric_factor(center, self.normal, self.normal, Clamp::Own);
        factor.map_or(0.0, |(g, _)| g * luminance(light.intensity))
    }

    /// The error of a light in a light map. That of bilinear interpolation is about h² / 8 · |G″| in either direction; over a
    /// plane at distance z, z² / r⁴ has |G″| ≤ 4 / r⁴; lobes are the more curved the narrower they are.
    fn error(&self, light: &LightSample) -> f32 {
        match light.profile {
            Profile::Directional | Profile::Distant { .. } => 0.0,
            // Its cone has an edge.
            Profile::Spot { .. } => f32::INFINITY,
            Profile::Cosine | Profile::Lobe { .. } | Profile::Hemisphere => {
                let (u2, v2) = (self.across.length_squared(), self.up.length_squared());
                let spacing2 = u2.max(v2) / ((SIDE - 1) * (SIDE - 1)) as f32;
                let distance2 = (light.position - self.nearest(light.position)).length_squared();
                let height = (light.position - self.corner).dot(self.normal);
                let curvature = light.profile.lobe().map_or(1.0, |(_, matt)| 8.0 - 7.0 * matt);
                curvature * luminance(light.intensity) * height * spacing2
                    / (distance2 * distance2 * distance2.sqrt())
            }
        }
    }

    /// W/m² that a light sends to any point of it, at most.
    fn most(&self, light: &LightSample) -> f32 {
        let brightest = light.intensity.max_element();
        match light.profile {
            Profile::Directional | Profile::Distant { .. } => brightest,
            _ => brightest / light.position.distance_squared(self.nearest(light.position)),
        }
    }

    /// The part of its patch's plane that a leaf covers; `None` for clusters.
    fn of(geometry: &Geometry, database: &VisibilityDatabase, leaf: usize) -> Option<Self> {
        let tree = database.receivers();
        let LeafKind::Patch { grid: grid_index, back, cells: [column, row, end_column, end_row] } =
            tree.leaves[leaf].kind
        else {
            return None;
        };
        let grid = &tree.grids[grid_index as usize];
        let cell = [grid.axis_u, grid.axis_v].map(|axis| axis / axis.length_squared());
        // A lone triangle has no patch and gets no map.
        let normal = geometry.patches.get(grid.patch as usize)?.normal;
        Some(Self {
            corner: grid.origin + cell[0] * column as f32 + cell[1] * row as f32,
            across: cell[0] * (end_column - column) as f32,
            up: cell[1] * (end_row - row) as f32,
            normal: if back { -normal } else { normal },
            is_split: [end_column - column < grid.columns, end_row - row < grid.rows],
        })
    }
}

/// Whether a leaf patch reflects what a light map holds and nothing else: its shading normal is that of its plane,
/// and it has no specular lobe, which depends on where one looks from.
fn is_plain(scene: &Scene, geometry: &Geometry, database: &VisibilityDatabase, leaf: usize) -> bool {
    let tree = database.receivers();
    let LeafKind::Patch { grid, .. } = tree.leaves[leaf].kind else { return false };
    let Some(patch) = geometry.patches.get(tree.grids[grid as usize].patch as usize) else { return false };
    let material = &scene.materials[patch.material];
    geometry.is_flat(scene, patch) && material.specular == 0.0 && material.metallic == 0.0
}
