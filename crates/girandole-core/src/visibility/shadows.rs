//! What lies behind a mover as a light sees it, against boxes about receivers.

use super::cones::Sphere;
use super::shapes::Apex;
use glam::DVec3;

/// A box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub center: DVec3,
    pub half_extent: DVec3,
}

/// Whether a sphere may touch a ray from a polygon, counter-clockwise about its normal, to a light in front of it.
pub(super) fn may_hide(sphere: &Sphere, apex: &Apex, corners: &[DVec3], normal: DVec3) -> bool {
    let Sphere { center, radius } = *sphere;
    let is_behind = |i: usize| {
        let (a, b) = (corners[i], corners[(i + 1) % corners.len()]);
        // Into the pyramid of the two, of any length.
        let side = apex.towards(a).cross(b - a);
        let height = side.dot(center - a);
        height < 0.0 && height * height > radius * radius * side.length_squared()
    };
    normal.dot(center - corners[0]) >= -radius && !(0..corners.len()).any(is_behind)
}

impl Bounds {
    pub fn new(low: DVec3, high: DVec3) -> Self {
        Self { center: (low + high) * 0.5, half_extent: (high - low) * 0.5 }
    }
}

/// All that rays of a light reach through a sphere, and beyond it: a part of a cone, or of a cylinder if they are parallel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shadow {
    /// On the axis, from which distances along it count.
    origin: DVec3,
    /// Along which light goes, unit length; its reciprocals, and its magnitudes.
    direction: DVec3,
    inverse: DVec3,
    magnitude: DVec3,
    /// No point of it is nearer than this along the axis.
    near: f64,
    /// Its radius is `base + slope · distance`.
    base: f64,
    slope: f64,
}

impl Shadow {
    /// None where all of the sphere is behind the light.
    pub fn new(apex: &Apex, sphere: &Sphere) -> Option<Self> {
        let Sphere { center, radius } = *sphere;
        if !apex.finite {
            return Some(Self::about(center, apex.normal, [-radius, radius, 0.0]));
        }
        let away = center - apex.position;
        if apex.normal.dot(away) < -radius {
            return None;
        }
        let square = away.length_squared();
        let along_tangent = square - radius * radius;
        if along_tangent <= 0.0 {
            // A light within it.
            return Some(Self::about(apex.position, apex.normal, [f64::NEG_INFINITY, f64::INFINITY, 0.0]));
        }
        let distance = square.sqrt();
        let slope = radius / along_tangent.sqrt();
        Some(Self::about(apex.position, away / distance, [distance - radius, 0.0, slope]))
    }

    fn about(origin: DVec3, direction: DVec3, [near, base, slope]: [f64; 3]) -> Self {
        let (inverse, magnitude) = (direction.recip(), direction.abs());
        Self { origin, direction, inverse, magnitude, near, base, slope }
    }

    /// Its radius at the distance of a point.
    pub fn radius_at(&self, point: DVec3) -> f64 {
        self.base + self.slope * (point - self.origin).dot(self.direction).max(0.0)
    }

    /// Whether it may reach into a box: whether its axis meets the box, enlarged by its radius at the box's far end.
    pub fn may_reach(&self, bounds: &Bounds) -> bool {
        let to = bounds.center - self.origin;
        let far = to.dot(self.direction) + bounds.half_extent.dot(self.magnitude);
        if far < self.near {
            return false;
        }
        let half = bounds.half_extent + (self.base + self.slope * far.max(0.0));
        // `min` and `max` ignore a NaN, which is an axis within the plane of a side.
        let (a, b) = ((to - half) * self.inverse, (to + half) * self.inverse);
        a.min(b).max_element().max(self.near) <= a.max(b).min_element().min(far)
    }
}
