//! The outline of what is picked: about the pixels that it covers, faint where something is before it.
//!
//! Its triangles are rasterised on the CPU, as the picture shows them (no backs of one-sided surfaces); the border
//! of what they cover is followed, and rays tell where it is hidden.

use super::selection::Selected;
use super::session::Session;
use super::tools::Tools;
use egui::{Color32, Painter, Pos2, Rect, Shape, Stroke};
use girandole_core::Generation;
use girandole_core::glam::{Vec2, Vec3};
use girandole_core::scene::{Geometry, LocalView, ObjectId, View};
use girandole_core::trace::SceneTracer;

mod mask;

use mask::Mask;

/// Of larger objects the outline is that of their box.
const MOST_TRIANGLES: usize = 400_000;
/// Pixels of a mask; larger pictures have coarser ones.
const MOST_PIXELS: u32 = 1 << 21;
/// What is nearer to the eye is cut away, in the scene's size.
const NEAR: f32 = 1e-4;
/// Every so manyth point of the border is looked at for what hides it.
const STRIDE: usize = 4;
const COLOR: Color32 = Color32::from_rgb(255, 165, 40);

/// The outline that was drawn last.
#[derive(Default)]
pub struct Outline {
    of: Option<Key>,
    lines: Vec<Line>,
}

#[derive(Clone, Copy, PartialEq)]
struct Key {
    object: ObjectId,
    view: View,
    scene: Generation,
    size: [u32; 2],
}

/// A piece of it that is seen, or hidden, as a whole; places as shares of the picture, from the top left corner.
struct Line {
    points: Vec<Vec2>,
    is_hidden: bool,
}

/// Paints it.
pub fn paint(painter: &Painter, rect: Rect, session: &Session, tools: &mut Tools) {
    let Some(Selected::Object(object)) = tools.selected.filter(|selected| selected.is_there(session)) else {
        return;
    };
    let Some(light) = session.illumination() else { return };
    let (view, size) = (session.view(tools.picture_size), tools.picture_size);
    let key = Key { object, view, scene: light.generation(), size };
    if tools.outline.of != Some(key) {
        let mut lines = Vec::new();
        session.trace(tools.picker.hierarchies(), |tracer| lines = trace(tracer, &key));
        tools.outline = Outline { of: Some(key), lines };
    }
    let painter = painter.with_clip_rect(rect);
    let place = |share: &Vec2| rect.min + egui::vec2(share.x, share.y) * rect.size();
    for Line { points, is_hidden } in &tools.outline.lines {
        let points: Vec<Pos2> = points.iter().map(place).collect();
        if *is_hidden {
            painter.add(Shape::line(points, Stroke::new(1.2, COLOR.gamma_multiply(0.35))));
        } else {
            painter.add(Shape::line(points.clone(), Stroke::new(3.5, Color32::from_black_alpha(110))));
            painter.add(Shape::line(points, Stroke::new(1.8, COLOR)));
        }
    }
}

fn trace(tracer: &SceneTracer, key: &Key) -> Vec<Line> {
    let geometry = tracer.geometry();
    let Some(range) = geometry.objects.get(key.object.index()) else { return Vec::new() };
    let view = key.view.relative_to(geometry.origin);
    let [width, height] = key.size.map(|pixels| pixels.max(1));
    let coarse = (f64::from(width) * f64::from(height) / f64::from(MOST_PIXELS)).sqrt().max(1.0);
    let size = [width, height].map(|pixels| ((f64::from(pixels) / coarse) as u32).max(1));
    let mut mask = Mask::new(size);
    let near = geometry.diagonal() * NEAR;
    let distance = |p: Vec3| view.project(p).1 - near;
    let place = |p: Vec3| {
        let ndc = view.project(p).0;
        Vec2::new(ndc.x + 1.0, 1.0 - ndc.y) * 0.5
    };
    let is_large = range.triangles.len() > MOST_TRIANGLES;
    for corners in if is_large { of_box(geometry, key.object) } else { of_object(tracer, &view, key.object) }
    {
        let polygon: Vec<Vec2> = before(&corners, distance).into_iter().map(place).collect();
        mask.fill(&polygon);
    }
    let hidden = |share: Vec2| {
        let ndc = Vec2::new(2.0 * share.x - 1.0, 1.0 - 2.0 * share.y);
        let (origin, direction) = view.ray(ndc);
        let is_own = |t: u32| geometry.triangles[t as usize].object as usize == key.object.index();
        let own = tracer.closest_hit_where(origin, direction, f32::INFINITY, |t, _| is_own(t));
        let first = tracer.closest_visible_within(origin, direction, view.clip.reach());
        own.zip(first).is_some_and(|(own, first)| first.t < own.t * 0.999 && !is_own(first.triangle))
    };
    mask.borders().into_iter().flat_map(|border| pieces(&border, hidden)).collect()
}

/// The triangles that are seen from their front.
fn of_object(tracer: &SceneTracer, view: &LocalView, object: ObjectId) -> Vec<[Vec3; 3]> {
    let geometry = tracer.geometry();
    let range = geometry.objects[object.index()].triangles.clone();
    let is_seen = |triangle: &u32| {
        let middle = geometry.corners(*triangle).iter().sum::<Vec3>() / 3.0;
        tracer.is_visible(*triangle, view.ray(view.project(middle).0).1)
    };
    range.filter(is_seen).map(|triangle| geometry.corners(triangle)).collect()
}

