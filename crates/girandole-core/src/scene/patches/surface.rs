//! Planar regions of a mesh.

use super::super::mesh::weld;
use super::super::{Mesh, NONE};
use glam::{DVec2, DVec3, Vec3};

/// Distance from the plane up to which vertices belong to it, relative to the mesh's extent: some ten roundings of
/// single precision, so that rotated walls are flat, and far less than any modelled step.
const PLANARITY: f64 = 2e-6;
/// How far a vertex normal may differ from the face normal.
const NORMAL_TOLERANCE: f64 = 1e-3;
/// Triangles along one edge beyond which it is given up.
const MAX_SHEETS: usize = 16;

/// A triangle of a region in the region's plane.
pub(super) struct FlatTriangle {
    /// Corners, counter-clockwise.
    pub corners: [DVec2; 3],
    /// The positions' identities.
    pub points: [u32; 3],
    /// The triangle of the region beyond each side, which starts at the corner of the same index; or [`NONE`].
    pub neighbors: [u32; 3],
}

/// A mesh's triangles with what connects them.
pub(super) struct Surface<'m> {
    mesh: &'m Mesh,
    points: Vec<u32>,
    /// Unit face normals; zero for triangles that are not flat.
    normals: Vec<DVec3>,
    pub areas: Vec<f64>,
    /// The flat triangle of the same direction and material beyond each side, or [`NONE`].
    neighbors: Vec<[u32; 3]>,
    /// Connected planar sets of triangles.
    pub regions: Vec<Vec<u32>>,
    /// Region of each triangle, and its place there.
    places: Vec<[u32; 2]>,
    /// Metres within which positions are the same.
    pub tolerance: f64,
}

