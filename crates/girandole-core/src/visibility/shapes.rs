//! Receivers and lights as occlusion pyramids see them.

use super::clusters::Cluster;
use super::groups::Group;
use crate::lights::{LightSample, Profile};
use crate::scene::Geometry;
use crate::trace::{LIFT_BY_ROUNDING, lift_distance};
use glam::{DVec3, Vec3};

/// Corners of a receiver's polygon, at most.
pub(crate) const MOST_CORNERS: usize = 8;
/// Relative error of the dot products that decide whether a receiver and a light face each other.
pub(crate) const ROUNDING: f64 = 5e-7;

/// Distances below which nothing is decided, metres.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tolerance {
    /// How far points are lifted off surfaces.
    pub lift: f64,
    /// More than coordinates are rounded by.
    pub tol: f64,
    /// What may lie behind a plane that it is said to lie in front of: where surfaces meet.
    pub edge: f64,
    /// Extra width of a pyramid: points may be looked up in a neighbouring leaf.
    pub side: f64,
    /// How much less than `lift` some points are lifted: 0 but for what is far away from the origin.
    pub less: f64,
}

impl Tolerance {
    /// For what is not so far from the origin that points are lifted farther for the sake of rounding.
    pub fn new(geometry: &Geometry) -> Self {
        Self::up_to(f64::from(lift_distance(geometry, Vec3::ZERO)), 0.0)
    }

    fn up_to(lift: f64, less: f64) -> Self {
        Self { lift, tol: 0.1 * lift + less, edge: 0.02 * (lift - less), side: 2.0 * lift + less, less }
    }

    /// For points of a box, some of which may be lifted farther than others.
    pub fn within(&self, low: DVec3, high: DVec3) -> Self {
        let far = low.abs().max(high.abs()).max_element() * (1.0 + 1e-6);
        let lift = (far * LIFT_BY_ROUNDING).max(self.lift);
        if lift > self.lift { Self::up_to(lift, lift - self.lift) } else { *self }
    }
}

/// A light as pyramids see it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Apex {
    pub position: DVec3,
    pub normal: DVec3,
    /// Whether it has a position; otherwise light comes against the normal.
    pub finite: bool,
}

impl Apex {
    pub fn new(light: &LightSample) -> Self {
        Self {
            position: light.position.as_dvec3(),
            normal: light.normal.as_dvec3(),
            finite: light.profile != Profile::Directional,
        }
    }

    pub fn towards(&self, point: DVec3) -> DVec3 {
        if self.finite { self.position - point } else { -self.normal }
    }

    /// Whether it is in front of a plane, or its light comes from there.
    pub fn is_in_front(&self, normal: DVec3, offset: f64) -> bool {
        if self.finite { normal.dot(self.position) > offset } else { normal.dot(self.normal) < 0.0 }
    }
}

/// A receiver as pyramids see it.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Shape<'a> {
    Patch {
        /// On the surface, counter-clockwise about the normal, at most [`MOST_CORNERS`].
        corners: &'a [DVec3],
        normal: DVec3,
        offset: f64,
        tilt: f64,
    },
    Cluster(&'a Cluster),
    Group(&'a Group),
}

impl Shape<'_> {
    /// What is in doubt about its points.
    pub fn tolerance(&self, of_scene: &Tolerance) -> Tolerance {
        match self {
            Self::Patch { corners, .. } => of_scene.within(
                corners.iter().copied().fold(DVec3::INFINITY, DVec3::min),
                corners.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max),
            ),
            Self::Cluster(cluster) => of_scene.within(cluster.low, cluster.high),
            Self::Group(group) => of_scene.within(group.bounds.low, group.bounds.high),
        }
    }

    /// Centre and radius of a sphere that holds its pyramids' ends, with all that is in doubt beside them.
    pub fn sphere(&self, tolerance: &Tolerance) -> (DVec3, f64) {
        let room = 4.0 * (tolerance.lift + tolerance.side);
        match self {
            Self::Patch { corners, .. } => {
                let center = corners.iter().sum::<DVec3>() / corners.len() as f64;
                (center, corners.iter().map(|c| c.distance(center)).fold(0.0, f64::max) + room)
            }
            Self::Cluster(cluster) => (cluster.center, cluster.radius + room),
            Self::Group(group) => (group.bounds.center, group.bounds.radius + room),
        }
    }
}

/// Convex, and it holds all lifted points of a receiver.
pub(crate) enum Hull {
    /// Lifted corners, how many, and from each of them to where it may be lifted less.
    Polygon([DVec3; MOST_CORNERS], usize, DVec3),
    /// Centre, radius and box, all with room for lifted points.
    Sphere(DVec3, f64, [DVec3; 2]),
}

impl Hull {
    pub fn middle(&self) -> DVec3 {
        match self {
            Self::Polygon(corners, n, _) => corners[..*n].iter().sum::<DVec3>() / *n as f64,
            Self::Sphere(center, ..) => *center,
        }
    }

    /// Smallest and largest `normal · x` over all of it.
    pub fn extent(&self, normal: DVec3) -> (f64, f64) {
        match self {
            Hull::Polygon(corners, n, down) => {
                let start = (f64::INFINITY, f64::NEG_INFINITY);
                let (low, high) = corners[..*n].iter().fold(start, |(low, high), c| {
                    let d = normal.dot(*c);
                    (low.min(d), high.max(d))
                });
                let d = normal.dot(*down);
                (low + d.min(0.0), high + d.max(0.0))
            }
            Hull::Sphere(center, radius, bounds) => {
                let (low, high) = extent(normal, *bounds);
                let d = normal.dot(*center);
                (low.max(d - radius), high.min(d + radius))
            }
        }
    }
}

/// Smallest and largest `normal · x` over a box.
pub(crate) fn extent(normal: DVec3, [low, high]: [DVec3; 2]) -> (f64, f64) {
    let (center, half) = ((low + high) * 0.5, (high - low) * 0.5);
    let (middle, reach) = (normal.dot(center), normal.abs().dot(half));
    (middle - reach, middle + reach)
}
