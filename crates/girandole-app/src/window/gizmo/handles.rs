//! The handles of what is picked: where they are on the screen, which one is under the pointer, and what a drag at
//! one does.

use egui::{Color32, Painter, Pos2, Rect, Stroke};
use girandole_core::glam::{DAffine3, DMat3, DQuat, DVec2, DVec3, Vec2, Vec3};
use girandole_core::scene::View;

/// Length of an arrow, in halves of the picture's height.
const LENGTH: f64 = 0.3;
/// Radius of a ring, and distance of a scale handle from the centre, in arrows.
const RING: f64 = 0.75;
const SCALE: f64 = 1.25;
/// Distance of the handle that scales all axes, to the right and up, in arrows.
const CORNER: f64 = 0.32;
/// Radius of the disc, and half the side of a scale handle, points.
const DISC: f32 = 7.0;
const BOX: f32 = 4.5;
/// How near the pointer has to be to a handle, points.
const REACH: f32 = 8.0;
/// Straight pieces of a ring.
const PIECES: u32 = 48;
/// Of a snapped turn, radians, and of a snapped scale.
const TURN: f64 = std::f64::consts::PI / 12.0;
const FACTOR: f64 = 0.1;
/// Factors of a drag at a scale handle.
const LEAST: f64 = 0.01;
const MOST: f64 = 100.0;
const AXES: [(DVec3, Color32); 3] = [
    (DVec3::X, Color32::from_rgb(235, 80, 70)),
    (DVec3::Y, Color32::from_rgb(100, 200, 80)),
    (DVec3::Z, Color32::from_rgb(80, 140, 245)),
];

/// What can be dragged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Handle {
    Arrow(usize),
    Ring(usize),
    Disc,
    /// Along one of its own axes.
    Scale(usize),
    ScaleAll,
}

/// A ray into the scene.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    origin: DVec3,
    direction: DVec3,
}

