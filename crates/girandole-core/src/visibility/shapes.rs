//! Shapes that occlusion pyramids are built from: lights, receivers and their convex hulls.

use super::clusters::Cluster;
use super::groups::ReceiverGroup;
use super::primitives::{Tolerance, box_extent};
use crate::lights::LightSample;
use glam::DVec3;

/// Corners of a receiver's polygon, at most.
pub(crate) const MAX_CORNERS: usize = 8;

/// The light at the apex of a pyramid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Apex {
    pub position: DVec3,
    pub normal: DVec3,
    /// Whether it has a position; otherwise its light is parallel to the normal.
    pub finite: bool,
}

impl Apex {
    pub fn new(light: &LightSample) -> Self {
        Self {
            position: light.position.as_dvec3(),
            normal: light.normal.as_dvec3(),
            finite: !light.profile.is_parallel(),
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

/// The plane of a patch: `normal · x = offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PatchPlane {
    pub normal: DVec3,
    pub offset: f64,
    /// Largest difference of its unit normal and the triangles'.
    pub tilt: f64,
}

impl PatchPlane {
    /// The same turned round where `sign` is −1.
    pub fn turned(self, sign: f64) -> Self {
        Self { normal: self.normal * sign, offset: self.offset * sign, ..self }
    }

    /// How far in front of it a point is.
    pub fn height(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }
}

/// The receiver at the base of a pyramid.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Shape<'a> {
    /// The corners lie on the surface, counter-clockwise about the normal, at most [`MAX_CORNERS`].
    Patch {
        corners: &'a [DVec3],
        plane: PatchPlane,
    },
    Cluster(&'a Cluster),
    Group(&'a ReceiverGroup),
}

impl Shape<'_> {
    /// The tolerance for its points.
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

    /// Centre and radius of a sphere that contains the bases of its pyramids, tolerances included.
    pub fn sphere(&self, tolerance: &Tolerance) -> (DVec3, f64) {
        let room = tolerance.room();
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

/// A convex set that contains all ray origins of a receiver.
pub(crate) enum Hull {
    /// The corners, offset like ray origins; how many; and from each of them to where its offset may be less.
    Polygon([DVec3; MAX_CORNERS], usize, DVec3),
    /// Centre, radius and box, all enlarged to contain the ray origins.
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
                let (low, high) = box_extent(normal, *bounds);
                let d = normal.dot(*center);
                (low.max(d - radius), high.min(d + radius))
            }
        }
    }

    /// The same for the three axes.
    pub fn extents(&self) -> [(f64, f64); 3] {
        match self {
            Hull::Polygon(corners, n, down) => {
                let low =
                    corners[..*n].iter().copied().fold(DVec3::INFINITY, DVec3::min) + down.min(DVec3::ZERO);
                let high = corners[..*n].iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max)
                    + down.max(DVec3::ZERO);
                std::array::from_fn(|i| (low[i], high[i]))
            }
            Hull::Sphere(..) => [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| self.extent(axis)),
        }
    }
}
