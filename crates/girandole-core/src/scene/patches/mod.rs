//! Finds planar convex patches in a mesh.
//!
//! 1. Vertices at the same position are one.
//! 2. Triangles are grown to planar regions across shared edges.
//! 3. A region with a convex outline is a patch; others are cut into convex [`polygons`].
//!
//! A patch consists of whole triangles, so an L-shaped floor becomes the convex parts that its triangulation allows.
//! Triangles meet only along whole edges: a vertex in the middle of a neighbour's edge (a T-junction) separates them.

mod polygons;

use super::repair::weld;
use super::{Mesh, MeshTriangle, NONE, Patch, Scene};
use glam::{DAffine3, DVec2, DVec3, Vec3};
use polygons::{Polygon, convex_polygons, whole_polygon};
use rustc_hash::FxHashMap;

/// Distance from the plane up to which vertices belong to it, relative to the mesh's extent: some ten roundings of
/// single precision, so that rotated walls are flat, and far less than any modelled step.
const PLANARITY: f64 = 2e-6;
/// How far a vertex normal may differ from the face normal.
const NORMAL_TOLERANCE: f64 = 1e-3;
/// Patches of an imported scene have at least this share of its diagonal squared.
const MIN_AREA: f64 = 1e-4;
/// A scene of more metres than this is a mistake, and its squares would leave the range of single precision.
const MAX_EXTENT: f64 = 1e15;

/// Marks coplanar connected triangles of one material as planar convex [`Patch`]es where they are at least `min_area`
/// large (m², in object space), and reorders the mesh's triangles so that those of patches come first, patch by
/// patch. Replaces the patches that the mesh had.
///
/// Triangles count as flat if their vertex normals are their own to 1e-3. They are connected where they share an edge
/// with both its ends (by position, so split vertices do not matter); a vertex that lies inside a neighbour's edge
/// ends the patch there.
pub fn mark_patches(mesh: &mut Mesh, min_area: f32) {
    let surface = Surface::new(mesh);
    let mut patches: Vec<(u32, Polygon)> = Vec::new();
    for region in surface.regions() {
        let area: f64 = region.iter().map(|&t| surface.areas[t as usize]).sum();
        if area < f64::from(min_area) {
            continue;
        }
        let flat = surface.flatten(&region);
        let found = match whole_polygon(&flat, surface.tolerance) {
            Some(polygon) => vec![polygon],
            None => convex_polygons(&flat, surface.tolerance),
        };
        for mut polygon in found {
            for triangle in &mut polygon.triangles {
                *triangle = region[*triangle as usize];
            }
            polygon.triangles.sort_unstable();
            for corner in &mut polygon.outline {
                let [triangle, side] = *corner;
                *corner = [region[triangle as usize], side];
            }
            if polygon.area >= f64::from(min_area) {
                patches.push((polygon.triangles[0], polygon));
            }
        }
    }
    patches.sort_unstable_by_key(|p| p.0);
    let mut triangles: Vec<MeshTriangle> = Vec::with_capacity(mesh.triangles.len());
    let mut taken = vec![false; mesh.triangles.len()];
    mesh.patches.clear();
    for (_, polygon) in &patches {
        let start = triangles.len() as u32;
        for &t in &polygon.triangles {
            taken[t as usize] = true;
            triangles.push(mesh.triangles[t as usize]);
        }
        let outline = polygon
            .outline
            .iter()
            .map(|&[t, side]| mesh.triangles[t as usize].vertices[side as usize])
            .collect();
        mesh.patches.push(Patch { outline, triangles: start..triangles.len() as u32 });
    }
    triangles.extend(mesh.triangles.iter().zip(taken).filter(|(_, taken)| !taken).map(|(t, _)| *t));
    mesh.triangles = triangles;
}

/// A triangle of a region in the region's plane.
pub(super) struct FlatTriangle {
    /// Corners, counter-clockwise.
    pub corners: [DVec2; 3],
    /// The positions' identities.
    pub points: [u32; 3],
    /// The triangle of the region beyond each side, which starts at the corner of the same index; or [`NONE`].
    pub neighbors: [u32; 3],
}

/// What region growing needs to know about a mesh.
struct Surface<'m> {
    mesh: &'m Mesh,
    points: Vec<u32>,
    /// Unit face normals; zero for triangles that are not flat.
    normals: Vec<DVec3>,
    areas: Vec<f64>,
    /// The triangle of each directed edge; [`NONE`] where several have it.
    edges: FxHashMap<(u32, u32), u32>,
    tolerance: f64,
}

