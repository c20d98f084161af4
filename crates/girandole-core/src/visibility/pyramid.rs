//! Occlusion pyramids: what can lie between a receiver and a light (Barczak §4.3.1, figure 4-5).
//!
//! A pyramid is a set of half-spaces that contain every ray from the receiver's lifted points to the light. All
//! distances are in double precision, so that only the geometry's own rounding counts, and [`Tolerance`] covers that.

mod planes;

use super::boxes::{Bundle, Cover, Slabs};
use super::clusters::{Cluster, ClusterTree};
use super::shapes::{Apex, Hull, MOST_CORNERS, Tolerance};
use super::surfaces::SimplePatch;
use glam::DVec3;

/// What a blocker does to a pyramid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Blocks {
    None,
    Partial,
    Full,
}

/// Which of a receiver's points and a light face each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Facing {
    None,
    Some,
    All,
}

/// Where a box is, as a pyramid sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    Outside,
    Crossing,
    Inside,
}

/// Inside is `normal · x ≥ offset`; the normal has unit length.
#[derive(Clone, Copy, Debug, Default)]
struct Plane {
    normal: DVec3,
    offset: f64,
    /// How far outside something has to be.
    margin: f64,
}

/// How many tests were made.
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

/// Working memory for clipping, and the tests that were made.
#[derive(Default)]
pub(crate) struct Scratch {
    from: Vec<DVec3>,
    to: Vec<DVec3>,
    pub tests: Tests,
}

/// Heights above a plane: the light's, and the receiver's lowest and highest lifted point's.
struct Sides {
    light: f64,
    low: f64,
    high: f64,
}

/// A receiver and a light that face each other; made anew for each pair in the same place.
pub(crate) struct Pyramid {
    apex: Apex,
    tolerance: Tolerance,
    hull: Hull,
    planes: [Plane; MOST_CORNERS + 2],
    count: usize,
    /// Made when they are first asked for.
    bundle: Bundle,
    slabs: Slabs,
}

impl Pyramid {
    pub fn new() -> Self {
        let apex = Apex { position: DVec3::ZERO, normal: DVec3::ZERO, finite: false };
        let hull = Hull::Sphere(DVec3::ZERO, 0.0, [DVec3::ZERO; 2]);
        let tolerance = Tolerance { lift: 0.0, tol: 0.0, edge: 0.0, side: 0.0, less: 0.0 };
        Self {
            apex,
            tolerance,
            hull,
            planes: [Plane::default(); MOST_CORNERS + 2],
            count: 0,
            bundle: Bundle::default(),
            slabs: Slabs::default(),
        }
    }

    /// The plane that separates the pyramid over a sphere best from a point beside it.
    fn facing(&self, point: DVec3) -> Option<Plane> {
        let Hull::Sphere(center, ..) = self.hull else { return None };
        let away = if self.apex.finite { center - self.apex.position } else { self.apex.normal };
        let axis = away.try_normalize()?;
        let beside = point - center;
        let across = (axis * axis.dot(beside) - beside).try_normalize()?;
        let (normal, offset) = self.tangent(axis, across);
        Some(Plane { normal, offset, margin: self.tolerance.side })
    }

    /// Smallest and largest `normal · x` over the receiver's lifted points.
    fn receiver_extent(&self, normal: DVec3) -> (f64, f64) {
        self.hull.extent(normal)
    }

    fn planes(&self) -> &[Plane] {
        &self.planes[..self.count]
    }

    /// Which of two boxes is nearer to the line between receiver and light, for the size that it has.
    pub fn is_nearer(&self, [(low, high), other]: [(DVec3, DVec3); 2]) -> bool {
        let middle = self.hull.middle();
        let along = self.apex.towards(middle);
        let beside = |(low, high): (DVec3, DVec3)| {
            ((low + high) * 0.5 - middle).cross(along).length_squared() / (high - low).length_squared()
        };
        beside((low, high)) < beside(other)
    }

    /// Where a box is; what is inside is so by more than what is in doubt.
    pub fn place(&mut self, low: DVec3, high: DVec3) -> Place {
        let (center, half) = ((low + high) * 0.5, (high - low) * 0.5);
        let mut place = Place::Inside;
        for p in self.planes() {
            let (middle, reach) = (p.normal.dot(center) - p.offset, p.normal.abs().dot(half));
            if middle + reach < -p.margin {
                return Place::Outside;
            }
            if middle - reach < p.margin {
                place = Place::Crossing;
            }
        }
        if place == Place::Crossing {
            if self.slabs.count == 0 {
                self.slabs.set(&self.apex, &self.hull, self.tolerance.side);
            }
            if self.slabs.miss(center, half) {
                return Place::Outside;
            }
        }
        place
    }

    /// Whether a polygon in a box, and not wider than `extent`, may cover the receiver, given what is known from the
    /// receiver that it is part of. If not, `cover` becomes what is known for its own parts.
    pub fn may_be_covered(
        &mut self,
        (low, high, extent): (DVec3, DVec3, f64),
        cover: &mut Cover,
        scratch: &mut Scratch,
    ) -> bool {
        if extent <= 0.0 || cover.missed != 0 {
            return false;
        }
        if self.bundle.count == 0 {
            self.bundle.set(&self.apex, &self.hull);
        }
        if self.bundle.width as f32 > cover.widest {
            return false;
        }
        scratch.tests.boxes += 1;
        self.bundle.passes(low, high, extent, cover)
    }

