//! The texels of a light's map that a small dynamic object covers, found here and drawn as points: far fewer than its triangles, of
//! which hundreds may share a texel.
//!
//! Worked example: a torus of 192 triangles and 14 cm, seen from 2 m in a map of 64 × 64 texels, covers the centres of one to three
//! of them. Of its 48 groups of four triangles, spheres about four of which are tested at a time, about ten may; these triangles
//! are projected and tested by their edges (Pineda 1988), and the nearest that covers a centre gives its depth.

use super::footprint::{Bounds, Extent, TexelRect};
use super::pieces::{FaceView, Piece};
use super::solids::Corners;
use crate::layout::MapTexel;
use crate::passes::shadow_maps::NEAR;
use girandole_core::glam::{Mat4, Vec3, Vec4};

/// Texels' centres within a box about a face's view of an object up to which the object is small there. It does not depend on what
/// part of a map is drawn, so that each part is as in a map that is drawn as a whole.
const MOST: usize = 256;
/// By how much boxes about what is shown are enlarged for rounding, texels.
const ROUNDING: f32 = 0.01;

/// The triangles of an object, four side by side, in a hierarchy of spheres.
#[derive(Clone, Debug, Default)]
pub(super) struct TriangleGroups {
    /// Triangles of the object; those of a group lie close together.
    order: Vec<u32>,
    groups: Vec<Piece>,
    /// x, y, z and the radius of spheres about four groups each.
    spheres: Vec<[Vec4; 4]>,
    /// The same about four of those each.
    above: Vec<[Vec4; 4]>,
}

/// Centres of texels in a box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Centers {
    /// Column and row of the first.
    first: [u32; 2],
    /// Columns and rows.
    count: [u32; 2],
}

impl Centers {
    /// Those within the extent of a small object in a map of a size; none where it is not small or not known.
    pub fn new(extent: &Extent, size: u32) -> Option<Self> {
        let last = (size - 1) as f32;
        let first = extent.low.map(|x| (x - 0.5 - ROUNDING).ceil().max(0.0));
        let end = extent.high.map(|x| (x - 0.5 + ROUNDING).floor().min(last) + 1.0);
        let count = [0, 1].map(|i| (end[i] - first[i]).max(0.0));
        (count[0] * count[1] <= MOST as f32)
            .then(|| Self { first: first.map(|x| x as u32), count: count.map(|x| x as u32) })
    }
}

impl TriangleGroups {
    /// Those of some triangles, given by their corners, in an order in which neighbours lie close together.
    pub fn new(corners: &[Corners], order: Vec<u32>) -> Self {
        let mut result = Self { order, ..Self::default() };
        result.follow(corners);
        result
    }

    /// Brings them up to where the triangles are.
    pub fn follow(&mut self, corners: &[Corners]) {
        let Self { order, groups, spheres, above } = self;
        groups.clear();
        let mut balls = Vec::with_capacity(order.len().div_ceil(4));
        for group in order.chunks(4) {
            let corners = [0, 1, 2, 3].map(|i| match group.get(i) {
                Some(&triangle) => corners[triangle as usize],
                // It covers nothing.
                None => [corners[group[0] as usize][0]; 3],
            });
            groups.push(Piece::new(corners));
            balls.push(ball(corners.as_flattened(), |corner| (*corner, 0.0)));
        }
        let of_groups = |balls: &[Vec4]| ball(balls, |ball| (ball.truncate(), ball.w));
        *spheres = balls.chunks(4).map(side_by_side).collect();
        let balls: Vec<Vec4> = balls.chunks(4).map(of_groups).collect();
        *above = balls.chunks(4).map(side_by_side).collect();
    }

    /// Appends those of the centres that the object covers in a part of the map, with its depth there; `false`, and nothing is
    /// appended, where parts of it are too close to the light's plane for that.
    pub fn cover(
        &self,
        view: &FaceView,
        centers: Centers,
        part: TexelRect,
        texels: &mut Vec<MapTexel>,
    ) -> bool {
        let Centers { first, count } = centers;
        if count.contains(&0) {
            return true;
        }
        let mut nearest = [0.0; MOST];
        for (index, above) in self.above.iter().enumerate() {
            let shown = |spheres| bits(view.may_show(spheres, first, count));
            let spheres =
                shown(above).filter_map(|i| Some((4 * index + i, self.spheres.get(4 * index + i)?)));
            for group in spheres.flat_map(|(index, spheres)| shown(spheres).map(move |i| 4 * index + i)) {
                if self.groups.get(group).is_some_and(|group| !group.cover(view, centers, &mut nearest)) {
                    return false;
                }
            }
        }
        for (index, &inverse) in (0..count[0] * count[1]).zip(&nearest) {
            let texel = [first[0] + index % count[0], first[1] + index / count[0]];
            if inverse > 0.0 && part.holds(texel) && view.shows(texel) {
                texels.push(MapTexel { place: place(texel), depth: (NEAR as f32 * inverse).min(1.0) });
            }
        }
        true
    }
}

