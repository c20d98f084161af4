//! Where light is added so that it reaches what is seen: what is tried, and how it is judged.

use super::defaults::inside;
use super::studio::ASPECT;
use super::{ClipPlanes, Geometry, LocalView, NONE, Scene, View};
use crate::lights::{SeenPoint, seen_points};
use crate::math::{sequence, warp};
use crate::trace::SceneTracer;
use glam::{Vec2, Vec3};

/// Points that are judged.
const POINTS: u32 = 128;
/// Rays from each of them that look for a way out.
const RAYS: u32 = 16;
/// The share of points that the first choice has to reach. Others are taken where they reach more.
const ENOUGH: f32 = 0.4;
/// Lines of sight that tell whether anything is seen.
const LINES_OF_SIGHT: u32 = 256;
/// From the eye to a lamp beside it, in a view towards −Z.
const BESIDE: Vec3 = Vec3::new(-0.45, 0.6, 0.2);

/// What is added.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum AddedLight {
    /// See [`Environment::studio`](super::Environment::studio).
    Studio,
    /// A point light.
    Lamp {
        /// Relative to the geometry's origin.
        position: Vec3,
        /// From there to what it is to light, metres.
        distance: f32,
        /// Where that is, in words.
        place: &'static str,
    },
}

impl Scene {
    /// What reaches most of what the first camera sees; of the usual choice, if that reaches enough.
    pub(super) fn added_light(&self, geometry: &Geometry) -> AddedLight {
        let everything = SceneTracer::of_all_surfaces(self, geometry);
        let usual = under_ceiling(&everything).unwrap_or(AddedLight::Studio);
        let Some(camera) = self.cameras.first() else { return usual };
        let view = View::new(self, camera, ASPECT);
        let tracer = SceneTracer::new(self, geometry);
        let points = seen_points(&tracer, &view, POINTS);
        let reach = |light: &AddedLight| share_reached(&tracer, &points, light);
        let mut best = (reach(&usual), usual);
        if points.is_empty() || best.0 >= ENOUGH {
            return usual;
        }
        let others = lamps(&tracer, &view.relative_to(geometry.origin), &points);
        for light in [AddedLight::Studio].into_iter().chain(others) {
            let reached = reach(&light);
            if reached > best.0 {
                best = (reached, light);
            }
        }
        best.1
    }

    /// Whether the first camera sees nothing for the sole reason that it looks at backs.
    pub(super) fn shows_backs_alone(&self, geometry: &Geometry) -> bool {
        let Some(camera) = self.cameras.first() else { return false };
        let view = View::new(self, camera, ASPECT).relative_to(geometry.origin);
        if (0..geometry.triangles.len() as u32).any(|triangle| is_in_view(self, geometry, &view, triangle)) {
            return false;
        }
        let tracer = SceneTracer::of_all_surfaces(self, geometry);
        let mut backs = 0;
        for i in 0..LINES_OF_SIGHT {
            let at = [0, 1].map(|d| 2.0 * sequence::sample(i, d, 0) - 1.0);
            let (origin, direction) = view.ray(at.into());
            let reach = view.clip.reach();
            if tracer.closest_visible_within(origin, direction, reach).is_some() {
                return false;
            }
            backs += u32::from(tracer.closest_hit(origin, direction, reach, NONE).is_some());
        }
        backs > 0
    }
}

/// Whether the middle of a triangle is in the picture and shows a side that is drawn: cameras look through backs.
fn is_in_view(scene: &Scene, geometry: &Geometry, view: &LocalView, triangle: u32) -> bool {
    let middle = geometry.corners(triangle).into_iter().sum::<Vec3>() / 3.0;
    let (ndc, distance) = view.project(middle);
    let direction = if view.orthographic { view.forward } else { middle - view.eye };
    let material = &scene.materials[geometry.triangles[triangle as usize].material];
    distance > view.clip.near
        && distance < view.clip.far
        && ndc.abs().max_element() <= 1.0
        && (material.double_sided || geometry.normal(triangle).dot(direction) < 0.0)
}

/// A lamp under the ceiling, in closed rooms.
fn under_ceiling(tracer: &SceneTracer) -> Option<AddedLight> {
    let below = inside(tracer)?;
    let distance = tracer.closest_hit(below, Vec3::Y, f32::INFINITY, NONE)?.t * 0.9;
    Some(AddedLight::Lamp { position: below + Vec3::Y * distance, distance, place: "under the ceiling" })
}

/// Lamps elsewhere: beside the eye, above the middle of what is seen, and at the eye, which reaches all that it sees.
fn lamps(tracer: &SceneTracer, view: &LocalView, points: &[SeenPoint]) -> Vec<AddedLight> {
    let middle = points.iter().map(|p| p.position).sum::<Vec3>() / points.len() as f32;
    let eye = match view.orthographic {
        // Any plane before what is seen is as good as the eye's own.
        true => {
            let nearest = points.iter().map(|p| view.project(p.position).1).fold(f32::INFINITY, f32::min);
            middle - view.forward * ((middle - view.eye).dot(view.forward) - 0.5 * (nearest + view.clip.near))
        }
        false => view.eye,
    };
    let away = median(points.iter().map(|p| p.position.distance(eye)));
    // As far as that leads, short of what is in the way.
    let clear = |from: Vec3, shift: Vec3| {
        let hit = tracer.closest_hit(from, shift, 1.25, NONE);
        from + shift * hit.map_or(1.0, |hit| 0.8 * hit.t)
    };
    let beside = view.right * BESIDE.x + view.up * BESIDE.y - view.forward * BESIDE.z;
    // From before the near plane on, walls may be between the eye and what is seen.
    let start = eye + view.forward * ClipPlanes::NONE.near.max(view.clip.near);
    let places = [
        (clear(start, beside * away), "beside the camera"),
        (clear(middle - view.forward * (0.05 * away), Vec3::Y * away), "above what is seen"),
        (start, "at the camera"),
    ];
    let lamp = |(position, place): (Vec3, &'static str)| AddedLight::Lamp {
        position,
        distance: median(points.iter().map(|p| p.position.distance(position))),
        place,
    };
    places.map(lamp).to_vec()
}

fn median(values: impl Iterator<Item = f32>) -> f32 {
    let mut values: Vec<f32> = values.collect();
    values.sort_by(f32::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(1.0).max(f32::MIN_POSITIVE)
}

/// The share of points that light comes to.
fn share_reached(tracer: &SceneTracer, points: &[SeenPoint], light: &AddedLight) -> f32 {
    let is_reached = |(index, point): (u32, &SeenPoint)| match *light {
        AddedLight::Lamp { position, .. } => {
            (position - point.position).dot(point.normal) > 0.0
                && !tracer.occluded(point.position, point.triangle, position, NONE)
        }
        AddedLight::Studio => {
            let (x, y) = warp::frame(point.normal);
            (0..RAYS).any(|ray| {
                let at = [0, 1].map(|d| sequence::sample(index * RAYS + ray, d, 0));
                let local = warp::cosine_hemisphere(Vec2::from_array(at));
                let direction = x * local.x + y * local.y + point.normal * local.z;
                tracer.closest_hit(point.position, direction, f32::INFINITY, point.triangle).is_none()
            })
        }
    };
    let reached = (0..).zip(points).filter(|pair| is_reached(*pair)).count();
    reached as f32 / points.len().max(1) as f32
}
