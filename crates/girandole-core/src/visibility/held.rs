//! Visibility on a hierarchy of receivers that is there already.

use super::groups::Descent;
use super::node_visibility::{NodeContext, NodeVisibility, SceneContext, Workspace, parent_corners};
use super::pyramid::Tests;
use super::receivers::{Node, Receivers};
use super::sources::Sources;
use super::state_matrix::StateMatrix;
use crate::parallel::map;
use crate::scene::NONE;
use std::ops::Range;
use std::sync::Arc;

/// Determines what static blockers leave to receivers that are held: for each light what building the same hierarchy finds,
/// whichever other lights there are.
pub(super) struct HeldPass<'a> {
    pub context: &'a SceneContext<'a>,
    pub receivers: &'a Receivers,
}

impl HeldPass<'_> {
    /// Tests the nodes of the roots of these sources, where they have some, given what is known of all of them before: for each root
    /// its first node, and the states.
    pub fn run(
        &self,
        (sources, roots): (&Sources, &[Option<Range<usize>>]),
        above: Option<Arc<NodeVisibility>>,
    ) -> (Vec<(usize, StateMatrix)>, Tests) {
        let (sides, meshes) = roots.split_at(sources.sides().len());
        let mut descent = Descent::new(sides.iter().map(Option::is_some).collect(), above.clone());
        let of_side = |side: u32, group: &Arc<NodeVisibility>| {
            let range = sides[side as usize].clone().unwrap_or_default();
            (range.start, self.run_root(range, (Some(group), false)))
        };
        while let Some(groups) = sources.groups().filter(|_| !descent.is_done()) {
            descent.step(groups, (self.context, usize::MAX), &of_side);
        }
        // Meshes, each by itself.
        let is_all = sources.one_mesh().is_some();
        let meshes: Vec<Range<usize>> = meshes.iter().flatten().cloned().collect();
        let of_meshes =
            map(&meshes, |range| (range.start, self.run_root(range.clone(), (above.as_deref(), is_all))));
        let (mut result, mut tests) = (Vec::new(), descent.tests);
        for (first, (states, of_root)) in descent.parts.into_iter().map(|(_, part)| part).chain(of_meshes) {
            result.push((first, states));
            tests += of_root;
        }
        (result, tests)
    }

    /// The nodes of one root, given the visibility of its group, or of what else it is in, or of just it.
    fn run_root(
        &self,
        range: Range<usize>,
        (group, is_all): (Option<&NodeVisibility>, bool),
    ) -> (StateMatrix, Tests) {
        let mut workspace = Workspace::new();
        let mut result = StateMatrix::with_room(range.len(), self.context.lights.len());
        // Until their children are tested.
        let mut open: Vec<NodeVisibility> = Vec::with_capacity(range.len());
        for index in range.clone() {
            let node = &self.receivers.nodes[index];
            let local = |node: u32| node as usize - range.start;
            let above = if node.parent == NONE { group } else { Some(&open[local(node.parent)]) };
            let shape = self.receivers.shape(self.context.surfaces, index as u32);
            let at = self.node_context(index, node, group.is_some() && is_all);
            let visibility = self.context.visibility_by_groups(shape, at, above, &mut workspace);
            result.push(&visibility.states);
            open.push(if node.leaf == NONE { visibility } else { NodeVisibility::default() });
            if node.parent != NONE {
                let parent = &self.receivers.nodes[node.parent as usize];
                if parent.children[1] as usize == index {
                    open[local(node.parent)] = NodeVisibility::default();
                }
            }
        }
        (result, workspace.scratch.tests)
    }

    fn node_context(&self, index: usize, node: &Node, root_is_known: bool) -> NodeContext {
        let above = (node.parent != NONE).then(|| self.receivers.node_corners(node.parent));
        NodeContext {
            is_known: node.parent == NONE && root_is_known,
            own_mesh: self.receivers.mesh(index as u32),
            is_leaf: node.leaf != NONE,
            parent_corners: parent_corners(self.receivers.node_corners(index as u32), above),
        }
    }
}