/// A sphere about others, with its radius.
fn ball<T>(members: &[T], of: impl Fn(&T) -> (Vec3, f32)) -> Vec4 {
    let center = Bounds::around(members.iter().map(|member| of(member).0)).center;
    let reach = |member: &T| of(member).0.distance(center) + of(member).1;
    center.extend(members.iter().map(reach).fold(0.0, f32::max))
}

/// Up to four spheres, filled up with the first.
fn side_by_side(balls: &[Vec4]) -> [Vec4; 4] {
    let [a, b, c, d] = [0, 1, 2, 3].map(|i| balls.get(i).copied().unwrap_or(balls[0]));
    let Mat4 { x_axis, y_axis, z_axis, w_axis } = Mat4::from_cols(a, b, c, d).transpose();
    [x_axis, y_axis, z_axis, w_axis]
}

/// Which of four bits are set, ascending.
fn bits(set: u32) -> impl Iterator<Item = usize> {
    (0..4).filter(move |i| set >> i & 1 == 1)
}

impl Piece {
    /// Takes note of the nearest of the triangles at each centre, as the reciprocal of the denominator, which is linear on the map;
    /// `false` where one of them is not well before the light.
    fn cover(&self, view: &FaceView, Centers { first, count }: Centers, nearest: &mut [f32; MOST]) -> bool {
        let [a, b, c] = self.corners().map(|corners| view.project(corners));
        if !(a.2 && b.2 && c.2) {
            return false;
        }
        let inverses = [a.1, b.1, c.1];
        let offset = [0, 1].map(|i| view.offset[i] - first[i] as f32);
        let [a, b, c] = [a.0, b.0, c.0].map(|places| [places[0] + offset[0], places[1] + offset[1]]);
        let [columns, rows] = [0, 1].map(|i| {
            let low = a[i].min(b[i]).min(c[i]).min_element();
            let high = a[i].max(b[i]).max(c[i]).max_element().min((count[i] - 1) as f32);
            // Rounded up and down; none if even the highest is below 0.
            let first = low as u32 + u32::from(low > (low as u32) as f32);
            first..if high < 0.0 { 0 } else { high as u32 + 1 }
        });
        let lowest = inverses[0].min(inverses[1]).min(inverses[2]);
        let highest = inverses[0].max(inverses[1]).max(inverses[2]);
        for row in rows {
            let [ay, by, cy] = [a[1], b[1], c[1]].map(|y| y - row as f32);
            for column in columns.clone() {
                let [ax, bx, cx] = [a[0], b[0], c[0]].map(|x| x - column as f32);
                // Triangles that share an edge leave no gap: the other one has the same number there, but for its sign.
                let sides = [bx * cy - by * cx, cx * ay - cy * ax, ax * by - ay * bx];
                let sum = sides[0] + sides[1] + sides[2];
                let (zero, [p, q, r]) = (Vec4::ZERO, sides);
                let is_covered = (p.cmpge(zero) & q.cmpge(zero) & r.cmpge(zero) & sum.cmpgt(zero))
                    | (p.cmple(zero) & q.cmple(zero) & r.cmple(zero) & sum.cmplt(zero));
                if is_covered.any() {
                    let inverse = (p * inverses[0] + q * inverses[1] + r * inverses[2]) / sum;
                    let covering = Vec4::select(is_covered, inverse.max(lowest).min(highest), zero);
                    let nearest = &mut nearest[(row * count[0] + column) as usize];
                    *nearest = nearest.max(covering.max_element());
                }
            }
        }
        true
    }
}

/// Column and row in a word.
fn place([column, row]: [u32; 2]) -> u32 {
    column | row << 16
}

