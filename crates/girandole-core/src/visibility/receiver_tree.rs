//! Bounds of receivers, and a hierarchy over their roots.

use super::cones::ConeBase;
use super::parallel::map;
use super::primitives::Tolerance;
use super::receivers::Receivers;
use super::shadows::Bounds;
use super::shapes::Shape;
use super::surfaces::Surfaces;
use crate::scene::NONE;
use glam::DVec3;
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

/// A node above the roots.
pub(super) struct Above {
    pub bounds: Bounds,
    /// Such nodes, counted from the number of receivers on, or roots.
    pub children: [u32; 2],
}

/// The hierarchy of receivers and what is above its roots, as one binary tree.
pub(super) struct ReceiverTree {
    /// By node of the hierarchy.
    pub receivers: Vec<Receiver>,
    pub above: Vec<Above>,
    /// [`NONE`] if there are no receivers.
    pub root: u32,
}

impl ReceiverTree {
    /// Over the receivers of these roots.
    pub fn new(surfaces: &Surfaces, receivers: &Receivers, roots: &[Range<usize>]) -> Self {
        let chunks: Vec<usize> = (0..receivers.nodes.len()).step_by(CHUNK).collect();
        let of_chunk = |first: &usize| -> Vec<Receiver> {
            let nodes = *first..(first + CHUNK).min(receivers.nodes.len());
            nodes.map(|node| Receiver::new(surfaces, receivers, node as u32)).collect()
        };
        let of_nodes = map(&chunks, of_chunk).into_iter().flatten().collect();
        let mut result = Self { receivers: of_nodes, above: Vec::new(), root: NONE };
        let mut roots: Vec<u32> = roots.iter().map(|range| range.start as u32).collect();
        if !roots.is_empty() {
            result.root = result.split(&mut roots);
        }
        result
    }

    /// A node above these roots, split at the median along the longest axis; or the only one.
    fn split(&mut self, roots: &mut [u32]) -> u32 {
        if let [one] = *roots {
            return one;
        }
        let of = |root: &u32| &self.receivers[*root as usize].bounds;
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
        self.above.push(Above { bounds: Bounds::new(low, high), children });
        (self.receivers.len() + self.above.len() - 1) as u32
    }
}

/// Receivers that one thread makes at once.
const CHUNK: usize = 256;
