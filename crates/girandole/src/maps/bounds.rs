//! Boxes, and trees of them.

use girandole_core::glam::Vec3;
use std::ops::Range;

/// An axis-aligned box in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub center: Vec3,
    pub half_extent: Vec3,
}

impl Bounds {
    /// The smallest one about points; at least one.
    pub fn around(points: impl Iterator<Item = Vec3>) -> Self {
        let (low, high) =
            points.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        Self { center: (low + high) * 0.5, half_extent: (high - low) * 0.5 }
    }

    /// The smallest one about others; at least one.
    pub fn about<'a>(others: impl Iterator<Item = &'a Self>) -> Self {
        Self::around(others.flat_map(|b| [b.center - b.half_extent, b.center + b.half_extent]))
    }
}

/// Orders items by place so that neighbours lie close together: halves them, at a multiple of `granule`, across the longest axis, until no
/// more than so many are left.
pub(crate) fn sort_by_place<T: Ord>(items: &mut [(Vec3, T)], granule: usize) {
    let granules = items.len().div_ceil(granule);
    if granules < 2 {
        return;
    }
    let axis = Bounds::around(items.iter().map(|item| item.0)).half_extent.max_position();
    let middle = granules / 2 * granule;
    items.select_nth_unstable_by(middle, |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
    let (low, high) = items.split_at_mut(middle);
    sort_by_place(low, granule);
    sort_by_place(high, granule);
}

/// Boxes in an order in which neighbours lie close together, and boxes about all of them and about each half, down to single ones.
#[derive(Debug, Default)]
pub(crate) struct BoundsTree {
    /// That about a range, then those of its first half, then those of its second.
    nodes: Vec<Bounds>,
}

impl BoundsTree {
    pub fn new(boxes: &[Bounds]) -> Self {
        let mut nodes = Vec::with_capacity(2 * boxes.len());
        if !boxes.is_empty() {
            build(boxes, &mut nodes);
        }
        Self { nodes }
    }

    /// How many boxes.
    pub fn len(&self) -> usize {
        self.nodes.len().div_ceil(2)
    }

    /// Visits boxes about ranges of boxes, from the whole down. What a visit returns, those of both halves are given; where that is nothing,
    /// they are not visited.
    pub fn visit<S: Copy>(&self, state: S, visit: &mut impl FnMut(S, &Bounds, Range<usize>) -> Option<S>) {
        if !self.nodes.is_empty() {
            self.descend(0, 0..self.len(), state, visit);
        }
    }

    fn descend<S: Copy>(
        &self,
        node: usize,
        range: Range<usize>,
        state: S,
        visit: &mut impl FnMut(S, &Bounds, Range<usize>) -> Option<S>,
    ) {
        let Some(state) = visit(state, &self.nodes[node], range.clone()) else { return };
        let half = range.len() / 2;
        if half > 0 {
            let middle = range.start + half;
            self.descend(node + 1, range.start..middle, state, visit);
            self.descend(node + 2 * half, middle..range.end, state, visit);
        }
    }
}

fn build(boxes: &[Bounds], nodes: &mut Vec<Bounds>) -> Bounds {
    let at = nodes.len();
    nodes.push(boxes[0]);
    if boxes.len() > 1 {
        let (first, second) = boxes.split_at(boxes.len() / 2);
        let halves = [build(first, nodes), build(second, nodes)];
        nodes[at] = Bounds::about(halves.iter());
    }
    nodes[at]
}
