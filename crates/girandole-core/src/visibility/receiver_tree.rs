//! Bounds of receivers, and a hierarchy over their roots.

use super::cones::ConeBase;
use super::primitives::Tolerance;
use super::receivers::Receivers;
use super::shadows::{Bounds, Shadow};
use super::shapes::Shape;
use super::surfaces::Surfaces;
use crate::parallel::map;
use crate::scene::NONE;
use glam::{DVec3, Vec3, Vec4};
use std::ops::Range;

/// What a receiver's pairs depend on, whichever the light is.
pub(super) struct Receiver {
    /// About all ray origins.
    pub bounds: Bounds,
    pub tolerance: Tolerance,
    /// Of a leaf.
    pub cone_base: Option<ConeBase>,
}

impl Receiver {
    fn new(surfaces: &Surfaces, receivers: &Receivers, index: u32) -> Self {
        let shape = receivers.shape(surfaces, index);
        let tolerance = shape.tolerance(&surfaces.tolerance);
        let [low, high] = match shape {
            Shape::Patch { corners, .. } => [
                corners.iter().copied().fold(DVec3::INFINITY, DVec3::min),
                corners.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max),
            ],
            Shape::Cluster(cluster) => [cluster.low, cluster.high],
            Shape::Group(group) => [group.bounds.low, group.bounds.high],
        };
        let room = tolerance.room();
        let is_leaf = receivers.nodes[index as usize].leaf != NONE;
        let cone_base = is_leaf.then(|| ConeBase::new(&shape, &tolerance));
        Self { bounds: Bounds::new(low - room, high + room), tolerance, cone_base }
    }
}

/// The hierarchy of receivers, and what is above its roots, as a tree of four children a node.
pub(super) struct ReceiverTree {
    /// By node of the hierarchy.
    pub receivers: Vec<Receiver>,
    /// The root is the last one.
    nodes: Vec<WideNode>,
    /// What single precision is less exact than, metres.
    slack: f32,
}

/// Four boxes, side by side.
struct WideNode {
    center: [Vec4; 3],
    half_extent: [Vec4; 3],
    children: [Child; 4],
}

#[derive(Clone, Copy)]
enum Child {
    None,
    Node(u32),
    Leaf(u32),
}

/// A shadow in single precision: see [`Shadow`].
struct NarrowShadow {
    origin: Vec3,
    direction: Vec3,
    inverse: Vec3,
    near: f32,
    base: f32,
    slope: f32,
}

/// The binary tree that wide nodes are made of: nodes of the hierarchy, and after them those above its roots.
struct BinaryTree<'a> {
    receivers: &'a Receivers,
    bounds: Vec<Bounds>,
    above: Vec<[u32; 2]>,
}

impl ReceiverTree {
    /// Over the receivers of these roots.
    pub fn new(surfaces: &Surfaces, receivers: &Receivers, roots: &[Range<usize>]) -> Self {
        let chunks: Vec<usize> = (0..receivers.nodes.len()).step_by(CHUNK).collect();
        let of_chunk = |first: &usize| -> Vec<Receiver> {
            let nodes = *first..(first + CHUNK).min(receivers.nodes.len());
            nodes.map(|node| Receiver::new(surfaces, receivers, node as u32)).collect()
        };
        let of_nodes: Vec<Receiver> = map(&chunks, of_chunk).into_iter().flatten().collect();
        let bounds: Vec<Bounds> = of_nodes.iter().map(|receiver| receiver.bounds).collect();
        let farthest = |b: &Bounds| (b.center.abs() + b.half_extent).max_element();
        let slack = (bounds.iter().map(farthest).fold(0.0, f64::max) * SLACK) as f32;
        let mut roots: Vec<u32> = roots.iter().map(|range| range.start as u32).collect();
        let mut nodes = Vec::new();
        if !roots.is_empty() {
            let mut binary = BinaryTree { receivers, bounds, above: Vec::new() };
            let root = binary.split(&mut roots);
            binary.widen(root, &mut nodes);
        }
        Self { receivers: of_nodes, nodes, slack }
    }

    /// Calls `visit` for each leaf that a shadow may reach, and adds the boxes that were tested.
    pub fn visit(&self, shadow: &Shadow, open: &mut Vec<u32>, boxes: &mut u64, mut visit: impl FnMut(u32)) {
        let shadow = NarrowShadow::new(shadow, self.slack);
        open.clear();
        open.extend(self.nodes.len().checked_sub(1).map(|root| root as u32));
        while let Some(node) = open.pop().map(|index| &self.nodes[index as usize]) {
            *boxes += node.children.len() as u64;
            let mut reached = shadow.reaches(node);
            while reached != 0 {
                match node.children[reached.trailing_zeros() as usize] {
                    Child::None => {}
                    Child::Node(child) => open.push(child),
                    Child::Leaf(leaf) => visit(leaf),
                }
                reached &= reached - 1;
            }
        }
    }
}