    /// Whether it is the receiver's bounds that the light sees, and not its corners.
    pub fn is_round(&self) -> bool {
        matches!(self.hull, Hull::Sphere(..))
    }

    /// Whether any triangle of a tree reaches into the pyramid.
    pub fn meets_tree(&mut self, tree: &ClusterTree, scratch: &mut Scratch) -> bool {
        let mut open = [0; 64];
        let mut count = usize::from(!tree.nodes.is_empty());
        while count > 0 {
            count -= 1;
            let cluster = &tree.nodes[open[count] as usize];
            scratch.tests.blockers += 1;
            match self.place_cluster(cluster) {
                Place::Outside => continue,
                Place::Inside => return true,
                Place::Crossing => {}
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
            } else if self.meets_triangles(tree, cluster, scratch) {
                return true;
            }
        }
        false
    }

    /// Where a cluster's bounds are, its sphere and its box.
    pub fn place_cluster(&mut self, cluster: &Cluster) -> Place {
        let reaches = |p: &Plane| p.normal.dot(cluster.center) + cluster.radius >= p.offset - p.margin;
        let sphere =
            self.planes().iter().all(reaches) && self.facing(cluster.center).is_none_or(|p| reaches(&p));
        if sphere { self.place(cluster.low, cluster.high) } else { Place::Outside }
    }

    /// Whether any triangle of a cluster reaches into the pyramid.
    pub fn meets_cluster(&mut self, tree: &ClusterTree, cluster: u32, scratch: &mut Scratch) -> bool {
        let cluster = &tree.nodes[cluster as usize];
        scratch.tests.blockers += 1;
        match self.place_cluster(cluster) {
            Place::Outside => false,
            Place::Inside => true,
            Place::Crossing => self.meets_triangles(tree, cluster, scratch),
        }
    }

    fn meets_triangles(&self, tree: &ClusterTree, cluster: &Cluster, scratch: &mut Scratch) -> bool {
        tree.triangles(cluster).iter().any(|corners| {
            scratch.tests.blockers += 1;
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
            normal == DVec3::ZERO
                || self.meets_polygon(corners, &self.sides(normal, normal.dot(corners[0])), scratch)
        })
    }

    /// What a patch does to the pyramid.
    pub fn test_patch(&self, patch: &SimplePatch, scratch: &mut Scratch) -> Blocks {
        scratch.tests.blockers += 1;
        let sides = self.sides(patch.normal, patch.offset);
        if !self.meets_polygon(&patch.corners, &sides, scratch) {
            return Blocks::None;
        }
        match patch.opaque && self.is_covered(patch, &sides) {
            true => Blocks::Full,
            false => Blocks::Partial,
        }
    }

    /// On which sides of a plane light and receiver are.
    fn sides(&self, normal: DVec3, offset: f64) -> Sides {
        let (low, high) = self.receiver_extent(normal);
        // Without a position only the sign of the light's height counts.
        let light = if self.apex.finite {
            normal.dot(self.apex.position) - offset
        } else {
            -normal.dot(self.apex.normal)
        };
        Sides { light, low: low - offset, high: high - offset }
    }

    fn meets_polygon(&self, corners: &[DVec3], sides: &Sides, scratch: &mut Scratch) -> bool {
        // The polygon's plane separates: receiver and light on one side.
        let edge = self.tolerance.edge;
        let clear = if self.apex.finite { edge } else { 0.0 };
        if sides.light >= clear && sides.low >= -edge || sides.light <= -clear && sides.high <= edge {
            return false;
        }
        // One of the pyramid's planes separates.
        let mut cut = 0_u32;
        for (i, p) in self.planes().iter().enumerate() {
            let (mut inside, mut outside) = (false, false);
            for corner in corners {
                let is_inside = p.normal.dot(*corner) >= p.offset - p.margin;
                inside |= is_inside;
                outside |= !is_inside;
            }
            if !inside {
                return false;
            }
            cut |= u32::from(outside) << i;
        }
        if cut == 0 {
            return true;
        }
        if let Hull::Sphere(..) = self.hull {
            let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
            if let Some(p) = self.facing(middle)
                && corners.iter().all(|c| p.normal.dot(*c) < p.offset - p.margin)
            {
                return false;
            }
        }
        // What is left of it after clipping (Sutherland and Hodgman 1974).
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
    fn is_covered(&self, patch: &SimplePatch, sides: &Sides) -> bool {
        let t = &self.tolerance;
        // The light on one side, the receiver on the other.
        let clear = if self.apex.finite { t.tol } else { 1e-6 };
        let height = sides.light;
        let (depth, sign) = if height >= clear && sides.high <= -t.tol {
            (-sides.low, 1.0)
        } else if height <= -clear && sides.low >= t.tol {
            (sides.high, -1.0)
        } else {
            return false;
        };
        // How much nearer to each other rays are where they pass through the patch.
        let narrowing = if self.apex.finite { height.abs() / (height.abs() + depth) } else { 1.0 };
        let margin = t.side.max(t.tol / narrowing);
        let n = patch.corners.len();
        (0..n).all(|i| {
            let (a, b) = (patch.corners[i], patch.corners[(i + 1) % n]);
            let side = ((b - a).cross(self.apex.towards(a)) * -sign).normalize_or_zero();
            side != DVec3::ZERO && self.receiver_extent(side).0 - side.dot(a) >= margin
        })
    }
}

/// The part of a convex polygon where `normal · x ≥ offset`.
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
