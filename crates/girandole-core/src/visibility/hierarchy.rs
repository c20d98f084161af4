//! The subtree of one root: the adaptive split of a patch, and the clusters of a mesh.

use super::clusters::Cluster;
use super::node_visibility::{NodeContext, NodeVisibility, SceneContext, Workspace, parent_corners};
use super::primitives::{area_vector, clip};
use super::pyramid::Tests;
use super::receivers::{cluster_of, patch_shape};
use super::shapes::{MAX_CORNERS, Shape};
use super::surfaces::SimplePatch;
use super::{State, VisibilitySettings};
use crate::scene::NONE;
use glam::DVec3;

/// A node under construction.
pub(crate) struct NodeBuilder {
    /// For a patch: first column and row, one past the last, in units of the finest split.
    pub cells: [u32; 4],
    /// For a patch: the polygon that is tested.
    pub corners: Vec<DVec3>,
    /// For a mesh: its cluster.
    pub cluster: u32,
    pub area: f64,
    pub visibility: NodeVisibility,
    pub children: Option<[usize; 2]>,
    /// For a patch: the surface within its cells.
    outline: Vec<DVec3>,
    /// Halvings along each axis.
    depth: [u32; 2],
    /// Further levels that may be split without a gain.
    look_ahead: u32,
}

/// A rectangle around a patch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    pub origin: DVec3,
    /// From one side of the rectangle to the other.
    pub sides: [DVec3; 2],
}

impl Frame {
    /// Of a patch.
    pub fn of(patch: &SimplePatch) -> Self {
        Self::new(&patch.corners, patch.plane.normal)
    }

    /// Along the longest edge; the second side is chosen so that the two and the normal are right-handed.
    pub fn new(corners: &[DVec3], normal: DVec3) -> Self {
        let edge = |i: usize| corners[(i + 1) % corners.len()] - corners[i];
        let longest = (0..corners.len()).fold(0, |best, i| {
            // Equal up to rounding counts as equal, so that the choice does not depend on the scene's position.
            if edge(i).length() > edge(best).length() * (1.0 + 1e-6) { i } else { best }
        });
        let u = edge(longest).normalize();
        let v = normal.cross(u);
        let range = |axis: DVec3| {
            corners
                .iter()
                .map(|c| axis.dot(*c - corners[0]))
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
        };
        let ((u0, u1), (v0, v1)) = (range(u), range(v));
        Self { origin: corners[0] + u * u0 + v * v0, sides: [u * (u1 - u0), v * (v1 - v0)] }
    }

    /// All of its corners.
    pub fn around(&self) -> [DVec3; 4] {
        self.corners([0, 0, 1, 1], 1.0)
    }

    fn corners(&self, cells: [u32; 4], finest: f64) -> [DVec3; 4] {
        let [u0, v0, u1, v1] = cells.map(|x| f64::from(x) / finest);
        let at = |u: f64, v: f64| self.origin + self.sides[0] * u + self.sides[1] * v;
        [at(u0, v0), at(u1, v0), at(u1, v1), at(u0, v1)]
    }
}

/// Builds the subtree of one side of a patch.
pub(crate) struct PatchRoot<'a> {
    pub context: &'a SceneContext<'a>,
    pub settings: &'a VisibilitySettings,
    pub simple: u32,
    pub back: bool,
    /// The visibility of its group.
    pub group_visibility: &'a NodeVisibility,
    pub frame: Frame,
    /// Area × partially occluded lights above which a node may be split.
    pub threshold: f64,
}

