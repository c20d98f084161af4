//! Which receivers a camera may see.

use super::cover::Cutter;
use super::database::VisibilityDatabase;
use super::shapes::Apex;
use super::surfaces::SimplePatch;
use crate::parallel::map;
use crate::scene::{ClipDepth, LocalView};
use glam::{Vec2, Vec3};

/// Leaves that one thread looks at.
const LEAVES: usize = 32;

impl VisibilityDatabase {
    /// For each leaf, whether a view may show some of it: not where it lies outside of the view's pyramid, faces away, or static polygons
    /// hide all of it. Polygons that a view may cut off hide nothing from it, and none does from parallel views.
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
            let mut cutter = Cutter::new();
            let hides = |_: u32, patch: &SimplePatch| hides(patch, &eye, cut);
            leaves.iter().map(|leaf| !cutter.hides(self, &eye, *leaf, hides)).collect::<Vec<bool>>()
        };
        let found = map(&chunks, are_seen);
        for (&leaf, is_seen) in candidates.iter().zip(found.into_iter().flatten()) {
            seen[leaf as usize] = is_seen;
        }
        seen
    }
}

/// Whether a polygon hides what is behind it: not from behind if it has one side, nor if it may be cut off.
fn hides(patch: &SimplePatch, eye: &Apex, cut: f64) -> bool {
    let height = patch.normal.dot(eye.position) - patch.offset;
    height > cut || patch.double_sided && height < -cut
}

/// How far from the eye the near plane of a view in perspective may cut off what it shows, metres.
fn cut_off(view: &LocalView) -> f64 {
    let of_depth = |depth: ClipDepth| depth.factor / (f32::from(u8::from(depth.factor > 0.0)) - depth.offset);
    let near = view.depth.map_or(view.clip.near, of_depth);
    let half = view.half_extent * (Vec2::ONE + view.center.abs());
    f64::from(near * half.extend(1.0).length() * 1.001)
}

/// Whether a sphere meets a view's pyramid.
fn meets(view: &LocalView, center: Vec3, radius: f32) -> bool {
    // About the axis, so that views off it are within.
    let half = view.half_extent * (Vec2::ONE + view.center.abs());
    let d = center - view.eye;
    let (depth, across) = (d.dot(view.forward), Vec2::new(d.dot(view.right), d.dot(view.up)).abs());
    if view.orthographic {
        return across.cmple(half + radius).all();
    }
    let slant = (Vec2::ONE + half * half).map(f32::sqrt);
    depth >= -radius && (across - half * depth).cmple(slant * radius).all()
}
