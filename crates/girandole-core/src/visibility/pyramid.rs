//! Occlusion pyramids: what can lie between a receiver and a light (Barczak §4.3.1, figure 4-5).
//!
//! A pyramid is a set of half-spaces that contain every ray from the receiver to the light, with
//! ray origins offset from the surface. All
//! distances are in double precision, so that only the geometry's own rounding counts, and [`Tolerance`] covers that.

mod planes;

use super::boxes::{FullCoverHint, RayBundle, Slabs, SweptBox};
use super::clusters::{Cluster, ClusterTree};
use super::cones::Sphere;
use super::primitives::{Tolerance, clip};
use super::shapes::{Apex, Hull, MAX_CORNERS};
use super::surfaces::SimplePatch;
use glam::DVec3;

/// How much of a pyramid a blocker occludes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Occlusion {
    None,
    Partial,
    Full,
}

/// How many of a receiver's points face a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Facing {
    None,
    Some,
    All,
}

/// Where a box is relative to a pyramid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Containment {
    Outside,
    Crossing,
    Inside,
}

/// Inside is `normal · x ≥ offset`; the normal has unit length.
#[derive(Clone, Copy, Debug, Default)]
struct Plane {
    normal: DVec3,
    offset: f64,
    /// What is outside by less than this counts as inside.
    margin: f64,
}

/// The number of tests made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tests {
    /// Of lights against receivers, and of pyramids against boxes of hierarchies.
    pub boxes: u64,
    /// Of pyramids against polygons, clusters and triangles.
    pub blockers: u64,
}

impl Tests {
    /// All of them.
    pub fn total(self) -> u64 {
        self.boxes + self.blockers
    }
}

impl std::ops::AddAssign for Tests {
    fn add_assign(&mut self, other: Self) {
        self.boxes += other.boxes;
        self.blockers += other.blockers;
    }
}

/// Buffers for clipping, and the number of tests made.
#[derive(Default)]
pub(crate) struct Scratch {
    from: Vec<DVec3>,
    to: Vec<DVec3>,
    pub tests: Tests,
}

/// Heights above a plane: the light's, and the lowest and highest of the receiver's ray origins.
struct PlaneHeights {
    light: f64,
    low: f64,
    high: f64,
}

/// The axis of the cone of planes that touch a receiver's sphere and go through the light.
#[derive(Clone, Copy, Debug)]
struct SphereAxis {
    /// From the light to the sphere, unit length.
    direction: DVec3,
    /// Of the angle between axis and planes.
    sine: f64,
    cosine: f64,
}

/// The half-spaces of a receiver and a light that face each other; set again for each pair.
pub(crate) struct Pyramid {
    apex: Apex,
    tolerance: Tolerance,
    hull: Hull,
    planes: [Plane; MAX_CORNERS + 2],
    count: usize,
    /// Whether planes are wanted, not only the facing.
    needs_planes: bool,
    /// Computed on first use.
    bundle: RayBundle,
    slabs: Slabs,
    /// Of a cluster.
    swept: Option<SweptBox>,
    /// Of a sphere: from the light to it.
    sphere_axis: Option<SphereAxis>,
    /// The receiver's middle, and from there to the light.
    axis: Option<(DVec3, DVec3)>,
}

impl Pyramid {
    pub fn new() -> Self {
        let apex = Apex { position: DVec3::ZERO, normal: DVec3::ZERO, finite: false };
        let hull = Hull::Sphere(DVec3::ZERO, 0.0, [DVec3::ZERO; 2]);
        let tolerance = Tolerance { ray_offset: 0.0, coordinate: 0.0, seam: 0.0, side: 0.0, less: 0.0 };
        Self {
            apex,
            tolerance,
            hull,
            planes: [Plane::default(); MAX_CORNERS + 2],
            count: 0,
            needs_planes: true,
            bundle: RayBundle::default(),
            slabs: Slabs::default(),
            swept: None,
            sphere_axis: None,
            axis: None,
        }
    }

    /// For a spherical receiver, the tangent plane that separates the pyramid best from a point beside it.
    fn tangent_towards(&self, point: DVec3) -> Option<Plane> {
        let (Hull::Sphere(center, ..), Some(axis)) = (&self.hull, &self.sphere_axis) else { return None };
        let SphereAxis { direction, .. } = *axis;
        let beside = point - center;
        let across = (direction * direction.dot(beside) - beside).try_normalize()?;
        let (normal, offset) = self.tangent(axis, across);
        Some(Plane { normal, offset, margin: self.tolerance.side })
    }

    /// Smallest and largest `normal · x` over the receiver's ray origins.
    fn receiver_extent(&self, normal: DVec3) -> (f64, f64) {
        self.hull.extent(normal)
    }

    fn planes(&self) -> &[Plane] {
        &self.planes[..self.count]
    }

