//! Cells that small things move through: what static blockers leave of a light to all of a cell holds for everything in it.
//!
//! Space is divided into cubes a few times as large as what moves. A light that static blockers leave to a cube, and to what
//! reaches out of it, wholly or not at all needs no further test for what has its middle there. Of all others only what may
//! block something of the cell is tested, first for a ball about the thing, then for its receivers. A cell depends on nothing but
//! where the thing is and how large it is, so that it may be kept for as long as the thing stays in it.

use super::balls::Ball;
use super::cones::Sphere;
use super::node_visibility::{NodeVisibility, SceneContext};
use super::pyramid::Tests;
use super::sources::Sources;
use super::surfaces::Surfaces;
use glam::DVec3;
use std::sync::Arc;

/// Edge of a cell in radii of what is in it: larger ones are left less often, and decide less.
const EDGE: f64 = 4.0;
/// Radius of what is small, as a share of the extent that surfaces of the scene have, at most.
const LARGEST: f64 = 0.05;

/// Whether what has this radius is small.
pub(super) fn is_small(surfaces: &Surfaces, radius: f64) -> bool {
    radius <= LARGEST * surfaces.typical_extent
}

/// A cube that the middle of an object is in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cell {
    /// Its lowest corner, in edges.
    place: DVec3,
    /// Metres.
    edge: f64,
    /// How far the object may reach from its middle, metres.
    reach: f64,
}

/// What static blockers leave to a cell.
#[derive(Clone, Debug)]
pub(super) struct CellVisibility {
    pub cell: Cell,
    visibility: Arc<NodeVisibility>,
}

impl Cell {
    /// The one that a ball is in; none if it is large.
    fn of(surfaces: &Surfaces, Sphere { center, radius }: Sphere) -> Option<Self> {
        let reach = round_up(radius);
        if !(reach > 0.0 && is_small(surfaces, reach)) {
            return None;
        }
        let edge = reach * EDGE;
        Some(Self { place: (center / edge).floor(), edge, reach })
    }

    /// What static blockers leave to it, and the tests made.
    fn visibility(&self, context: &SceneContext) -> (NodeVisibility, Tests) {
        let Self { place, edge, reach } = *self;
        let sphere = Sphere { center: (place + 0.5) * edge, radius: edge * 0.5 * 3_f64.sqrt() + reach };
        Ball::new(context, sphere, DVec3::splat(edge * 0.5 + reach)).visibility(None)
    }
}

impl CellVisibility {
    /// Of the cell that these receivers are in, if they have one: what is held, unless it is of another cell. And the tests made.
    pub fn of(context: &SceneContext, sources: &Sources, held: Option<&Self>) -> (Option<Self>, Tests) {
        let bounds = bounds_of(context.surfaces, sources);
        let Some(cell) = bounds.and_then(|(sphere, _)| Cell::of(context.surfaces, sphere)) else {
            return (None, Tests::default());
        };
        match held.filter(|held| held.cell == cell) {
            Some(held) => (Some(held.clone()), Tests::default()),
            None => {
                let (visibility, tests) = cell.visibility(context);
                (Some(Self { cell, visibility: Arc::new(visibility) }), tests)
            }
        }
    }

    /// The same of these lights alone.
    pub fn of_lights(&self, context: &SceneContext) -> (Self, Tests) {
        let (visibility, tests) = self.cell.visibility(context);
        (Self { visibility: Arc::new(visibility), ..*self }, tests)
    }

    /// Whether these receivers are in it.
    pub fn holds(&self, surfaces: &Surfaces, sources: &Sources) -> bool {
        bounds_of(surfaces, sources).and_then(|(sphere, _)| Cell::of(surfaces, sphere)) == Some(self.cell)
    }

    /// What static blockers leave to a ball about these receivers, and the tests made.
    pub fn within(&self, context: &SceneContext, sources: &Sources) -> (NodeVisibility, Tests) {
        match bounds_of(context.surfaces, sources) {
            Some((sphere, half)) => Ball::new(context, sphere, half).visibility(Some(&self.visibility)),
            None => Default::default(),
        }
    }

    /// Replaces what is known of some lights.
    pub fn set_columns(&mut self, lights: &[u32], columns: &Self) {
        Arc::make_mut(&mut self.visibility).set_columns(lights, &columns.visibility);
    }
}

/// A sphere about some receivers, if there are any, and half the extent of a box about the same middle.
fn bounds_of(surfaces: &Surfaces, sources: &Sources) -> Option<(Sphere, DVec3)> {
    let cluster = |&mesh: &u32| &surfaces.meshes[mesh as usize].tree.nodes[0];
    if let Some(cluster) = sources.one_mesh().as_ref().map(cluster) {
        return Some((cluster.sphere(), (cluster.high - cluster.low) * 0.5));
    }
    let meshes = sources.meshes().iter().map(cluster).map(|m| (m.low, m.high));
    let patches = sources.patches().map(|patch| &surfaces.patches[patch as usize]).map(|p| (p.low, p.high));
    let (low, high) = patches.chain(meshes).reduce(|(low, high), (l, h)| (low.min(l), high.max(h)))?;
    Some((Sphere::of_box(low, high), (high - low) * 0.5))
}

/// The next larger number of few, so that what turns keeps its own.
fn round_up(x: f64) -> f64 {
    let step = f64::from_bits(x.to_bits() & f64::INFINITY.to_bits()) * 0.25;
    (x / step).ceil() * step
}
