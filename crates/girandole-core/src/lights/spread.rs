//! How far what light samples stand for is spread.
//!
//! Rectangles that are fitted to candidates leave gaps between each other, and overlap: close to them, in corners and at the feet of
//! things, these are seen as dark and bright spots. So each is longer by half than what was fitted, as if what surfaces reflect were
//! filtered; what emits has edges, and is not. Where something static stands in a rectangle's plane, seen from its sample, it ends
//! there, lest light pass a wall; in a narrow gap, as above a lamp that hangs close below a ceiling, it ends where its surface does.
//! Its other end then goes less far, lest corners get too little light (or, if it did not go on at all, too much).

use super::{LightSample, Rectangle, SampleOrigin};
use crate::parallel::in_order;
use crate::scene::NONE;
use crate::trace::SceneTracer;
use glam::Vec3;

/// By how much a rectangle's sides are longer than what was fitted, if it reflects. With 1.3 relMSE is 5 % higher; with 1.8 it is the
/// same, and corners are darker.
pub const SPREAD: f32 = 1.5;
/// How far an end goes whose other end is at a wall, as a share.
const BESIDE_WALL: f32 = 0.3;
/// A side is no shorter than this share of what was fitted, whatever stands in its way, of what reflects and of what emits: all of what was
/// fitted to still shines from there, and is the brighter close by the smaller it is. What reflects is no better known than that: of
/// 300 samples in a classroom .1 leaves twice the outliers. What emits is, and would shine through boards that it stands behind.
const LEAST: [f32; 2] = [0.4, 0.1];
/// Height over the plane at which it is looked for what stands in it, as a share of the rectangle's radius.
const HEIGHT: f32 = 0.001;
/// Cosine between a rectangle and what it ends at, above which both are one surface.
const BENT: f32 = 0.7;
/// What lies closer before a sample than this share of its rectangle's radius makes a narrow gap, out of which a rectangle must not stick: it
/// would light what lies beside the gap as brightly as what lies in it.
const NARROW: f32 = 0.2;
/// How exactly the edge of a surface in a narrow gap is found: halvings of how far a rectangle would go.
const EDGE_STEPS: u32 = 8;
/// How far out it is looked for the surface below a rectangle's corners, as a share of its half axes: where the surface bends; and elsewhere,
/// within what was fitted.
const CORNERS: [f32; 2] = [0.98, 0.65];

impl LightSample {
    /// Whether its rectangle is larger than what it stands for by [`SPREAD`], where nothing stands in the way.
    pub fn is_spread(&self) -> bool {
        matches!(self.origin, SampleOrigin::Bounce { .. })
    }
}

/// Spreads what each sample stands for.
pub(super) fn spread(tracer: &SceneTracer, samples: &mut [LightSample]) {
    let found = in_order(samples.len(), |i| {
        samples[i].rectangle.map(|fitted| spread_out(tracer, &samples[i], fitted))
    });
    for (sample, rectangle) in samples.iter_mut().zip(found) {
        sample.rectangle = rectangle;
    }
}

/// Whether something static lies before a sample closer than [`NARROW`] of the radius, m, of what it stands for.
pub(super) fn is_in_narrow_gap(tracer: &SceneTracer, sample: &LightSample, radius: f32) -> bool {
    let origin = tracer.offset_ray_origin(sample.position, sample.normal);
    let is_other = |triangle, _| is_other_and_static(tracer, sample, triangle);
    sample.triangle() != NONE
        && tracer.closest_hit_where(origin, sample.normal, NARROW * radius, is_other).is_some()
}

/// Whether a triangle is static, and not the one that the sample lies on.
fn is_other_and_static(tracer: &SceneTracer, sample: &LightSample, triangle: u32) -> bool {
    let object = tracer.geometry().triangles[triangle as usize].object;
    !tracer.scene().objects[object as usize].dynamic && triangle != sample.triangle()
}

