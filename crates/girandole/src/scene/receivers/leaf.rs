//! How a leaf receiver and a light lie to each other: near or not, and whether the leaf's light map holds the light. That is
//! decided by static geometry and the lights alone, so that what moves changes no more of a light map than the lights that it
//! blocks as a whole.

use crate::records::LeafRecord;
use crate::scene::surface_ids::is_flat;
use crate::shader_constants::{
    MAPPED_SHADOWED, MAPPED_UNSHADOWED, NEAR_SHADOWED, NEAR_UNSHADOWED, NO_PART, SHADOWED, SIDE, UNSHADOWED,
};
use girandole_core::glam::Vec3;
use girandole_core::image::luminance;
use girandole_core::lights::{Clamp, LightSample, Profile};
use girandole_core::scene::{Geometry, Scene};
use girandole_core::visibility::{Leaf, LeafKind, State, VisibilityDatabase};

/// Largest error of interpolating a light's contribution in a light map, as a share of what the leaf receives.
const INTERPOLATION_ERROR: f32 = 5e-4;
/// Sums of light maps stay below this, in their units.
const LARGEST_SUM: f32 = (1u32 << 30) as f32;

/// How a light lies to a leaf.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Relation {
    /// Whether the leaf's light map has room for it.
    pub in_map: bool,
    /// Whether some point of the leaf may be near to what it stands for.
    pub is_near: bool,
    /// Whether it brings no light.
    pub is_dark: bool,
}

/// A leaf, with what depends on static geometry and the lights.
pub(super) struct LeafLight {
    /// What a leaf patch with a light map covers.
    pub rectangle: Option<LeafRectangle>,
    pub has_map: bool,
    /// By light.
    pub relations: Vec<Relation>,
    /// Units of the light map's sums in 1 W/m² of irradiance: a power of two.
    pub units: f32,
}

impl LeafLight {
    pub fn new(
        (scene, geometry): (&Scene, &Geometry),
        lights: &[LightSample],
        database: &VisibilityDatabase,
        leaf: usize,
    ) -> Self {
        let rectangle = LeafRectangle::of(geometry, database, leaf);
        let has_map = rectangle.is_some() && is_plain(scene, geometry, database, leaf);
        let place = &database.receivers().leaves[leaf];
        let mapped = rectangle.as_ref().filter(|_| has_map);
        let in_map = in_map(lights, database.standing_states(leaf as u32), mapped);
        let relation = |(light, in_map): (&LightSample, bool)| Relation {
            in_map,
            is_near: is_near(light, rectangle.as_ref(), place),
            is_dark: light.intensity == Vec3::ZERO,
        };
        let relations: Vec<Relation> = lights.iter().zip(in_map).map(relation).collect();
        let units = mapped.map_or(1.0, |r| units(lights, &relations, r));
        Self { rectangle, has_map, relations, units }
    }

    /// Without the object that it is on.
    pub fn record(&self, light_map: u32) -> LeafRecord {
        let Some(r) = &self.rectangle else { return LeafRecord { light_map, ..LeafRecord::default() } };
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
            ..LeafRecord::default()
        }
    }
}

impl Relation {
    /// The part of the leaf's list that the light is in.
    pub fn part(self, state: State) -> u32 {
        if self.is_dark {
            return NO_PART;
        }
        match (state, self.in_map, self.is_near) {
            (State::Full, ..) => NO_PART,
            (State::Unoccluded, _, true) => NEAR_UNSHADOWED,
            (State::Partial, _, true) => NEAR_SHADOWED,
            (State::Unoccluded, true, false) => MAPPED_UNSHADOWED,
            (State::Unoccluded, false, false) => UNSHADOWED,
            (State::Partial, false, false) => SHADOWED,
            (State::Partial, true, false) => MAPPED_SHADOWED,
        }
    }
}

/// A leaf patch in world space.
pub(super) struct LeafRectangle {
    corner: Vec3,
    across: Vec3,
    up: Vec3,
    normal: Vec3,
}