impl PatchRoot<'_> {
    fn finest(&self) -> u32 {
        1 << self.settings.max_depth.min(8)
    }

    fn node(
        &self,
        cells: [u32; 4],
        outline: Vec<DVec3>,
        depth: [u32; 2],
        parent: Option<&NodeBuilder>,
        workspace: &mut Workspace,
    ) -> NodeBuilder {
        let patch = &self.context.surfaces.patches[self.simple as usize];
        let mut corners = outline.clone();
        if corners.len() > MAX_CORNERS {
            corners = self.frame.corners(cells, f64::from(self.finest())).to_vec();
            // The frame lies in the plane only up to rounding: project its corners.
            for corner in &mut corners {
                *corner -= patch.plane.normal * patch.plane.height(*corner);
            }
        }
        if self.back {
            corners.reverse();
        }
        let shape = patch_shape(self.context.surfaces, self.simple, self.back, &corners);
        let area = area_vector(&outline).length();
        // A node is a leaf if it would be too small to split with every undecided light partial.
        let above = parent.map_or(self.group_visibility, |p| &p.visibility);
        let is_leaf = area * above.undecided() as f64 <= self.threshold;
        let parent_corners = parent_corners(&corners, parent.map(|p| &p.corners[..]));
        let node = NodeContext { is_leaf, parent_corners, ..NodeContext::default() };
        let visibility = self.context.visibility_by_groups(shape, node, Some(above), workspace);
        NodeBuilder {
            cells,
            corners,
            cluster: NONE,
            area,
            visibility,
            children: None,
            outline,
            depth,
            look_ahead: LOOK_AHEAD,
        }
    }

    /// The node's halves along one axis, unless one of them would be empty.
    fn halves(&self, node: &NodeBuilder, axis: usize) -> Option<[([u32; 4], Vec<DVec3>); 2]> {
        let cells = node.cells;
        if cells[axis + 2] - cells[axis] < 2 {
            return None;
        }
        let middle = (cells[axis] + cells[axis + 2]) / 2;
        let side = self.frame.sides[axis];
        let normal = side.try_normalize()?;
        let at = normal.dot(self.frame.origin + side * (f64::from(middle) / f64::from(self.finest())));
        let half = |sign: f64, end: usize| {
            let mut outline = Vec::with_capacity(node.outline.len() + 1);
            clip(&node.outline, &mut outline, normal * sign, at * sign);
            let mut cells = cells;
            cells[axis + end] = middle;
            (area_vector(&outline).length() > 1e-4 * node.area).then_some((cells, outline))
        };
        Some([half(-1.0, 2)?, half(1.0, 0)?])
    }

    /// Splits so many nodes of its subtree at most, for as long as that reduces the cost; then undoes splits that did not.
    pub fn grow(&self, subtree: &mut Subtree, most: usize) {
        let patch = &self.context.surfaces.patches[self.simple as usize];
        let finest = self.finest();
        let root = |workspace: &mut Workspace| {
            self.node([0, 0, finest, finest], patch.corners.clone(), [0; 2], None, workspace)
        };
        subtree.grow(most, root, |node, workspace| self.split(node, workspace));
        if subtree.is_done() {
            self.collapse(&mut subtree.nodes);
        }
    }

    /// The node's halves, unless it is cheap or its look-ahead is used up.
    fn split(&self, node: &NodeBuilder, workspace: &mut Workspace) -> Option<[NodeBuilder; 2]> {
        if node.look_ahead == 0 || cost(node) <= self.threshold {
            return None;
        }
        let length = |axis: usize| self.frame.sides[axis].length() / f64::from(1 << node.depth[axis]);
        let longer = usize::from(length(1) > length(0) * (1.0 + 1e-6));
        let (axis, halves) =
            [longer, 1 - longer].into_iter().find_map(|axis| Some((axis, self.halves(node, axis)?)))?;
        let mut depth = node.depth;
        depth[axis] += 1;
        let mut children =
            halves.map(|(cells, outline)| self.node(cells, outline, depth, Some(node), workspace));
        let after: f64 = children.iter().map(cost).sum();
        let pays = after <= cost(node) * (1.0 - f64::from(self.settings.least_gain));
        for child in &mut children {
            child.look_ahead = if pays { LOOK_AHEAD } else { node.look_ahead - 1 };
        }
        Some(children)
    }

    /// Undoes splits that reduced the cost too little.
    fn collapse(&self, nodes: &mut [NodeBuilder]) {
        let mut below = vec![0.0; nodes.len()];
        for index in (0..nodes.len()).rev() {
            let own = cost(&nodes[index]);
            below[index] = own;
            if let Some([a, b]) = nodes[index].children {
                let after = below[a] + below[b];
                if after <= own * (1.0 - f64::from(self.settings.least_gain)) {
                    below[index] = after;
                } else {
                    nodes[index].children = None;
                }
            }
        }
    }
}

