//! What dynamic blockers that cover nothing block of the light that others leave: parts of it.

use super::State;
use super::balls::is_small;
use super::clusters::ClusterTree;
use super::cones::{ConeBase, ShadowCone, Sphere};
use super::light_points::LightPoint;
use super::movers::Movers;
use super::node_visibility::Workspace;
use super::pyramid::{Containment, Occlusion, Pyramid, Scratch, Tests};
use super::receiver_tree::{Receiver, ReceiverTree};
use super::receivers::Receivers;
use super::shadows::{Shadow, may_hide};
use super::shapes::{Apex, Shape};
use super::state_matrix::StateMatrix;
use super::surfaces::{MeshPart, Surfaces};
use crate::parallel::map;
use crate::scene::NONE;
use std::ops::Range;

/// Finds the pairs that these blockers make partial, light by light. The shadow of each of them is looked up in the hierarchy of
/// receivers; where it reaches a leaf that nothing else blocks a part of, the pair is tested by the pyramid of the two, unless the
/// cone about it already decides. An inner node is partial if one of its leaves is. A blocker that one static polygon hides from a
/// light as a whole blocks nothing of it that is not blocked already.
pub(super) struct ShadePass<'a> {
    pub surfaces: &'a Surfaces,
    pub lights: &'a [LightPoint],
    pub receivers: &'a Receivers,
    pub movers: &'a Movers,
    /// By node, the visibility that static blockers leave, and all that are not looked for here.
    pub fixed: &'a StateMatrix,
    pub left: &'a StateMatrix,
}

/// A small thing's shadow that is smaller than this share of the leaf that it may fall on is that of a bounding sphere: which part of
/// it blocks the light matters little.
const SMALL: f64 = 0.5;
/// Of the angle between a polygon's normal and parallel light, to test spheres against the two.
const LEAST_COSINE: f64 = 1e-3;

/// All pairs that are partial because of these blockers.
pub(super) struct Shades {
    /// Nodes of blockers that may block all light that comes to them themselves.
    own: Vec<Range<usize>>,
    /// By light, all other nodes.
    others: Vec<Vec<u32>>,
}

impl Shades {
    /// Puts them into what all other blockers leave.
    pub fn put_into(self, states: &mut StateMatrix) {
        self.own.into_iter().flatten().for_each(|node| states.set_all_partial(node));
        for (light, nodes) in self.others.into_iter().enumerate() {
            nodes.into_iter().for_each(|node| states.set_partial(node as usize, light));
        }
    }
}

impl ShadePass<'_> {
    /// All of them, and the tests made.
    pub fn run(&self) -> (Shades, Tests) {
        let (own, roots): (Vec<_>, Vec<_>) =
            self.receivers.roots(0).into_iter().partition(|root| self.shades_itself(root));
        let tree = ReceiverTree::new(self.surfaces, self.receivers, &roots);
        let own_roots = self.roots_of_blockers();
        let lights: Vec<usize> = (0..self.lights.len()).collect();
        let of_light = |light: &usize| {
            let mut pass = LightPass::new(self, (&tree, &own_roots), *light);
            pass.run();
            (pass.shades, pass.workspace.scratch.tests)
        };
        let (others, of_lights): (Vec<Vec<u32>>, Vec<Tests>) = map(&lights, of_light).into_iter().unzip();
        let mut tests = Tests::default();
        of_lights.into_iter().for_each(|of_light| tests += of_light);
        (Shades { own, others }, tests)
    }

    /// By blocker, the root of the receivers on it, or [`NONE`].
    fn roots_of_blockers(&self) -> Vec<u32> {
        let mut result = vec![NONE; self.movers.others.len()];
        for root in self.receivers.roots(0) {
            if let Some(index) = self.blocker_of(root.start as u32) {
                result[index] = root.start as u32;
            }
        }
        result
    }

    /// The blocker that a node of a mesh is part of.
    fn blocker_of(&self, node: u32) -> Option<usize> {
        let blocker = self.surfaces.patches.len() as u32 + self.receivers.mesh(node)?;
        self.movers.others.binary_search(&blocker).ok()
    }

    /// Whether a root is part of a blocker that may itself block all light that comes to it.
    fn shades_itself(&self, root: &Range<usize>) -> bool {
        let node = root.start as u32;
        let is_concave = |mesh: u32| !self.surfaces.meshes[mesh as usize].convex;
        self.blocker_of(node).is_some() && self.receivers.mesh(node).is_some_and(is_concave)
    }
}

/// The pairs of one light.
struct LightPass<'a> {
    of: &'a ShadePass<'a>,
    tree: &'a ReceiverTree,
    /// By blocker, the root of the receivers on it.
    own_roots: &'a [u32],
    light: usize,
    apex: &'a Apex,
    /// By node, whether some blocker was found to block a part.
    found: Vec<bool>,
    /// Those nodes.
    shades: Vec<u32>,
    workspace: Workspace,
}

impl<'a> LightPass<'a> {
    fn new(of: &'a ShadePass<'a>, (tree, own_roots): (&'a ReceiverTree, &'a [u32]), light: usize) -> Self {
        let apex = &of.lights[light].apex;
        let found = vec![false; of.receivers.nodes.len()];
        let (shades, workspace) = (Vec::new(), Workspace::new());
        Self { of, tree, own_roots, light, apex, found, shades, workspace }
    }

