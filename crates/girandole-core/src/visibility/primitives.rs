//! What all of visibility determination computes with: tolerances, and extents, areas and clipping of boxes and polygons.

use crate::scene::Geometry;
use crate::trace::{RAY_OFFSET_BY_ROUNDING, ray_offset_distance};
use glam::{DVec3, Vec3};

/// Relative error of the dot products that decide whether a receiver and a light face each other.
pub(crate) const ROUNDING: f64 = 5e-7;

/// Share of the scene's size by which single precision rounds its coordinates, and as much again.
const ROUNDING_OF_COORDINATES: f64 = 6e-8;

/// Distances within which tests are conservative, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Tolerance {
    /// Distance by which ray origins are offset from surfaces.
    pub ray_offset: f64,
    /// An upper bound on the rounding error of coordinates.
    pub coordinate: f64,
    /// How far a polygon may reach behind a plane and still count as in front of it: at the seam of two surfaces.
    pub seam: f64,
    /// Extra width of a pyramid: points may be looked up in a neighbouring leaf.
    pub side: f64,
    /// How much less than `ray_offset` some points are offset: 0 but for what is far away from the origin.
    pub less: f64,
}

impl Tolerance {
    /// For what is not so far from the origin that points are offset farther for the sake of rounding.
    pub fn new(geometry: &Geometry) -> Self {
        let tolerance = Self::up_to(f64::from(ray_offset_distance(geometry, Vec3::ZERO)), 0.0);
        tolerance.at_least(ROUNDING_OF_COORDINATES * f64::from(geometry.diagonal()))
    }

    fn up_to(ray_offset: f64, less: f64) -> Self {
        Self {
            ray_offset,
            coordinate: 0.15 * ray_offset + less,
            seam: 0.1 * (ray_offset - less),
            side: 2.0 * ray_offset + less,
            less,
        }
    }

    /// The same where coordinates may be wrong by so much.
    fn at_least(self, coordinate: f64) -> Self {
        let coordinate = self.coordinate.max(coordinate + self.less);
        Self { coordinate, side: self.side.max(2.0 * coordinate), ..self }
    }

    /// How much farther than a receiver's own bounds those of its pyramids reach.
    pub fn room(&self) -> f64 {
        4.0 * (self.ray_offset + self.side)
    }

    /// For points of a box, some of which may be offset farther than others.
    pub fn within(&self, low: DVec3, high: DVec3) -> Self {
        let far = low.abs().max(high.abs()).max_element() * (1.0 + 1e-6);
        let offset = (far * RAY_OFFSET_BY_ROUNDING).max(self.ray_offset);
        if offset > self.ray_offset {
            Self::up_to(offset, offset - self.ray_offset).at_least(self.coordinate)
        } else {
            *self
        }
    }
}

/// Smallest and largest `normal · x` over a box.
pub(crate) fn box_extent(normal: DVec3, [low, high]: [DVec3; 2]) -> (f64, f64) {
    let (center, half) = ((low + high) * 0.5, (high - low) * 0.5);
    let (middle, reach) = (normal.dot(center), normal.abs().dot(half));
    (middle - reach, middle + reach)
}

/// Area of a planar polygon times its unit normal.
pub(crate) fn area_vector(corners: &[DVec3]) -> DVec3 {
    let first = corners.first().copied().unwrap_or_default();
    let mut sum = DVec3::ZERO;
    for pair in corners.windows(2) {
        sum += (pair[0] - first).cross(pair[1] - first);
    }
    sum * 0.5
}

/// The part of a convex polygon where `normal · x ≥ offset` (Sutherland and Hodgman 1974).
pub(crate) fn clip(from: &[DVec3], to: &mut Vec<DVec3>, normal: DVec3, offset: f64) {
    to.clear();
    let Some(&last) = from.last() else { return };
    let (mut a, mut height) = (last, normal.dot(last) - offset);
    for &b in from {
        let next = normal.dot(b) - offset;
        if (height >= 0.0) != (next >= 0.0) {
            to.push(a + (b - a) * (height / (height - next)));
        }
        if next >= 0.0 {
            to.push(b);
        }
        (a, height) = (b, next);
    }
}
