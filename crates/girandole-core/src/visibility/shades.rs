//! What dynamic blockers that cover nothing block of the light that others leave: parts of it.

use super::State;
use super::clusters::ClusterTree;
use super::cones::{ShadowCone, Sphere};
use super::light_points::LightPoint;
use super::movers::Movers;
use super::node_visibility::Workspace;
use super::parallel::map;
use super::pyramid::{Containment, Occlusion, Pyramid, Scratch, Tests};
use super::receiver_tree::{Receiver, ReceiverTree};
use super::receivers::Receivers;
use super::shadows::{Shadow, may_hide};
use super::shapes::{Apex, Shape};
use super::state_matrix::StateMatrix;
use super::surfaces::{MeshPart, Surfaces};
use crate::scene::NONE;
use std::ops::Range;

/// Finds the pairs that these blockers make partial, light by light. All of their shadows go down the hierarchy of receivers
/// together, each as far as it reaches; where that is a leaf, the pair is tested by the pyramid of the two, unless the cone about
/// it already decides. An inner node is partial if one of its leaves is.
pub(super) struct ShadePass<'a> {
    pub surfaces: &'a Surfaces,
    pub lights: &'a [LightPoint],
    pub receivers: &'a Receivers,
    pub movers: &'a Movers,
    /// By node, the visibility that all other blockers leave.
    pub left: &'a StateMatrix,
}

/// A node that a light is blocked from in part, and which of the blockers does it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shade {
    pub node: u32,
    pub blocker: u32,
}

/// A shadow that is smaller than this share of the leaf that it may fall on is that of a bounding sphere: which part of so
/// small a thing blocks the light matters little.
const SMALL: f64 = 0.25;
/// Of the angle between a polygon's normal and parallel light, to test spheres against the two.
const LEAST_COSINE: f64 = 1e-3;

impl ShadePass<'_> {
    /// By light, its shades; and the tests made.
    pub fn run(&self) -> (Vec<Vec<Shade>>, Tests) {
        let (own, roots): (Vec<Range<usize>>, Vec<Range<usize>>) =
            self.receivers.roots().into_iter().partition(|root| self.shades_itself(root).is_some());
        let tree = ReceiverTree::new(self.surfaces, self.receivers, &roots);
        let lights: Vec<u32> = (0..self.lights.len() as u32).collect();
        let of_light = |light: &u32| {
            let mut pass = LightPass::new(self, &tree, *light);
            pass.run();
            for root in &own {
                pass.shade_itself(root);
            }
            (pass.shades, pass.workspace.scratch.tests)
        };
        let mut tests = Tests::default();
        let add = |(shades, of_light)| {
            tests += of_light;
            shades
        };
        (map(&lights, of_light).into_iter().map(add).collect(), tests)
    }

    /// The blocker that a root is part of, if all light that comes to it may be blocked by that itself.
    fn shades_itself(&self, root: &Range<usize>) -> Option<u32> {
        let mesh = self.receivers.mesh(root.start as u32)?;
        let blocker = self.surfaces.patches.len() as u32 + mesh;
        let index = self.movers.others.binary_search(&blocker).ok()?;
        (!self.surfaces.meshes[mesh as usize].convex).then_some(index as u32)
    }
}

/// The pairs of one light.
struct LightPass<'a> {
    of: &'a ShadePass<'a>,
    tree: &'a ReceiverTree,
    light: u32,
    apex: &'a Apex,
    /// Of blockers, by their indices.
    shadows: Vec<(u32, Shadow)>,
    /// Indices of shadows that reach a node, list by list from the root to that node.
    reaching: Vec<u32>,
    shades: Vec<Shade>,
    workspace: Workspace,
}

impl<'a> LightPass<'a> {
    fn new(of: &'a ShadePass<'a>, tree: &'a ReceiverTree, light: u32) -> Self {
        let apex = &of.lights[light as usize].apex;
        let shadow = |(index, sphere)| Shadow::new(apex, sphere).map(|shadow| (index, shadow));
        let shadows: Vec<(u32, Shadow)> = (0..).zip(&of.movers.spheres).filter_map(shadow).collect();
        let reaching = (0..shadows.len() as u32).collect();
        Self { of, tree, light, apex, shadows, reaching, shades: Vec::new(), workspace: Workspace::new() }
    }

    fn run(&mut self) {
        if self.tree.root != NONE {
            self.visit(self.tree.root, 0);
        }
    }

