//! Handles at the object that is picked: arrows to move it along the world's axes, a disc to move it in the picture's plane,
//! rings to turn it.

use super::session::Session;
use super::tools::Tools;
use egui::{Color32, Painter, Pos2, Rect, Response, Stroke};
use girandole::DebugView;
use girandole_core::glam::{DAffine3, DQuat, DVec2, DVec3, Vec2, Vec3};
use girandole_core::scene::{Edit, NamedIndex, Object, ObjectId, Transform, View};

/// Length of an arrow, in halves of the picture's height.
const LENGTH: f64 = 0.3;
/// Radius of a ring, in arrows.
const RING: f64 = 0.75;
/// Radius of the disc, points.
const DISC: f32 = 7.0;
/// How near the pointer has to be to a handle, points.
const REACH: f32 = 8.0;
/// Straight pieces of a ring.
const PIECES: u32 = 48;
const AXES: [(DVec3, Color32); 3] = [
    (DVec3::X, Color32::from_rgb(235, 80, 70)),
    (DVec3::Y, Color32::from_rgb(100, 200, 80)),
    (DVec3::Z, Color32::from_rgb(80, 140, 245)),
];

/// What can be dragged.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Handle {
    Arrow(usize),
    Ring(usize),
    Disc,
}

/// A drag at a handle.
#[derive(Clone, Copy, Debug)]
pub struct Drag {
    handle: Handle,
    object: ObjectId,
    center: DVec3,
    /// Where the pointer's ray was, and the object's node, when it began.
    from: Ray,
    world: DAffine3,
}

/// A ray into the scene.
#[derive(Clone, Copy, Debug)]
struct Ray {
    origin: DVec3,
    direction: DVec3,
}

impl Ray {
    fn new(view: &View, at: Vec2) -> Self {
        let (origin, direction) = view.relative_to(view.eye).ray(at);
        Self { origin: view.eye + origin.as_dvec3(), direction: direction.as_dvec3().normalize() }
    }

    /// Where it meets a plane; `None` where it runs along it, or away from it.
    fn plane(&self, point: DVec3, normal: DVec3) -> Option<DVec3> {
        let t = (point - self.origin).dot(normal) / self.direction.dot(normal);
        (t.is_finite() && t > 0.0).then(|| self.origin + self.direction * t)
    }

    /// How far along a line through `point` it comes nearest to it.
    fn along(&self, point: DVec3, axis: DVec3) -> Option<f64> {
        let normal = self.direction.cross(axis).cross(axis);
        Some((self.plane(point, normal.try_normalize()?)? - point).dot(axis))
    }

    /// The angle about an axis through `point`, of where it meets the plane across.
    fn angle(&self, point: DVec3, axis: DVec3) -> Option<f64> {
        let [u, v] = across(axis);
        let to = self.plane(point, axis)? - point;
        Some(DVec2::new(to.dot(u), to.dot(v)).to_angle())
    }
}

/// Two axes across another one, right-handed with it.
fn across(axis: DVec3) -> [DVec3; 2] {
    let u = DVec3::new(axis.y, axis.z, axis.x);
    [u, axis.cross(u)]
}

impl Drag {
    /// What the object's node becomes, in the world.
    fn moved(&self, view: &View, to: Ray) -> Option<DAffine3> {
        let Self { handle, center, from, world, .. } = *self;
        let shift = match handle {
            Handle::Arrow(axis) => {
                let axis = AXES[axis].0;
                axis * (to.along(center, axis)? - from.along(center, axis)?)
            }
            Handle::Disc => {
                let normal = view.forward.as_dvec3();
                to.plane(center, normal)? - from.plane(center, normal)?
            }
            Handle::Ring(axis) => {
                let axis = AXES[axis].0;
                let turn = DQuat::from_axis_angle(axis, to.angle(center, axis)? - from.angle(center, axis)?);
                let about = DAffine3::from_rotation_translation(turn, center - turn * center);
                return Some(about * world);
            }
        };
        Some(DAffine3::from_translation(shift) * world)
    }
}

/// The handles of an object, on the screen.
struct Handles<'a> {
    view: &'a View,
    rect: Rect,
    center: DVec3,
    /// Of an arrow, metres.
    length: f64,
}

impl<'a> Handles<'a> {
    fn new(view: &'a View, rect: Rect, center: DVec3) -> Self {
        let distance = (center - view.eye).dot(view.forward.as_dvec3()).max(1e-6);
        let half_height = f64::from(view.half_extent.y) * if view.orthographic { 1.0 } else { distance };
        Self { view, rect, center, length: half_height * LENGTH }
    }

