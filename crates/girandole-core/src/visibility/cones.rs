//! Cones about all rays between a light and a receiver, against bounding spheres.

use super::primitives::Tolerance;
use super::pyramid::Containment;
use super::shapes::{Apex, Shape};
use glam::DVec3;

/// A bounding sphere.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sphere {
    pub center: DVec3,
    pub radius: f64,
}

impl Sphere {
    /// Of a box.
    pub fn of_box(low: DVec3, high: DVec3) -> Self {
        Self { center: (low + high) * 0.5, radius: 0.5 * (high - low).length() }
    }
}

/// What a cone depends on of a receiver, whichever the light is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ConeBase {
    /// Contains all ray origins, tolerances included.
    sphere: Sphere,
    /// How far rays may be outside of the cone.
    room: f64,
    /// Of a patch the normal, and the radius of a circle about the centre within it; else zeros.
    normal: DVec3,
    inscribed: f64,
}

impl ConeBase {
    /// Of whatever is in a sphere that has room already.
    pub fn of_sphere(sphere: Sphere, tolerance: &Tolerance) -> Self {
        Self { sphere, room: tolerance.room(), normal: DVec3::ZERO, inscribed: 0.0 }
    }

    /// Radius of a circle or a sphere that lies about within the receiver, metres.
    pub fn inner_radius(&self) -> f64 {
        if self.normal == DVec3::ZERO { 0.5 * self.sphere.radius } else { self.inscribed }
    }

    pub fn new(shape: &Shape, tolerance: &Tolerance) -> Self {
        let (center, radius) = shape.sphere(tolerance);
        let (mut normal, mut inscribed) = (DVec3::ZERO, 0.0);
        if let Shape::Patch { corners, plane } = shape {
            normal = plane.normal;
            let distance = |i: usize| {
                let (a, b) = (corners[i], corners[(i + 1) % corners.len()]);
                normal.cross(b - a).normalize_or_zero().dot(center - a)
            };
            inscribed = (0..corners.len()).map(distance).fold(f64::INFINITY, f64::min).max(0.0);
        }
        Self { sphere: Sphere { center, radius }, room: tolerance.room(), normal, inscribed }
    }
}

/// The convex hull of a light and a receiver's bounding sphere, and what of it certainly is within the pyramid of the two:
/// cheaper to test than that.
#[derive(Debug)]
pub(crate) struct ShadowCone<'a> {
    base: &'a ConeBase,
    /// From the receiver's centre to the light, unit length; zero for a light within the sphere.
    towards: DVec3,
    /// The light's distance from the centre.
    length: f64,
    /// Of the angle between axis and surface.
    sine: f64,
    cosine_square: f64,
    /// The same, and the radius of a sphere about the centre, of a cone within the pyramid.
    inner_radius: f64,
    inner_sine: f64,
}

impl<'a> ShadowCone<'a> {
    pub fn new(apex: &Apex, base: &'a ConeBase) -> Self {
        let Sphere { center, radius } = base.sphere;
        let towards = apex.towards(center);
        let distance = towards.length();
        let mut result = Self {
            base,
            towards: DVec3::ZERO,
            length: f64::INFINITY,
            sine: 0.0,
            cosine_square: 1.0,
            inner_radius: 0.0,
            inner_sine: 0.0,
        };
        if !apex.finite {
            result.towards = towards / distance;
            result.inner_radius = base.inscribed * base.normal.dot(result.towards) - base.room;
        } else if distance > radius {
            (result.towards, result.length, result.sine) = (towards / distance, distance, radius / distance);
            result.cosine_square = 1.0 - result.sine * result.sine;
            // Where the receiver's plane and the light's cut nothing off.
            if apex.normal.dot(-towards) >= radius {
                // The plane through the light and an edge is nearer to the centre than the edge, as the light's height is
                // less than its distance from the edge.
                let height = base.normal.dot(towards);
                result.inner_radius = base.inscribed * height / (distance + radius) - base.room;
                result.inner_sine = result.inner_radius / distance;
            }
        }
        result
    }

    /// Whether the first of two spheres is nearer to the axis.
    pub fn is_nearer(&self, sphere: &Sphere, other: &Sphere) -> bool {
        let distance_square = |sphere: &Sphere| {
            let beside = sphere.center - self.base.sphere.center;
            let along = beside.dot(self.towards).max(0.0);
            beside.length_squared() - along * along
        };
        distance_square(sphere) < distance_square(other)
    }

    /// Whether it may touch a sphere.
    pub fn may_touch(&self, sphere: &Sphere) -> bool {
        self.classify(sphere) != Containment::Outside
    }

    /// Where a sphere is: outside, or certainly inside the pyramid, or neither is known.
    pub fn classify(&self, sphere: &Sphere) -> Containment {
        let beside = sphere.center - self.base.sphere.center;
        let reach = sphere.radius + self.base.room;
        let (along, square) = (beside.dot(self.towards), beside.length_squared());
        let across = square - along * along;
        let at_center = self.base.sphere.radius + reach;
        if along < 0.0 || along * along * self.cosine_square < across * (1.0 - self.cosine_square) {
            // Of the hull, the receiver's sphere is nearest.
            return if square > at_center * at_center { Containment::Outside } else { Containment::Crossing };
        }
        let width = at_center - along * self.sine;
        if width < 0.0 || across * self.cosine_square > width * width || along > self.length + reach {
            return Containment::Outside;
        }
        let left = self.inner_radius - along * self.inner_sine - sphere.radius;
        let is_inside = left >= 0.0
            && across <= left * left
            && along + sphere.radius <= self.length
            && beside.dot(self.base.normal) >= reach;
        if is_inside { Containment::Inside } else { Containment::Crossing }
    }
}
