//! What several polygons hide together: the walls beside a door and the lintel above it, of which none hides the next room by itself.
//!
//! The part of a receiver that is seen from an apex is what is left of its polygon when the shadow of one static polygon after the other
//! is cut off: what is within the planes through the apex and the polygon's edges, and beyond its own plane. Of a receiver that is a
//! cluster, the faces of its box are cut. Pieces narrower than a seam count for nothing.

use super::blockers::BlockerTree;
use super::database::VisibilityDatabase;
use super::primitives::{Tolerance, area_vector, clip};
use super::pyramid::{Containment, Facing, Pyramid};
use super::shapes::{Apex, PatchPlane, Shape};
use super::surfaces::{SimplePatch, Surfaces};
use crate::scene::NONE;
use glam::DVec3;

/// Polygons that are cut off at most, those that seem largest.
const MOST_POLYGONS: usize = 48;
/// Pieces that a receiver may be left in, before it counts as seen.
const MOST_PIECES: usize = 96;
/// Share of the tolerance beside a receiver that seams are narrower than.
const SEAM: f64 = 0.25;

/// Buffers of one thread.
pub(super) struct Cutter<'a> {
    surfaces: &'a Surfaces,
    /// Over static blockers.
    groups: &'a BlockerTree,
    pyramid: Pyramid,
    open: Vec<u32>,
    /// Polygons, by how large they seem.
    polygons: Vec<(f64, u32)>,
    pieces: Vec<Vec<DVec3>>,
    next: Vec<Vec<DVec3>>,
    spare: Vec<DVec3>,
}

impl VisibilityDatabase {
    /// Whether static polygons together hide all of a leaf from a light. States say so only where one of them does.
    pub fn is_covered(&self, leaf: u32, light: u32) -> bool {
        let point = &self.lights[light as usize];
        let hides = |blocker, _: &SimplePatch| blocker != point.own;
        self.leaf_shape(leaf).is_some_and(|shape| self.cutter().hides(&point.apex, shape, hides))
    }
}

impl<'a> Cutter<'a> {
    pub fn new(surfaces: &'a Surfaces, groups: &'a BlockerTree) -> Self {
        Self {
            surfaces,
            groups,
            pyramid: Pyramid::new(),
            open: Vec::new(),
            polygons: Vec::new(),
            pieces: Vec::new(),
            next: Vec::new(),
            spare: Vec::new(),
        }
    }

    /// Whether static polygons that are accepted hide all of a receiver from an apex.
    pub fn hides(&mut self, apex: &Apex, shape: Shape, accept: impl Fn(u32, &SimplePatch) -> bool) -> bool {
        let tolerance = shape.tolerance(&self.surfaces.tolerance);
        if self.pyramid.facing(apex, shape, &tolerance) == Facing::None {
            return true;
        }
        // Most of what is seen is so at its middle.
        let faces = faces(shape, apex, tolerance.side);
        let is_hidden = |face: &Vec<DVec3>| self.blocks(apex, middle(face), &tolerance, &accept);
        if faces.is_empty() || !faces.iter().all(is_hidden) {
            return false;
        }
        self.pyramid.set(apex, shape, &tolerance);
        self.find(apex, accept);
        faces.into_iter().all(|face| self.covers(apex, face, &tolerance))
    }

    /// Whether some polygon lies between an apex and a point.
    fn blocks(
        &mut self,
        apex: &Apex,
        point: DVec3,
        tolerance: &Tolerance,
        accept: impl Fn(u32, &SimplePatch) -> bool,
    ) -> bool {
        let (groups, surfaces) = (self.groups, self.surfaces);
        let inverse = apex.towards(point).recip();
        let end = if apex.finite { 1.0 } else { f64::INFINITY };
        self.open.clear();
        self.open.extend((!groups.is_empty()).then_some(0));
        while let Some(index) = self.open.pop() {
            let node = &groups.nodes[index as usize];
            let (a, b) = ((node.low - point) * inverse, (node.high - point) * inverse);
            // Beside a box along an axis that the ray keeps to there is nothing to compare with.
            let (enter, leave) = (a.min(b).max_element().max(0.0), a.max(b).min_element().min(end));
            if node.mesh != NONE || enter > leave * (1.0 + 1e-12) {
                continue;
            }
            if node.count == 0 {
                self.open.extend([node.first, node.first + 1]);
                continue;
            }
            for &blocker in &groups.items[node.first as usize..(node.first + node.count) as usize] {
                let patch = surfaces.patches.get(blocker as usize).filter(|patch| patch.opaque);
                let is_between =
                    |patch: &&SimplePatch| accept(blocker, patch) && is_beyond(patch, apex, point, tolerance);
                if patch.filter(is_between).is_some() {
                    return true;
                }
            }
        }
        false
    }

    /// Finds the polygons between an apex and a receiver, those that seem largest first.
    fn find(&mut self, apex: &Apex, accept: impl Fn(u32, &SimplePatch) -> bool) {
        let (groups, surfaces) = (self.groups, self.surfaces);
        self.polygons.clear();
        self.open.clear();
        self.open.extend((!groups.is_empty()).then_some(0));
        while let Some(index) = self.open.pop() {
            let node = &groups.nodes[index as usize];
            if node.mesh != NONE || self.pyramid.classify_box(node.low, node.high) == Containment::Outside {
                continue;
            }
            if node.count == 0 {
                self.open.extend([node.first, node.first + 1]);
                continue;
            }
            for &blocker in &groups.items[node.first as usize..(node.first + node.count) as usize] {
                let Some(patch) = surfaces.patches.get(blocker as usize).filter(|patch| patch.opaque) else {
                    continue;
                };
                if accept(blocker, patch) {
                    let to = apex.towards((patch.low + patch.high) * 0.5);
                    let seeming = patch.area * patch.plane.normal.dot(to.normalize_or_zero()).abs();
                    let size = if apex.finite { seeming / to.length_squared().max(1e-12) } else { seeming };
                    self.polygons.push((size, blocker));
                }
            }
        }
        self.polygons.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        self.polygons.truncate(MOST_POLYGONS);
    }

