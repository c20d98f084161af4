//! A binary tree of clusters over some triangles of an object: receivers near the root, blockers down to the leaves.

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

impl ClusterTree {
    /// Splits triangles at the median of their centroids along the longest axis.
    pub fn new(scene: &Scene, geometry: &Geometry, mut order: Vec<u32>) -> Self {
        let centroid = |t: u32| {
            let [a, b, c] = geometry.corners(t).map(|p| p.as_dvec3());
            a + b + c
        };
        let mut nodes = Vec::new();
        let mut open = vec![(0..order.len(), NONE)];
        // Depth first, parents before children.
        while let Some((range, parent)) = open.pop() {
            let index = nodes.len() as u32;
            let mut cluster = Cluster::new(scene, geometry, &order[range.clone()]);
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
            let triangles = &mut order[range.clone()];
            let (low, high) = triangles
                .iter()
                .map(|&t| centroid(t))
                .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), c| (low.min(c), high.max(c)));
            let extent = high - low;
            let axis = (0..3).fold(0, |best, i| if extent[i] > extent[best] { i } else { best });
            let middle = triangles.len() / 2;
            triangles.select_nth_unstable_by(middle, |&a, &b| {
                centroid(a)[axis].total_cmp(&centroid(b)[axis]).then(a.cmp(&b))
            });
            open.push((range.start + middle..range.end, index));
            open.push((range.start..range.start + middle, index));
        }
        let corners = order.iter().map(|&t| geometry.corners(t).map(|p| p.as_dvec3())).collect();
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
    fn new(scene: &Scene, geometry: &Geometry, triangles: &[u32]) -> Self {
        let points = || triangles.iter().flat_map(|&t| geometry.corners(t)).map(|p| p.as_dvec3());
        let low = points().fold(DVec3::INFINITY, DVec3::min);
        let high = points().fold(DVec3::NEG_INFINITY, DVec3::max);
        let center = (low + high) * 0.5;
        let radius = points().map(|p| p.distance(center)).fold(0.0, f64::max);
        let normal = |&t: &u32| geometry.normal(t).as_dvec3();
        let area = |t: &u32| f64::from(geometry.area(*t));
        let sum = triangles.iter().map(|t| normal(t) * area(t)).sum::<DVec3>();
        let axis = sum.normalize_or_zero();
        let double_sided = triangles
            .iter()
            .any(|&t| scene.materials[geometry.triangles[t as usize].material as usize].double_sided);
        let cosine = triangles.iter().map(|t| normal(t).dot(axis)).fold(1.0, f64::min);
        let angle = if double_sided || axis == DVec3::ZERO { PI } else { libm::acos(cosine) };
        Self {
            center,
            radius,
            low,
            high,
            axis,
            angle,
            area: triangles.iter().map(area).sum(),
            range: 0..0,
            children: [NONE; 2],
        }
    }
}