    fn left(&self, node: u32) -> State {
        self.of.left.row(node as usize)[self.light as usize]
    }

    /// Finds the shades at a node and below, of the shadows from `first` on; the blocker of the node itself, if it is one of them.
    fn visit(&mut self, node: u32, first: usize) -> Option<u32> {
        let above = (node as usize).checked_sub(self.tree.receivers.len());
        let (bounds, left) = match above {
            None => (&self.tree.receivers[node as usize].bounds, Some(self.left(node))),
            Some(above) => (&self.tree.above[above].bounds, None),
        };
        if left == Some(State::Full) {
            return None;
        }
        let end = self.reaching.len();
        self.workspace.scratch.tests.boxes += (end - first) as u64;
        for at in first..end {
            let index = self.reaching[at];
            if self.shadows[index as usize].1.may_reach(bounds) {
                self.reaching.push(index);
            }
        }
        let mut blocker = None;
        if self.reaching.len() > end {
            blocker = match above {
                Some(above) => {
                    self.visit_both(self.tree.above[above].children, end);
                    None
                }
                None => match self.of.receivers.nodes[node as usize].children {
                    [NONE, _] => self.blocker(node, left, end),
                    children => self.visit_both(children, end),
                },
            };
        }
        self.reaching.truncate(end);
        let blocker = blocker.filter(|_| left == Some(State::Unoccluded))?;
        self.shades.push(Shade { node, blocker });
        Some(blocker)
    }

    fn visit_both(&mut self, [a, b]: [u32; 2], first: usize) -> Option<u32> {
        let (a, b) = (self.visit(a, first), self.visit(b, first));
        a.or(b)
    }

    /// A blocker of which something is within a leaf's pyramid, among those whose shadows reach it from `first` on.
    fn blocker(&mut self, leaf: u32, left: Option<State>, first: usize) -> Option<u32> {
        let Self { of, tree, apex, shadows, reaching, workspace, .. } = self;
        let receiver = &tree.receivers[leaf as usize];
        let cone_base = receiver.cone_base.as_ref().filter(|_| left == Some(State::Unoccluded))?;
        let Workspace { scratch, pyramid, stack, .. } = workspace;
        stack.clear();
        let mut test = PairTest {
            receiver,
            shape: of.receivers.shape(of.surfaces, leaf),
            own_mesh: of.receivers.mesh(leaf),
            apex,
            cone: ShadowCone::new(apex, cone_base),
            pyramid,
            is_set: false,
            scratch,
            stack,
        };
        let largest = SMALL * cone_base.inner_radius();
        let object = of.receivers.object(of.surfaces, leaf);
        let found = reaching[first..].iter().find(|&&index| {
            let (blocker, shadow) = &shadows[index as usize];
            let sphere = &of.movers.spheres[*blocker as usize];
            test.scratch.tests.boxes += 1;
            let blocker = of.movers.others[*blocker as usize];
            if shadow.radius_at(receiver.bounds.center) <= largest
                && of.surfaces.blocker_object(blocker) != object
                && let Some(is_touched) = test.touches(sphere)
            {
                return is_touched;
            }
            match test.cone.classify(sphere) {
                Containment::Outside => false,
                Containment::Inside => true,
                Containment::Crossing => test.intersects(of.surfaces, blocker),
            }
        });
        found.map(|&index| shadows[index as usize].0)
    }

    /// All that comes to a blocker that may block it itself.
    fn shade_itself(&mut self, root: &Range<usize>) {
        let Some(blocker) = self.of.shades_itself(root) else { return };
        for node in root.start as u32..root.end as u32 {
            if self.left(node) == State::Unoccluded {
                self.shades.push(Shade { node, blocker });
            }
        }
    }
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
    /// Whether a sphere may touch any of the rays; `None` where a polygon and its light are nearly in one plane.
    fn touches(&self, sphere: &Sphere) -> Option<bool> {
        let Shape::Patch { corners, normal, offset, .. } = self.shape else {
            return Some(self.cone.may_touch(sphere));
        };
        let room = self.receiver.tolerance.room();
        let is_in_front = match self.apex.finite {
            true => normal.dot(self.apex.position) - offset > room,
            false => -normal.dot(self.apex.normal) > LEAST_COSINE,
        };
        let sphere = Sphere { radius: sphere.radius + room, ..*sphere };
        is_in_front.then(|| may_hide(&sphere, self.apex, corners, normal))
    }

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
