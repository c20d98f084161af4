//! The texels of a light's map that a small dynamic object covers, found here and drawn as points: far fewer than its triangles, of
//! which hundreds may share a texel.
//!
//! Worked example: a torus of 192 triangles and 14 cm, seen from 2 m in a map of 64 × 64 texels, covers the centres of one to three
//! of them. All of its 96 vertices are projected; the triangles whose box holds one of those centres are tested by their edges
//! (Pineda 1988), and the nearest that covers it gives its depth.

use super::footprint::{Bounds, Extent, TexelRect};
use super::pieces::FaceView;
use super::solids::Corners;
use crate::layout::MapTexel;
use crate::passes::shadow_maps::NEAR;
use girandole_core::glam::{Mat4, Vec2, Vec3, Vec4};
use girandole_core::scene::Geometry;
use std::collections::BTreeMap;

/// Texels' centres within a box about a face's view of an object up to which the object is small there. It does not depend on what
/// part of a map is drawn, so that each part is as in a map that is drawn as a whole.
const MOST: usize = 256;
/// By how much boxes about what is shown are enlarged for rounding, texels.
const ROUNDING: f32 = 0.01;

/// Triangles in a group.
const GROUP: usize = 4;

/// An object as vertices that its triangles share.
#[derive(Clone, Debug, Default)]
pub(super) struct SharedVertices {
    /// Indices of the geometry's vertices.
    vertices: Vec<u32>,
    /// Three indices of these a triangle, in the order of clusters.
    triangles: Vec<[u32; 3]>,
    /// The same, so that those of a group lie close together.
    by_place: Vec<[u32; 3]>,
    /// x, y and z of four vertices at a time.
    positions: Vec<[Vec4; 3]>,
    /// x, y, z and the radius of spheres about four groups of triangles at a time.
    spheres: Vec<[Vec4; 4]>,
}

/// Projected vertices; memory that is used again.
#[derive(Clone, Debug, Default)]
pub(crate) struct Projected {
    /// x, y, −x and −y, in texels from the first centre.
    places: Vec<Vec4>,
    /// The reciprocal of each one's denominator, which is linear on the map.
    inverses: Vec<f32>,
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

impl SharedVertices {
    /// Those of an object's triangles, in the order of clusters and so that neighbours lie close together.
    pub fn new(geometry: &Geometry, [triangles, by_place]: [&[u32]; 2]) -> Self {
        let mut vertices = Vec::new();
        let mut known = BTreeMap::new();
        let mut shared = |&triangle: &u32| {
            geometry.triangles[triangle as usize].vertices.map(|vertex| {
                *known.entry(vertex).or_insert_with(|| {
                    vertices.push(vertex);
                    vertices.len() as u32 - 1
                })
            })
        };
        let by_place = by_place.iter().map(&mut shared).collect();
        let triangles = triangles.iter().map(&mut shared).collect();
        let mut result = Self { vertices, triangles, by_place, ..Self::default() };
        result.follow(geometry);
        result
    }

    /// Brings positions up to where the object is.
    pub fn follow(&mut self, geometry: &Geometry) {
        let position = |vertices: &[u32], i: usize| {
            geometry.positions[vertices.get(i).copied().unwrap_or(vertices[0]) as usize]
        };
        self.positions.clear();
        self.positions.extend(self.vertices.chunks(4).map(|vertices| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|i| position(vertices, i).extend(0.0));
            let Mat4 { x_axis, y_axis, z_axis, .. } = Mat4::from_cols(a, b, c, d).transpose();
            [x_axis, y_axis, z_axis]
        }));
        let spheres: Vec<Vec4> = self.by_place.chunks(GROUP).map(|group| self.sphere(group)).collect();
        self.spheres.clear();
        self.spheres.extend(spheres.chunks(4).map(|spheres| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|i| spheres.get(i).copied().unwrap_or(spheres[0]));
            Mat4::from_cols(a, b, c, d).transpose().to_cols_array_2d().map(Vec4::from)
        }));
    }

    fn corner(&self, vertex: u32) -> Vec3 {
        let [x, y, z] = &self.positions[vertex as usize / 4];
        let lane = vertex as usize % 4;
        Vec3::new(x[lane], y[lane], z[lane])
    }

    /// About the box of some triangles, with its radius.
    fn sphere(&self, triangles: &[[u32; 3]]) -> Vec4 {
        let corners = || triangles.iter().flatten().map(|&corner| self.corner(corner));
        let center = Bounds::around(corners()).center;
        center.extend(corners().map(|corner| corner.distance_squared(center)).fold(0.0, f32::max).sqrt())
    }

    /// The corners of all triangles.
    pub fn corners(&self) -> Vec<Corners> {
        self.triangles.iter().map(|corners| corners.map(|corner| self.corner(corner))).collect()
    }

    /// Appends those of the centres that the object covers in a part of the map, with its depth there; `false`, and nothing is
    /// appended, where parts of it are too close to the light's plane for that.
    pub fn cover(
        &self,
        view: &FaceView,
        centers: Centers,
        part: TexelRect,
        (projected, texels): (&mut Projected, &mut Vec<MapTexel>),
    ) -> bool {
        if centers.count.contains(&0) {
            return true;
        }
        if !self.project(view, centers.first, projected) {
            return false;
        }
        let mut nearest = [0f32; MOST];
        for (index, spheres) in self.spheres.iter().enumerate() {
            let shown = view.may_show(spheres, centers.first, centers.count);
            for group in self.by_place[4 * GROUP * index..].chunks(GROUP).take(4).enumerate() {
                if shown >> group.0 & 1 == 1 {
                    cover(group.1, projected, centers.count, &mut nearest);
                }
            }
        }
        for (index, &inverse) in (0..centers.count[0] * centers.count[1]).zip(&nearest) {
            let [column, row] = [index % centers.count[0], index / centers.count[0]];
            let texel = [centers.first[0] + column, centers.first[1] + row];
            if inverse > 0.0 && part.holds(texel) && view.shows(texel) {
                texels.push(MapTexel { place: place(texel), depth: (NEAR as f32 * inverse).min(1.0) });
            }
        }
        true
    }

    /// Projects all vertices; `false` where one is not well before the light.
    fn project(&self, view: &FaceView, first: [u32; 2], projected: &mut Projected) -> bool {
        projected.places.clear();
        projected.inverses.clear();
        let offset = [0, 1].map(|i| view.offset[i] - first[i] as f32);
        let mut is_known = true;
        for &[x, y, z] in &self.positions {
            let ([u, v], inverse, known) = view.project([x, y, z]);
            is_known &= known;
            let [u, v] = [u + offset[0], v + offset[1]];
            let vertices = Mat4::from_cols(u, v, -u, -v).transpose();
            projected.places.extend([vertices.x_axis, vertices.y_axis, vertices.z_axis, vertices.w_axis]);
            projected.inverses.extend(inverse.to_array());
        }
        is_known
    }
}

