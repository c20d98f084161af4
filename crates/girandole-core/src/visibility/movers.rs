//! Dynamic blockers.

use super::blockers::BlockerTree;
use super::cones::Sphere;
use super::surfaces::Surfaces;

/// The dynamic blockers.
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
}
