//! How much of what is seen light reaches.

use super::view_points::{ViewPoint, view_points};
use super::{Clamp, LightSample};
use crate::parallel::in_order;
use crate::scene::View;
use crate::trace::SceneTracer;

/// Points that are judged.
const POINTS: u32 = 128;
/// What has less than this share of the light of the brightest tenth is not reached.
const DIM: f32 = 0.05;

/// The share of what a view sees that emits, or that samples light at least a twentieth as much as the brightest tenth; 1 where nothing
/// is seen.
pub(crate) fn share_reached(tracer: &SceneTracer, view: &View, samples: &[LightSample]) -> f32 {
    let points = view_points(tracer, &[*view], POINTS);
    if points.is_empty() {
        return 1.0;
    }
    let irradiance = in_order(points.len(), |i| {
        let (surface, triangle) = (&points[i].surface, points[i].triangle);
        let from = |sample: &LightSample| {
            let (position, ng, ns) = (surface.position, surface.geometric_normal, surface.shading_normal);
            let (g, _) = sample.geometric_factor(position, ng, ns, Clamp::Own)?;
            let end = sample.shadow_ray_end(position, tracer.geometry());
            let is_lit = !sample.is_before(position, ng, ns)
                || !tracer.occluded(position, triangle, end, sample.triangle());
            is_lit.then(|| g * sample.intensity.max_element())
        };
        samples.iter().filter_map(from).sum()
    });
    let mut order = irradiance.clone();
    order.sort_unstable_by(f32::total_cmp);
    let bright = order[order.len() - 1 - order.len() / 10];
    let (scene, geometry) = (tracer.scene(), tracer.geometry());
    let emits = |triangle: u32| scene.materials[geometry.triangles[triangle as usize].material].emits();
    let is_reached =
        |(&e, point): (&f32, &ViewPoint)| emits(point.triangle) || (e > 0.0 && e >= DIM * bright);
    let reached = irradiance.iter().zip(&points).filter(|pair| is_reached(*pair)).count();
    reached as f32 / points.len() as f32
}
