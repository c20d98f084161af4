//! Points that views see, well spread over their pictures.

use super::LightSample;
use crate::brdf::Surface;
use crate::image::luminance;
use crate::math::{sequence, warp};
use crate::scene::View;
use crate::trace::{Hit, SceneTracer};
use glam::{Vec2, Vec3};

/// Points by which candidates are weighed.
pub(super) const POINTS: u32 = 1024;
/// Of the sequence that they are spread by: they depend on nothing but the views.
const POINTS_SEED: u32 = 0x3c6e_f372;
/// Rays that look for points that are lit by a sample.
const LIT: u32 = 8;

/// Squared GGX α of a lobe that shows as much as a diffuse surface does, about, and how many times as much a smooth one may count.
const LOBE: f32 = 0.3;
const MOST_CLOSER: f32 = 8.0;

/// A surface point that a view sees.
pub(super) struct ViewPoint {
    pub surface: Surface,
    pub triangle: u32,
    /// How much of the light that arrives it reflects, by luminance.
    pub reflectance: f32,
    /// What light counts for that is not an environment's: a smooth surface shows the few samples in its lobe, and needs them the closer.
    /// What it shows of an environment does not come from samples alone.
    pub local_reflectance: f32,
    /// Whether it is seen now, or may be soon.
    pub is_seen: bool,
}

/// So many points that the views see of what reflects.
pub(super) fn view_points(tracer: &SceneTracer, views: &[View], count: u32) -> Vec<ViewPoint> {
    let geometry = tracer.geometry();
    let views: Vec<_> = views.iter().map(|v| v.relative_to(geometry.origin)).collect();
    let mut points = Vec::new();
    for i in 0..4 * count {
        let Some(view) = views.get(i as usize % views.len().max(1)) else { break };
        if points.len() == count as usize {
            break;
        }
        let index = i / views.len() as u32;
        let at = Vec2::from_array([0, 1].map(|d| sequence::sample(index, d, POINTS_SEED)));
        let (origin, direction) = view.ray(2.0 * at - 1.0);
        let Some(hit) = tracer.closest_visible(origin, direction) else { continue };
        points.extend(view_point(tracer, &hit, direction));
    }
    points
}

/// Where a ray hits what reflects.
fn view_point(tracer: &SceneTracer, hit: &Hit, direction: Vec3) -> Option<ViewPoint> {
    let wo = -direction.normalize();
    let mut surface = tracer.geometry().surface(tracer.scene(), hit.triangle, hit.barycentric, wo);
    let [diffuse, specular] = [surface.albedo, surface.f0].map(luminance);
    let reflectance = luminance(surface.albedo + surface.f0);
    let closer = (LOBE / (surface.alpha * surface.alpha)).clamp(1.0, MOST_CLOSER);
    let local_reflectance = diffuse + specular * closer;
    surface.position = tracer.offset_ray_origin(surface.position, surface.geometric_normal);
    (reflectance > 0.0).then_some(ViewPoint {
        surface,
        triangle: hit.triangle,
        reflectance,
        local_reflectance,
        is_seen: true,
    })
}

/// Points that are seen, and among them, evenly, some that may be soon.
pub(super) fn with_ahead(seen: Vec<ViewPoint>, ahead: Vec<ViewPoint>) -> Vec<ViewPoint> {
    let ahead = ahead.into_iter().map(|point| ViewPoint { is_seen: false, ..point }).collect();
    let ranked = |points: Vec<ViewPoint>| {
        let count = points.len() as f32;
        points.into_iter().enumerate().map(move |(i, point)| ((i as f32 + 0.5) / count, point))
    };
    let mut all: Vec<_> = ranked(seen).chain(ranked(ahead)).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all.into_iter().map(|(_, point)| point).collect()
}

/// Points that are lit by a sample and that views see: some of those that lie before it, which are lit most where it is close.
pub(super) fn lit_points(tracer: &SceneTracer, views: &[View], sample: &LightSample) -> Vec<ViewPoint> {
    let origin = tracer.geometry().origin;
    let (x, y) = warp::frame(sample.normal);
    let before = |i: u32| {
        let s = [0, 1].map(|d| sequence::sample(i, d, POINTS_SEED));
        let local = warp::cosine_hemisphere(Vec2::from_array(s));
        let direction = x * local.x + y * local.y + sample.normal * local.z;
        let lit = tracer.closest_hit(sample.position, direction, f32::INFINITY, sample.triangle())?;
        let at = sample.position + direction * lit.t;
        let sees = |view: &View| {
            let view = view.relative_to(origin);
            let (ndc, distance) = view.project(at);
            if distance <= 0.0 || ndc.abs().max_element() > 1.0 {
                return None;
            }
            let (eye, direction) = view.ray(ndc);
            let hit = tracer.closest_visible(eye, direction)?;
            (hit.triangle == lit.triangle).then(|| view_point(tracer, &hit, direction))?
        };
        views.iter().find_map(sees)
    };
    (0..LIT).filter_map(before).collect()
}
