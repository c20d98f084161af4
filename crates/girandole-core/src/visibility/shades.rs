//! What dynamic blockers that cover nothing block of the light that others leave: parts of it.

use super::State;
use super::blockers::BlockerNode;
use super::clusters::ClusterTree;
use super::cones::{ConeBase, ShadowCone, Sphere};
use super::light_points::LightPoint;
use super::movers::Movers;
use super::node_visibility::Workspace;
use super::parallel::map;
use super::primitives::Tolerance;
use super::pyramid::{Containment, Occlusion, Pyramid, Scratch, Tests};
use super::receivers::Receivers;
use super::shapes::{Apex, Shape};
use super::state_matrix::StateMatrix;
use super::surfaces::Surfaces;
use crate::scene::NONE;
use rustc_hash::FxHashMap;
use std::ops::Range;

/// Finds the pairs that these blockers make partial. A pair of a leaf is tested by the pyramid of the two, unless the cone about
/// it already decides. Inner nodes are tested by their cones alone, to find the leaves: such a node is partial if one of its
/// leaves is.
pub(super) struct ShadePass<'a> {
    pub surfaces: &'a Surfaces,
    pub lights: &'a [LightPoint],
    pub receivers: &'a Receivers,
    pub movers: &'a Movers,
    /// By node, the visibility that all other blockers leave.
    pub left: &'a StateMatrix,
}

/// A light that is blocked in part, and the node of the hierarchy of blockers that does it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shade {
    pub light: u32,
    pub blocker: u32,
}

/// A light for which a node has to be tested, and a node of the hierarchy of blockers that is to be tested for it; all those of
/// a light follow each other.
type Open = (u32, u32);

/// Up to so many nodes of the hierarchy of blockers are tested for the children of a node and light; more where the parent
/// left more.
const MAX_OPEN: usize = 12;

/// A receiver that is tested.
struct Receiver<'a> {
    shape: Shape<'a>,
    tolerance: Tolerance,
    cone_base: ConeBase,
    own_mesh: Option<u32>,
}

