//! Boxes about what moved, in a tree: where a light's map is stale already as far as a group of them reaches, none of the group
//! is looked at.

use super::map_view::{Bounds, MapView, TexelRect};
use girandole_core::scene::ObjectId;
use std::ops::Range;

/// Boxes that are not divided further.
const GROUP: usize = 4;

/// Boxes about objects.
#[derive(Debug, Default)]
pub(crate) struct MovedBoxes {
    boxes: Vec<(ObjectId, Bounds)>,
    /// Of more than [`GROUP`] boxes each, those above before those below.
    groups: Vec<Group>,
}

#[derive(Debug)]
struct Group {
    bounds: Bounds,
    boxes: Range<usize>,
    /// The index after those of all groups below.
    end: usize,
}

impl MovedBoxes {
    pub fn new(boxes: Vec<(ObjectId, Bounds)>) -> Self {
        let mut result = Self { boxes, groups: Vec::new() };
        result.divide(0..result.boxes.len());
        result
    }

    /// Makes groups of these boxes, halved across their longest axis.
    fn divide(&mut self, range: Range<usize>) {
        if range.len() <= GROUP {
            return;
        }
        let members = &mut self.boxes[range.clone()];
        let bounds = Bounds::about(members.iter().map(|(_, bounds)| bounds));
        let axis = bounds.half_extent.max_position();
        let middle = members.len() / 2;
        members.select_nth_unstable_by(middle, |(a, of_a), (b, of_b)| {
            of_a.center[axis].total_cmp(&of_b.center[axis]).then(a.cmp(b))
        });
        let index = self.groups.len();
        let middle = range.start + middle;
        self.groups.push(Group { bounds, boxes: range.clone(), end: 0 });
        self.divide(range.start..middle);
        self.divide(middle..range.end);
        self.groups[index].end = self.groups.len();
    }

    /// What becomes stale of a map of which a part is stale already; objects that are hidden from its light change nothing.
    pub fn stale(&self, map: &MapView, stale: TexelRect, is_hidden: impl Fn(ObjectId) -> bool) -> TexelRect {
        let mut result = stale;
        let mark = |boxes: Range<usize>, result: &mut TexelRect| {
            for (object, bounds) in &self.boxes[boxes] {
                if !is_hidden(*object) {
                    *result = result.union(&map.covered(bounds));
                }
            }
        };
        let (mut index, mut next) = (0, 0);
        let whole = TexelRect::whole(map.size);
        while let Some(group) = self.groups.get(index) {
            // Those before it that belong to no group of their own.
            mark(next..group.boxes.start.max(next), &mut result);
            if result == whole {
                return result;
            }
            next = next.max(group.boxes.start);
            if result.union(&map.covered(&group.bounds)) == result {
                (index, next) = (group.end, group.boxes.end);
            } else {
                index += 1;
            }
        }
        mark(next..self.boxes.len(), &mut result);
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::Light;
    use girandole_core::glam::Vec3;
    use girandole_core::math::sequence;

    #[test]
    fn what_becomes_stale_is_what_all_boxes_cover() {
        const SIZE: u32 = 128;
        let number = |case: u32, what: u32| sequence::sample(case, 0, what) - 0.5;
        let vector = |case: u32, what: u32| Vec3::from([0, 1, 2].map(|i| number(case, 3 * what + i)));
        let (mut smaller, mut shown) = (0, 0);
        for case in 0..60 {
            let normal = vector(case, 0).normalize();
            let tangent = normal.any_orthonormal_vector();
            let light = Light { normal, tangent, position: vector(case, 1) * 3.0, ..Light::default() };
            let map = MapView::new(&light, SIZE, 4);
            let boxes: Vec<(ObjectId, Bounds)> = (0..case)
                .map(|i| (ObjectId(i), vector(case, 2 + i)))
                .map(|(id, at)| {
                    (id, Bounds { center: at * 4.0 + normal * 2.0, half_extent: Vec3::splat(0.05) })
                })
                .collect();
            let stale =
                if case % 2 == 0 { TexelRect::default() } else { TexelRect { first: [60; 2], end: [64; 2] } };
            let is_hidden = |object: ObjectId| object.0 % 5 == 3;
            let seen = boxes.iter().filter(|(object, _)| !is_hidden(*object));
            let all = seen.fold(stale, |rect, (_, bounds)| rect.union(&map.covered(bounds)));
            assert_eq!(MovedBoxes::new(boxes.clone()).stale(&map, stale, is_hidden), all, "case {case}");
            // The controls: hidden ones count, and not all of the map is stale.
            let with_hidden = MovedBoxes::new(boxes).stale(&map, stale, |_| false);
            smaller += u32::from(all != with_hidden);
            shown += u32::from(!all.is_empty() && all != TexelRect::whole(SIZE));
        }
        assert!(smaller > 5 && shown > 20, "{smaller} {shown}");
    }
}
