//! Which receivers a camera may see.

use super::State;
use super::cover::Cutter;
use super::database::VisibilityDatabase;
use super::held::HeldPass;
use super::light_points::LightPoint;
use super::node_visibility::SceneContext;
use super::shapes::Apex;
use super::sources::Sources;
use super::state_matrix::StateMatrix;
use super::surfaces::SimplePatch;
use crate::parallel::map;
use crate::scene::{ClipDepth, LocalView, NONE};
use glam::{Vec2, Vec3};
use std::ops::Range;

impl VisibilityDatabase {
    /// For each leaf, whether a view may show some of it: not where it lies outside of the view's pyramid, faces away, or static polygons
    /// hide all of it. The eye is a light in the sense of this module. Polygons that a view may cut off hide nothing from it, and none
    /// does from parallel views.
    pub fn seen_leaves(&self, view: &LocalView) -> Vec<bool> {
        let leaves = &self.receivers().leaves;
        let mut seen: Vec<bool> = leaves.iter().map(|leaf| meets(view, leaf.center, leaf.radius)).collect();
        if view.orthographic {
            return seen;
        }
        let eye = Apex { position: view.eye.as_dvec3(), normal: view.forward.as_dvec3(), finite: true };
        let states = self.states_of(&eye);
        let cut = cut_off(view);
        let candidates: Vec<u32> = (0..leaves.len() as u32)
            .filter(|leaf| seen[*leaf as usize])
            .filter(|leaf| !self.is_hidden(leaves[*leaf as usize].node as usize, &states, (&eye, cut)))
            .collect();
        seen.fill(false);
        let hides = |_: u32, patch: &SimplePatch| hides(patch, &eye, cut);
        let is_seen = |leaf: &u32| !Cutter::new().hides(self, &eye, *leaf, hides);
        for (&leaf, is_seen) in candidates.iter().zip(map(&candidates, is_seen)) {
            seen[leaf as usize] = is_seen;
        }
        seen
    }

    /// The states of all nodes for one apex, and what static blockers decide them.
    fn states_of(&self, apex: &Apex) -> StateMatrix {
        let is_outside = self.groups.is_outside(apex);
        let points = [LightPoint { apex: *apex, own: NONE, is_outside }];
        let context = SceneContext { surfaces: &self.surfaces, lights: &points, blockers: &self.groups };
        let pass = HeldPass { context: &context, receivers: &self.assembly.receivers };
        let roots = self.assembly.receivers.roots();
        let parts = map(&self.sources_with_roots(&roots), |&of_sources| pass.run(of_sources, None).0);
        parts.into_iter().fold(StateMatrix::new(1), |mut all, part| {
            all.append(part);
            all
        })
    }

    /// Static surfaces and those of each dynamic object, with the roots of their receivers.
    fn sources_with_roots<'a>(&'a self, roots: &'a [Range<usize>]) -> Vec<(&'a Sources, &'a [Range<usize>])> {
        let mut rest = roots;
        let all = std::iter::once(&self.sources).chain(self.segments.iter().map(|segment| &segment.sources));
        all.map(|sources| {
            let (own, others) = rest.split_at(sources.roots().len());
            rest = others;
            (sources, own)
        })
        .collect()
    }

    /// Whether a node faces away from an eye, or a polygon hides all of it that is not within a distance of the eye. Polygons with one side
    /// hide nothing from behind.
    fn is_hidden(&self, mut node: usize, states: &StateMatrix, (eye, cut): (&Apex, f64)) -> bool {
        if states.row(node)[0] != State::Full {
            return false;
        }
        let nodes = &self.receivers().nodes;
        loop {
            if let Some((group, _)) = states.decider(node, 0) {
                let patch = |blocker: u32| self.surfaces.patches.get(blocker as usize);
                let members = self.groups.members(group);
                return members.into_iter().all(|b| patch(b).is_some_and(|patch| hides(patch, eye, cut)));
            }
            // Below a full blocker nothing is tested again.
            let parent = nodes[node].parent;
            if parent == NONE || states.row(parent as usize)[0] != State::Full {
                return true;
            }
            node = parent as usize;
        }
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
