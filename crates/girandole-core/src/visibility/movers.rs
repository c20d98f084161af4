//! Hierarchies over dynamic blockers.

use super::blockers::{Blocker, BlockerTree};
use super::cones::Sphere;
use super::surfaces::Surfaces;

/// The dynamic blockers, in two hierarchies whose nodes are numbered one after the other.
#[derive(Clone, Debug, Default)]
pub(crate) struct Movers {
    /// Over opaque polygons, any of which may cover a receiver.
    pub covers: BlockerTree,
    /// Over all others: they never block all light of a receiver.
    pub others: BlockerTree,
    /// About the nodes of the others.
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
        let others = BlockerTree::over(surfaces, others);
        let spheres = others.nodes.iter().map(|node| Sphere::of_box(node.low, node.high)).collect();
        Self { covers, others, spheres }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.covers.is_empty() && self.others.is_empty()
    }

    /// The number that a node of the others has among all.
    pub fn number(&self, node: u32) -> u32 {
        self.covers.nodes.len() as u32 + node
    }

    /// The blocker of a node, or the group if it has several.
    pub fn blocker(&self, surfaces: &Surfaces, number: u32) -> Blocker {
        let (tree, node) = self.find(number);
        match tree.blocker(surfaces, node) {
            Blocker::Group(_) => Blocker::Group(number),
            one => one,
        }
    }

    /// All blockers below a node.
    pub fn members(&self, number: u32) -> Vec<u32> {
        let (tree, node) = self.find(number);
        tree.members(node)
    }

    fn find(&self, number: u32) -> (&BlockerTree, u32) {
        match number.checked_sub(self.covers.nodes.len() as u32) {
            None => (&self.covers, number),
            Some(node) => (&self.others, node),
        }
    }
}
