//! Boxes against a pyramid: what cannot reach into it, and what cannot cover the receiver.

use super::shapes::{Apex, Hull, MOST_CORNERS};
use glam::DVec3;

/// What a group of blockers may cover, of a receiver and its parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cover {
    /// Nothing that is wider, metres.
    pub widest: f32,
    /// Nothing that has one of these corners of the receiver, a bit each: rays from there to the light miss the group.
    pub missed: u8,
}

impl Cover {
    /// As long as nothing is known.
    pub const ANY: Self = Self { widest: f32::INFINITY, missed: 0 };

    /// The same for a part of the receiver, given which of the receiver's corners its own are: counted from 1, 0 for
    /// new ones.
    pub fn of_part(self, corners: &[u8; MOST_CORNERS]) -> Self {
        if self.missed == 0 {
            return self;
        }
        let missed = |i: usize| u8::from(u32::from(self.missed) << 1 >> corners[i] & 1 == 1);
        Self { missed: (0..MOST_CORNERS).fold(0, |bits, i| bits | missed(i) << i), ..self }
    }
}

/// Some rays of a pyramid, from the receiver's outermost points to the light: a polygon that covers the receiver is hit
/// by all of them.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Bundle {
    rays: [Ray; MOST_CORNERS],
    /// How many there are, 0 before they are made.
    pub count: usize,
    /// Whether they start at the receiver's corners, so that all others lie between them.
    corners: bool,
    /// Greatest width of them.
    pub width: f64,
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
        let (mut towards, mut inverse_squares) = ([DVec3::ZERO; MOST_CORNERS], [0.0; MOST_CORNERS]);
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

    /// Whether all rays pass through a box at which they are at most `extent` apart. If not, `cover` becomes what that
    /// shows for the receiver's parts.
    pub fn passes(&self, low: DVec3, high: DVec3, extent: f64, cover: &mut Cover) -> bool {
        let (mut missed, mut narrow) = (0_u8, true);
        for (i, ray) in self.rays[..self.count].iter().enumerate() {
            let (a, b) = ((low - ray.origin) * ray.inverse, (high - ray.origin) * ray.inverse);
            // `min` and `max` take the number where the other is none: a ray within the plane of a side.
            let enter = a.min(b).max_element().max(0.0);
            let leave = a.max(b).min_element().min(ray.length);
            missed |= u8::from(enter > leave) << i;
            narrow &= ray.width * ray.narrowing(leave) <= extent;
        }
        let passes = missed == 0 && narrow;
        if self.corners && !passes {
            let widest = extent / self.narrowest(low, high) * (1.0 + 1e-6);
            *cover = Cover { widest: cover.widest.min(widest as f32), missed };
        }
        passes
    }

    /// How much nearer to each other rays are, at least, where they leave a box. Along an axis that all rays follow the
    /// same way, none leaves later than the last of those at the corners.
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
    /// How much nearer to the others it is than at the receiver: rays meet at the light.
    fn narrowing(&self, at: f64) -> f64 {
        if self.length == 1.0 { 1.0 - at } else { 1.0 }
    }
}

/// All that is as near to the line from a receiver to a light as the receiver is wide: quicker to ask than a pyramid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    from: DVec3,
    towards: DVec3,
    inverse_square: f64,
    /// How far the line goes, in lengths of `towards`.
    end: f64,
    radius: f64,
}

impl Reach {
    /// Around a sphere that holds the receiver.
    pub fn new(apex: &Apex, (center, radius): (DVec3, f64)) -> Self {
        let towards = apex.towards(center);
        let inverse_square = towards.length_squared().max(f64::MIN_POSITIVE).recip();
        let end = if apex.finite { 1.0 } else { f64::INFINITY };
        Self { from: center, towards, inverse_square, end, radius }
    }

    /// Whether a box may be that near.
    pub fn meets(&self, low: DVec3, high: DVec3) -> bool {
        let beside = (low + high) * 0.5 - self.from;
        let along = (beside.dot(self.towards) * self.inverse_square).clamp(0.0, self.end);
        let room = self.radius + 0.5 * (high - low).length();
        (beside - self.towards * along).length_squared() <= room * room
    }
}

/// Directions that may separate a box from a pyramid where the pyramid's own planes do not: the box's axes, and those
/// across them and the pyramid (Gottschalk, Lin and Manocha 1996). With the pyramid's least and greatest extent.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Slabs {
    slabs: [(DVec3, f64, f64); 6],
    /// How many there are, 0 before they are made.
    pub count: usize,
}

impl Slabs {
    pub fn set(&mut self, apex: &Apex, hull: &Hull, margin: f64) {
        let along = apex.towards(hull.middle()).normalize_or_zero();
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let normals = axes.into_iter().chain(axes.map(|axis| along.cross(axis).normalize_or_zero()));
        for (slab, normal) in self.slabs.iter_mut().zip(normals) {
            let (mut low, mut high) = hull.extent(normal);
            if apex.finite {
                let light = normal.dot(apex.position);
                (low, high) = (low.min(light), high.max(light));
            } else {
                // It has no end towards the light.
                let slope = normal.dot(along);
                low = if slope < -1e-12 { f64::NEG_INFINITY } else { low };
                high = if slope > 1e-12 { f64::INFINITY } else { high };
            }
            *slab = (normal, low - margin, high + margin);
        }
        self.count = self.slabs.len();
    }

    /// Whether a box lies outside.
    pub fn miss(&self, center: DVec3, half: DVec3) -> bool {
        self.slabs[..self.count].iter().any(|(normal, low, high)| {
            let (middle, reach) = (normal.dot(center), normal.abs().dot(half));
            middle + reach < *low || middle - reach > *high
        })
    }
}
