//! Boxes about what moved, in a tree: where a light's map is stale already as far as all boxes in a part of it reach, none of these is looked
//! at.

use super::bounds::{Bounds, BoundsTree, sort_by_place};
use super::map_view::{MapView, TexelRect};
use girandole_core::scene::ObjectId;

/// Boxes about objects.
#[derive(Debug, Default)]
pub(crate) struct MovedBoxes {
    objects: Vec<ObjectId>,
    tree: BoundsTree,
}

impl MovedBoxes {
    pub fn new(boxes: &[(ObjectId, Bounds)]) -> Self {
        let mut order: Vec<_> = boxes.iter().enumerate().map(|(i, (_, bounds))| (bounds.center, i)).collect();
        sort_by_place(&mut order, 1);
        let (objects, bounds): (Vec<_>, Vec<_>) = order.into_iter().map(|(_, i)| boxes[i]).unzip();
        Self { objects, tree: BoundsTree::new(&bounds) }
    }

    /// What becomes stale of a map of which a part is stale already; objects that are hidden from its light change nothing.
    pub fn stale(&self, map: &MapView, stale: TexelRect, is_hidden: impl Fn(ObjectId) -> bool) -> TexelRect {
        let mut result = stale;
        self.tree.visit((), &mut |(), bounds, range| {
            let with = result.union(&map.covered(bounds));
            if range.len() == 1 && !is_hidden(self.objects[range.start]) {
                result = with;
            }
            (with != result).then_some(())
        });
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
            let map = MapView { light: &light, size: SIZE, is_octahedral: true };
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
            assert_eq!(MovedBoxes::new(&boxes).stale(&map, stale, is_hidden), all, "case {case}");
            // The controls: hidden ones count, and not all of the map is stale.
            let with_hidden = MovedBoxes::new(&boxes).stale(&map, stale, |_| false);
            smaller += u32::from(all != with_hidden);
            shown += u32::from(!all.is_empty() && all != TexelRect::whole(SIZE));
        }
        assert!(smaller > 5 && shown > 20, "{smaller} {shown}");
    }
}
