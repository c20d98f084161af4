//! Which receivers a camera may see.

use super::database::VisibilityDatabase;
use super::primitives::clip;
use super::shapes::Apex;
use super::surfaces::SimplePatch;
use crate::parallel::map;
use crate::scene::{ClipDepth, LocalView, NONE};
use glam::{Vec2, Vec3};

/// Leaves that one thread looks at.
const LEAVES: usize = 32;

impl VisibilityDatabase {
    /// For each leaf, whether a view may show some of it: not where it lies outside of the view's pyramid, faces away, or static polygons
    /// hide all of it. Polygons that a view may cut off hide nothing from it, and none does from parallel views. What is not
    /// determined counts as seen.
    pub fn seen_leaves(&self, view: &LocalView) -> Vec<bool> {
        let leaves = &self.receivers().leaves;
        let mut seen: Vec<bool> = leaves.iter().map(|leaf| meets(view, leaf.center, leaf.radius)).collect();
        if view.orthographic {
            return seen;
        }
        // A light in the sense of this module.
        let eye = Apex { position: view.eye.as_dvec3(), normal: view.forward.as_dvec3(), finite: true };
        let cut = cut_off(view);
        let candidates: Vec<u32> = (0..leaves.len() as u32).filter(|leaf| seen[*leaf as usize]).collect();
        let chunks: Vec<&[u32]> = candidates.chunks(LEAVES).collect();
        let are_seen = |leaves: &&[u32]| {
            let mut cutter = self.cutter();
            let hides = |_: u32, patch: &SimplePatch| hides(patch, &eye, cut);
            let mut is_seen =
                |leaf: &u32| self.leaf_shape(*leaf).is_none_or(|shape| !cutter.hides(&eye, shape, hides));
            leaves.iter().map(&mut is_seen).collect::<Vec<bool>>()
        };
        let found = map(&chunks, are_seen);
        for (&leaf, is_seen) in candidates.iter().zip(found.into_iter().flatten()) {
            seen[leaf as usize] = is_seen;
        }
        seen
    }

    /// The corners of a polygon that holds all that a view may show of a leaf, if the leaf is a part of a patch; there are none where it
    /// shows nothing.
    pub fn seen_polygon(&self, leaf: u32, view: &LocalView) -> Option<Vec<Vec3>> {
        let receivers = self.receivers();
        let node = receivers.leaves[leaf as usize].node;
        let corners = if node == NONE { &[][..] } else { receivers.node_corners(node) };
        if corners.is_empty() {
            return None;
        }
        let half = half_about_axis(view) * 1.01;
        let [eye, forward] = [view.eye, view.forward].map(Vec3::as_dvec3);
        let sides = [(view.right, half.x), (-view.right, half.x), (view.up, half.y), (-view.up, half.y)];
        let (mut polygon, mut rest) = (corners.to_vec(), Vec::new());
        for (outward, half) in sides {
            let (outward, half) = (outward.as_dvec3(), f64::from(half));
            let (normal, room) =
                if view.orthographic { (-outward, half) } else { (forward * half - outward, 0.0) };
            clip(&polygon, &mut rest, normal, normal.dot(eye) - room);
            std::mem::swap(&mut polygon, &mut rest);
        }
        Some(polygon.iter().map(|corner| corner.as_vec3()).collect())
    }
}

/// Half of what a view shows to either side and up and down, about its axis, so that views off it are within.
fn half_about_axis(view: &LocalView) -> Vec2 {
    view.half_extent * (Vec2::ONE + view.center.abs())
}

/// Whether a polygon hides what is behind it: not from behind if it has one side, nor if it may be cut off.
pub(super) fn hides(patch: &SimplePatch, eye: &Apex, cut: f64) -> bool {
    let height = patch.plane.height(eye.position);
    height > cut || patch.double_sided && height < -cut
}

/// How far from the eye the near plane of a view in perspective may cut off what it shows, metres.
pub(super) fn cut_off(view: &LocalView) -> f64 {
    let of_depth = |depth: ClipDepth| depth.factor / (f32::from(u8::from(depth.factor > 0.0)) - depth.offset);
    let near = view.depth.map_or(view.clip.near, of_depth);
    let half = half_about_axis(view);
    f64::from(near * half.extend(1.0).length() * 1.001)
}

/// Whether a sphere meets a view's pyramid.
fn meets(view: &LocalView, center: Vec3, radius: f32) -> bool {
    let half = half_about_axis(view);
    let d = center - view.eye;
    let (depth, across) = (d.dot(view.forward), Vec2::new(d.dot(view.right), d.dot(view.up)).abs());
    if view.orthographic {
        return across.cmple(half + radius).all();
    }
    let slant = (Vec2::ONE + half * half).map(f32::sqrt);
    depth >= -radius && (across - half * depth).cmple(slant * radius).all()
}
