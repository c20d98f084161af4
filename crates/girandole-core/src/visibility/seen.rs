//! Which receivers a camera may see.

use super::State;
use super::database::VisibilityDatabase;
use super::held::HeldPass;
use super::light_points::LightPoint;
use super::node_visibility::SceneContext;
use super::shapes::Apex;
use super::sources::Sources;
use super::state_matrix::StateMatrix;
use crate::parallel::map;
use crate::scene::{LocalView, NONE};
use glam::{Vec2, Vec3};
use std::ops::Range;

impl VisibilityDatabase {
    /// For each leaf, whether a view may show some of it: not where it lies outside of the view's pyramid, faces away, or is hidden
    /// as a whole by one static polygon. For the latter the eye is a light in the sense of this module, whose light ends where the view
    /// begins; views that are parallel or cut off what is near look past polygons, and none hides anything from them.
    pub fn seen_leaves(&self, view: &LocalView) -> Vec<bool> {
        let leaves = &self.receivers().leaves;
        let mut seen: Vec<bool> = leaves.iter().map(|leaf| meets(view, leaf.center, leaf.radius)).collect();
        let is_cut = view.clip.near > 0.0 || view.depth.is_some() || view.orthographic;
        if is_cut {
            return seen;
        }
        let eye = Apex { position: view.eye.as_dvec3(), normal: view.forward.as_dvec3(), finite: true };
        let states = self.states_of(&eye);
        for (leaf, seen) in leaves.iter().zip(&mut seen) {
            *seen &= !self.is_hidden(leaf.node as usize, &states, &eye);
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

    /// Whether a node faces away from an eye, or a polygon hides all of it. Polygons with one side hide nothing from behind.
    fn is_hidden(&self, mut node: usize, states: &StateMatrix, eye: &Apex) -> bool {
        if states.row(node)[0] != State::Full {
            return false;
        }
        let nodes = &self.receivers().nodes;
        loop {
            if let Some((group, _)) = states.decider(node, 0) {
                let hides = |blocker: u32| {
                    let patch = self.surfaces.patches.get(blocker as usize);
                    patch.is_some_and(|p| p.double_sided || eye.is_in_front(p.normal, p.offset))
                };
                return self.groups.members(group).into_iter().all(hides);
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
