//! Where a moving camera will be: samples that it will need are to stand before it sees them.

use crate::scene::{NONE, View};
use crate::trace::SceneTracer;
use glam::{Vec2, Vec3};

/// Frames that one looks ahead: two seconds at 30 frames a second, in which samples go over to another room. In a building the
/// error where a walk comes into another room was 1.6 times that of a fresh set, with 45 frames 3.9 times.
const LEAD: f32 = 60.0;
/// Share of the way to what is ahead that the camera will not pass.
const KEPT_OFF: f32 = 0.1;
/// Share of that time in which it may as well have turned to either side.
const SOON: f32 = 0.33;

/// What samples are placed for.
#[derive(Clone, Debug, Default)]
pub(super) struct Views {
    /// What is seen, and as from which frame.
    pub seen: Vec<View>,
    pub placed: u32,
    /// What may be seen soon.
    pub ahead: Vec<View>,
    /// What will be seen, as far as that is known, and not guessed.
    pub to_come: Vec<View>,
    /// Whether views that do not move are known not to.
    pub is_still: bool,
}

impl Views {
    /// Takes note of views, and of what will be seen: around the places that they are on their way to, look at, or may turn to, unless
    /// it is known. Whoever goes into a room may turn there, too.
    pub fn go_on(&mut self, tracer: &SceneTracer, views: &[View], to_come: &[View], frame: u32) {
        let frames = (frame - self.placed).max(1) as f32;
        let before = std::mem::replace(&mut self.seen, views.to_vec());
        (self.placed, self.to_come) = (frame, to_come.to_vec());
        let pairs = views.iter().zip(&before).filter(|(view, _)| !view.orthographic);
        let of = |(view, before): (&View, &View)| {
            stations(tracer, view, (view.eye - before.eye).as_vec3() * (LEAD / frames))
        };
        self.ahead = match to_come {
            [] => pairs.flat_map(of).flat_map(|view| around(&view)).collect(),
            _ => to_come.to_vec(),
        };
    }
}

/// Where a view will be that is on its way: as far ahead as it goes or looks, and sooner also to either side of its way.
fn stations(tracer: &SceneTracer, view: &View, way: Vec3) -> Vec<View> {
    let gaze = view.forward * way.length();
    let aside = way.cross(view.up).normalize_or_zero() * way.length();
    let soon = [way, gaze, aside, -aside].map(|way| way * SOON);
    [way, gaze].into_iter().chain(soon).map(|way| arrived(tracer, view, way)).collect()
}

/// A view that goes on by so much, but into nothing.
fn arrived(tracer: &SceneTracer, view: &View, way: Vec3) -> View {
    if way == Vec3::ZERO {
        return *view;
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Geometry, Scene, builtin};
    use glam::DVec3;

    fn with_tracer(check: impl Fn(&SceneTracer, View)) {
        let scene: Scene = builtin::build("table", builtin::default_object("table")).expect("built in");
        let geometry = Geometry::new(&scene);
        let view = View::new(&scene, &scene.cameras[0], 1.0);
        check(&SceneTracer::new(&scene, &geometry), view);
    }

    #[test]
    fn one_arrives_before_walls_and_not_beyond() {
        with_tracer(|tracer, view| {
            let step = view.forward.as_dvec3() * 0.01;
            let then = arrived(tracer, &view, (step * 10.0).as_vec3());
            assert!(then.eye.abs_diff_eq(view.eye + step * 10.0, 1e-5), "{then:?}");
            let still = arrived(tracer, &view, Vec3::ZERO);
            assert_eq!(still, view);
            // Into a wall: all of the way but a little.
            let local = view.relative_to(tracer.geometry().origin);
            let wall = tracer.closest_hit(local.eye, local.forward, f32::INFINITY, NONE).expect("a wall");
            let then = arrived(tracer, &view, (step * 1e4).as_vec3());
            let gone = (then.eye - view.eye).length() as f32;
            assert!((gone / wall.t - 0.9).abs() < 1e-3, "{gone} of {}", wall.t);
        });
    }

    #[test]
    fn one_looks_ahead_along_the_way_along_the_gaze_and_to_both_sides() {
        with_tracer(|tracer, view| {
            let way = -0.3 * view.right;
            let gone =
                |way: Vec3| stations(tracer, &view, way).into_iter().map(|s| (s.eye - view.eye).as_vec3());
            let expected = [way, 0.3 * view.forward];
            let sides =
                [way, 0.3 * view.forward, way.cross(view.up), view.up.cross(way)].map(|way| way * SOON);
            for (gone, expected) in gone(way).zip(expected.into_iter().chain(sides)) {
                assert!(gone.abs_diff_eq(expected, 1e-5), "{gone} {expected}");
            }
            assert_eq!(gone(way).count(), 6);
            // The control: who stands still goes nowhere.
            assert!(gone(Vec3::ZERO).all(|gone| gone == Vec3::ZERO));
        });
    }

    #[test]
    fn all_around_is_every_direction_beside_the_horizon() {
        with_tracer(|_, view| {
            let views = around(&view);
            for angle in (0..16).map(|i| 0.4 * i as f32) {
                let direction = view.forward * angle.cos() + view.right * angle.sin();
                let point = view.relative_to(DVec3::ZERO).eye + direction;
                let sees = |view: &View| {
                    let (ndc, distance) = view.relative_to(DVec3::ZERO).project(point);
                    distance > 0.0 && ndc.abs().max_element() <= 1.001
                };
                assert!(views.iter().any(sees), "{angle}");
                assert!(!sees(&views[0]) || !sees(&views[2]));
            }
        });
    }
}