/// Takes note of the nearest of some triangles at each centre.
fn cover(triangles: &[[u32; 3]], projected: &Projected, count: [u32; 2], nearest: &mut [f32; MOST]) {
    let last = count.map(|n| (n - 1) as f32);
    // The lowest x and y are not above the last centre, the highest not below the first.
    let limits = Vec4::new(last[0], last[1], 0.0, 0.0);
    let (places, inverses) = (&projected.places[..], &projected.inverses[..]);
    for &[a, b, c] in triangles {
        let corners = [a as usize, b as usize, c as usize];
        let [a, b, c] = [places[corners[0]], places[corners[1]], places[corners[2]]];
        let bounds = a.min(b).min(c);
        if !bounds.cmple(limits).all() {
            continue;
        }
        let inverses = [inverses[corners[0]], inverses[corners[1]], inverses[corners[2]]];
        let low = [first_not_below(bounds.x), first_not_below(bounds.y)];
        // Rounded down; not below 0.
        let high = [(-bounds.z).min(last[0]) as u32, (-bounds.w).min(last[1]) as u32];
        for row in low[1]..=high[1] {
            for column in low[0]..=high[0] {
                let center = Vec2::new(column as f32, row as f32);
                let at = [a, b, c].map(|place| Vec2::new(place.x, place.y) - center);
                let nearest = &mut nearest[(row * count[0] + column) as usize];
                *nearest = nearest.max(inverse_at(at, inverses));
            }
        }
    }
}

/// The least whole number from 0 that is not below x.
fn first_not_below(x: f32) -> u32 {
    let whole = x as u32;
    whole + u32::from(x > whole as f32)
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

/// What is linear over a triangle, at the origin; 0 where the triangle does not cover it. Triangles that share an edge leave no gap: the
/// other one has the same number there, but for its sign.
fn inverse_at([a, b, c]: [Vec2; 3], inverses: [f32; 3]) -> f32 {
    let side = |p: Vec2, q: Vec2| p.x * q.y - p.y * q.x;
    let sides = Vec3::new(side(b, c), side(c, a), side(a, b));
    let sum = sides.x + sides.y + sides.z;
    let is_covered = sides.cmpge(Vec3::ZERO).all() || sides.cmple(Vec3::ZERO).all();
    if !is_covered || sum == 0.0 {
        return 0.0;
    }
    let inverses = Vec3::from(inverses);
    (sides.dot(inverses) / sum).clamp(inverses.min_element(), inverses.max_element())
}

#[cfg(test)]
mod tests {
    use super::super::footprint::MapView;
    use super::super::pieces::tests::{direction, vector};
    use super::*;
    use crate::layout::Light;
    use girandole_core::glam::DVec3;
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
        let radius = if case.is_multiple_of(4) { 0.2 } else { 0.05 };
        let place = Transform::translation(vector(case, 2) * 4.0 + normal);
        scene.add_object("torus", shapes::torus(radius, 0.4 * radius, 12, 8, 0), place);
        let geometry = Geometry::new(&scene);
        let position = vector(case, 1) - geometry.origin.as_vec3();
        (Light { normal, tangent, position, ..Light::default() }, geometry)
    }

    /// The texels that are drawn in a part of a map, with their depths, and the faces of the object that they were not found for.
    fn drawn(light: &Light, geometry: &Geometry, part: TexelRect) -> (BTreeMap<[u32; 2], f32>, u32) {
        let all: Vec<u32> = (0..geometry.triangles.len() as u32).collect();
        let vertices = SharedVertices::new(geometry, [&all, &all]);
        let map = MapView::new(light, SIZE, 4);
        let bounds = Bounds::around(geometry.positions.iter().copied());
        let touched = map.faces_touched(&bounds);
        let (mut texels, mut others) = (Vec::new(), 0);
        for face in (0..4).filter(|face| touched >> face & 1 == 1) {
            let Some(extent) = map.extent_drawn(face, &bounds, part) else { continue };
            let view = map.face(face).expect("a face of an octahedron");
            let memory = (&mut Projected::default(), &mut texels);
            let centers = Centers::new(&extent, SIZE);
            let found = centers.is_some_and(|centers| vertices.cover(&view, centers, part, memory));
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