impl Ray {
    pub fn new(view: &View, at: Vec2) -> Self {
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

/// A drag at a handle.
#[derive(Clone, Copy, Debug)]
pub struct Grip {
    pub handle: Handle,
    pub center: DVec3,
    /// Where the pointer's ray was, and the node in the world, when it began.
    pub from: Ray,
    pub world: DAffine3,
}

impl Grip {
    /// What the node becomes, in the world; `grid` is the step of moves, metres, where drags go by steps.
    pub fn moved(&self, view: &View, to: Ray, grid: Option<f64>) -> Option<DAffine3> {
        let Self { handle, center, from, world, .. } = *self;
        let snapped = |x: f64, step: f64| if grid.is_some() { (x / step).round() * step } else { x };
        let scaled = |factor: f64, axis: Option<DVec3>| {
            let least = if grid.is_some() { FACTOR } else { LEAST };
            let factor = snapped(factor, FACTOR).clamp(least, MOST);
            let map = match axis {
                Some(axis) => DMat3::IDENTITY + outer(axis) * (factor - 1.0),
                None => DMat3::IDENTITY * factor,
            };
            DAffine3 { matrix3: map, translation: center - map * center } * world
        };
        let shift = match handle {
            Handle::Arrow(axis) => {
                let axis = AXES[axis].0;
                let by = to.along(center, axis)? - from.along(center, axis)?;
                axis * grid.map_or(by, |step| snapped(by, step))
            }
            Handle::Disc => {
                let normal = view.forward.as_dvec3();
                let by = to.plane(center, normal)? - from.plane(center, normal)?;
                grid.map_or(by, |step| (by / step).round() * step)
            }
            Handle::Ring(axis) => {
                let axis = AXES[axis].0;
                let angle = snapped(to.angle(center, axis)? - from.angle(center, axis)?, TURN);
                let turn = DQuat::from_axis_angle(axis, angle);
                let about = DAffine3::from_rotation_translation(turn, center - turn * center);
                return Some(about * world);
            }
            Handle::Scale(axis) => {
                let axis = own_axes(&world)[axis];
                let factor = to.along(center, axis)? / from.along(center, axis)?;
                return Some(scaled(factor, Some(axis)));
            }
            Handle::ScaleAll => {
                let normal = view.forward.as_dvec3();
                let aside = (view.right + view.up).as_dvec3();
                let reach = |ray: Ray| Some((ray.plane(center, normal)? - center).dot(aside));
                return Some(scaled(reach(to)? / reach(from)?, None));
            }
        };
        Some(DAffine3::from_translation(shift) * world)
    }
}

/// The matrix that keeps of a vector what is along an axis.
fn outer(axis: DVec3) -> DMat3 {
    DMat3::from_cols(axis * axis.x, axis * axis.y, axis * axis.z)
}

/// A node's axes in the world, of length 1.
fn own_axes(world: &DAffine3) -> [DVec3; 3] {
    let matrix = world.matrix3;
    let axis = |column: DVec3, i: usize| column.try_normalize().unwrap_or(AXES[i].0);
    [axis(matrix.x_axis, 0), axis(matrix.y_axis, 1), axis(matrix.z_axis, 2)]
}

/// The handles of something, on the screen.
pub struct Handles<'a> {
    view: &'a View,
    rect: Rect,
    center: DVec3,
    axes: [DVec3; 3],
    /// Of an arrow, metres.
    length: f64,
    all: Vec<Handle>,
}

/// Where a point is on the screen; `None` behind the eye.
pub fn screen(view: &View, rect: Rect, point: DVec3) -> Option<Pos2> {
    let (ndc, distance) = view.relative_to(point).project(Vec3::ZERO);
    let share = egui::vec2(ndc.x + 1.0, 1.0 - ndc.y) * 0.5;
    (distance > 0.0).then(|| rect.min + share * rect.size())
}

impl<'a> Handles<'a> {
    /// Of a node at a place, as far as it can be turned and scaled.
    pub fn new(
        (view, rect): (&'a View, Rect),
        center: DVec3,
        world: &DAffine3,
        (turns, scales): (bool, bool),
    ) -> Self {
        let distance = (center - view.eye).dot(view.forward.as_dvec3()).max(1e-6);
        let half_height = f64::from(view.half_extent.y) * if view.orthographic { 1.0 } else { distance };
        Self {
            view,
            rect,
            center,
            axes: own_axes(world),
            length: half_height * LENGTH,
            all: all().into_iter().filter(|handle| handle.is_among(turns, scales)).collect(),
        }
    }

    fn line(&self, handle: Handle) -> Vec<Pos2> {
        let Self { view, rect, center, length, .. } = *self;
        let points: Vec<DVec3> = match handle {
            Handle::Disc => vec![center],
            Handle::Arrow(axis) => vec![center, center + AXES[axis].0 * length],
            Handle::Scale(axis) => vec![center + self.axes[axis] * (length * SCALE)],
            Handle::ScaleAll => vec![center + (view.right + view.up).as_dvec3() * (length * CORNER)],
            Handle::Ring(axis) => {
                let [u, v] = across(AXES[axis].0);
                let radius = length * RING;
                let point = |i: u32| {
                    let at = DVec2::from_angle(std::f64::consts::TAU * f64::from(i) / f64::from(PIECES));
                    center + (u * at.x + v * at.y) * radius
                };
                (0..=PIECES).map(point).collect()
            }
        };
        points.into_iter().filter_map(|point| screen(view, rect, point)).collect()
    }

    /// The handle under the pointer.
    pub fn at(&self, pointer: Pos2) -> Option<Handle> {
        let near = |handle: &Handle| {
            let line = self.line(*handle);
            line.iter().any(|p| p.distance(pointer) < REACH)
                || line.windows(2).any(|piece| distance(pointer, piece[0], piece[1]) < REACH)
        };
        self.all.iter().copied().find(near)
    }

    pub fn paint(&self, painter: &Painter, highlighted: Option<Handle>) {
        // The first ones lie on top.
        for &handle in self.all.iter().rev() {
            let line = self.line(handle);
            let color = if highlighted == Some(handle) { Color32::YELLOW } else { handle.color() };
            match (handle, line.as_slice()) {
                (Handle::Disc, [center]) => {
                    painter.circle(*center, DISC, color.gamma_multiply(0.4), Stroke::new(1.5, color));
                }
                (Handle::Scale(_) | Handle::ScaleAll, [center]) => {
                    let square = Rect::from_center_size(*center, egui::Vec2::splat(2.0 * BOX));
                    painter.rect(
                        square,
                        1.0,
                        color,
                        Stroke::new(1.0, Color32::BLACK),
                        egui::StrokeKind::Outside,
                    );
                }
                (Handle::Arrow(_), [from, to]) => painter.arrow(*from, *to - *from, Stroke::new(2.5, color)),
                _ => drop(painter.line(line, Stroke::new(1.5, color))),
            }
        }
    }
}

impl Handle {
    fn color(self) -> Color32 {
        match self {
            Self::Arrow(axis) | Self::Ring(axis) | Self::Scale(axis) => AXES[axis].1,
            Self::Disc | Self::ScaleAll => Color32::WHITE,
        }
    }

