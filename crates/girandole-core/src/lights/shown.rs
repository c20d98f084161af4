//! What shadow maps of an environment's light show: what views see, in maps of ordinary size.

use super::{LightSample, Profile};
use crate::scene::{Geometry, View};
use crate::trace::SceneTracer;
use glam::{Vec2, Vec3};

/// Rays that look for what is seen, of all views and of each at least.
const RAYS: u32 = 4096;
const LEAST_RAYS: u32 = 64;
/// What is seen may be larger by this factor before others are made.
const MARGIN: f32 = 1.25;
/// Maps stay as they are until they are larger than what is seen by this factor.
const TOO_LARGE: f32 = 2.5;

/// A sphere in the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundingSphere {
    /// Relative to the geometry's origin.
    pub center: Vec3,
    /// Metres.
    pub radius: f32,
}

impl BoundingSphere {
    /// About all of the scene.
    pub(super) fn of_scene(geometry: &Geometry) -> Self {
        Self { center: geometry.center(), radius: geometry.extent() * 0.5 }
    }

    /// About what views see, and a little more; all of the scene for no views.
    pub(super) fn seen(tracer: &SceneTracer, views: &[View]) -> Self {
        let all = Self::of_scene(tracer.geometry());
        let seen = seen(tracer, views);
        let low = seen.iter().fold(Vec3::INFINITY, |a, &b| a.min(b));
        let high = seen.iter().fold(Vec3::NEG_INFINITY, |a, &b| a.max(b));
        let center = (low + high) * 0.5;
        let radius = MARGIN * seen.iter().fold(0.0_f32, |a, &b| a.max(b.distance(center)));
        if seen.is_empty() || radius <= 0.0 || radius >= all.radius { all } else { Self { center, radius } }
    }

    /// The same for other views, as long as it shows all of what they see without wasting much.
    pub(super) fn or_seen(self, tracer: &SceneTracer, views: &[View]) -> Self {
        let next = Self::seen(tracer, views);
        let reach = self.center.distance(next.center) + next.radius / MARGIN;
        if reach <= self.radius && self.radius <= TOO_LARGE * next.radius { self } else { next }
    }

    /// Makes maps of an environment's samples show it.
    pub(super) fn fit(self, samples: &mut [LightSample]) {
        for sample in samples {
            if let Profile::Distant { shown, .. } = &mut sample.profile {
                *shown = self;
            }
        }
    }
}

/// Points that views see, evenly over their pictures.
fn seen(tracer: &SceneTracer, views: &[View]) -> Vec<Vec3> {
    let count = (RAYS / views.len().max(1) as u32).max(LEAST_RAYS);
    let side = f64::from(count).sqrt() as u32;
    let origin = tracer.geometry().origin;
    let of_view = |view: &View| {
        let view = view.relative_to(origin);
        let at = |i: u32| Vec2::new((i % side) as f32, (i / side) as f32) / (side - 1) as f32;
        let hit = |i| {
            let (eye, direction) = view.ray(2.0 * at(i) - 1.0);
            tracer
                .closest_visible_within(eye, direction, view.clip.reach())
                .map(|hit| eye + direction * hit.t)
        };
        (0..side * side).filter_map(hit).collect::<Vec<_>>()
    };
    views.iter().flat_map(of_view).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin::{self, MovingObject};
    use crate::scene::{Environment, FieldOfView, Scene, Transform, Viewpoint};
    use glam::DVec3;

    /// A view of a room from one side of it, and the room with another one far away.
    fn rooms() -> (Scene, View) {
        let mut scene = builtin::build("table", MovingObject::None).expect("a room");
        let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
        let shell = scene.objects[0].clone();
        let mesh = scene.meshes[shell.mesh].clone();
        scene.add_object("another", mesh, Transform::translation(Vec3::new(40.0, 0.0, 0.0)));
        scene.environment = Some(Environment::constant(Vec3::ONE).expect("light"));
        (scene, view)
    }

    #[test]
    fn maps_show_what_is_seen_and_little_else() {
        let (scene, view) = rooms();
        let geometry = Geometry::new(&scene);
        let tracer = SceneTracer::new(&scene, &geometry);
        let all = BoundingSphere::of_scene(&geometry);
        assert_eq!(BoundingSphere::seen(&tracer, &[]), all);
        let shown = BoundingSphere::seen(&tracer, &[view]);
        assert!(shown.radius < 0.4 * all.radius, "{shown:?} of {all:?}");
        // Between the rays that looked for it, too.
        let local = view.relative_to(geometry.origin);
        for i in 0..5000 {
            let at = Vec2::from_array([0, 1].map(|d| crate::math::sequence::sample(i, d, 1)));
            let (eye, direction) = local.ray(2.0 * at - 1.0);
            let hit = tracer.closest_visible(eye, direction).expect("a wall");
            assert!((eye + direction * hit.t).distance(shown.center) < shown.radius);
        }
        // Two views need both.
        let away = Viewpoint {
            eye: DVec3::new(41.0, 1.5, 0.0),
            target: DVec3::new(40.0, 1.0, 0.0),
            up: DVec3::Y,
            field: FieldOfView::Perspective { degrees: 57.0 },
            clip: Default::default(),
        };
        let away = away.view(1.0).expect("a view");
        let both = BoundingSphere::seen(&tracer, &[view, away]);
        assert!(both.radius > 2.0 * shown.radius, "{both:?}");
        // It stays while it suffices.
        let turned = View { forward: (view.forward + view.right * 0.05).normalize(), ..view };
        assert_eq!(shown.or_seen(&tracer, &[turned]), shown);
        assert_ne!(shown.or_seen(&tracer, &[away]), shown);
        assert_eq!(both.or_seen(&tracer, &[view]), shown, "too large by far");
    }
}