/// Levels within which a split has to reduce the cost. In a furnished room something blocks a part of every light for a
/// half and for a quarter of the floor: the cost falls once pieces are smaller than the furniture.
const LOOK_AHEAD: u32 = 7;

/// Area × partially occluded lights.
fn cost(node: &NodeBuilder) -> f64 {
    node.area * node.visibility.states.iter().filter(|&&s| s == State::Partial).count() as f64
}

/// Builds the subtree of a mesh: its clusters down to those of so many triangles at most.
pub(crate) struct MeshRoot<'a> {
    pub context: &'a SceneContext<'a>,
    pub mesh: u32,
    /// What is known before of what it is in, or of just it.
    pub above: Option<&'a NodeVisibility>,
    pub is_all: bool,
    pub triangles: u32,
}

impl MeshRoot<'_> {
    /// Splits so many nodes of its subtree at most.
    pub fn grow(&self, subtree: &mut Subtree, most: usize) {
        let root = |workspace: &mut Workspace| self.node(0, self.above, workspace);
        subtree.grow(most, root, |parent, workspace| {
            let cluster = self.cluster(parent.cluster);
            (!self.is_leaf(cluster))
                .then(|| cluster.children.map(|child| self.node(child, Some(&parent.visibility), workspace)))
        });
    }

    fn cluster(&self, index: u32) -> &Cluster {
        cluster_of(self.context.surfaces, self.mesh, index)
    }

    fn is_leaf(&self, cluster: &Cluster) -> bool {
        cluster.range.len() <= self.triangles as usize || cluster.children[0] == NONE
    }

    fn node(&self, index: u32, parent: Option<&NodeVisibility>, workspace: &mut Workspace) -> NodeBuilder {
        let cluster = self.cluster(index);
        let node = NodeContext {
            own_mesh: Some(self.mesh),
            is_leaf: self.is_leaf(cluster),
            is_known: index == 0 && self.above.is_some() && self.is_all,
            ..NodeContext::default()
        };
        NodeBuilder {
            cells: [0; 4],
            corners: Vec::new(),
            cluster: index,
            area: cluster.area,
            visibility: self.context.visibility_by_groups(Shape::Cluster(cluster), node, parent, workspace),
            children: None,
            outline: Vec::new(),
            depth: [0; 2],
            look_ahead: 0,
        }
    }
}

/// A subtree, whole or in the making.
#[derive(Default)]
pub(crate) struct Subtree {
    pub nodes: Vec<NodeBuilder>,
    /// Nodes that are to be split.
    open: Vec<usize>,
    /// Made to grow it.
    pub tests: Tests,
}

impl Subtree {
    pub fn is_done(&self) -> bool {
        !self.nodes.is_empty() && self.open.is_empty()
    }

    /// Splits so many nodes at most until `split` returns none, from the root on, and drops what only a node's children start from
    /// once they are built.
    fn grow(
        &mut self,
        most: usize,
        root: impl FnOnce(&mut Workspace) -> NodeBuilder,
        mut split: impl FnMut(&NodeBuilder, &mut Workspace) -> Option<[NodeBuilder; 2]>,
    ) {
        let mut workspace = Workspace::new();
        let Self { nodes, open, tests } = self;
        if nodes.is_empty() {
            nodes.push(root(&mut workspace));
            open.push(0);
        }
        for _ in 0..most {
            let Some(index) = open.pop() else { break };
            let children = split(&nodes[index], &mut workspace);
            nodes[index].visibility.entries = Vec::new();
            if let Some(children) = children {
                let indices = [nodes.len(), nodes.len() + 1];
                nodes[index].children = Some(indices);
                nodes.extend(children);
                open.extend(indices);
            }
        }
        *tests += workspace.scratch.tests;
    }
}
