//! Conservative tests of boxes: which cannot reach into a pyramid, and which cannot hold a full blocker.

use super::shapes::{Apex, Hull, MAX_CORNERS};
use glam::DVec3;

/// Which parts of a receiver a node of the blocker hierarchy may cover in full, from the tests of the receiver itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FullCoverHint {
    /// It covers no part whose rays are farther apart than this, metres.
    pub max_width: f32,
    /// It covers no part that has one of these corners of the receiver, a bit each: rays from there to the light miss
    /// the node's box.
    pub missed_corners: u8,
}

impl FullCoverHint {
    /// Before any test.
    pub const UNKNOWN: Self = Self { max_width: f32::INFINITY, missed_corners: 0 };

    /// The hint for a child of the receiver, given for each of its corners the parent's corner at the same position,
    /// counted from 1; 0 for new ones.
    pub fn for_child(self, parent_corners: &[u8; MAX_CORNERS]) -> Self {
        if self.missed_corners == 0 {
            return self;
        }
        let missed = |i: usize| u8::from(u32::from(self.missed_corners) << 1 >> parent_corners[i] & 1 == 1);
        Self { missed_corners: (0..MAX_CORNERS).fold(0, |bits, i| bits | missed(i) << i), ..self }
    }
}

/// Some rays of a pyramid, from the receiver's outermost points to the light: a polygon that covers the receiver is hit
/// by all of them.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RayBundle {
    rays: [Ray; MAX_CORNERS],
    /// The number of rays; 0 before [`RayBundle::set`].
    pub count: usize,
    /// Whether they start at the receiver's corners, so that all others lie between them.
    corners: bool,
    /// Greatest width of them.
    pub width: f64,
}

/// From `origin` on the receiver to `length` times the vector whose reciprocal is `inverse`.
#[derive(Clone, Copy, Debug, Default)]
struct Ray {
    origin: DVec3,
    inverse: DVec3,
    length: f64,
    /// Distance from the farthest other ray at the receiver, across that ray.
    width: f64,
}

impl RayBundle {
    pub fn set(&mut self, apex: &Apex, hull: &Hull) {
        let mut points = [DVec3::ZERO; MAX_CORNERS];
        self.corners = matches!(hull, Hull::Polygon(..));
        self.count = match hull {
            Hull::Polygon(corners, n, _) => {
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
        let (mut towards, mut inverse_squares) = ([DVec3::ZERO; MAX_CORNERS], [0.0; MAX_CORNERS]);
        for i in 0..self.count {
            towards[i] = apex.towards(points[i]);
            inverse_squares[i] = towards[i].length_squared().recip();
        }
        let length = if apex.finite { 1.0 } else { f64::INFINITY };
        for i in 0..self.count {
            let across =
                |j: usize| (points[j] - points[i]).cross(towards[j]).length_squared() * inverse_squares[j];
            let width = (0..self.count).map(across).fold(0.0, f64::max).sqrt();
            self.rays[i] = Ray { origin: points[i], inverse: towards[i].recip(), length, width };
        }
        self.width = self.rays[..self.count].iter().map(|r| r.width).fold(0.0, f64::max);
    }

    /// Whether all rays pass through a box and are at most `extent` apart there. If not, `hint` becomes what that implies
    /// for the receiver's children.
    pub fn passes(&self, low: DVec3, high: DVec3, extent: f64, hint: &mut FullCoverHint) -> bool {
        let (mut missed, mut narrow) = (0_u8, true);
        for (i, ray) in self.rays[..self.count].iter().enumerate() {
            let (a, b) = ((low - ray.origin) * ray.inverse, (high - ray.origin) * ray.inverse);
            // `min` and `max` ignore a NaN, which is a ray within the plane of a side.
            let enter = a.min(b).max_element().max(0.0);
            let leave = a.max(b).min_element().min(ray.length);
            missed |= u8::from(enter > leave) << i;
            narrow &= ray.width * ray.narrowing(leave) <= extent;
        }
        let passes = missed == 0 && narrow;
        if self.corners && !passes {
            let width = extent / self.narrowest(low, high) * (1.0 + 1e-6);
            *hint = FullCoverHint { max_width: hint.max_width.min(width as f32), missed_corners: missed };
        }
        passes
    }

    /// A lower bound of [`Ray::narrowing`] where rays leave a box. Along an axis on which all rays have the same sign, none
    /// leaves later than the last of those at the corners.
    fn narrowest(&self, low: DVec3, high: DVec3) -> f64 {
        let rays = &self.rays[..self.count];
        let mut leave: f64 = 1.0;
        for axis in 0..3 {
            let forward = rays[0].inverse[axis] > 0.0;
            if rays.iter().all(|r| if forward { r.inverse[axis] > 0.0 } else { r.inverse[axis] < 0.0 }) {
                let end = if forward { high[axis] } else { low[axis] };
                let ends = rays.iter().map(|r| (end - r.origin[axis]) * r.inverse[axis]);
                leave = leave.min(ends.fold(0.0, f64::max));
            }
        }
        rays[0].narrowing(leave)
    }
}

impl Ray {
    /// The distance to the other rays as a share of that at the receiver: rays meet at the light.
    fn narrowing(&self, at: f64) -> f64 {
        if self.length == 1.0 { 1.0 - at } else { 1.0 }
    }
}

/// A box swept to the light, to which it shrinks: encloses the pyramid of a receiver in it, and is cheaper to test.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SweptBox {
    /// Where its lower and its upper corner are at the receiver.
    corners: [DVec3; 2],
    /// Reciprocals of the ways that they go.
    inverse: [DVec3; 2],
    /// How far they go, in lengths of those ways.
    end: f64,
}

impl SweptBox {
    /// `margin` is how far rays may be outside of it.
    pub fn new(apex: &Apex, [low, high]: [DVec3; 2], margin: f64) -> Self {
        let corners = [low - margin, high + margin];
        let ways = match apex.finite {
            true => [apex.position - margin - corners[0], apex.position + margin - corners[1]],
            false => [-apex.normal; 2],
        };
        let end = if apex.finite { 1.0 } else { f64::INFINITY };
        Self { corners, inverse: ways.map(DVec3::recip), end }
    }

