//! Hierarchies as kernels of the renderer walk them: eight children a node, boxes in bytes (Ylitie, Karras and Laine 2017, section 3).

use super::hierarchy::{aabb, balanced_wide, depth, wide};
use crate::slices::complete;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::node::CwBvhNode;

/// A node of a [`WideHierarchy`]: 20 words.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct WideNode {
    /// What boxes of children are relative to.
    pub origin: Vec3,
    /// Units of their coordinates in x, y and z, as exponents of floats; which children are nodes, a bit each.
    pub units: [u8; 4],
    /// The first of the children that are nodes; they follow one another.
    pub first_node: u32,
    /// Where the boxes that it holds by itself begin in [`WideHierarchy::boxes`].
    pub first_box: u32,
    /// Of each child: 001 and 24 + its place for a node; how many boxes, in unary, and the first of them for others; 0 for none.
    pub children: [u8; 8],
    /// Smallest and largest x of the children's boxes, y, and z.
    pub bounds: [[u8; 8]; 6],
}

/// A bounding volume hierarchy with eight children a node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WideHierarchy {
    /// From the root; none where there are no boxes. Children come after their parents.
    pub nodes: Vec<WideNode>,
    /// Indices of boxes, node by node.
    pub boxes: Vec<u32>,
}

impl WideHierarchy {
    /// Over boxes, each with its smallest and its largest corner, with `levels` of nodes at most; nothing where not even a balanced one
    /// has so few.
    pub fn over(boxes: &[(Vec3, Vec3)], levels: usize) -> Option<Self> {
        let boxes: Vec<Aabb> = boxes.iter().map(|&(low, high)| aabb(low, high)).collect();
        if boxes.is_empty() {
            return Some(Self::default());
        }
        let build = BvhBuildParams::medium_build();
        let mut tree = complete(wide(&boxes, &build));
        if depth(&tree) > levels {
            tree = balanced_wide(&boxes, &build);
        }
        let is_possible = depth(&tree) <= levels;
        let CwBvh { nodes, primitive_indices, .. } = tree;
        let nodes = nodes.iter().map(WideNode::from).collect();
        is_possible.then_some(Self { nodes, boxes: primitive_indices })
    }

    /// The same tree over other boxes, as many as before.
    pub fn refit(&mut self, boxes: &[(Vec3, Vec3)]) {
        let mut bounds = vec![Aabb::empty(); self.nodes.len()];
        for at in (0..self.nodes.len()).rev() {
            let node = &mut self.nodes[at];
            let children: [Aabb; 8] = std::array::from_fn(|child| match node.child(child) {
                Child::None => Aabb::empty(),
                Child::Node(index) => bounds[index],
                Child::Boxes(range) => {
                    let of = self.boxes[range].iter().map(|&i| boxes[i as usize]);
                    of.fold(Aabb::empty(), |all, (low, high)| all.union(&aabb(low, high)))
                }
            });
            bounds[at] = children.iter().fold(Aabb::empty(), |all, child| all.union(child));
            node.hold(&bounds[at], &children);
        }
    }
}

/// What a node has in one of its eight places.
enum Child {
    None,
    Node(usize),
    Boxes(std::ops::Range<usize>),
}

impl WideNode {
    fn child(&self, place: usize) -> Child {
        let (word, nodes) = (self.children[place], u32::from(self.units[3]));
        if word == 0 {
            return Child::None;
        }
        if nodes >> place & 1 == 1 {
            let before = nodes & ((1 << place) - 1);
            return Child::Node((self.first_node + before.count_ones()) as usize);
        }
        let first = (self.first_box + u32::from(word & 31)) as usize;
        Child::Boxes(first..first + (word >> 5).count_ones() as usize)
    }

