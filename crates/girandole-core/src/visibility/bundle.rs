//! Rays from a light to some points of a receiver: a polygon that covers the receiver is hit by all of them.

use super::pyramid::{Apex, Hull, MOST_CORNERS};
use glam::DVec3;

/// Some rays of a pyramid, from the receiver's outermost points to the light.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Bundle {
    rays: [Ray; MOST_CORNERS],
    /// How many there are, 0 before they are made.
    pub count: usize,
}

/// From `origin`, where the receiver is, as far as `length` times what `inverse` is the inverse of.
#[derive(Clone, Copy, Debug, Default)]
struct Ray {
    origin: DVec3,
    inverse: DVec3,
    length: f64,
    /// Distance from the farthest other ray at the receiver, across that ray.
    width: f64,
}

impl Bundle {
    pub fn set(&mut self, apex: &Apex, hull: &Hull) {
        let mut points = [DVec3::ZERO; MOST_CORNERS];
        self.count = match hull {
            Hull::Polygon(corners, n) => {
                points = *corners;
                *n
            }
            // The middles of the box's sides lie within the sphere.
            Hull::Sphere(center, _, [low, high]) => {
                let half = (*high - *low) * 0.5;
                for axis in 0..3 {
                    let mut to = DVec3::ZERO;
                    to[axis] = half[axis];
                    (points[axis * 2], points[axis * 2 + 1]) = (*center + to, *center - to);
                }
                6
            }
        };
        for i in 0..self.count {
            let towards = apex.towards(points[i]);
            let across = |other: &DVec3| {
                let direction = apex.towards(*other);
                (*other - points[i]).cross(direction).length_squared() / direction.length_squared()
            };
            let width = points[..self.count].iter().map(across).fold(0.0, f64::max).sqrt();
            let length = if apex.finite { 1.0 } else { f64::INFINITY };
            self.rays[i] = Ray { origin: points[i], inverse: towards.recip(), length, width };
        }
    }

    /// Whether all rays pass through a box at which they are at most `extent` apart.
    pub fn passes(&self, low: DVec3, high: DVec3, extent: f64) -> bool {
        self.rays[..self.count].iter().all(|ray| {
            let (a, b) = ((low - ray.origin) * ray.inverse, (high - ray.origin) * ray.inverse);
            // `min` and `max` take the number where the other is none: a ray within the plane of a side.
            let enter = a.min(b).max_element().max(0.0);
            let leave = a.max(b).min_element().min(ray.length);
            // Rays meet at the light.
            let narrowed = if ray.length == 1.0 { ray.width * (1.0 - leave) } else { ray.width };
            enter <= leave && narrowed <= extent
        })
    }
}