impl<'m> Surface<'m> {
    pub fn new(mesh: &'m Mesh) -> Self {
        let finite = || mesh.positions.iter().filter(|p| p.is_finite());
        let low = finite().fold(Vec3::INFINITY, |a, p| a.min(*p));
        let high = finite().fold(Vec3::NEG_INFINITY, |a, p| a.max(*p));
        let extent = low.abs().max(high.abs()).as_dvec3().length();
        let mut surface = Self {
            mesh,
            points: weld(&mesh.positions),
            normals: Vec::with_capacity(mesh.triangles.len()),
            areas: Vec::with_capacity(mesh.triangles.len()),
            neighbors: vec![[NONE; 3]; mesh.triangles.len()],
            regions: Vec::new(),
            places: vec![[NONE; 2]; mesh.triangles.len()],
            tolerance: extent * PLANARITY,
        };
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = surface.corners(index as u32);
            let cross = (b - a).cross(c - a);
            let normal = cross.normalize_or_zero();
            let flat = normal != DVec3::ZERO
                && cross.is_finite()
                && triangle.vertices.iter().all(|&v| {
                    let vertex = mesh.normals.get(v as usize).copied().unwrap_or_default();
                    (vertex.as_dvec3() - normal).length() <= NORMAL_TOLERANCE
                });
            surface.normals.push(if flat { normal } else { DVec3::ZERO });
            surface.areas.push(cross.length() * 0.5);
        }
        surface.connect();
        surface.grow();
        surface
    }

    fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.mesh.triangles[triangle as usize].vertices.map(|v| self.mesh.positions[v as usize].as_dvec3())
    }

    fn points(&self, triangle: u32) -> [u32; 3] {
        self.mesh.triangles[triangle as usize].vertices.map(|v| self.points[v as usize])
    }

    fn is_flat(&self, triangle: u32) -> bool {
        self.normals[triangle as usize] != DVec3::ZERO
    }

    fn alike(&self, a: u32, b: u32) -> bool {
        let material = |t: u32| self.mesh.triangles[t as usize].material;
        let difference = self.normals[a as usize] - self.normals[b as usize];
        material(a) == material(b) && difference.length() <= 2.0 * NORMAL_TOLERANCE
    }

    /// Finds the neighbours. Where more than two triangles meet, as in sheets back to back, those that face the same
    /// way belong together, unless it is unclear which.
    fn connect(&mut self) {
        // Both ends in ascending order, and three times the triangle plus which side.
        let triangles = (0..self.mesh.triangles.len() as u32).filter(|&t| self.is_flat(t));
        let mut edges: Vec<[u32; 3]> = triangles
            .flat_map(|t| {
                let p = self.points(t);
                [0, 1, 2].map(|i| {
                    let (a, b) = (p[i], p[(i + 1) % 3]);
                    [a.min(b), a.max(b), 3 * t + i as u32]
                })
            })
            .collect();
        edges.sort_unstable();
        let mut pairs = Vec::new();
        for sides in edges.chunk_by(|x, y| x[..2] == y[..2]).filter(|s| s.len() <= MAX_SHEETS) {
            let rises = |x: usize| self.points(sides[x][2] / 3)[sides[x][2] as usize % 3] == sides[x][0];
            let alike = |x: usize, y: usize| self.alike(sides[x][2] / 3, sides[y][2] / 3);
            let partner = |x: usize| {
                let mut own = (0..sides.len()).filter(|&y| y != x && rises(y) == rises(x));
                let mut beyond = (0..sides.len()).filter(|&y| rises(y) != rises(x) && alike(x, y));
                let found = beyond.next().filter(|_| beyond.next().is_none());
                found.filter(|_| own.all(|y| !alike(x, y)))
            };
            for x in 0..sides.len() {
                // Likeness within a tolerance is not transitive, so the other side is asked too.
                if let Some(y) = partner(x).filter(|&y| partner(y) == Some(x)) {
                    pairs.push((sides[x][2], sides[y][2] / 3));
                }
            }
        }
        for (side, other) in pairs {
            self.neighbors[side as usize / 3][side as usize % 3] = other;
        }
    }

    /// Grows regions, each from its largest triangle, whose plane counts.
    fn grow(&mut self) {
        let mut seeds: Vec<u32> =
            (0..self.mesh.triangles.len() as u32).filter(|&t| self.is_flat(t)).collect();
        seeds.sort_by(|&a, &b| self.areas[b as usize].total_cmp(&self.areas[a as usize]));
        for seed in seeds {
            if self.places[seed as usize][0] != NONE {
                continue;
            }
            let number = self.regions.len() as u32;
            self.places[seed as usize] = [number, 0];
            let (normal, origin) = (self.normals[seed as usize], self.corners(seed)[0]);
            let mut region = vec![seed];
            let mut next = 0;
            while let Some(&triangle) = region.get(next) {
                next += 1;
                for other in self.neighbors[triangle as usize] {
                    if other != NONE
                        && self.places[other as usize][0] == NONE
                        && self.alike(other, seed)
                        && self
                            .corners(other)
                            .iter()
                            .all(|&p| (p - origin).dot(normal).abs() <= self.tolerance)
                    {
                        self.places[other as usize] = [number, region.len() as u32];
                        region.push(other);
                    }
                }
            }
            self.regions.push(region);
        }
    }

    /// A region in the coordinates of its first triangle's plane.
    pub fn flatten(&self, number: u32) -> Vec<FlatTriangle> {
        let region = &self.regions[number as usize];
        let normal = self.normals[region[0] as usize];
        let origin = self.corners(region[0])[0];
        let u = normal.any_orthonormal_vector();
        let v = normal.cross(u);
        let local = |triangle: u32| match self.places.get(triangle as usize) {
            Some(&[region, place]) if region == number => place,
            _ => NONE,
        };
        region
            .iter()
            .map(|&t| FlatTriangle {
                corners: self.corners(t).map(|p| DVec2::new((p - origin).dot(u), (p - origin).dot(v))),
                points: self.points(t),
                neighbors: self.neighbors[t as usize].map(local),
            })
            .collect()
    }
}