impl BinaryTree<'_> {
    /// A node above these roots, split at the median along the longest axis; or the only one.
    fn split(&mut self, roots: &mut [u32]) -> u32 {
        if let [one] = *roots {
            return one;
        }
        let of = |root: &u32| &self.bounds[*root as usize];
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (mut first, mut last) = (low, high);
        for &Bounds { center, half_extent } in roots.iter().map(of) {
            (low, high) = (low.min(center - half_extent), high.max(center + half_extent));
            (first, last) = (first.min(center), last.max(center));
        }
        let extent = last - first;
        let axis = (0..3).fold(0, |best, i| if extent[i] > extent[best] { i } else { best });
        let along = |root: &u32| of(root).center[axis];
        let middle = roots.len() / 2;
        roots.select_nth_unstable_by(middle, |a, b| along(a).total_cmp(&along(b)).then(a.cmp(b)));
        let (a, b) = roots.split_at_mut(middle);
        let children = [self.split(a), self.split(b)];
        self.above.push(children);
        self.bounds.push(Bounds::new(low, high));
        (self.bounds.len() - 1) as u32
    }

    fn children(&self, node: u32) -> Option<[u32; 2]> {
        match self.receivers.nodes.get(node as usize) {
            Some(node) => (node.leaf == NONE).then_some(node.children),
            None => Some(self.above[node as usize - self.receivers.nodes.len()]),
        }
    }

    /// Makes a wide node of a node, after those below; its index.
    fn widen(&self, node: u32, nodes: &mut Vec<WideNode>) -> u32 {
        let mut members = vec![node];
        while members.len() < 4 {
            let area = |member: &u32| {
                let DVec3 { x, y, z } = self.bounds[*member as usize].half_extent;
                x * y + y * z + z * x
            };
            let inner = (0..members.len()).filter(|&i| self.children(members[i]).is_some());
            let Some(largest) = inner.max_by(|&a, &b| area(&members[a]).total_cmp(&area(&members[b]))) else {
                break;
            };
            let Some([a, b]) = self.children(members[largest]) else { break };
            members[largest] = a;
            members.push(b);
        }
        let mut wide =
            WideNode { center: [Vec4::ZERO; 3], half_extent: [Vec4::ZERO; 3], children: [Child::None; 4] };
        for (i, &member) in members.iter().enumerate() {
            let Bounds { center, half_extent } = &self.bounds[member as usize];
            for axis in 0..3 {
                (wide.center[axis][i], wide.half_extent[axis][i]) =
                    (center[axis] as f32, half_extent[axis] as f32);
            }
            wide.children[i] = match self.children(member) {
                Some(_) => Child::Node(self.widen(member, nodes)),
                None => Child::Leaf(member),
            };
        }
        nodes.push(wide);
        (nodes.len() - 1) as u32
    }
}

impl NarrowShadow {
    fn new(shadow: &Shadow, slack: f32) -> Self {
        let Shadow { origin, direction, near, base, slope, .. } = *shadow;
        let (origin, direction) = (origin.as_vec3(), direction.as_vec3());
        // What rounding takes away at most, of the light's place too.
        let slack = slack + origin.abs().max_element() * SLACK as f32;
        let inverse = |x: f32| if x.abs() < LEAST { 1.0 / LEAST.copysign(x) } else { 1.0 / x };
        let inverse = Vec3::new(inverse(direction.x), inverse(direction.y), inverse(direction.z));
        let (base, slope) = ((base * (1.0 + SLACK)) as f32, (slope * (1.0 + SLACK)) as f32);
        Self {
            origin,
            direction,
            inverse,
            near: near as f32 - slack,
            base: (base + slack).min(f32::MAX / 1e20),
            slope,
        }
    }

    /// Which of four boxes it may reach into, a bit each: [`Shadow::may_reach`].
    fn reaches(&self, node: &WideNode) -> u32 {
        let (mut to, mut far) = (node.center, Vec4::ZERO);
        for (to, origin) in to.iter_mut().zip(self.origin.to_array()) {
            *to -= origin;
        }
        let axes = || to.iter().zip(&node.half_extent);
        for ((&to, &half), direction) in axes().zip(self.direction.to_array()) {
            far += to * direction + half * direction.abs();
        }
        let radius = far.max(Vec4::ZERO) * self.slope + self.base;
        let (mut enter, mut leave) = (Vec4::splat(self.near), far + self.base);
        for ((&to, &half), inverse) in axes().zip(self.inverse.to_array()) {
            let half = half + radius;
            let (a, b) = ((to - half) * inverse, (to + half) * inverse);
            (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
        }
        enter.cmple(leave).bitmask()
    }
}

/// Receivers that one thread makes at once.
const CHUNK: usize = 256;
/// Share of coordinates that single precision is less exact than.
const SLACK: f64 = 4e-6;
/// Components of directions that count as 0.
const LEAST: f32 = 1e-12;
