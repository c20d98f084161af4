//! Dynamic blockers.

use super::blockers::{Blocker, BlockerTree};
use super::cones::Sphere;
use super::surfaces::Surfaces;

/// The dynamic blockers, numbered one after the other: nodes of a hierarchy, then single ones.
#[derive(Clone, Debug, Default)]
pub(crate) struct Movers {
    /// Over opaque polygons, any of which may cover a receiver.
    pub covers: BlockerTree,
    /// All others, in ascending order: they never block all light of a receiver.
    pub others: Vec<u32>,
    /// About the others.
    pub spheres: Vec<Sphere>,
}

impl Movers {
    /// Those of the objects that are accepted.
    pub fn of(surfaces: &Surfaces, accept: impl Fn(u32) -> bool) -> Self {
        let is_opaque = |blocker: &u32| surfaces.patches.get(*blocker as usize).is_some_and(|p| p.opaque);
        let blocks = |&b: &u32| surfaces.blocks(b) && accept(surfaces.blocker_object(b));
        let all = (0..surfaces.blocker_count()).filter(blocks);
        let (covers, others): (Vec<u32>, Vec<u32>) = all.partition(is_opaque);
        let mut covers = BlockerTree::over(surfaces, covers);
        // Receivers move behind them.
        covers.set_extents(surfaces, false);
        let spheres = others.iter().map(|&blocker| surfaces.blocker_sphere(blocker)).collect();
        Self { covers, others, spheres }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.covers.is_empty() && self.others.is_empty()
    }

    /// The number that one of the others has among all.
    pub fn number(&self, other: u32) -> u32 {
        self.covers.nodes.len() as u32 + other
    }

    /// The blocker of a number, or the group if it has several.
    pub fn blocker(&self, surfaces: &Surfaces, number: u32) -> Blocker {
        match self.other(number) {
            None => self.covers.blocker(surfaces, number),
            Some(blocker) => surfaces.blocker(blocker),
        }
    }

    /// All blockers of a number.
    pub fn members(&self, number: u32) -> Vec<u32> {
        self.other(number).map_or_else(|| self.covers.members(number), |blocker| vec![blocker])
    }

    fn other(&self, number: u32) -> Option<u32> {
        let index = number.checked_sub(self.covers.nodes.len() as u32)?;
        self.others.get(index as usize).copied()
    }
}