    /// Whether the first of two boxes is nearer to the line between receiver and light, relative to its size.
    pub fn is_nearer(&mut self, [(low, high), other]: [(DVec3, DVec3); 2]) -> bool {
        let (middle, along) = *self.axis.get_or_insert_with(|| {
            let middle = self.hull.middle();
            (middle, self.apex.towards(middle))
        });
        let length = along.length_squared();
        // Squares of twice the distance times that length, and of the size.
        let beside = |(low, high): (DVec3, DVec3)| {
            let to = low + high - middle * 2.0;
            let ahead = to.dot(along);
            (to.length_squared() * length - ahead * ahead, (high - low).length_squared())
        };
        let ((distance, size), (other_distance, other_size)) = (beside((low, high)), beside(other));
        distance * other_size < other_distance * size
    }

    /// Where a box is; what is inside is so by more than the tolerance.
    pub fn classify_box(&mut self, low: DVec3, high: DVec3) -> Containment {
        if self.swept.as_ref().is_some_and(|swept| !swept.may_intersect(low, high)) {
            return Containment::Outside;
        }
        let (center, half) = ((low + high) * 0.5, (high - low) * 0.5);
        let mut containment = Containment::Inside;
        for p in self.planes() {
            let (middle, reach) = (p.normal.dot(center) - p.offset, p.normal.abs().dot(half));
            if middle + reach < -p.margin {
                return Containment::Outside;
            }
            if middle - reach < p.margin {
                containment = Containment::Crossing;
            }
        }
        if containment == Containment::Crossing && self.swept.is_none() {
            if self.slabs.count == 0 {
                self.slabs.set(&self.apex, &self.hull, self.tolerance.side);
            }
            if self.slabs.separate(center, half) {
                return Containment::Outside;
            }
        }
        containment
    }

    /// Whether a polygon in a box, and not wider than `extent`, may cover the receiver, given the hint from its parent's
    /// test. If not, `hint` becomes what that implies for the receiver's children.
    pub fn may_be_fully_covered(
        &mut self,
        (low, high, extent): (DVec3, DVec3, f64),
        hint: &mut FullCoverHint,
        scratch: &mut Scratch,
    ) -> bool {
        if extent <= 0.0 || hint.missed_corners != 0 {
            return false;
        }
        if self.bundle.count == 0 {
            self.bundle.set(&self.apex, &self.hull);
        }
        if self.bundle.width as f32 > hint.max_width {
            return false;
        }
        scratch.tests.boxes += 1;
        self.bundle.passes(low, high, extent, hint)
    }

    /// Whether it is built from the receiver's bounding sphere, not from its corners.
    pub fn has_sphere(&self) -> bool {
        matches!(self.hull, Hull::Sphere(..))
    }

    /// Whether any triangle of a tree intersects the pyramid.
    pub fn intersects_tree(&mut self, tree: &ClusterTree, scratch: &mut Scratch) -> bool {
        let mut open = [0; 64];
        let mut count = usize::from(!tree.nodes.is_empty());
        while count > 0 {
            count -= 1;
            let cluster = &tree.nodes[open[count] as usize];
            scratch.tests.blockers += 1;
            match self.classify_cluster(cluster) {
                Containment::Outside => continue,
                Containment::Inside => return true,
                Containment::Crossing => {}
            }
            if cluster.children[0] != crate::scene::NONE {
                if count + 2 > open.len() {
                    return true;
                }
                open[count..count + 2].copy_from_slice(&cluster.children);
                let [a, b] = cluster.children.map(|c| &tree.nodes[c as usize]);
                if self.is_nearer([(a.low, a.high), (b.low, b.high)]) {
                    open.swap(count, count + 1);
                }
                count += 2;
            } else if self.intersects_triangles(tree, cluster, scratch) {
                return true;
            }
        }
        false
    }

    /// Where a sphere is.
    pub fn classify_sphere(&self, sphere: &Sphere) -> Containment {
        let mut containment = Containment::Inside;
        for p in self.planes() {
            let height = p.normal.dot(sphere.center) - p.offset;
            if height + sphere.radius < -p.margin {
                return Containment::Outside;
            }
            if height - sphere.radius < p.margin {
                containment = Containment::Crossing;
            }
        }
        containment
    }

    /// Where a cluster is, by its sphere and its box.
    pub fn classify_cluster(&mut self, cluster: &Cluster) -> Containment {
        let reaches = |p: &Plane| p.normal.dot(cluster.center) + cluster.radius >= p.offset - p.margin;
        let sphere = self.planes().iter().all(reaches)
            && self.tangent_towards(cluster.center).is_none_or(|p| reaches(&p));
        if sphere { self.classify_box(cluster.low, cluster.high) } else { Containment::Outside }
    }