    /// Where a point is on the screen; `None` behind the eye.
    fn screen(&self, point: DVec3) -> Option<Pos2> {
        let (ndc, distance) = self.view.relative_to(point).project(Vec3::ZERO);
        let share = egui::vec2(ndc.x + 1.0, 1.0 - ndc.y) * 0.5;
        (distance > 0.0).then(|| self.rect.min + share * self.rect.size())
    }

    fn line(&self, handle: Handle) -> Vec<Pos2> {
        let points: Vec<DVec3> = match handle {
            Handle::Disc => vec![self.center],
            Handle::Arrow(axis) => vec![self.center, self.center + AXES[axis].0 * self.length],
            Handle::Ring(axis) => {
                let [u, v] = across(AXES[axis].0);
                let radius = self.length * RING;
                let point = |i: u32| {
                    let at = DVec2::from_angle(std::f64::consts::TAU * f64::from(i) / f64::from(PIECES));
                    self.center + (u * at.x + v * at.y) * radius
                };
                (0..=PIECES).map(point).collect()
            }
        };
        points.into_iter().filter_map(|point| self.screen(point)).collect()
    }

    /// The handle under the pointer.
    fn at(&self, pointer: Pos2) -> Option<Handle> {
        let near = |handle: &Handle| {
            let line = self.line(*handle);
            line.iter().any(|p| p.distance(pointer) < REACH)
                || line.windows(2).any(|piece| distance(pointer, piece[0], piece[1]) < REACH)
        };
        all().into_iter().find(near)
    }

    fn paint(&self, painter: &Painter, highlighted: Option<Handle>) {
        for handle in all() {
            let line = self.line(handle);
            let color = match handle {
                Handle::Arrow(axis) | Handle::Ring(axis) => AXES[axis].1,
                Handle::Disc => Color32::WHITE,
            };
            let color = if highlighted == Some(handle) { Color32::YELLOW } else { color };
            match (handle, line.as_slice()) {
                (Handle::Disc, [center]) => {
                    painter.circle(*center, DISC, color.gamma_multiply(0.4), Stroke::new(1.5, color));
                }
                (Handle::Arrow(_), [from, to]) => painter.arrow(*from, *to - *from, Stroke::new(2.5, color)),
                _ => drop(painter.line(line, Stroke::new(1.5, color))),
            }
        }
    }
}

/// All handles, those that are easily missed first.
fn all() -> [Handle; 7] {
    use Handle::{Arrow, Disc, Ring};
    [Disc, Arrow(0), Arrow(1), Arrow(2), Ring(0), Ring(1), Ring(2)]
}

/// Distance of a point to a piece of a line.
fn distance(point: Pos2, from: Pos2, to: Pos2) -> f32 {
    let along = to - from;
    let t = ((point - from).dot(along) / along.length_sq().max(1e-6)).clamp(0.0, 1.0);
    point.distance(from + along * t)
}

/// Shows the handles of what is picked, and lets them be dragged. Returns whether the pointer is theirs.
pub fn act(painter: &Painter, response: &Response, session: &mut Session, tools: &mut Tools) -> bool {
    let view = session.view(tools.picture_size);
    // The atlas shows no scene.
    let selected = tools.selected.filter(|_| session.settings.debug != Some(DebugView::Atlas));
    let Some((id, center)) = selected.and_then(|id| Some((id, center(session, id)?))) else {
        tools.drag = None;
        return false;
    };
    let handles = Handles::new(&view, response.rect, center);
    let pointer = response.ctx.input(|input| input.pointer.interact_pos());
    let pressed = response.ctx.input(|input| input.pointer.press_origin());
    let under = |at: Option<Pos2>| at.and_then(|at| handles.at(at));
    if response.drag_started_by(egui::PointerButton::Primary)
        && let Some((handle, at)) = under(pressed).zip(pressed)
    {
        let world = session.scene.world_from_node(session.scene.objects[id.index()].node);
        let from = Ray::new(&view, super::controls::place(response, at));
        tools.drag = Some(Drag { handle, object: id, center, from, world });
    }
    // A slow frame may hold the end of a drag together with its last steps.
    let primary = egui::PointerButton::Primary;
    if !response.dragged_by(primary) && !response.drag_stopped_by(primary) {
        tools.drag = None;
    }
    let highlighted = tools.drag.map(|drag| drag.handle).or_else(|| under(pointer));
    handles.paint(&painter.with_clip_rect(response.rect), highlighted);
    if let (Some(drag), Some(at)) = (tools.drag, pointer) {
        let to = Ray::new(&view, super::controls::place(response, at));
        drag.moved(&view, to).into_iter().for_each(|world| put(session, drag.object, world));
    }
    highlighted.is_some()
}