/// A larger rectangle than was fitted, which ends where something stands.
fn spread_out(tracer: &SceneTracer, sample: &LightSample, fitted: Rectangle) -> Rectangle {
    let geometry = tracer.geometry();
    let is_static = |triangle, _| is_other_and_static(tracer, sample, triangle);
    let height = sample.normal * (HEIGHT * fitted.radius());
    let offset = tracer.offset_ray_origin(sample.position, sample.normal) - sample.position;
    let origin = sample.position + offset + height;
    // How far it goes from there until something stands in the way, and whether that is the same surface, bent: what comes out of the
    // plane before its end is met a little later, higher up.
    let free = |from: Vec3, towards: Vec3, length: f32| {
        let hit = tracer.closest_hit_where(from, towards, 2.0 * length, is_static);
        let end = hit.map(|hit| {
            let [a, b, c] = geometry.corners(hit.triangle);
            let across = (b - a).cross(c - a).normalize_or_zero();
            let at_plane = (a - sample.position - (from - origin)).dot(across) / towards.dot(across);
            let end = if at_plane > 0.0 { hit.t.min(at_plane) } else { hit.t };
            (end, across.dot(sample.normal).abs() > BENT)
        });
        end.filter(|end| end.0 < length).unwrap_or((length, false))
    };
    // How far it goes on its surface, in a narrow gap; else as far as may be.
    let gap = NARROW * fitted.radius();
    let is_narrow = tracer.closest_hit_where(origin, sample.normal, gap, is_static).is_some();
    let on_surface = |towards: Vec3, length: f32| {
        let is_there = |at: f32| {
            tracer.closest_hit_where(origin + towards * at, -sample.normal, gap, |_, _| true).is_some()
        };
        if !is_narrow || is_there(length) {
            return length;
        }
        let (mut low, mut high) = (0.0, length);
        for _ in 0..EDGE_STEPS {
            let middle = 0.5 * (low + high);
            *(if is_there(middle) { &mut low } else { &mut high }) = middle;
        }
        low
    };
    let axes = fitted.half_axes.map(|axis| {
        let (half, along) = (axis.length(), axis.normalize_or_zero());
        let at = (sample.position - fitted.center).dot(along).clamp(-half, half);
        let more = if sample.is_spread() { (SPREAD - 1.0) * half } else { 0.0 };
        // From the sample to either end: what was fitted, and how far it goes.
        let fitted = [half - at, half + at];
        let ends = [0, 1].map(|side| {
            let towards = [along, -along][side];
            let (end, is_bent) = free(origin, towards, fitted[side] + more);
            (on_surface(towards, end), is_bent)
        });
        let is_open = [0, 1].map(|side| ends[side].0 >= fitted[side] + more);
        let end = |side: usize| {
            ends[side].0 - if is_open[side] && !is_open[1 - side] { (1.0 - BESIDE_WALL) * more } else { 0.0 }
        };
        (along, at, [end(0), end(1)], ends.map(|end| end.1), half)
    });
    let mut center = fitted.center;
    let half_axes = [0, 1].map(|i| {
        let (along, at, mut ends, is_bent, half) = axes[i];
        let (across, _, to_sides, _, _) = axes[1 - i];
        for side in (0..2).filter(|&side| is_bent[side]) {
            for from in [across * to_sides[0], across * -to_sides[1]] {
                ends[side] = free(origin + from * CORNERS[0], [along, -along][side], ends[side]).0;
            }
        }
        let [high, low] = ends;
        center += along * (at + 0.5 * (high - low));
        let least = LEAST[usize::from(!sample.is_spread())];
        along * (0.5 * (high + low)).max(least * half)
    });
    let is_bent = axes.iter().any(|axis| axis.3[0] || axis.3[1]);
    let [u, v] = half_axes.map(|axis| axis * CORNERS[usize::from(!is_bent)]);
    let is_on_surface = |corner: &Vec3| {
        let (from, length) = (center + *corner + height + offset, 2.0 * (height + offset).length());
        tracer.closest_hit_where(from, -sample.normal, length, |_, _| true).is_some()
    };
    let corners = [u + v, u - v, v - u, -u - v];
    let is_open = fitted.is_open && !is_bent
        || corners.iter().filter(|corner| is_on_surface(corner)).count() > corners.len() / 2;
    Rectangle { center, half_axes, is_open }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lights::{LightSet, LightSettings, Profile};
    use crate::scene::builtin::{self, MovingObject};
    use crate::scene::{Geometry, Material, MaterialId, Mesh, Scene, Transform};
    use glam::Quat;

    /// A sample on the first triangle.
    fn deposit(position: Vec3, normal: Vec3, fitted: Rectangle) -> LightSample {
        LightSample {
            position,
            normal,
            intensity: Vec3::ONE,
            profile: Profile::Cosine,
            origin: SampleOrigin::Bounce { path: 0, bounce: 1, triangle: 0 },
            rectangle: Some(fitted),
        }
    }

    #[test]
    fn what_samples_stand_for_ends_at_walls_and_is_larger_elsewhere() {
        let scene = builtin::build("pillars", MovingObject::None).unwrap();
        let geometry = Geometry::new(&scene);
        let tracer = SceneTracer::new(&scene, &geometry);
        let set = LightSet::sample(&scene, &geometry, &LightSettings::default()).unwrap();
        let mut fitted = set.samples().to_vec();
        for sample in &mut fitted {
            if let Some(rectangle) = &mut sample.rectangle {
                rectangle.half_axes = rectangle.half_axes.map(|axis| axis / SPREAD);
            }
        }
        let mut spread_again = fitted.clone();
        spread(&tracer, &mut spread_again);
        let (mut ended, mut whole) = (0, 0);
        for (sample, found) in fitted.iter().zip(&spread_again) {
            let (Some(fitted), Some(found)) = (sample.rectangle, found.rectangle) else { continue };
            let from = tracer.offset_ray_origin(sample.position, sample.normal)
                + sample.normal * (HEIGHT * fitted.radius());
            let at = sample.position - found.center;
            for (axis, before) in found.half_axes.into_iter().zip(fitted.half_axes) {
                let along = axis.normalize_or_zero();
                if axis.length() <= 1.001 * LEAST[usize::from(!sample.is_spread())] * before.length() {
                    continue;
                }
                for side in [axis, -axis] {
                    let end = from + along * (side - at).dot(along) * 0.999;
                    assert!(!tracer.occluded(from, sample.triangle(), end, NONE), "{sample:?} {found:?}");
                }
            }
            let spread = if sample.is_spread() { SPREAD * SPREAD } else { 1.0 };
            let share = found.area() / (spread * fitted.area());
            assert!(share <= 1.001, "{share}");
            *(if share < 0.9 { &mut ended } else { &mut whole }) += 1;
        }
        assert!(ended > 20 && whole > 100, "{ended} end at something, {whole} do not");
    }
    #[test]
    fn in_a_groove_they_stand_for_two_fifths_along_it_at_least() {
        let mut scene = builtin::build("pillars", MovingObject::None).unwrap();
        let geometry = Geometry::new(&scene);
        let set = LightSet::sample(&scene, &geometry, &LightSettings::default()).unwrap();
        let length = |s: &LightSample| s.rectangle.map_or(0.0, |r| r.half_axes[0].length());
        let of_floor = set.samples().iter().filter(|s| s.normal.y > 0.99 && s.is_spread());
        let sample = of_floor.max_by(|a, b| length(a).total_cmp(&length(b))).unwrap();
        let fitted = sample.rectangle.unwrap();
        let along = fitted.half_axes[0].normalize();
        // Two boards, 4 cm apart.
        let mut board = Mesh::default();
        board.add_box(Vec3::new(0.02, -0.1, -1.0), Vec3::new(0.03, 0.5, 1.0), MaterialId(0));
        for side in [along, -along] {
            let place = sample.position + geometry.origin.as_vec3();
            let turn = Quat::from_rotation_arc(Vec3::X, side);
            scene.add_object("board", board.clone(), Transform::rigid(turn, place));
        }
        let geometry = Geometry::new(&scene);
        let found = spread_out(&SceneTracer::new(&scene, &geometry), sample, fitted);
        let share = found.half_axes[0].length() / fitted.half_axes[0].length();
        assert!(length(sample) > 0.1 && (share - 0.4).abs() < 1e-3, "{} {share}", length(sample));
        let off = (found.center - sample.position).dot(along);
        assert!(off.abs() < 1e-3, "{off} m beside the groove");
    }

    #[test]
    fn what_mostly_floats_lights_nothing_that_its_sample_is_behind() {
        // A beam, and a sample on it whose cluster goes on elsewhere: no wall reaches down past what is below the beam.
        let is_open = |height: f32, is_known: bool| {
            let mut beam = Mesh::default();
            beam.add_box(Vec3::new(-2.0, 0.0, -0.1), Vec3::new(2.0, height, 0.0), MaterialId(0));
            let mut scene = Scene::default();
            scene.add_material(Material::diffuse("gray", Vec3::splat(0.5)));
            scene.add_object("beam", beam, Transform::IDENTITY);
            let geometry = Geometry::new(&scene);
            let position = Vec3::new(0.0, 0.5 * height, 0.0) - geometry.origin.as_vec3();
            let fitted = Rectangle { is_open: is_known, ..Rectangle::square(position, Vec3::Z, 0.36) };
            let sample = deposit(position, Vec3::Z, fitted);
            spread_out(&SceneTracer::new(&scene, &geometry), &sample, fitted).is_open
        };
        assert!(!is_open(0.2, false));
        // The controls: it is spread by half, and what was fitted lies on the beam; several candidates tell that it goes on.
        assert!(is_open(0.65, false) && is_open(0.2, true));
    }

    #[test]
    fn they_do_not_stick_out_of_narrow_gaps() {
        // A plate below a ceiling, and a sample close to its edge.
        let end = |gap: f32| {
            let plate = |half: f32| {
                let mut mesh = Mesh::default();
                mesh.add_box(Vec3::new(-half, -0.01, -half), Vec3::new(half, 0.0, half), MaterialId(0));
                mesh
            };
            let mut scene = Scene::default();
            scene.add_material(Material::diffuse("gray", Vec3::splat(0.5)));
            scene.add_object("plate", plate(0.5), Transform::IDENTITY);
            scene.add_object("ceiling", plate(2.0), Transform::translation(Vec3::Y * (gap + 0.01)));
            let geometry = Geometry::new(&scene);
            let position = Vec3::new(0.3, 0.0, 0.0) - geometry.origin.as_vec3();
            let fitted = Rectangle::square(position, Vec3::Y, 0.36);
            let sample = deposit(position, Vec3::Y, fitted);
            let found = spread_out(&SceneTracer::new(&scene, &geometry), &sample, fitted);
            let half: f32 = found.half_axes.iter().map(|axis| axis.x.abs()).sum();
            found.center.x + geometry.origin.as_vec3().x + half
        };
        assert!((end(0.01) - 0.5).abs() < 0.005, "{}", end(0.01));
        // The control: where there is room the rectangle is filtered as elsewhere.
        assert!((end(1.0) - 0.75).abs() < 0.005, "{}", end(1.0));
    }
}