    /// Whether the polygons that were found hide all of a convex polygon.
    fn covers(&mut self, apex: &Apex, face: Vec<DVec3>, tolerance: &Tolerance) -> bool {
        let Self { surfaces, polygons, pieces, next, spare, .. } = self;
        let seam = SEAM * tolerance.side;
        pieces.clear();
        pieces.push(face);
        for (_, index) in polygons.iter() {
            let patch = &surfaces.patches[*index as usize];
            next.clear();
            for piece in pieces.drain(..) {
                cut(piece, patch, apex, tolerance, spare, |rest| {
                    if width(&rest) > seam {
                        next.push(rest);
                    }
                });
            }
            std::mem::swap(pieces, next);
            if pieces.is_empty() {
                return true;
            }
            if pieces.len() > MOST_PIECES {
                return false;
            }
        }
        false
    }
}

/// The convex polygons that are seen of a receiver: all of a patch, the near faces of a cluster's box; a little larger than they are. None
/// where an apex is within that box.
fn faces(shape: Shape, apex: &Apex, side: f64) -> Vec<Vec<DVec3>> {
    match shape {
        Shape::Patch { corners, .. } => {
            let center = middle(corners);
            let outward = |corner: &DVec3| *corner + (*corner - center).normalize_or_zero() * (1.5 * side);
            vec![corners.iter().map(outward).collect()]
        }
        Shape::Cluster(cluster) => {
            let (low, high) = (cluster.low - side, cluster.high + side);
            let mut faces = Vec::new();
            for axis in 0..3 {
                for at in [low, high] {
                    let sign = if at == low { -1.0 } else { 1.0 };
                    let mut normal = DVec3::ZERO;
                    normal[axis] = sign;
                    if !apex.is_in_front(normal, normal.dot(at)) {
                        continue;
                    }
                    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                    let corner = |of_u: DVec3, of_v: DVec3| {
                        let mut corner = at;
                        (corner[u], corner[v]) = (of_u[u], of_v[v]);
                        corner
                    };
                    faces.push(vec![
                        corner(low, low),
                        corner(high, low),
                        corner(high, high),
                        corner(low, high),
                    ]);
                }
            }
            faces
        }
        Shape::Group(_) => Vec::new(),
    }
}

fn middle(corners: &[DVec3]) -> DVec3 {
    corners.iter().sum::<DVec3>() / corners.len().max(1) as f64
}

/// Planes through an apex and the edges of a polygon, with the polygon before them: normals and offsets.
fn edges<'a>(patch: &'a SimplePatch, apex: &'a Apex) -> impl Iterator<Item = (DVec3, f64)> + 'a {
    let height = apex.towards(patch.corners[0]).dot(patch.plane.normal);
    let next = patch.corners.iter().cycle().skip(1);
    patch.corners.iter().zip(next).map(move |(a, b)| {
        let normal = (*b - *a).cross(apex.towards(*a)) * -height.signum();
        (normal, normal.dot(*a))
    })
}

/// The plane of a polygon, with its normal away from an apex.
fn away(patch: &SimplePatch, apex: &Apex) -> PatchPlane {
    patch.plane.turned(-apex.towards(patch.corners[0]).dot(patch.plane.normal).signum())
}

/// Whether a polygon lies between an apex and a point.
pub(super) fn is_beyond(patch: &SimplePatch, apex: &Apex, point: DVec3, tolerance: &Tolerance) -> bool {
    let PatchPlane { normal, offset, .. } = away(patch, apex);
    normal.dot(point) >= offset + tolerance.coordinate
        && edges(patch, apex).all(|(normal, offset)| normal.dot(point) >= offset)
}

/// Cuts the part of a convex polygon off that a patch hides from an apex; convex pieces are left.
fn cut(
    piece: Vec<DVec3>,
    patch: &SimplePatch,
    apex: &Apex,
    tolerance: &Tolerance,
    spare: &mut Vec<DVec3>,
    mut left: impl FnMut(Vec<DVec3>),
) {
    let PatchPlane { normal, offset, .. } = away(patch, apex);
    let planes = || edges(patch, apex).chain([(normal, offset + tolerance.coordinate)]);
    // Where nothing is hidden, it stays in one piece.
    let mut inner = piece.clone();
    for (normal, offset) in planes() {
        clip(&inner, spare, normal, offset);
        std::mem::swap(&mut inner, spare);
    }
    if inner.len() < 3 {
        left(piece);
        return;
    }
    let mut rest = piece;
    for (normal, offset) in planes() {
        let mut outer = Vec::with_capacity(rest.len() + 1);
        clip(&rest, &mut outer, -normal, -offset);
        if outer.len() > 2 {
            left(outer);
        }
        clip(&rest, spare, normal, offset);
        std::mem::swap(&mut rest, spare);
    }
}

/// About how wide a polygon is at its narrowest.
fn width(corners: &[DVec3]) -> f64 {
    let extent = corners.iter().map(|c| c.distance(corners[0])).fold(0.0, f64::max);
    if extent > 0.0 { area_vector(corners).length() * 2.0 / extent } else { 0.0 }
}