impl ShadePass<'_> {
    /// By node of the hierarchy of receivers, its shades in the order of lights; and the tests made.
    pub fn run(&self) -> (Vec<Vec<Shade>>, Tests) {
        let own_nodes = self.mesh_nodes();
        let mut tests = Tests::default();
        let roots = self.receivers.roots();
        let of_root = |range: &Range<usize>| {
            let mesh = self.receivers.mesh(range.start as u32);
            match mesh.filter(|mesh| !self.surfaces.meshes[*mesh as usize].convex) {
                // All light that comes to it may be blocked by the mesh itself.
                Some(mesh) if own_nodes.contains_key(&mesh) => {
                    (self.shade_itself(range.clone(), own_nodes[&mesh]), Tests::default())
                }
                _ => self.run_root(range.clone()),
            }
        };
        let mut result = Vec::with_capacity(self.receivers.nodes.len());
        for (shades, of_part) in map(&roots, of_root) {
            tests += of_part;
            result.extend(shades);
        }
        (result, tests)
    }

    /// By mesh, its node.
    fn mesh_nodes(&self) -> FxHashMap<u32, u32> {
        let tree = &self.movers.others;
        let mesh_of = |node: usize| {
            let items = tree.leaf_items(node as u32);
            items.iter().filter_map(|item| item.checked_sub(self.surfaces.patches.len() as u32))
        };
        (0..tree.nodes.len()).flat_map(|node| mesh_of(node).map(move |mesh| (mesh, node as u32))).collect()
    }

    fn shade_itself(&self, range: Range<usize>, blocker: u32) -> Vec<Vec<Shade>> {
        let shade = |node: usize| {
            let lights = (0..).zip(self.left.row(node)).filter(|(_, state)| **state == State::Unoccluded);
            lights.map(|(light, _)| Shade { light, blocker }).collect()
        };
        range.map(shade).collect()
    }

    /// The nodes of one root.
    fn run_root(&self, range: Range<usize>) -> (Vec<Vec<Shade>>, Tests) {
        let mut workspace = Workspace::new();
        let mut open: Vec<Vec<Open>> = Vec::with_capacity(range.len());
        let mut shades: Vec<Vec<Shade>> = Vec::with_capacity(range.len());
        for index in range.clone() {
            let node = &self.receivers.nodes[index];
            let all: Vec<Open>;
            let of_parent = match node.parent {
                NONE => {
                    all = (0..self.lights.len() as u32).map(|light| (light, 0)).collect();
                    &all
                }
                parent => &open[parent as usize - range.start],
            };
            let is_leaf = node.leaf != NONE;
            let (mut of_node, mut of_leaf) = (Vec::new(), Vec::new());
            match is_leaf {
                true => of_leaf = self.test_leaf(index, of_parent, &mut workspace),
                false => of_node = self.narrow(index, of_parent, &mut workspace.scratch.tests),
            }
            open.push(of_node);
            shades.push(of_leaf);
        }
        self.pass_up(range, &mut shades);
        (shades, workspace.scratch.tests)
    }

    fn receiver(&self, index: usize) -> Receiver<'_> {
        let shape = self.receivers.shape(self.surfaces, index as u32);
        let tolerance = shape.tolerance(&self.surfaces.tolerance);
        let own_mesh = self.receivers.mesh(index as u32);
        Receiver { shape, tolerance, cone_base: ConeBase::new(&shape, &tolerance), own_mesh }
    }

    /// The lights of which something may be blocked for a part of an inner node, and by what.
    fn narrow(&self, index: usize, open: &[Open], tests: &mut Tests) -> Vec<Open> {
        if open.is_empty() {
            return Vec::new();
        }
        let (receiver, left) = (self.receiver(index), self.left.row(index));
        let mut result: Vec<Open> = Vec::with_capacity(open.len());
        for of_light in open.chunk_by(|a, b| a.0 == b.0) {
            let light = of_light[0].0;
            if left[light as usize] != State::Full {
                let cone = ShadowCone::new(&self.lights[light as usize].apex, &receiver.cone_base);
                self.add_touched(&cone, of_light, &mut result, tests);
            }
        }
        result
    }

    /// Adds those nodes that a cone may touch, as far down as there is room.
    fn add_touched(&self, cone: &ShadowCone, open: &[Open], result: &mut Vec<Open>, tests: &mut Tests) {
        let first = result.len();
        let mut touches = |(_, node): &Open| {
            tests.boxes += 1;
            cone.may_touch(&self.movers.spheres[*node as usize])
        };
        result.extend(open.iter().copied().filter(&mut touches));
        let mut next = first;
        while next < result.len() {
            let (light, node) = result[next];
            let BlockerNode { count, first: child, .. } = self.movers.others.nodes[node as usize];
            if count > 0 || result.len() - first >= MAX_OPEN {
                next += 1;
                continue;
            }
            result.swap_remove(next);
            result.extend([(light, child), (light, child + 1)].into_iter().filter(&mut touches));
        }
    }

    /// The lights of which something is blocked for a leaf.
    fn test_leaf(&self, index: usize, open: &[Open], workspace: &mut Workspace) -> Vec<Shade> {
        if open.is_empty() {
            return Vec::new();
        }
        let (receiver, left) = (self.receiver(index), self.left.row(index));
        let mut result = Vec::new();
        for of_light in open.chunk_by(|a, b| a.0 == b.0) {
            let light = of_light[0].0;
            if left[light as usize] == State::Unoccluded
                && let Some(blocker) = self.blocker(&receiver, of_light, workspace)
            {
                result.push(Shade { light, blocker });
            }
        }
        result
    }

    /// A node of which something is within a leaf's pyramid, among these for one light and those below.
    fn blocker(&self, receiver: &Receiver, open: &[Open], workspace: &mut Workspace) -> Option<u32> {
        let apex = &self.lights[open[0].0 as usize].apex;
        let cone = ShadowCone::new(apex, &receiver.cone_base);
        let Workspace { scratch, pyramid, stack, .. } = workspace;
        let Movers { others, spheres, .. } = self.movers;
        stack.clear();
        stack.extend(open.iter().map(|(_, node)| node));
        let mut test = PairTest { receiver, apex, cone, pyramid, scratch, stack, is_set: false };
        while let Some(index) = test.stack.pop() {
            test.scratch.tests.boxes += 1;
            let BlockerNode { count, first, .. } = others.nodes[index as usize];
            match test.cone.classify(&spheres[index as usize]) {
                Containment::Outside => {}
                Containment::Inside => return Some(index),
                Containment::Crossing if count == 0 => {
                    let children = [first, first + 1];
                    test.push_nearer_last(children, children.map(|child| spheres[child as usize]));
                }
                Containment::Crossing => {
                    if others.leaf_items(index).iter().any(|&item| test.intersects(self.surfaces, item)) {
                        return Some(index);
                    }
                }
            }
        }
        None
    }

    /// Gives each inner node what its children have, where nothing else blocks a part.
    fn pass_up(&self, range: Range<usize>, shades: &mut [Vec<Shade>]) {
        for index in range.clone().rev() {
            let parent = self.receivers.nodes[index].parent;
            let of_node = &mut shades[index - range.start];
            of_node.sort_by_key(|shade| shade.light);
            of_node.dedup_by_key(|shade| shade.light);
            if parent != NONE {
                let left = self.left.row(parent as usize);
                let is_new = |shade: &&Shade| left[shade.light as usize] == State::Unoccluded;
                let passed: Vec<Shade> = of_node.iter().filter(is_new).copied().collect();
                shades[parent as usize - range.start].extend(passed);
            }
        }
    }
}