    fn is_among(self, turns: bool, scales: bool) -> bool {
        match self {
            Self::Arrow(_) | Self::Disc => true,
            Self::Ring(_) => turns,
            Self::Scale(_) | Self::ScaleAll => scales,
        }
    }
}

/// All handles, those that are easily missed first.
fn all() -> [Handle; 11] {
    use Handle::{Arrow, Disc, Ring, Scale, ScaleAll};
    [Disc, ScaleAll, Scale(0), Scale(1), Scale(2), Arrow(0), Arrow(1), Arrow(2), Ring(0), Ring(1), Ring(2)]
}

/// Distance of a point to a piece of a line.
fn distance(point: Pos2, from: Pos2, to: Pos2) -> f32 {
    let along = to - from;
    let t = ((point - from).dot(along) / along.length_sq().max(1e-6)).clamp(0.0, 1.0);
    point.distance(from + along * t)
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
            clip: Default::default(),
        }
    }

    fn dragged_from(world: DAffine3, handle: Handle, from: Vec2, to: Vec2, grid: Option<f64>) -> DAffine3 {
        let view = view();
        let from = Ray::new(&view, from);
        let grip = Grip { handle, center: DVec3::ZERO, from, world };
        grip.moved(&view, Ray::new(&view, to), grid).unwrap()
    }

    fn dragged(handle: Handle, from: Vec2, to: Vec2) -> DAffine3 {
        dragged_from(DAffine3::IDENTITY, handle, from, to, None)
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
    fn boxes_scale_along_the_objects_own_axes_and_the_corner_all_of_them() {
        let quarter = DAffine3::from_rotation_z(std::f64::consts::FRAC_PI_2);
        // Its own X is the world's Y.
        let (from, to) = (Vec2::new(0.0, 0.2), Vec2::new(0.0, 0.3));
        let scaled = dragged_from(quarter, Handle::Scale(0), from, to, None);
        assert!(scaled.transform_vector3(DVec3::X).abs_diff_eq(DVec3::Y * 1.5, 1e-6), "{scaled}");
        assert!(scaled.transform_vector3(DVec3::Y).abs_diff_eq(DVec3::NEG_X, 1e-6), "{scaled}");
        let all = dragged(Handle::ScaleAll, Vec2::new(0.1, 0.1), Vec2::new(0.2, 0.2));
        assert!(all.abs_diff_eq(DAffine3::from_scale(DVec3::splat(2.0)), 1e-6), "{all}");
        // Never inside out.
        let through = dragged(Handle::ScaleAll, Vec2::new(0.1, 0.1), Vec2::new(-0.2, -0.2));
        assert!(through.matrix3.determinant() > 0.0, "{through}");
    }

    #[test]
    fn snapped_drags_go_by_steps() {
        let snapped = |handle, from, to| dragged_from(DAffine3::IDENTITY, handle, from, to, Some(0.5));
        let moved = snapped(Handle::Arrow(0), Vec2::ZERO, Vec2::new(0.17, 0.0));
        assert!(moved.translation.abs_diff_eq(DVec3::X * 1.5, 1e-9), "{moved}");
        let plane = snapped(Handle::Disc, Vec2::ZERO, Vec2::new(0.3, -0.22));
        assert!(plane.translation.abs_diff_eq(DVec3::new(3.0, -2.0, 0.0), 1e-9), "{plane}");
        let turned = snapped(Handle::Ring(2), Vec2::new(0.2, 0.0), Vec2::new(0.2, 0.06));
        assert!(turned.abs_diff_eq(DAffine3::from_rotation_z(TURN), 1e-9), "{turned}");
        let scaled = snapped(Handle::ScaleAll, Vec2::new(0.1, 0.1), Vec2::new(0.134, 0.134));
        assert!(scaled.abs_diff_eq(DAffine3::from_scale(DVec3::splat(1.3)), 1e-9), "{scaled}");
        let least = snapped(Handle::ScaleAll, Vec2::new(0.1, 0.1), Vec2::new(0.001, 0.001));
        assert!(least.abs_diff_eq(DAffine3::from_scale(DVec3::splat(FACTOR)), 1e-9), "{least}");
    }

    #[test]
    fn the_pointer_finds_handles_where_they_are_drawn() {
        let (view, rect) = (view(), Rect::from_min_size(Pos2::ZERO, egui::vec2(800.0, 800.0)));
        let of = |kinds| Handles::new((&view, rect), DVec3::ZERO, &DAffine3::IDENTITY, kinds);
        let handles = of((true, true));
        for (at, handle) in [
            ([400.0, 400.0], Some(Handle::Disc)),
            ([460.0, 402.0], Some(Handle::Arrow(0))),
            ([400.0, 340.0], Some(Handle::Arrow(1))),
            ([550.0, 400.0], Some(Handle::Scale(0))),
            ([400.0, 250.0], Some(Handle::Scale(1))),
            ([438.0, 362.0], Some(Handle::ScaleAll)),
            ([700.0, 100.0], None),
        ] {
            assert_eq!(handles.at(Pos2::from(at)), handle, "{at:?}");
        }
        // A point light neither turns nor grows.
        assert_eq!(of((false, false)).at(Pos2::new(550.0, 400.0)), None);
    }
}
