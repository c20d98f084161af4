//! Receivers and lights as occlusion pyramids see them.

use super::clusters::Cluster;
use super::groups::Group;
use crate::lights::{LightSample, Profile};
use crate::scene::Geometry;
use crate::trace::lift_distance;
use glam::DVec3;

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
}

impl Tolerance {
    pub fn new(geometry: &Geometry) -> Self {
        let far = geometry.bounds.0.abs().max(geometry.bounds.1.abs());
        let lift = f64::from(lift_distance(geometry, far));
        Self { lift, tol: 0.1 * lift, edge: 0.02 * lift, side: 2.0 * lift }
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
    /// Lifted corners.
    Polygon([DVec3; MOST_CORNERS], usize),
    /// Centre, radius and box, all with room for lifted points.
    Sphere(DVec3, f64, [DVec3; 2]),
}

impl Hull {
    pub fn middle(&self) -> DVec3 {
        match self {
            Self::Polygon(corners, n) => corners[..*n].iter().sum::<DVec3>() / *n as f64,
            Self::Sphere(center, ..) => *center,
        }
    }

    /// Smallest and largest `normal · x` over all of it.
    pub fn extent(&self, normal: DVec3) -> (f64, f64) {
        match self {
            Hull::Polygon(corners, n) => {
                corners[..*n].iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), c| {
                    let d = normal.dot(*c);
                    (low.min(d), high.max(d))
                })
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