/// The faces of an object's box.
fn of_box(geometry: &Geometry, object: ObjectId) -> Vec<[Vec3; 3]> {
    let range = geometry.objects[object.index()].vertices.clone();
    let positions = &geometry.positions[range.start as usize..range.end as usize];
    let first = positions.first().copied().unwrap_or_default();
    let (low, high) = positions.iter().fold((first, first), |(low, high), &p| (low.min(p), high.max(p)));
    let corner = |i: u32| {
        let pick = |bit: u32, low: f32, high: f32| if i >> bit & 1 == 0 { low } else { high };
        Vec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z))
    };
    const FACES: [[u32; 4]; 6] =
        [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    FACES.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).map(|face| face.map(corner)).collect()
}

/// What of a triangle is before the eye.
fn before(corners: &[Vec3; 3], distance: impl Fn(Vec3) -> f32) -> Vec<Vec3> {
    let mut polygon = Vec::with_capacity(4);
    for i in 0..3 {
        let (a, b) = (corners[i], corners[(i + 1) % 3]);
        let (from, to) = (distance(a), distance(b));
        if from > 0.0 {
            polygon.push(a);
        }
        if (from > 0.0) != (to > 0.0) {
            polygon.push(a.lerp(b, from / (from - to)));
        }
    }
    polygon
}

/// A closed border, smoothed, in pieces that are seen and pieces that are hidden.
fn pieces(border: &mask::Border, hidden: impl Fn(Vec2) -> bool) -> Vec<Line> {
    let count = border.points.len();
    let hides: Vec<bool> = (0..count).step_by(STRIDE).map(|i| hidden(border.inside[i])).collect();
    let is_hidden = |i: usize| hides[(i % count) / STRIDE];
    let smooth = |i: usize| {
        let around = [count - 2, count - 1, 0, 1, 2].map(|by| border.points[(i + by) % count]);
        around.iter().sum::<Vec2>() / 5.0
    };
    let mut lines: Vec<Line> = Vec::new();
    for i in 0..=count {
        let (point, this) = (smooth(i % count), is_hidden(i));
        match lines.last_mut() {
            Some(line) if line.is_hidden == this => line.points.push(point),
            last => {
                last.into_iter().for_each(|line| line.points.push(point));
                lines.push(Line { points: vec![point], is_hidden: this });
            }
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::super::session::tests::{SIZE, drawn};
    use super::*;
    use crate::window::camera::moved;

    /// The outline's smallest and largest place, and the share of its points that are hidden.
    fn extent(lines: &[Line]) -> (Vec2, Vec2, f32) {
        let points = || lines.iter().flat_map(|line| &line.points);
        let low = points().fold(Vec2::INFINITY, |low, p| low.min(*p));
        let high = points().fold(Vec2::NEG_INFINITY, |high, p| high.max(*p));
        let hidden: usize = lines.iter().filter(|line| line.is_hidden).map(|line| line.points.len()).sum();
        (low, high, hidden as f32 / points().count().max(1) as f32)
    }

    #[test]
    fn the_outline_is_about_the_objects_pixels() {
        let session = drawn().session;
        let object = ObjectId::from(session.scene.objects.len() - 1);
        let light = session.illumination().unwrap();
        let outlined = |view: View| {
            let key = Key { object, view, scene: light.generation(), size: [640, 480] };
            let mut lines = Vec::new();
            session.trace(&mut Default::default(), |tracer| lines = trace(tracer, &key));
            lines
        };
        let view = session.view(SIZE);
        // Its vertices tell where it has to be.
        let geometry = light.geometry();
        let range = geometry.objects[object.index()].vertices.clone();
        let local = view.relative_to(geometry.origin);
        let place = |v: u32| {
            let ndc = local.project(geometry.positions[v as usize]).0;
            Vec2::new(ndc.x + 1.0, 1.0 - ndc.y) * 0.5
        };
        let low = range.clone().map(place).fold(Vec2::INFINITY, Vec2::min);
        let high = range.map(place).fold(Vec2::NEG_INFINITY, Vec2::max);
        let (first, last, hidden) = extent(&outlined(view));
        assert!(first.abs_diff_eq(low, 0.01) && last.abs_diff_eq(high, 0.01), "{first} {last} {low} {high}");
        assert!(hidden < 0.05, "{hidden}");
        // From behind the wall, whose back is not there, too; and from where a pillar or the floor is before it, it
        // is hidden.
        let below = View { forward: Vec3::Y, up: Vec3::Z, right: Vec3::X, ..view };
        let middle = session.scene.world_from_node(session.scene.objects[object.index()].node).translation;
        let below = moved(&View { eye: middle, ..below }, Vec3::NEG_Z * 10.0);
        let (.., seen) = extent(&outlined(below));
        assert!(seen < 0.05, "the floor has one side: {seen}");
        // Behind the eye there is none.
        let away = View { forward: -view.forward, right: -view.right, ..view };
        assert!(outlined(away).is_empty());
    }

    #[test]
    fn triangles_are_cut_before_the_eye() {
        let corners = [Vec3::new(0.0, 0.0, -1.0), Vec3::new(0.0, 0.0, 1.0), Vec3::new(1.0, 0.0, 1.0)];
        let cut = before(&corners, |p| p.z);
        assert_eq!(cut.len(), 4);
        assert!(cut.iter().all(|p| p.z >= 0.0));
        assert!(before(&corners, |p| p.z - 2.0).is_empty());
        assert_eq!(before(&corners, |p| p.z + 2.0), corners);
    }
}