impl LeafRectangle {
    /// Its point that is nearest to another one.
    fn nearest(&self, point: Vec3) -> Vec3 {
        let along =
            |axis: Vec3| axis * ((point - self.corner).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
        self.corner + along(self.across) + along(self.up)
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
        })
    }
}

/// Whether some point of a leaf may be near to what a light stands for.
fn is_near(light: &LightSample, leaf_rectangle: Option<&LeafRectangle>, leaf: &Leaf) -> bool {
    const SLACK: f32 = 1.001;
    light.rectangle.is_some_and(|lit| {
        let distance = match leaf_rectangle {
            Some(leaf) => leaf.nearest(lit.center).distance(lit.center),
            None => leaf.center.distance(lit.center) - leaf.radius,
        };
        distance < SLACK * lit.reach()
    })
}

/// Whether a leaf patch reflects what a light map holds and nothing else: its shading normal is that of its plane,
/// and it has no specular lobe, which depends on where one looks from.
fn is_plain(scene: &Scene, geometry: &Geometry, database: &VisibilityDatabase, leaf: usize) -> bool {
    let tree = database.receivers();
    let LeafKind::Patch { grid, .. } = tree.leaves[leaf].kind else { return false };
    let Some(patch) = geometry.patches.get(tree.grids[grid as usize].patch as usize) else { return false };
    let material = &scene.materials[patch.material as usize];
    is_flat(scene, geometry, patch) && material.specular == 0.0 && material.metallic == 0.0
}

/// Which lights a leaf's light map holds: those whose contribution changes little from texel to texel. The error of
/// bilinear interpolation is about h² / 8 · |G″| in either direction; over a plane at distance z, z² / r⁴ has |G″| ≤
/// 4 / r⁴.
fn in_map(lights: &[LightSample], states: &[State], rectangle: Option<&LeafRectangle>) -> Vec<bool> {
    let Some(r) = rectangle else { return vec![false; lights.len()] };
    let center = r.corner + (r.across + r.up) * 0.5;
    let (u2, v2) = (r.across.length_squared(), r.up.length_squared());
    let spacing2 = u2.max(v2) / ((SIDE - 1) * (SIDE - 1)) as f32;
    let luminance = |l: &LightSample| luminance(l.intensity);
    let received: f32 = lights
        .iter()
        .zip(states)
        .filter(|(_, s)| **s != State::Full)
        .filter_map(|(l, _)| {
            l.geometric_factor(center, r.normal, r.normal, Clamp::Own).map(|(g, _)| g * luminance(l))
        })
        .sum();
    lights
        .iter()
        .map(|light| match light.profile {
            Profile::Directional => true,
            // Its cone has an edge.
            Profile::Spot { .. } => false,
            Profile::Cosine | Profile::Hemisphere => {
                let d = light.position - r.corner;
                let distance2 = (light.position - r.nearest(light.position)).length_squared();
                let height = d.dot(r.normal);
                let error = luminance(light) * height * spacing2 / (distance2 * distance2 * distance2.sqrt());
                error <= INTERPOLATION_ERROR * received
            }
        })
        .collect()
}

/// Of a map's sums: so fine that all that it may hold stays below [`LARGEST_SUM`].
fn units(lights: &[LightSample], relations: &[Relation], rectangle: &LeafRectangle) -> f32 {
    let most = |light: &LightSample| match light.profile {
        Profile::Directional => light.intensity.max_element(),
        _ => {
            let nearest = rectangle.nearest(light.position);
            light.intensity.max_element() / light.position.distance_squared(nearest)
        }
    };
    let mapped = lights.iter().zip(relations).filter(|(_, relation)| relation.in_map && !relation.is_near);
    let sum: f32 = mapped.map(|(light, _)| most(light)).sum();
    // The power of two below, in the range of normal numbers.
    let units = (LARGEST_SUM / (1.001 * sum)).clamp(1e-30, 1e30);
    f32::from_bits(units.to_bits() & 0x7f80_0000)
}
