//! A binary tree over sources, halved in power along the longest axis of their centres, turns one point of the unit square into a
//! source and a point of it, splitting u and v in turn (hierarchical warping, Clarberg et al. 2005, §3): points that are well spread
//! in the square stay so over many small sources.

use super::emitters::Source;
use glam::{DVec2, Vec3};

/// A map from the unit square to sources in proportion to their weights.
pub(super) struct SourceTree {
    sources: Vec<Source>,
    /// Inner nodes: share of the first child; children (≥ 0: a node, < 0: source −1 − child).
    nodes: Vec<(f64, [i64; 2])>,
    total: f64,
}

impl SourceTree {
    /// Builds the tree; `None` without sources.
    pub fn new(mut sources: Vec<Source>) -> Option<Self> {
        let total = sources.iter().map(|s| s.weight).sum::<f64>();
        let mut nodes = Vec::new();
        if sources.is_empty() {
            return None;
        }
        // Ranges of sources still to be split, with their parent's node and side.
        let mut open = vec![(0, sources.len(), None::<(usize, usize)>)];
        while let Some((start, end, parent)) = open.pop() {
            let child = if end - start == 1 {
                -1 - start as i64
            } else {
                let range = &mut sources[start..end];
                let (share, middle) = halve(range);
                nodes.push((share, [0, 0]));
                let node = nodes.len() - 1;
                open.push((start + middle, end, Some((node, 1))));
                open.push((start, start + middle, Some((node, 0))));
                node as i64
            };
            if let Some((node, side)) = parent {
                nodes[node].1[side] = child;
            }
        }
        Some(Self { sources, nodes, total })
    }

    /// A source in proportion to weight, and the point remapped to the unit square: uniform again.
    pub fn choose(&self, at: DVec2) -> (&Source, DVec2) {
        const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;
        let mut at = at.to_array();
        let mut node = if self.nodes.is_empty() { -1 } else { 0 };
        let mut depth = 0;
        while node >= 0 {
            let (share, children) = self.nodes[node as usize];
            let s = &mut at[depth & 1];
            let second = *s >= share;
            *s = if second { (*s - share) / (1.0 - share) } else { *s / share }.clamp(0.0, BELOW_ONE);
            node = children[usize::from(second)];
            depth += 1;
        }
        (&self.sources[(-1 - node) as usize], DVec2::from_array(at))
    }

    /// What there is to choose.
    pub fn sources(&self) -> &[Source] {
        &self.sources
    }

    /// By source, the part of the unit square that chooses it: lower corner and size.
    pub fn places(&self) -> Vec<[DVec2; 2]> {
        let mut result = vec![[DVec2::ZERO, DVec2::ONE]; self.sources.len()];
        let mut open =
            if self.nodes.is_empty() { Vec::new() } else { vec![(0, [DVec2::ZERO, DVec2::ONE], 0)] };
        while let Some((node, [low, size], depth)) = open.pop() {
            if node < 0 {
                result[(-1 - node) as usize] = [low, size];
                continue;
            }
            let (share, children) = self.nodes[node as usize];
            let along = if depth & 1 == 0 { DVec2::X } else { DVec2::Y };
            let first = [low, size - size * along * (1.0 - share)];
            let second = [low + size * along * share, size - size * along * share];
            open.extend([(children[0], first, depth + 1), (children[1], second, depth + 1)]);
        }
        result
    }

    /// The power of all sources by luminance, watts.
    pub fn power(&self) -> f64 {
        self.total
    }

    /// The probability of a source.
    pub fn probability(&self, source: &Source) -> f64 {
        source.weight / self.total
    }
}

/// Sorts sources along the longest axis of their centres and finds where to split them: the first part's share of
/// the weight, and its length (at least 1, and less than all).
fn halve(sources: &mut [Source]) -> (f64, usize) {
    let low = sources.iter().fold(Vec3::INFINITY, |m, s| m.min(s.center));
    let high = sources.iter().fold(Vec3::NEG_INFINITY, |m, s| m.max(s.center));
    let size = high - low;
    let axis = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
    sources.sort_by(|a, b| a.center[axis].total_cmp(&b.center[axis]));
    let total: f64 = sources.iter().map(|s| s.weight).sum();
    let mut first = 0.0;
    for (i, source) in sources[..sources.len() - 1].iter().enumerate() {
        let next = first + source.weight;
        if next >= total * 0.5 || i + 2 == sources.len() {
            // Whichever cut is nearer to the middle, if there is a choice.
            return if i > 0 && total * 0.5 - first < next - total * 0.5 {
                (first / total, i)
            } else {
                (next / total, i + 1)
            };
        }
        first = next;
    }
    (0.5, sources.len() / 2)
}