    /// Whether one static polygon hides a blocker as a whole.
    fn is_hidden(&mut self, blocker: u32) -> bool {
        let root = self.own_roots[blocker as usize];
        let ShadePass { surfaces, receivers, fixed, .. } = *self.of;
        let pyramid = &mut self.workspace.pyramid;
        root != NONE
            && receivers.is_hidden(surfaces, (root, fixed.row(root as usize)[self.light]), self.apex, pyramid)
    }

    fn left(&self, node: u32) -> State {
        self.of.left.row(node as usize)[self.light]
    }

    fn run(&mut self) {
        let mut open = Vec::new();
        for (blocker, sphere) in (0..).zip(&self.of.movers.spheres) {
            if self.is_hidden(blocker) {
                continue;
            }
            let Some(shadow) = Shadow::new(self.apex, sphere) else { continue };
            let mut boxes = 0;
            self.tree.visit(&shadow, &mut open, &mut boxes, |leaf| {
                let is_open = !self.found[leaf as usize] && self.left(leaf) == State::Unoccluded;
                if is_open && self.is_shaded(leaf, blocker, &shadow) {
                    self.found[leaf as usize] = true;
                    self.shades.push(leaf);
                }
            });
            self.workspace.scratch.tests.boxes += boxes;
        }
        self.pass_up();
    }

    /// Whether something of a blocker is within a leaf's pyramid.
    fn is_shaded(&mut self, leaf: u32, blocker: u32, shadow: &Shadow) -> bool {
        let Self { of, tree, apex, workspace, .. } = self;
        let receiver = &tree.receivers[leaf as usize];
        let Some(cone_base) = &receiver.cone_base else { return false };
        let (sphere, blocker) = (&of.movers.spheres[blocker as usize], of.movers.others[blocker as usize]);
        let Workspace { scratch, pyramid, stack, .. } = workspace;
        scratch.tests.boxes += 1;
        stack.clear();
        let (surfaces, shape) = (of.surfaces, of.receivers.shape(of.surfaces, leaf));
        if is_small(surfaces, sphere.radius)
            && shadow.radius_at(receiver.bounds.center) <= SMALL * cone_base.inner_radius()
            && surfaces.blocker_object(blocker) != of.receivers.object(surfaces, leaf)
            && let Some(is_touched) = touches(sphere, apex, (&shape, receiver, cone_base))
        {
            return is_touched;
        }
        let cone = ShadowCone::new(apex, cone_base);
        match cone.classify(sphere) {
            Containment::Outside => false,
            Containment::Inside => true,
            Containment::Crossing => {
                let own_mesh = of.receivers.mesh(leaf);
                let mut test = PairTest {
                    receiver,
                    shape,
                    own_mesh,
                    apex,
                    cone,
                    pyramid,
                    is_set: false,
                    scratch,
                    stack,
                };
                test.intersects(surfaces, blocker)
            }
        }
    }

    /// Gives each inner node what its leaves have, where nothing else blocks a part.
    fn pass_up(&mut self) {
        for index in 0..self.shades.len() {
            let mut node = self.shades[index];
            loop {
                node = self.of.receivers.nodes[node as usize].parent;
                if node == NONE || self.found[node as usize] || self.left(node) != State::Unoccluded {
                    break;
                }
                self.found[node as usize] = true;
                self.shades.push(node);
            }
        }
    }
}

/// Whether a sphere may touch any ray from a receiver to a light; `None` where a polygon and its light are nearly in one plane.
fn touches(
    sphere: &Sphere,
    apex: &Apex,
    (shape, receiver, cone_base): (&Shape, &Receiver, &ConeBase),
) -> Option<bool> {
    let Shape::Patch { corners, plane } = *shape else {
        return Some(ShadowCone::new(apex, cone_base).may_touch(sphere));
    };
    let room = receiver.tolerance.room();
    let is_in_front = match apex.finite {
        true => plane.height(apex.position) > room,
        false => -plane.normal.dot(apex.normal) > LEAST_COSINE,
    };
    let sphere = Sphere { radius: sphere.radius + room, ..*sphere };
    is_in_front.then(|| may_hide(&sphere, apex, corners, plane.normal))
}

/// The tests of a receiver and a light.
struct PairTest<'a> {
    receiver: &'a Receiver,
    shape: Shape<'a>,
    own_mesh: Option<u32>,
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
        match blocker.checked_sub(surfaces.patches.len() as u32) {
            Some(mesh) => {
                let MeshPart { convex, tree, .. } = &surfaces.meshes[mesh as usize];
                if self.own_mesh == Some(mesh) { !convex } else { self.intersects_tree(tree) }
            }
            None => {
                self.set_pyramid();
                surfaces.test(blocker, self.pyramid, self.own_mesh, self.scratch) != Occlusion::None
            }
        }
    }

    fn set_pyramid(&mut self) {
        if !self.is_set {
            self.scratch.tests.boxes += 1;
            self.pyramid.set(self.apex, self.shape, &self.receiver.tolerance);
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