impl MapTexel {
    /// The texel of a map in its page.
    pub fn in_page(self, origin: [u32; 2]) -> Self {
        Self { place: self.place + place(origin), ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::super::footprint::MapView;
    use super::super::pieces::tests::{direction, vector};
    use super::*;
    use crate::layout::Light;
    use girandole_core::glam::DVec3;
    use girandole_core::scene::Geometry;
    use girandole_core::scene::builtin::shapes;
    use girandole_core::scene::{Material, Scene, Transform};
    use std::collections::BTreeMap;

    const SIZE: u32 = 64;

    /// A light, and a torus before or behind it of a texel or a few across.
    fn light_and_torus(case: u32) -> (Light, Geometry) {
        let normal = vector(case, 0).normalize();
        let tangent = normal.any_orthonormal_vector();
        let mut scene = Scene::default();
        scene.add_material(Material::diffuse("gray", Vec3::splat(0.5)));
        let radius = [0.05, 0.5, 0.05, 0.15][case as usize % 4];
        let place = Transform::translation(vector(case, 2) * 4.0 + normal);
        scene.add_object("torus", shapes::torus(radius, 0.4 * radius, 12, 8, 0), place);
        let geometry = Geometry::new(&scene);
        let position = vector(case, 1) - geometry.origin.as_vec3();
        (Light { normal, tangent, position, ..Light::default() }, geometry)
    }

    /// The texels that are drawn in a part of a map, with their depths, and the faces of the object that they were not found for.
    fn drawn(light: &Light, geometry: &Geometry, part: TexelRect) -> (BTreeMap<[u32; 2], f32>, u32) {
        let all: Vec<u32> = (0..geometry.triangles.len() as u32).collect();
        let corners: Vec<Corners> = all.iter().map(|&t| geometry.corners(t)).collect();
        let groups = TriangleGroups::new(&corners, all);
        let map = MapView::new(light, SIZE, 4);
        let bounds = Bounds::around(geometry.positions.iter().copied());
        let touched = map.faces_touched(&bounds);
        let (mut texels, mut others) = (Vec::new(), 0);
        for face in (0..4).filter(|face| touched >> face & 1 == 1) {
            let Some(extent) = map.extent_drawn(face, &bounds, part) else { continue };
            let view = map.face(face).expect("a face of an octahedron");
            let centers = Centers::new(&extent, SIZE);
            let found = centers.is_some_and(|centers| groups.cover(&view, centers, part, &mut texels));
            others += u32::from(!found);
        }
        // On seams both faces have a texel, with the same depth but for rounding: the nearer counts.
        let mut result = BTreeMap::new();
        for MapTexel { place, depth } in texels {
            let nearest = result.entry([place & 0xffff, place >> 16]).or_insert(depth);
            *nearest = nearest.max(depth);
        }
        (result, others)
    }

    /// The least distance of the object on the ray through a place in the map, in that direction's own unit, if it meets it.
    fn distance(light: &Light, geometry: &Geometry, place: [f64; 2]) -> Option<f64> {
        let direction = direction(light, SIZE, place);
        let hit = |triangle: u32| {
            let [a, b, c] = geometry.corners(triangle).map(|p| (p - light.position).as_dvec3());
            let volume = |p: DVec3, q: DVec3| p.cross(q).dot(direction);
            let sides = [volume(b, c), volume(c, a), volume(a, b)];
            let is_within = sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0);
            let normal = (b - a).cross(c - a);
            is_within.then(|| a.dot(normal) / direction.dot(normal)).filter(|t| *t > 0.0)
        };
        (0..geometry.triangles.len() as u32).filter_map(hit).min_by(f64::total_cmp)
    }

    #[test]
    fn texels_are_those_whose_centres_see_the_object_at_its_depth() {
        let (mut covered, mut small, mut large, mut displaced) = (0, 0, 0, 0);
        for case in 0..240 {
            let (light, geometry) = light_and_torus(case);
            let (texels, others) = drawn(&light, &geometry, TexelRect::whole(SIZE));
            if others > 0 {
                large += 1;
                continue;
            }
            small += u32::from(!texels.is_empty());
            let bounds = Bounds::around(geometry.positions.iter().copied());
            let around = MapView::new(&light, SIZE, 4).covered(&bounds);
            assert!(texels.keys().all(|texel| around.holds(*texel)));
            let texels_around = (around.first[1]..around.end[1])
                .flat_map(|row| (around.first[0]..around.end[0]).map(move |column| [column, row]));
            for texel in texels_around {
                let at = |shift: [f64; 2]| {
                    let place = [0, 1].map(|i| f64::from(texel[i]) + 0.5 + shift[i]);
                    distance(&light, &geometry, place)
                };
                // Next to an outline rounding decides.
                let near = [[-1e-3, 0.0], [1e-3, 0.0], [0.0, -1e-3], [0.0, 1e-3]].map(at);
                let expected = at([0.0; 2]);
                let is_clear = near.iter().all(|d| {
                    d.is_some() == expected.is_some()
                        && d.zip(expected).is_none_or(|(d, e)| (d / e - 1.0).abs() < 0.01)
                });
                let depth = texels.get(&texel).map(|depth| NEAR / f64::from(*depth));
                let agrees = |depth: Option<f64>| match (expected, depth) {
                    (Some(expected), Some(depth)) => (depth / expected - 1.0).abs() < 1e-3,
                    (expected, depth) => expected.is_some() == depth.is_some(),
                };
                assert!(!is_clear || agrees(depth), "case {case}: {texel:?} {expected:?} {depth:?}");
                covered += u32::from(expected.is_some());
                // The control: a third of a texel beside it, texels are others.
                displaced += u32::from(is_clear && !agrees(at([0.33, 0.0])));
            }
        }
        assert!(
            covered > 400 && small > 100 && large > 10 && displaced > 100,
            "{covered} {small} {large} {displaced}"
        );
    }

    #[test]
    fn texels_of_a_part_of_a_map_are_those_of_the_whole_map() {
        let (mut inside, mut all) = (0, 0);
        for case in 0..200 {
            let (light, geometry) = light_and_torus(case);
            let part = TexelRect { first: [case % 40, 10], end: [case % 40 + 20, 50] };
            let whole = drawn(&light, &geometry, TexelRect::whole(SIZE)).0;
            let of_part = drawn(&light, &geometry, part).0;
            let expected = whole.iter().filter(|(texel, _)| part.holds(**texel));
            assert!(of_part.iter().eq(expected), "case {case}");
            (inside, all) = (inside + of_part.len(), all + whole.len());
        }
        assert!(inside > 50 && inside * 2 < all, "{inside} {all}");
    }
}
