//! Points that views see, well spread over their pictures.

use super::LightSample;
use crate::brdf::Surface;
use crate::image::luminance;
use crate::math::{sequence, warp};
use crate::parallel::in_order;
use crate::scene::{LocalView, View};
use crate::trace::{Hit, SceneTracer};
use glam::{Vec2, Vec3};
use rustc_hash::FxHashSet;

/// Points by which candidates are weighed.
pub(super) const POINTS: u32 = 1024;
/// Of the sequence that they are spread by: they depend on nothing but the views.
const POINTS_SEED: u32 = 0x3c6e_f372;

/// Cells that points are spread by: the finest, as a share of what is seen, and how much coarser the next ones are.
const FINEST_CELL: f32 = 1.0 / 512.0;
const COARSER: f32 = 1.3;

/// Squared GGX α of a lobe that shows as much as a diffuse surface does, about, and how many times as much a smooth one may count.
const LOBE: f32 = 0.3;
const MOST_CLOSER: f32 = 8.0;

/// A surface point that a view sees.
#[derive(Clone, Debug)]
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
    /// By which view, and where in its picture.
    seen_by: (u32, Vec2),
}

/// A point that a view sees of what reflects, offset from its surface.
pub(crate) struct SeenPoint {
    /// Relative to the geometry's origin.
    pub position: Vec3,
    /// Geometric, on the side that is seen.
    pub normal: Vec3,
    pub triangle: u32,
}

/// So many of them, at most.
pub(crate) fn seen_points(tracer: &SceneTracer, view: &View, count: u32) -> Vec<SeenPoint> {
    let point = |point: ViewPoint| SeenPoint {
        position: point.surface.position,
        normal: point.surface.geometric_normal,
        triangle: point.triangle,
    };
    view_points(tracer, &[*view], count).into_iter().map(point).collect()
}

/// So many points that the views see of what reflects.
pub(super) fn view_points(tracer: &SceneTracer, views: &[View], count: u32) -> Vec<ViewPoint> {
    let geometry = tracer.geometry();
    let views: Vec<_> = views.iter().map(|v| v.relative_to(geometry.origin)).collect();
    let mut points = Vec::new();
    let count = count as usize;
    if views.is_empty() {
        return points;
    }
    for round in 0..4 {
        let found = in_order(count, |i| {
            let i = round * count + i;
            let at = [0, 1].map(|d| sequence::sample((i / views.len()) as u32, d, POINTS_SEED));
            let number = i % views.len();
            seen_at(tracer, (number as u32, &views[number]), 2.0 * Vec2::from_array(at) - 1.0)
        });
        points.extend(found.into_iter().flatten());
        if points.len() >= count {
            points.truncate(count);
            break;
        }
    }
    points
}

/// What a view sees at a place of its picture, if it reflects.
fn seen_at(tracer: &SceneTracer, (number, view): (u32, &LocalView), at: Vec2) -> Option<ViewPoint> {
    let (origin, direction) = view.ray(at);
    let hit = tracer.closest_visible_within(origin, direction, view.clip.reach())?;
    view_point(tracer, &hit, direction, (number, at))
}

/// At most so many of the points, no two of them in one cell of a grid as fine as that allows: well spread over surfaces, whatever
/// part of the picture these are in.
pub(super) fn spread(points: Vec<ViewPoint>, count: usize) -> Vec<ViewPoint> {
    let positions = || points.iter().map(|point| point.surface.position);
    let (low, high) =
        positions().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
    let mut cell = (high - low).max_element() * FINEST_CELL;
    if points.len() <= count || cell <= 0.0 {
        return points.into_iter().take(count).collect();
    }
    loop {
        let mut taken = FxHashSet::default();
        let is_first: Vec<bool> =
            positions().map(|p| taken.insert(((p - low) / cell).as_u16vec3())).collect();
        if taken.len() <= count {
            return points.into_iter().zip(is_first).filter_map(|(p, first)| first.then_some(p)).collect();
        }
        cell *= COARSER;
    }
}

/// Points that are seen close to others, so many to each: at most so far apart, as a share of half a picture.
pub(super) fn points_around<'a>(
    tracer: &SceneTracer,
    views: &[View],
    points: impl Iterator<Item = &'a ViewPoint>,
    (count, reach): (u32, f32),
) -> Vec<ViewPoint> {
    let views: Vec<_> = views.iter().map(|v| v.relative_to(tracer.geometry().origin)).collect();
    let around = (0..).zip(points).flat_map(|(index, point)| {
        let (number, middle) = point.seen_by;
        let view = &views[number as usize];
        (0..count).filter_map(move |i| {
            let shift = [0, 1].map(|d| 2.0 * sequence::sample(index * count + i, d, POINTS_SEED) - 1.0);
            let at = middle + reach * Vec2::from_array(shift);
            (at.abs().max_element() <= 1.0).then(|| seen_at(tracer, (number, view), at))?
        })
    });
    around.collect()
}