    /// Takes other boxes of its children, all of them in `whole`.
    fn hold(&mut self, whole: &Aabb, children: &[Aabb; 8]) {
        self.origin = whole.min.to_array().into();
        let extent = whole.max - whole.min;
        for axis in 0..3 {
            // The least power of two of which 255 are enough, and a little more for rounding.
            let exponent =
                libm::ceilf(libm::log2f((extent[axis] * 1.000_001 / 255.0).max(f32::MIN_POSITIVE)));
            let unit = libm::exp2f(exponent);
            self.units[axis] = (unit.to_bits() >> 23) as u8;
            for (place, child) in children.iter().enumerate().filter(|(_, child)| child.min.x <= child.max.x)
            {
                let of = |v: f32| (v - self.origin[axis]) / unit;
                self.bounds[2 * axis][place] = libm::floorf(of(child.min[axis])).clamp(0.0, 255.0) as u8;
                self.bounds[2 * axis + 1][place] = libm::ceilf(of(child.max[axis])).clamp(0.0, 255.0) as u8;
            }
        }
    }
}

impl From<&CwBvhNode> for WideNode {
    fn from(node: &CwBvhNode) -> Self {
        let [x, y, z] = node.e;
        Self {
            origin: node.p.to_array().into(),
            units: [x, y, z, node.imask],
            first_node: node.child_base_idx,
            first_box: node.primitive_base_idx,
            children: node.child_meta,
            bounds: [
                node.child_min_x,
                node.child_max_x,
                node.child_min_y,
                node.child_max_y,
                node.child_min_z,
                node.child_max_z,
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn boxes(count: usize, shift: f32) -> Vec<(Vec3, Vec3)> {
        let number = |i: usize, k: f32| (i as f32 * k + shift).sin() * 10.0;
        (0..count)
            .map(|i| {
                let low = Vec3::new(number(i, 1.3), number(i, 2.7), number(i, 5.1));
                (low, low + Vec3::new(0.3, 0.1, 0.7) * (1.0 + number(i, 0.7).abs()))
            })
            .collect()
    }

    /// Whether each box is below a node in whose children's boxes it lies, all the way down.
    fn holds(hierarchy: &WideHierarchy, boxes: &[(Vec3, Vec3)]) -> bool {
        let mut met = vec![0; boxes.len()];
        let everywhere = (Vec3::NEG_INFINITY, Vec3::INFINITY);
        let mut waiting = if hierarchy.nodes.is_empty() { Vec::new() } else { vec![(0, everywhere)] };
        let mut is_in = true;
        while let Some((at, (above_low, above_high))) = waiting.pop() {
            let node = &hierarchy.nodes[at];
            for place in 0..8 {
                let corner = |side: usize| {
                    let of = |axis: usize| {
                        let unit = f32::from_bits(u32::from(node.units[axis]) << 23);
                        node.origin[axis] + f32::from(node.bounds[2 * axis + side][place]) * unit
                    };
                    Vec3::new(of(0), of(1), of(2))
                };
                let low = (corner(0) - 1e-5).max(above_low);
                let high = (corner(1) + 1e-5).min(above_high);
                let is_inside = |(a, b): &(Vec3, Vec3)| low.cmple(*a).all() && b.cmple(high).all();
                match node.child(place) {
                    Child::None => {}
                    Child::Node(child) => waiting.push((child, (low, high))),
                    Child::Boxes(range) => {
                        for &index in &hierarchy.boxes[range] {
                            met[index as usize] += 1;
                            is_in &= is_inside(&boxes[index as usize]);
                        }
                    }
                }
            }
        }
        is_in && met.iter().all(|&n| n == 1)
    }

    #[test]
    fn every_box_lies_in_its_nodes() {
        for count in [0, 1, 2, 3, 20, 700] {
            let before = boxes(count, 0.0);
            let mut hierarchy = WideHierarchy::over(&before, 4).expect("four levels");
            assert!(holds(&hierarchy, &before), "{count}");
            let after = boxes(count, 0.9);
            // The control: where boxes have moved, the old hierarchy does not hold them.
            assert_eq!(holds(&hierarchy, &after), count == 0, "{count}");
            hierarchy.refit(&after);
            assert!(holds(&hierarchy, &after), "{count}");
            assert_eq!(WideHierarchy::over(&before, 1).is_none(), count > 3, "{count}");
        }
    }
}
