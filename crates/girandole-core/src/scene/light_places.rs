//! Punctual lights that lie on surfaces: a bulb whose origin is in the plane of its ceiling.
//!
//! Rounding decides on which side of a surface such a light is, and whether a ray that ends there meets that surface. It is
//! therefore hung from the surface, a millimetre in a room of seven metres, to where it shines: a spot to the side that it points to, a
//! point light to the front of the surface, or, if that has no front, to the side where most of the scene is. Where several planes meet,
//! as in a corner, it is before all of them.
//!
//! Worked example: a point light in the plane of a ceiling is a millimetre below it. Rays from the room no longer end in the plane,
//! where every other one met the ceiling; what it sends up lights the ceiling, as that of a bulb there does.

use super::{Geometry, PunctualKind, Scene};
use crate::trace::ray_offset_distance;
use glam::{DVec3, Vec3};

/// How far a light is hung from what it lies on, as a share of [`Geometry::detail`].
const HUNG: f32 = 1.0 / 7000.0;
/// Planes whose normals have a greater cosine are one.
const SAME_PLANE: f32 = 0.999;
/// A spot points to a side of a plane if the sine of its elevation is greater.
const POINTS_AWAY: f32 = 0.01;
/// Steps that look for a place before all of several planes.
const STEPS: u32 = 16;

/// A light that may lie on something.
struct Place {
    light: usize,
    position: Vec3,
    /// Of a spot.
    forward: Option<Vec3>,
    /// How close to a surface it lies on that, but for rounding, metres.
    distance: f32,
    /// Unit normals of what it lies on, towards the side where it is to be; one a plane.
    planes: Vec<Vec3>,
}

/// How far each of the scene's lights is shifted, metres; the geometry's triangles are complete.
pub(super) fn shifts(scene: &Scene, geometry: &Geometry) -> Vec<Vec3> {
    let mut shifts = vec![Vec3::ZERO; scene.lights.len()];
    let mut places = places(scene, geometry);
    places.sort_by(|a, b| a.position.x.total_cmp(&b.position.x));
    let Some(most) = places.iter().map(|place| place.distance).max_by(f32::total_cmp) else { return shifts };
    for (index, triangle) in (0..).zip(&geometry.triangles) {
        let corners @ [a, b, c] = geometry.corners(index);
        let (low, high) = (a.min(b).min(c) - most, a.max(b).max(c) + most);
        let first = places.partition_point(|place| place.position.x < low.x);
        for place in places[first..].iter_mut().take_while(|place| place.position.x <= high.x) {
            let is_near = place.position.cmpge(low).all() && place.position.cmple(high).all();
            if is_near && touches(place.position, corners, place.distance) {
                let double_sided = scene.materials[triangle.material].double_sided;
                place.add(geometry, geometry.normal(index), double_sided);
            }
        }
    }
    for place in places {
        shifts[place.light] = place.shift(geometry);
    }
    shifts
}

fn places(scene: &Scene, geometry: &Geometry) -> Vec<Place> {
    if scene.lights.is_empty() {
        return Vec::new();
    }
    let world_from_nodes = scene.world_from_nodes();
    let place = |(light, punctual): (usize, &super::PunctualLight)| {
        let node = world_from_nodes.get(punctual.node.index())?;
        let position = (node.translation - geometry.origin).as_vec3();
        let forward = match punctual.kind {
            PunctualKind::Directional => return None,
            PunctualKind::Point => None,
            PunctualKind::Spot { .. } => {
                Some(node.transform_vector3(DVec3::NEG_Z).normalize_or_zero().as_vec3())
            }
        };
        let distance = ray_offset_distance(geometry, position);
        position.is_finite().then_some(Place { light, position, forward, distance, planes: Vec::new() })
    };
    scene.lights.iter().enumerate().filter_map(place).collect()
}

impl Place {
    /// Adds a plane, with the normal of its front.
    fn add(&mut self, geometry: &Geometry, normal: Vec3, double_sided: bool) {
        if self.planes.iter().any(|plane| plane.dot(normal).abs() > SAME_PLANE) {
            return;
        }
        let is_behind = match self.forward {
            Some(forward) if forward.dot(normal).abs() > POINTS_AWAY => forward.dot(normal) < 0.0,
            _ => double_sided && most_is_behind(geometry, self.position, normal),
        };
        self.planes.push(if is_behind { -normal } else { normal });
    }

    /// To a place before all planes, as near as that can be, about, and no more than halfway to what is before them.
    fn shift(&self, geometry: &Geometry) -> Vec3 {
        let mut towards = Vec3::ZERO;
        for _ in 0..STEPS {
            for plane in &self.planes {
                towards += *plane * (1.0 - plane.dot(towards)).max(0.0);
            }
        }
        if towards == Vec3::ZERO {
            return towards;
        }
        let hung = (HUNG * geometry.detail()).max(self.distance);
        let free = |triangle: u32| {
            let t = meets(self.position, towards * hung, geometry.corners(triangle));
            if t > self.distance / hung { t } else { f32::INFINITY }
        };
        let nearest = (0..geometry.triangles.len() as u32).map(free).fold(2.0, f32::min);
        towards * (0.5 * nearest * hung)
    }
}

/// Where a ray meets a triangle; infinite if it does not (Möller and Trumbore 1997).
fn meets(origin: Vec3, direction: Vec3, [a, b, c]: [Vec3; 3]) -> f32 {
    let [origin, direction, a, b, c] = [origin, direction, a, b, c].map(Vec3::as_dvec3);
    let (u, v, to) = (b - a, c - a, origin - a);
    let (p, q) = (direction.cross(v), to.cross(u));
    let inverse = u.dot(p).recip();
    let (x, y, t) = (to.dot(p) * inverse, direction.dot(q) * inverse, v.dot(q) * inverse);
    if x >= 0.0 && y >= 0.0 && x + y <= 1.0 && t > 0.0 { t as f32 } else { f32::INFINITY }
}

/// Whether most of the scene's surface is behind a plane.
fn most_is_behind(geometry: &Geometry, point: Vec3, normal: Vec3) -> bool {
    let of = |triangle: u32| {
        let middle = geometry.corners(triangle).into_iter().sum::<Vec3>() / 3.0;
        f64::from(geometry.area(triangle)) * f64::from(normal.dot(middle - point).signum())
    };
    // What is in the plane itself is on no side.
    let is_beside = |triangle: &u32| {
        let far = |corner: Vec3| normal.dot(corner - point).abs() > 1e-4 * corner.distance(point);
        geometry.corners(*triangle).into_iter().any(far)
    };
    (0..geometry.triangles.len() as u32).filter(is_beside).map(of).sum::<f64>() < 0.0
}

/// Whether a point is closer to a triangle than that.
fn touches(point: Vec3, corners: [Vec3; 3], distance: f32) -> bool {
    let [a, b, c] = corners.map(|corner| (corner - point).as_dvec3());
    let Some(normal) = (b - a).cross(c - a).try_normalize() else { return false };
    let distance = f64::from(distance);
    let is_inside =
        |from: DVec3, to: DVec3| normal.cross(to - from).normalize_or_zero().dot(from) <= distance;
    normal.dot(a).abs() <= distance && is_inside(a, b) && is_inside(b, c) && is_inside(c, a)
}