    /// Whether any triangle of a cluster intersects the pyramid.
    pub fn intersects_cluster(&mut self, tree: &ClusterTree, cluster: u32, scratch: &mut Scratch) -> bool {
        let cluster = &tree.nodes[cluster as usize];
        scratch.tests.blockers += 1;
        match self.classify_cluster(cluster) {
            Containment::Outside => false,
            Containment::Inside => true,
            Containment::Crossing => self.intersects_triangles(tree, cluster, scratch),
        }
    }

    fn intersects_triangles(&self, tree: &ClusterTree, cluster: &Cluster, scratch: &mut Scratch) -> bool {
        tree.triangles(cluster).iter().any(|corners| {
            scratch.tests.blockers += 1;
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
            normal == DVec3::ZERO
                || self.intersects_polygon(corners, &self.heights(normal, normal.dot(corners[0])), scratch)
        })
    }

    /// How much of the pyramid a patch occludes.
    pub fn test_patch(&self, patch: &SimplePatch, scratch: &mut Scratch) -> Occlusion {
        scratch.tests.blockers += 1;
        let heights = self.heights(patch.plane.normal, patch.plane.offset);
        if !self.intersects_polygon(&patch.corners, &heights, scratch) {
            return Occlusion::None;
        }
        match patch.opaque && self.is_covered(patch, &heights) {
            true => Occlusion::Full,
            false => Occlusion::Partial,
        }
    }

    /// How high above a plane light and receiver are.
    fn heights(&self, normal: DVec3, offset: f64) -> PlaneHeights {
        let (low, high) = self.receiver_extent(normal);
        // Without a position only the sign of the light's height counts.
        let light = if self.apex.finite {
            normal.dot(self.apex.position) - offset
        } else {
            -normal.dot(self.apex.normal)
        };
        PlaneHeights { light, low: low - offset, high: high - offset }
    }

    fn intersects_polygon(&self, corners: &[DVec3], heights: &PlaneHeights, scratch: &mut Scratch) -> bool {
        // The polygon's plane separates: receiver and light on one side.
        let seam = self.tolerance.seam;
        let clear = if self.apex.finite { seam } else { 0.0 };
        if heights.light >= clear && heights.low >= -seam || heights.light <= -clear && heights.high <= seam {
            return false;
        }
        // One of the pyramid's planes separates. A bit for each corner: a patch has 64 at most.
        let all = u64::MAX >> (64 - corners.len());
        let (mut cut, mut outside_any) = (0_u32, 0_u64);
        for (i, p) in self.planes().iter().enumerate() {
            let mut outside = 0_u64;
            for (j, corner) in corners.iter().enumerate() {
                let is_inside = p.normal.dot(*corner) >= p.offset - p.margin;
                outside |= u64::from(!is_inside) << j;
            }
            if outside == all {
                return false;
            }
            cut |= u32::from(outside != 0) << i;
            outside_any |= outside;
        }
        if cut == 0 {
            return true;
        }
        if let Hull::Sphere(..) = self.hull {
            let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
            if let Some(p) = self.tangent_towards(middle)
                && corners.iter().all(|c| p.normal.dot(*c) < p.offset - p.margin)
            {
                return false;
            }
        }
        // A corner is inside.
        if outside_any != all {
            return true;
        }
        // Clip the polygon by the planes that cross it.
        let Scratch { from, to, .. } = scratch;
        from.clear();
        from.extend_from_slice(corners);
        for (i, p) in self.planes().iter().enumerate() {
            if cut >> i & 1 == 0 {
                continue;
            }
            clip(from, to, p.normal, p.offset - p.margin);
            std::mem::swap(from, to);
            if from.is_empty() {
                return false;
            }
        }
        true
    }

    /// Whether every ray from the receiver to the light passes through a convex patch.
    fn is_covered(&self, patch: &SimplePatch, heights: &PlaneHeights) -> bool {
        let t = &self.tolerance;
        // The light on one side, the receiver on the other.
        let clear = if self.apex.finite { t.coordinate } else { 1e-6 };
        let height = heights.light;
        let (depth, sign) = if height >= clear && heights.high <= -t.coordinate {
            (-heights.low, 1.0)
        } else if height <= -clear && heights.low >= t.coordinate {
            (heights.high, -1.0)
        } else {
            return false;
        };
        // The distance of rays to each other at the patch, as a share of that at the receiver.
        let narrowing = if self.apex.finite { height.abs() / (height.abs() + depth) } else { 1.0 };
        let margin = t.side.max(t.coordinate / narrowing);
        let n = patch.corners.len();
        (0..n).all(|i| {
            let (a, b) = (patch.corners[i], patch.corners[(i + 1) % n]);
            let side = ((b - a).cross(self.apex.towards(a)) * -sign).normalize_or_zero();
            side != DVec3::ZERO && self.receiver_extent(side).0 - side.dot(a) >= margin
        })
    }
}