    /// Whether it may intersect a box: whether at one time its lower corner is not above, and its upper one not below that.
    pub fn may_intersect(&self, low: DVec3, high: DVec3) -> bool {
        let [below, above] =
            [(high - self.corners[0]) * self.inverse[0], (low - self.corners[1]) * self.inverse[1]];
        let (mut enter, mut leave): (f64, f64) = (0.0, self.end);
        for axis in 0..3 {
            // A corner that goes up passes a bound from below. `min` and `max` ignore a NaN, which is one that stays on it.
            if self.inverse[0][axis] > 0.0 {
                leave = leave.min(below[axis]);
            } else {
                enter = enter.max(below[axis]);
            }
            if self.inverse[1][axis] > 0.0 {
                enter = enter.max(above[axis]);
            } else {
                leave = leave.min(above[axis]);
            }
        }
        enter <= leave
    }
}

/// Axes that may separate a box from a pyramid where the pyramid's own planes do not: the box's axes, and their cross
/// products with the pyramid's (Gottschalk, Lin and Manocha 1996); with the pyramid's extent along each.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Slabs {
    slabs: [(DVec3, f64, f64); 6],
    /// The number of slabs; 0 before [`Slabs::set`].
    pub count: usize,
}

impl Slabs {
    pub fn set(&mut self, apex: &Apex, hull: &Hull, margin: f64) {
        let along = apex.towards(hull.middle()).normalize_or_zero();
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let [x, y, z] = hull.extents();
        let across = axes.map(|axis| along.cross(axis).normalize_or_zero());
        let extents = [x, y, z].into_iter().chain(across.map(|normal| hull.extent(normal)));
        for ((slab, normal), (mut low, mut high)) in
            self.slabs.iter_mut().zip(axes.into_iter().chain(across)).zip(extents)
        {
            if apex.finite {
                let light = normal.dot(apex.position);
                (low, high) = (low.min(light), high.max(light));
            } else {
                // Unbounded towards the light.
                let slope = normal.dot(along);
                low = if slope < -1e-12 { f64::NEG_INFINITY } else { low };
                high = if slope > 1e-12 { f64::INFINITY } else { high };
            }
            *slab = (normal, low - margin, high + margin);
        }
        self.count = self.slabs.len();
    }

    /// Whether one of them separates a box from the pyramid.
    pub fn separate(&self, center: DVec3, half: DVec3) -> bool {
        self.slabs[..self.count].iter().any(|(normal, low, high)| {
            let (middle, reach) = (normal.dot(center), normal.abs().dot(half));
            middle + reach < *low || middle - reach > *high
        })
    }
}
