//! Where nodes are in the world.

use super::motion::Pose;
use super::{NodeId, Scene};
use glam::DAffine3;

/// World from node, of any node.
pub(super) type WorldFromNode<'a> = &'a dyn Fn(NodeId) -> DAffine3;

impl Scene {
    /// World from node. Where many are asked for, [`Scene::world_from_nodes`] has the same in one step a node.
    pub fn world_from_node(&self, node: NodeId) -> DAffine3 {
        let above = std::iter::successors(Some(node), |&node| self.nodes[node].parent);
        let above: Vec<NodeId> = above.collect();
        above
            .into_iter()
            .rev()
            .fold(DAffine3::IDENTITY, |world, node| world * self.nodes[node].local.affine())
    }

    /// World from node of all nodes, in their order.
    pub fn world_from_nodes(&self) -> Vec<DAffine3> {
        self.world_from_posed_nodes(&[])
    }

    /// The same in these [poses](Scene::poses).
    pub(super) fn world_from_posed_nodes(&self, poses: &[Pose]) -> Vec<DAffine3> {
        let mut locals: Vec<DAffine3> = self.nodes.iter().map(|node| node.local.affine()).collect();
        for pose in poses {
            if let Some(local) = pose.local {
                locals[pose.node.index()] = local.affine();
            }
        }
        self.inherited(DAffine3::IDENTITY, |&above, node| above * locals[node.index()])
    }

    /// Which nodes are among these, or below one of them.
    pub(super) fn at_or_below(&self, is_one: impl Fn(NodeId) -> bool) -> Vec<bool> {
        self.inherited(false, |&above, node| above || is_one(node))
    }

    /// What each node has, which follows from what its parent has; `root` is what is above roots.
    pub(super) fn inherited<T: Clone>(&self, root: T, next: impl Fn(&T, NodeId) -> T) -> Vec<T> {
        let mut all: Vec<Option<T>> = vec![None; self.nodes.len()];
        let mut below = Vec::new();
        for index in 0..self.nodes.len() {
            // Parents are first as a rule, but callers may hang nodes in any order.
            let mut node = Some(NodeId::from(index));
            while let Some(above) = node.filter(|&node| all[node.index()].is_none()) {
                below.push(above);
                node = self.nodes[above].parent;
            }
            let mut known = node.and_then(|node| all[node.index()].clone()).unwrap_or_else(|| root.clone());
            while let Some(node) = below.pop() {
                known = next(&known, node);
                all[node.index()] = Some(known.clone());
            }
        }
        all.into_iter().map(|one| one.unwrap_or_else(|| root.clone())).collect()
    }
}
