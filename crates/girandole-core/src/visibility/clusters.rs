//! A binary tree of clusters over some triangles of an object: receivers near the root, blockers down to the leaves.

use super::cones::Sphere;
use super::primitives::box_extent;
use crate::scene::{Geometry, NONE, Scene};
use glam::DVec3;
use std::f64::consts::PI;
use std::ops::Range;

/// Triangles of a leaf, at most.
pub(crate) const LEAF_TRIANGLES: usize = 8;

/// Some triangles and their bounds.
#[derive(Clone, Debug)]
pub(crate) struct Cluster {
    pub center: DVec3,
    pub radius: f64,
    pub low: DVec3,
    pub high: DVec3,
    /// All normals lie within `angle` of this direction.
    pub axis: DVec3,
    /// Radians; π where there is no such cone, as for double-sided ones.
    pub angle: f64,
    /// Sine and cosine of that angle and a little more, which rounding is less than.
    pub angle_sine_cosine: (f64, f64),
    pub area: f64,
    /// Into [`ClusterTree::order`].
    pub range: Range<u32>,
    /// [`NONE`] for a leaf.
    pub children: [u32; 2],
}

/// The tree; its first node is the root.
#[derive(Clone, Debug)]
pub(crate) struct ClusterTree {
    pub nodes: Vec<Cluster>,
    /// Indices into [`Geometry::triangles`], cluster by cluster.
    pub order: Vec<u32>,
    /// Corners of the triangles in that order.
    pub corners: Vec<[DVec3; 3]>,
}

/// What clusters need to know of a triangle.
struct ClusterTriangle {
    corners: [DVec3; 3],
    /// Three times the centroid.
    middle: DVec3,
    normal: DVec3,
    area: f64,
    double_sided: bool,
}

impl ClusterTriangle {
    fn new(scene: &Scene, geometry: &Geometry, triangle: u32) -> Self {
        let corners = geometry.corners(triangle).map(|p| p.as_dvec3());
        let [a, b, c] = corners;
        let material = geometry.triangles[triangle as usize].material;
        Self {
            corners,
            middle: a + b + c,
            normal: geometry.normal(triangle).as_dvec3(),
            area: f64::from(geometry.area(triangle)),
            double_sided: scene.materials[material].double_sided,
        }
    }
}

impl ClusterTree {
    /// Splits triangles, in ascending order, at the median of their centroids along the longest axis.
    pub fn new(scene: &Scene, geometry: &Geometry, triangles: &[u32]) -> Self {
        let of: Vec<ClusterTriangle> =
            triangles.iter().map(|&t| ClusterTriangle::new(scene, geometry, t)).collect();
        let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
        let mut nodes = Vec::new();
        let mut open = vec![(0..order.len(), NONE)];
        // Depth first, parents before children.
        while let Some((range, parent)) = open.pop() {
            let index = nodes.len() as u32;
            let members = &mut order[range.clone()];
            let mut cluster = Cluster::new(members.iter().map(|&t| &of[t as usize]));
            cluster.range = range.start as u32..range.end as u32;
            nodes.push(cluster);
            if parent != NONE {
                let children = &mut nodes[parent as usize].children;
                let slot = usize::from(children[0] != NONE);
                children[slot] = index;
            }
            if range.len() <= LEAF_TRIANGLES {
                continue;
            }
            let (low, high) = members
                .iter()
                .map(|&t| of[t as usize].middle)
                .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), c| (low.min(c), high.max(c)));
            let extent = high - low;
            let axis = (0..3).fold(0, |best, i| if extent[i] > extent[best] { i } else { best });
            let middle = members.len() / 2;
            let along = |t: u32| of[t as usize].middle[axis];
            members.select_nth_unstable_by(middle, |&a, &b| along(a).total_cmp(&along(b)).then(a.cmp(&b)));
            open.push((range.start + middle..range.end, index));
            open.push((range.start..range.start + middle, index));
        }
        let corners = order.iter().map(|&t| of[t as usize].corners).collect();
        for triangle in &mut order {
            *triangle = triangles[*triangle as usize];
        }
        Self { nodes, order, corners }
    }

    /// Whether any corner has `normal · x > offset`; `None` if that takes more than `visits` visits of clusters, from
    /// which those made are subtracted.
    pub fn extends_beyond(&self, normal: DVec3, offset: f64, visits: &mut u32) -> Option<bool> {
        let mut open = vec![0];
        while let Some(cluster) = open.pop().and_then(|i: u32| self.nodes.get(i as usize)) {
            *visits = visits.checked_sub(1)?;
            let of_sphere = normal.dot(cluster.center) + cluster.radius;
            if of_sphere.min(box_extent(normal, [cluster.low, cluster.high]).1) <= offset {
                continue;
            }
            if cluster.children[0] != NONE {
                open.extend(cluster.children);
            } else if self.triangles(cluster).iter().flatten().any(|c| normal.dot(*c) > offset) {
                return Some(true);
            }
        }
        Some(false)
    }

    /// The triangles' corners of a cluster.
    pub fn triangles(&self, cluster: &Cluster) -> &[[DVec3; 3]] {
        &self.corners[cluster.range.start as usize..cluster.range.end as usize]
    }
}

impl Cluster {
    fn new<'a>(triangles: impl Iterator<Item = &'a ClusterTriangle> + Clone) -> Self {
        let points = || triangles.clone().flat_map(|t| t.corners);
        let (low, high) =
            points().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        let center = (low + high) * 0.5;
        let radius = points().map(|p| p.distance_squared(center)).fold(0.0, f64::max).sqrt();
        let axis = triangles.clone().map(|t| t.normal * t.area).sum::<DVec3>().normalize_or_zero();
        let double_sided = triangles.clone().any(|t| t.double_sided);
        let cosine = triangles.clone().map(|t| t.normal.dot(axis)).fold(1.0, f64::min);
        let angle = if double_sided || axis == DVec3::ZERO { PI } else { libm::acos(cosine) };
        let area = triangles.map(|t| t.area).sum();
        let angle_sine_cosine = Self::sine_cosine(angle);
        let children = [NONE; 2];
        Self { center, radius, low, high, axis, angle, angle_sine_cosine, area, range: 0..0, children }
    }

    /// Its bounding sphere.
    pub fn sphere(&self) -> Sphere {
        Sphere { center: self.center, radius: self.radius }
    }

    /// What [`Cluster::angle_sine_cosine`] is for an angle.
    pub fn sine_cosine(angle: f64) -> (f64, f64) {
        libm::sincos(angle + 1e-3)
    }
}