/// Where a ray hits what reflects.
fn view_point(tracer: &SceneTracer, hit: &Hit, direction: Vec3, seen_by: (u32, Vec2)) -> Option<ViewPoint> {
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
        seen_by,
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

/// Points that are lit by a sample and that views see: what that many rays find of those that lie before it. They leave all of
/// the surface that it stands for, so that most points are found where it lights most: along the edge of a wall, say.
pub(super) fn lit_points(
    tracer: &SceneTracer,
    views: &[View],
    sample: &LightSample,
    rays: u32,
) -> Vec<ViewPoint> {
    let origin = tracer.geometry().origin;
    let (x, y) = warp::frame(sample.normal);
    let before = |i: u32| {
        let s = [0, 1, 2, 3].map(|d| sequence::sample(i, d, POINTS_SEED));
        let local = warp::cosine_hemisphere(Vec2::new(s[0], s[1]));
        let direction = x * local.x + y * local.y + sample.normal * local.z;
        let start = sample.rectangle.map_or(sample.position, |r| {
            r.center + r.half_axes[0] * (2.0 * s[2] - 1.0) + r.half_axes[1] * (2.0 * s[3] - 1.0)
        });
        let lit = tracer.closest_hit(start, direction, f32::INFINITY, sample.triangle())?;
        let at = start + direction * lit.t;
        let sees = |(number, view): (u32, &View)| {
            let view = view.relative_to(origin);
            let (ndc, distance) = view.project(at);
            if distance <= 0.0 || ndc.abs().max_element() > 1.0 {
                return None;
            }
            let (eye, direction) = view.ray(ndc);
            let hit = tracer.closest_visible_within(eye, direction, view.clip.reach())?;
            (hit.triangle == lit.triangle).then(|| view_point(tracer, &hit, direction, (number, ndc)))?
        };
        (0..).zip(views).find_map(sees)
    };
    (0..rays).filter_map(before).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lights::tests::{closed_box, scene_of};
    use crate::lights::{Profile, Rectangle, SampleOrigin};
    use crate::scene::{FieldOfView, Geometry, Material, NONE, Viewpoint, builtin};
    use glam::DVec3;

    #[test]
    fn few_points_lie_on_all_that_is_seen_and_others_close_to_them() {
        let scene = builtin::build("table", builtin::default_object("table")).expect("built in");
        let geometry = Geometry::new(&scene);
        let tracer = SceneTracer::new(&scene, &geometry);
        let views = [View::new(&scene, &scene.cameras[0], 1.0)];
        let all = || view_points(&tracer, &views, 4096);
        let (few, first) = (spread(all(), 300), view_points(&tracer, &views, 300));
        assert!((150..=300).contains(&few.len()), "{}", few.len());
        // How far what is seen is from them, at most.
        let farthest = |points: &[ViewPoint]| {
            let to =
                |p: Vec3| points.iter().map(|q| q.surface.position.distance(p)).fold(f32::INFINITY, f32::min);
            all().iter().map(|p| to(p.surface.position)).fold(0.0, f32::max)
        };
        let reach = farthest(&few);
        assert!(reach < 0.85 * farthest(&first), "{reach}, {}", farthest(&first));
        // As few as there are stay as they are.
        assert_eq!(spread(view_points(&tracer, &views, 300), 300).len(), 300);
        let close = points_around(&tracer, &views, few.iter(), (2, 0.01));
        assert!(close.len() > few.len());
        for point in &close {
            let is_close =
                |other: &ViewPoint| (other.seen_by.1 - point.seen_by.1).abs().max_element() <= 0.0101;
            assert!(few.iter().any(is_close) && point.seen_by.1.abs().max_element() <= 1.0);
        }
    }

    #[test]
    fn points_are_found_where_a_sample_lights_most() {
        // A sample that stands for a wall of a cube, and a view of a strip of the ceiling along it.
        let (scene, geometry) = scene_of(closed_box(), vec![Material::diffuse("gray", Vec3::splat(0.5)); 2]);
        let tracer = SceneTracer::new(&scene, &geometry);
        let strip = Viewpoint {
            eye: DVec3::new(0.5, 0.2, 0.5),
            target: DVec3::new(0.02, 1.0, 0.5),
            up: DVec3::Y,
            field: FieldOfView::Perspective { degrees: 3.0 },
            clip: Default::default(),
        };
        let views = [strip.view(8.0).expect("a view")];
        let position = (DVec3::new(1e-4, 0.5, 0.5) - geometry.origin).as_vec3();
        let rectangle = Rectangle {
            center: position,
            half_axes: [Vec3::Y, Vec3::Z].map(|axis| 0.5 * axis),
            is_open: true,
        };
        let sample = LightSample {
            position,
            normal: Vec3::X,
            intensity: Vec3::ONE,
            profile: Profile::Cosine,
            origin: SampleOrigin::Emitter { triangle: NONE, point: 0 },
            rectangle: Some(rectangle),
        };
        let found = |from: &LightSample| lit_points(&tracer, &views, from, 4096).len();
        // The control: rays from its place alone.
        let [all, place] = [sample, LightSample { rectangle: None, ..sample }].map(|from| found(&from));
        assert!(all >= 15 && all > 3 * place, "{all}, {place}");
    }
}
