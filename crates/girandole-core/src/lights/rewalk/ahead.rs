//! Where a moving camera will be: samples that it will need are to stand before it sees them.

use super::IncrementalWalk;
use crate::scene::{NONE, View};
use crate::trace::SceneTracer;
use glam::Vec2;

/// Frames that one looks ahead. A second at 30 frames a second: about as long as it takes samples to come and go.
const LEAD: f32 = 30.0;
/// Share of the way to what is ahead that the camera will not pass.
const KEPT_OFF: f32 = 0.1;

impl IncrementalWalk {
    /// Takes note of views, and tells what will be seen around the places that they are on their way to: whoever goes into a room
    /// may turn there.
    pub(super) fn look_ahead(&mut self, tracer: &SceneTracer, views: &[View]) -> Vec<View> {
        let frames = (self.frame - self.placed).max(1) as f32;
        let before = std::mem::replace(&mut self.views, views.to_vec());
        self.placed = self.frame;
        let pairs = views.iter().zip(&before).filter(|(view, _)| !view.orthographic);
        pairs.flat_map(|(view, before)| around(&arrived(tracer, before, view, LEAD / frames))).collect()
    }
}

/// A view that goes on as from one to the other, so many times as far, but into nothing.
fn arrived(tracer: &SceneTracer, before: &View, view: &View, times: f32) -> View {
    let way = (view.eye - before.eye).as_vec3() * times;
    let eye = view.relative_to(tracer.geometry().origin).eye;
    let free = match tracer.closest_hit(eye, way, 1.0, NONE) {
        Some(hit) => hit.t * (1.0 - KEPT_OFF),
        None => 1.0,
    };
    View { eye: view.eye + (way * free).as_dvec3(), ..*view }
}

/// Four views all around.
fn around(view: &View) -> [View; 4] {
    let View { right, forward, .. } = *view;
    let sides = [(right, forward), (-forward, right), (-right, -forward), (forward, -right)];
    sides.map(|(right, forward)| View { right, forward, half_extent: Vec2::ONE, center: Vec2::ZERO, ..*view })
}
