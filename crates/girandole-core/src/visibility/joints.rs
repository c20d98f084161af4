//! Where static polygons stand on a receiver or against it. A texel of a shadow map that shows the receiver on the light's side of such a
//! joint may be looked up from the other side: there the texels beside it have to be asked, too.

use super::cover::is_beyond;
use super::database::VisibilityDatabase;
use super::primitives::Tolerance;
use super::shapes::{Apex, PatchPlane, Shape};
use super::surfaces::SimplePatch;
use crate::lights::LightSample;
use crate::scene::NONE;
use glam::DVec3;

/// A static polygon that touches a leaf from border to border.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    polygon: SimplePatch,
    /// The leaf's corners and its middle.
    points: Vec<DVec3>,
    tolerance: Tolerance,
}

impl Joint {
    /// Whether the polygon hides a corner of the leaf, or its middle, from a light.
    pub fn is_between(&self, light: &LightSample) -> bool {
        let apex = Apex::new(light);
        self.points.iter().any(|point| is_beyond(&self.polygon, &apex, *point, &self.tolerance))
    }
}

impl VisibilityDatabase {
    /// The joints of a leaf that is a part of a static patch; none of others, which are clusters of triangles or may move. What ends on a leaf, as
    /// a leg of a table, is none.
    pub fn joints(&self, leaf: u32) -> Vec<Joint> {
        let (surfaces, groups) = (&self.surfaces, &self.groups);
        if leaf >= self.first_dynamic_leaf() {
            return Vec::new();
        }
        let Some(shape @ Shape::Patch { corners, plane }) = self.leaf_shape(leaf) else {
            return Vec::new();
        };
        let tolerance = shape.tolerance(&surfaces.tolerance);
        let near = tolerance.side;
        let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let points: Vec<DVec3> = corners.iter().copied().chain([middle]).collect();
        let low = corners.iter().copied().fold(DVec3::INFINITY, DVec3::min) - near;
        let high = corners.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max) + near;
        let is_apart = |l: DVec3, h: DVec3| l.cmpgt(high).any() || h.cmplt(low).any();
        let mut found = Vec::new();
        let mut open: Vec<u32> = (!groups.is_empty()).then_some(0).into_iter().collect();
        while let Some(index) = open.pop() {
            let node = &groups.nodes[index as usize];
            if node.mesh != NONE || is_apart(node.low, node.high) {
                continue;
            }
            if node.count == 0 {
                open.extend([node.first, node.first + 1]);
                continue;
            }
            let items = &groups.items[node.first as usize..(node.first + node.count) as usize];
            for patch in items.iter().filter_map(|&blocker| surfaces.patches.get(blocker as usize)) {
                let heights = || patch.corners.iter().map(|corner| plane.height(*corner));
                let is_flush = heights().all(|height| height.abs() <= near);
                if is_apart(patch.low, patch.high) || is_flush {
                    continue;
                }
                let along = plane.normal.cross(patch.plane.normal).normalize_or_zero();
                let of_patch = contact(&patch.corners, &plane, near, along);
                let of_leaf = contact(corners, &patch.plane, near, along);
                let reaches = |([a, b], [c, d]): &([f64; 2], [f64; 2])| *a <= c + near && *b >= d - near;
                if of_patch.zip(of_leaf).filter(reaches).is_some() {
                    found.push(Joint { polygon: patch.clone(), points: points.clone(), tolerance });
                }
            }
        }
        found
    }
}

/// How far a polygon's border reaches along a direction within so much of a plane, if it does at all.
fn contact(corners: &[DVec3], plane: &PatchPlane, near: f64, along: DVec3) -> Option<[f64; 2]> {
    let mut range: Option<[f64; 2]> = None;
    for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        let [from, to] = [a, b].map(|corner| plane.height(*corner));
        let at = |height: f64| if from == to { 0.0 } else { ((height - from) / (to - from)).clamp(0.0, 1.0) };
        for t in [0.0, at(-near), at(near), 1.0] {
            if (from + t * (to - from)).abs() <= near * (1.0 + 1e-9) {
                let place = along.dot(a.lerp(*b, t));
                let [low, high] = range.unwrap_or([place; 2]);
                range = Some([low.min(place), high.max(place)]);
            }
        }
    }
    range
}
