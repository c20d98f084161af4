//! Cells that small things move through: what static blockers leave of a light to all of a cell holds for everything in it.
//!
//! Space is divided into cubes a few times as large as what moves. A light that static blockers leave to a cube, and to what
//! reaches out of it, wholly or not at all needs no further test for what has its middle there; of all others only what may
//! block something of the cell is tested. A cell depends on nothing but where the object is and how large it is, so that it
//! may be kept for as long as the object stays in it.

use super::clusters::Cluster;
use super::node_visibility::{NodeContext, NodeVisibility, SceneContext, Workspace};
use super::pyramid::Tests;
use super::shapes::Shape;
use super::sources::Sources;
use super::surfaces::Surfaces;
use crate::scene::NONE;
use glam::DVec3;
use std::f64::consts::PI;
use std::sync::Arc;

/// Edge of a cell in extents of what is in it: larger ones are left less often, and decide less.
const EDGE: f64 = 4.0;
/// Extent of what has cells, as a share of the extent that surfaces of the scene have, at most.
const LARGEST: f64 = 0.05;

/// A cube that the middle of an object's bounds is in.
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
    pub visibility: Arc<NodeVisibility>,
}

impl Cell {
    /// The one that these receivers are in; none if they are large.
    pub fn of(surfaces: &Surfaces, sources: &Sources) -> Option<Self> {
        let patches = sources.patches().map(|patch| &surfaces.patches[patch as usize]);
        let meshes = sources.meshes().iter().map(|&mesh| &surfaces.meshes[mesh as usize].tree.nodes[0]);
        let boxes = patches.map(|p| (p.low, p.high)).chain(meshes.map(|m| (m.low, m.high)));
        let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (low, high) = boxes.fold(start, |(low, high), (l, h)| (low.min(l), high.max(h)));
        let reach = round_up(0.5 * (high - low).length());
        if !(reach > 0.0 && reach <= LARGEST * surfaces.typical_extent) {
            return None;
        }
        let edge = reach * EDGE;
        Some(Self { place: ((low + high) * (0.5 / edge)).floor(), edge, reach })
    }

    /// What static blockers leave to it, and the tests made.
    pub fn visibility(&self, context: &SceneContext) -> (NodeVisibility, Tests) {
        let Self { place, edge, reach } = *self;
        let bounds = Cluster {
            center: (place + 0.5) * edge,
            radius: edge * 0.5 * 3_f64.sqrt() + reach,
            low: place * edge - reach,
            high: (place + 1.0) * edge + reach,
            axis: DVec3::ZERO,
            angle: PI,
            angle_sine_cosine: Cluster::sine_cosine(PI),
            area: 0.0,
            range: 0..0,
            children: [NONE; 2],
        };
        let mut workspace = Workspace::new();
        let node = NodeContext { is_root: true, ..NodeContext::default() };
        let visibility =
            context.visibility_by_groups(Shape::Cluster(&bounds), node, None, &mut workspace);
        (visibility, workspace.scratch.tests)
    }
}

impl CellVisibility {
    /// Of the cell that these receivers are in, if they have one: what is held, unless it is of another cell; and the tests made.
    pub fn of(context: &SceneContext, sources: &Sources, held: Option<&Self>) -> (Option<Self>, Tests) {
        let Some(cell) = Cell::of(context.surfaces, sources) else { return (None, Tests::default()) };
        match held.filter(|held| held.cell == cell) {
            Some(held) => (Some(held.clone()), Tests::default()),
            None => {
                let (visibility, tests) = cell.visibility(context);
                (Some(Self { cell, visibility: Arc::new(visibility) }), tests)
            }
        }
    }

    /// Replaces what is known of some lights.
    pub fn set_columns(&mut self, lights: &[u32], columns: &NodeVisibility) {
        Arc::make_mut(&mut self.visibility).set_columns(lights, columns);
    }
}

/// The next larger number of few, so that what turns keeps its own.
fn round_up(x: f64) -> f64 {
    let step = f64::from_bits(x.to_bits() & f64::INFINITY.to_bits()) * 0.25;
    (x / step).ceil() * step
}
