//! Watches what is seen while samples come and go: nowhere may it change by more than a little in a frame.
//!
//! 1. Points are watched all over the views' pictures, on all surfaces that are seen in these, however small a part of a picture
//!    they are in, and where those samples light that change.
//! 2. Close to a sample, and where one sample goes for another, what changes differs from point to point: where the sum over single
//!    samples is large, points close by are watched as well, and so is what those samples light most that go on in this frame
//!    (`slots/steps.rs`).

use super::IncrementalWalk;
use crate::lights::view_points::{ViewPoint, lit_points, points_around, spread, view_points};
use crate::lights::{LightSample, importance};
use crate::scene::{Geometry, Scene, View};
use crate::trace::SceneTracer;
use glam::Vec3;

/// Points that views see, at which what comes and goes must not be seen to do so: enough that few pixels differ from them all.
const WATCHED: usize = 8192;
/// As many as that where many samples come and go, and each of them changes little: pairs of samples and points, and points at least.
const WATCHED_PAIRS: usize = 1_000_000;
const LEAST_WATCHED: usize = 512;
/// They are chosen among so many: what is seen through a gap must be among them.
const LOOKED_AT: u32 = 16384;
/// Rays that look for points that are lit by samples that change: in all, of those that are to change and of those that do; and of
/// each at least and at most. What is seen of a ceiling through a gap may be lit more than all else.
const LIT_RAYS: [u32; 2] = [4096, 16384];
const LEAST_LIT: u32 = 8;
const MOST_LIT: u32 = 512;
/// Points close to one that changes much, and how much closer the next ones are.
const CLOSE_POINTS: u32 = 4;
const CLOSER: f32 = 0.4;
/// After this many times the frames of a fade what moved has come through: then only what is seen of it counts.
const HURRY: u32 = 6;

impl IncrementalWalk {
    /// Lets samples come and go as far as what is seen may change in a frame.
    pub(super) fn advance(&mut self, scene: &Scene, geometry: &Geometry) {
        let is_watched = !self.views.seen.is_empty() && !self.slots.is_settled();
        let tracer = is_watched.then(|| self.hierarchies.tracer(scene, geometry));
        let brightness = self.sampling.importance.brightness;
        let in_hurry =
            self.placements.moved.is_some_and(|moved| self.frame - moved <= HURRY * self.pace.fade);
        let mut points: Vec<ViewPoint> = Vec::new();
        let (mut reach, mut is_lit) = (0.0, false);
        self.slots.advance(in_hurry, |changes, around| {
            let tracer = tracer.as_ref()?;
            let before = points.len();
            if let Some(around) = around {
                let parents = around.iter().map(|&point| &points[point]);
                let more = points_around(tracer, &self.views.seen, parents, (CLOSE_POINTS, reach));
                points.extend(more);
                if !is_lit {
                    let lit = most_lit_points(tracer, &self.views.seen, changes, LIT_RAYS[1]);
                    points.extend(lit.take(most_watched(changes.len())));
                    is_lit = true;
                }
                reach *= CLOSER;
            } else {
                points = watched_points(tracer, &self.views.seen, changes);
                // As far apart as they are.
                reach = 2.0 / (points.len() as f32).sqrt();
            }
            let is_seen = brightness > 0.0 && !points.is_empty();
            is_seen.then(|| importance::brought(tracer, &points[before..], changes, brightness))
        });
    }
}

/// Points that are watched where so many samples change.
fn most_watched(changes: usize) -> usize {
    (WATCHED_PAIRS / changes.max(1)).clamp(LEAST_WATCHED, WATCHED)
}

/// Points that views see: everywhere in their pictures and on surfaces, and where samples light that change.
fn watched_points(tracer: &SceneTracer, views: &[View], changes: &[(LightSample, Vec3)]) -> Vec<ViewPoint> {
    let most = most_watched(changes.len());
    let mut points = view_points(tracer, views, LOOKED_AT);
    let rest = points.split_off(points.len().min(most / 2));
    points.extend(spread(rest, most / 4));
    points.extend(most_lit_points(tracer, views, changes, LIT_RAYS[0]).take(most / 4));
    points
}

/// Points that views see and that samples light most, those first whose sample changes most.
fn most_lit_points<'a>(
    tracer: &'a SceneTracer,
    views: &'a [View],
    changes: &[(LightSample, Vec3)],
    rays: u32,
) -> impl Iterator<Item = ViewPoint> + 'a {
    let mut order = changes.to_vec();
    order.sort_by(|a, b| b.1.abs().max_element().total_cmp(&a.1.abs().max_element()));
    let rays = (rays / changes.len().max(1) as u32).clamp(LEAST_LIT, MOST_LIT);
    order.into_iter().flat_map(move |(sample, _)| lit_points(tracer, views, &sample, rays))
}
