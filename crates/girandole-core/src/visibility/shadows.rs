//! What lies behind a mover as a light sees it, against boxes about receivers.

use super::cones::Sphere;
use super::primitives::ROUNDING;
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
    pub origin: DVec3,
    /// Along which light goes, unit length; its reciprocals, and its magnitudes.
    pub direction: DVec3,
    inverse: DVec3,
    magnitude: DVec3,
    /// No point of it is nearer than this along the axis.
    pub near: f64,
    /// No point of the sphere is farther than this, and none before it nearer than that.
    end: f64,
    start: f64,
    /// Its radius is `base + slope · distance`.
    pub base: f64,
    pub slope: f64,
}

impl Shadow {
    /// None where all of the sphere is behind the light.
    pub fn new(apex: &Apex, sphere: &Sphere) -> Option<Self> {
        let Sphere { center, radius } = *sphere;
        if !apex.finite {
            let start = f64::NEG_INFINITY;
            return Some(Self {
                start,
                ..Self::about(center, apex.normal, [-radius, radius], [radius, 0.0])
            });
        }
        let away = center - apex.position;
        let square = away.length_squared();
        if apex.normal.dot(away) < -(radius + ROUNDING * square.sqrt()) {
            return None;
        }
        let along_tangent = square - radius * radius;
        if along_tangent <= 0.0 {
            // A light within it.
            let all = [f64::NEG_INFINITY, f64::INFINITY];
            return Some(Self {
                start: all[0],
                ..Self::about(apex.position, apex.normal, all, [all[1], 0.0])
            });
        }
        let distance = square.sqrt();
        let slope = radius / along_tangent.sqrt();
        let range = [distance - radius, distance + radius];
        Some(Self::about(apex.position, away / distance, range, [0.0, slope]))
    }

    fn about(origin: DVec3, direction: DVec3, [near, end]: [f64; 2], [base, slope]: [f64; 2]) -> Self {
        let (inverse, magnitude) = (direction.recip(), direction.abs());
        Self { origin, direction, inverse, magnitude, near, end, start: 0.0, base, slope }
    }

    /// Its radius at the distance of a point.
    pub fn radius_at(&self, point: DVec3) -> f64 {
        self.base + self.slope * (point - self.origin).dot(self.direction).max(0.0)
    }

    /// Whether a part of it between the light and the sphere, that included, may be in a box: whether its axis meets the box, enlarged
    /// by its radius at the box's far end.
    pub fn may_pass(&self, bounds: &Bounds) -> bool {
        let to = bounds.center - self.origin;
        let (along, reach) = (to.dot(self.direction), bounds.half_extent.dot(self.magnitude));
        let [near, far] = [(along - reach).max(self.start), (along + reach).min(self.end)];
        near <= far && self.meets(to, bounds.half_extent, [near, far])
    }

    /// Whether the line about which all of it is meets a box.
    pub fn has_axis_in(&self, bounds: &Bounds) -> bool {
        let to = bounds.center - self.origin;
        self.base == f64::INFINITY
            || Self { base: 0.0, slope: 0.0, ..*self }.meets(to, bounds.half_extent, [self.start, self.end])
    }

    /// Whether the axis meets a box, enlarged by the radius at the far end of a range, within that range.
    fn meets(&self, to: DVec3, half_extent: DVec3, [near, far]: [f64; 2]) -> bool {
        let half = half_extent + (self.base + self.slope * far.max(0.0));
        // `min` and `max` ignore a NaN, which is an axis within the plane of a side.
        let (a, b) = ((to - half) * self.inverse, (to + half) * self.inverse);
        a.min(b).max_element().max(near) <= a.max(b).min_element().min(far)
    }
}