/// The middle of the bounds of an object, as it was last drawn; `None` where it cannot be moved by its node.
fn center(session: &Session, id: ObjectId) -> Option<DVec3> {
    let movable = |object: &&Object| !object.removed && object.skin.is_none();
    session.scene.objects.get(id.index()).filter(movable)?;
    let geometry = session.renderer()?.illumination()?.geometry();
    let range = geometry.objects.get(id.index())?.vertices.clone();
    let positions = &geometry.positions[range.start as usize..range.end as usize];
    let first = *positions.first()?;
    let (low, high) = positions.iter().fold((first, first), |(low, high), &p| (low.min(p), high.max(p)));
    Some(geometry.origin + ((low + high) * 0.5).as_dvec3())
}

/// Puts an object's node elsewhere in the world.
fn put(session: &mut Session, id: ObjectId, world: DAffine3) {
    let node = session.scene.objects[id.index()].node;
    let parent = session.scene.nodes[node].parent;
    let above = parent.map_or(DAffine3::IDENTITY, |parent| session.scene.world_from_node(parent));
    let local = Transform::Affine(above.inverse() * world);
    let node = NamedIndex::node(&session.scene, node);
    session.edit(Edit::SetTransform { node, transform: local });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From 10 m in front of the origin, 90° high.
    fn view() -> View {
        View {
            eye: DVec3::Z * 10.0,
            right: Vec3::X,
            up: Vec3::Y,
            forward: Vec3::NEG_Z,
            half_extent: Vec2::ONE,
            center: Vec2::ZERO,
            orthographic: false,
            depth: None,
        }
    }

    fn dragged(handle: Handle, from: Vec2, to: Vec2) -> DAffine3 {
        let (view, object) = (view(), ObjectId(0));
        let from = Ray::new(&view, from);
        let drag = Drag { handle, object, center: DVec3::ZERO, from, world: DAffine3::IDENTITY };
        drag.moved(&view, Ray::new(&view, to)).unwrap()
    }

    #[test]
    fn an_arrow_moves_along_its_axis_as_far_as_the_pointer() {
        let moved = dragged(Handle::Arrow(0), Vec2::new(0.1, 0.0), Vec2::new(0.3, 0.0));
        assert!(moved.translation.abs_diff_eq(DVec3::X * 2.0, 1e-6), "{moved}");
        let beside = dragged(Handle::Arrow(0), Vec2::new(0.1, 0.0), Vec2::new(0.3, 0.2));
        assert!(
            beside.translation.x > 1.5
                && beside.translation.abs_diff_eq(DVec3::X * beside.translation.x, 1e-6),
            "{beside}"
        );
    }

    #[test]
    fn the_disc_moves_in_the_pictures_plane() {
        let moved = dragged(Handle::Disc, Vec2::ZERO, Vec2::new(0.3, -0.2));
        assert!(moved.translation.abs_diff_eq(DVec3::new(3.0, -2.0, 0.0), 1e-6), "{moved}");
    }

    #[test]
    fn a_ring_turns_about_its_axis_and_leaves_the_centre() {
        let moved = dragged(Handle::Ring(2), Vec2::new(0.2, 0.0), Vec2::new(0.0, 0.2));
        assert!(moved.transform_point3(DVec3::X).abs_diff_eq(DVec3::Y, 1e-6), "{moved}");
        assert!(moved.transform_point3(DVec3::ZERO).abs_diff_eq(DVec3::ZERO, 1e-6));
    }

    #[test]
    fn the_pointer_finds_handles_where_they_are_drawn() {
        let (view, rect) = (view(), Rect::from_min_size(Pos2::ZERO, egui::vec2(800.0, 800.0)));
        let handles = Handles::new(&view, rect, DVec3::ZERO);
        assert_eq!(handles.at(Pos2::new(400.0, 400.0)), Some(Handle::Disc));
        assert_eq!(handles.at(Pos2::new(460.0, 402.0)), Some(Handle::Arrow(0)));
        assert_eq!(handles.at(Pos2::new(400.0, 340.0)), Some(Handle::Arrow(1)));
        assert_eq!(handles.at(Pos2::new(700.0, 100.0)), None);
    }
}