impl<'m> Surface<'m> {
    fn new(mesh: &'m Mesh) -> Self {
        let finite = || mesh.positions.iter().filter(|p| p.is_finite());
        let low = finite().fold(Vec3::INFINITY, |a, p| a.min(*p));
        let high = finite().fold(Vec3::NEG_INFINITY, |a, p| a.max(*p));
        let extent = low.abs().max(high.abs()).as_dvec3().length();
        let points = weld(&mesh.positions);
        let mut normals = Vec::with_capacity(mesh.triangles.len());
        let mut areas = Vec::with_capacity(mesh.triangles.len());
        let mut edges = FxHashMap::default();
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = triangle.vertices.map(|v| mesh.positions[v as usize].as_dvec3());
            let cross = (b - a).cross(c - a);
            let normal = cross.normalize_or_zero();
            let flat = normal != DVec3::ZERO
                && cross.is_finite()
                && triangle.vertices.iter().all(|&v| {
                    let vertex = mesh.normals.get(v as usize).copied().unwrap_or_default();
                    (vertex.as_dvec3() - normal).length() <= NORMAL_TOLERANCE
                });
            normals.push(if flat { normal } else { DVec3::ZERO });
            areas.push(cross.length() * 0.5);
            if flat {
                for edge in sides(triangle.vertices.map(|v| points[v as usize])) {
                    edges.entry(edge).and_modify(|t| *t = NONE).or_insert(index as u32);
                }
            }
        }
        Self { mesh, points, normals, areas, edges, tolerance: extent * PLANARITY }
    }

    /// The flat triangles beyond each side of a flat one.
    fn neighbors(&self, triangle: u32) -> [u32; 3] {
        let corners = self.mesh.triangles[triangle as usize].vertices.map(|v| self.points[v as usize]);
        sides(corners).map(|(a, b)| {
            let own = self.edges.get(&(a, b)).copied().unwrap_or(NONE);
            if own == NONE { NONE } else { self.edges.get(&(b, a)).copied().unwrap_or(NONE) }
        })
    }

    fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.mesh.triangles[triangle as usize].vertices.map(|v| self.mesh.positions[v as usize].as_dvec3())
    }

    /// Connected planar sets of triangles, each grown from its largest one, whose plane counts.
    fn regions(&self) -> Vec<Vec<u32>> {
        let mut seeds: Vec<u32> =
            (0..self.normals.len() as u32).filter(|&t| self.normals[t as usize] != DVec3::ZERO).collect();
        seeds.sort_by(|&a, &b| self.areas[b as usize].total_cmp(&self.areas[a as usize]));
        let mut taken = vec![false; self.normals.len()];
        let mut regions = Vec::new();
        for seed in seeds {
            if taken[seed as usize] {
                continue;
            }
            taken[seed as usize] = true;
            let normal = self.normals[seed as usize];
            let origin = self.corners(seed)[0];
            let material = self.mesh.triangles[seed as usize].material;
            let mut region = vec![seed];
            let mut next = 0;
            while let Some(&triangle) = region.get(next) {
                next += 1;
                for other in self.neighbors(triangle) {
                    if other != NONE
                        && !taken[other as usize]
                        && self.mesh.triangles[other as usize].material == material
                        && (self.normals[other as usize] - normal).length() <= 2.0 * NORMAL_TOLERANCE
                        && self
                            .corners(other)
                            .iter()
                            .all(|&p| (p - origin).dot(normal).abs() <= self.tolerance)
                    {
                        taken[other as usize] = true;
                        region.push(other);
                    }
                }
            }
            regions.push(region);
        }
        regions
    }

    /// A region in the coordinates of its first triangle's plane.
    fn flatten(&self, region: &[u32]) -> Vec<FlatTriangle> {
        let normal = self.normals[region[0] as usize];
        let origin = self.corners(region[0])[0];
        let u = normal.any_orthonormal_vector();
        let v = normal.cross(u);
        let local: FxHashMap<u32, u32> = region.iter().enumerate().map(|(i, &t)| (t, i as u32)).collect();
        region
            .iter()
            .map(|&t| FlatTriangle {
                corners: self.corners(t).map(|p| DVec2::new((p - origin).dot(u), (p - origin).dot(v))),
                points: self.mesh.triangles[t as usize].vertices.map(|v| self.points[v as usize]),
                neighbors: self.neighbors(t).map(|n| local.get(&n).copied().unwrap_or(NONE)),
            })
            .collect()
    }
}

fn sides([a, b, c]: [u32; 3]) -> [(u32, u32); 3] {
    [(a, b), (b, c), (c, a)]
}

/// Marks the patches of all meshes of an imported scene: those that are of some size where they are shown largest.
/// Says what is wrong with scenes too large for single precision.
pub(crate) fn mark_scene(scene: &mut Scene) -> Result<(), String> {
    let affines: Vec<DAffine3> = scene.objects.iter().map(|o| scene.world_from_node(o.node)).collect();
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let bounds: Vec<(Vec3, Vec3)> = scene
        .meshes
        .iter()
        .map(|mesh| {
            let start = (Vec3::INFINITY, Vec3::NEG_INFINITY);
            mesh.positions.iter().fold(start, |(low, high), p| (low.min(*p), high.max(*p)))
        })
        .collect();
    let mut scales = vec![0.0_f64; scene.meshes.len()];
    for (object, affine) in scene.objects.iter().zip(&affines) {
        let (min, max) = bounds[object.mesh];
        for corner in 0..8 {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { min[axis] } else { max[axis] };
            let p = affine.transform_point3(Vec3::new(pick(0), pick(1), pick(2)).as_dvec3());
            if !p.is_finite() {
                return Err("has an object without a finite place; check its transforms".into());
            }
            low = low.min(p);
            high = high.max(p);
        }
        // How much areas grow at most, exact for those along two of the object's axes.
        let m = affine.matrix3;
        for (a, b) in [(m.x_axis, m.y_axis), (m.y_axis, m.z_axis), (m.z_axis, m.x_axis)] {
            scales[object.mesh] = scales[object.mesh].max(a.cross(b).length());
        }
    }
    let diagonal = (high - low).length();
    if diagonal > MAX_EXTENT || low.abs().max(high.abs()).max_element() > MAX_EXTENT {
        return Err(format!("reaches {diagonal:.3e} m far; scale it to metres"));
    }
    let least = MIN_AREA * diagonal * diagonal;
    for (mesh, scale) in scene.meshes.iter_mut().zip(scales) {
        if scale > 0.0 {
            mark_patches(mesh, (least / scale) as f32);
        }
    }
    Ok(())
}