/// The tests of a receiver and a light.
struct PairTest<'a> {
    receiver: &'a Receiver<'a>,
    apex: &'a Apex,
    cone: ShadowCone<'a>,
    /// Set once it is needed.
    pyramid: &'a mut Pyramid,
    is_set: bool,
    scratch: &'a mut Scratch,
    /// Nodes of a hierarchy that are to be tested.
    stack: &'a mut Vec<u32>,
}

impl PairTest<'_> {
    /// Whether anything of a blocker is in the pyramid.
    fn intersects(&mut self, surfaces: &Surfaces, blocker: u32) -> bool {
        let own_mesh = self.receiver.own_mesh;
        match blocker.checked_sub(surfaces.patches.len() as u32) {
            Some(mesh) if own_mesh != Some(mesh) => {
                self.intersects_tree(&surfaces.meshes[mesh as usize].tree)
            }
            _ => {
                self.set_pyramid();
                surfaces.test(blocker, self.pyramid, own_mesh, self.scratch) != Occlusion::None
            }
        }
    }

    fn set_pyramid(&mut self) {
        if !self.is_set {
            self.scratch.tests.boxes += 1;
            self.pyramid.set(self.apex, self.receiver.shape, &self.receiver.tolerance);
            self.is_set = true;
        }
    }

    /// The one that is tested first is more likely to be all that has to be.
    fn push_nearer_last(&mut self, nodes: [u32; 2], spheres: [Sphere; 2]) {
        let nearer = usize::from(!self.cone.is_nearer(&spheres[0], &spheres[1]));
        self.stack.extend([nodes[1 - nearer], nodes[nearer]]);
    }

    /// Tests clusters by the cone first, and the triangles of those that it crosses by the pyramid.
    fn intersects_tree(&mut self, tree: &ClusterTree) -> bool {
        let below = self.stack.len();
        self.stack.push(0);
        while self.stack.len() > below
            && let Some(index) = self.stack.pop()
        {
            if self.intersects_cluster(tree, index) {
                self.stack.truncate(below);
                return true;
            }
        }
        false
    }

    /// Whether anything of a cluster is in the pyramid; for one that has children that is left to them, unless it is certain.
    fn intersects_cluster(&mut self, tree: &ClusterTree, index: u32) -> bool {
        let cluster = &tree.nodes[index as usize];
        self.scratch.tests.boxes += 1;
        match self.cone.classify(&cluster.sphere()) {
            Containment::Outside => return false,
            Containment::Inside => return true,
            Containment::Crossing => self.set_pyramid(),
        }
        if cluster.children[0] == NONE {
            return self.pyramid.intersects_cluster(tree, index, self.scratch);
        }
        self.scratch.tests.blockers += 1;
        let containment = self.pyramid.classify_sphere(&cluster.sphere());
        if containment == Containment::Crossing {
            let spheres = cluster.children.map(|child| tree.nodes[child as usize].sphere());
            self.push_nearer_last(cluster.children, spheres);
        }
        containment == Containment::Inside
    }
}
