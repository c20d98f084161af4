//! Meshes from polygons.

use super::Parsed;
use super::polygons::{Part, Polygons};
use super::smoothing::smooth;
use crate::scene::repair::drop_duplicates;
use crate::scene::{Mesh, MeshTriangle, NONE};
use glam::{Vec2, Vec3};
use rustc_hash::FxHashMap;

/// Texture coordinates stay exact enough below this.
const MOST_COORDINATE: f32 = 1e9;

impl Polygons {
    /// Checks what was read, cuts it into triangles, and adds the normals that are missing. Vertices are in the order
    /// in which faces have them.
    ///
    /// # Errors
    /// What is wrong, after "the file is not usable: ".
    pub fn mesh(mut self) -> Parsed<Mesh> {
        self.check()?;
        let parts = self.cut()?;
        let normals: Vec<Vec3> =
            self.normals.iter().map(|n| n.as_dvec3().normalize_or_zero().as_vec3()).collect();
        let has_normal = |corner: u32| {
            let normal = self.corners[corner as usize].normal;
            normal != NONE && normals[normal as usize] != Vec3::ZERO
        };
        let is_whole = parts.iter().all(|part| part.corners.iter().all(|&corner| has_normal(corner)));
        let smoothed = (!is_whole).then(|| smooth(&self, &parts));
        let mut mesh = Mesh::default();
        let mut known: FxHashMap<[u32; 4], u32> = FxHashMap::default();
        for (number, part) in parts.iter().enumerate() {
            let vertices = [0, 1, 2].map(|i| {
                let corner = part.corners[i];
                let (group, normal) = match &smoothed {
                    Some(smoothed) if !has_normal(corner) => {
                        let group = smoothed.groups[number][i];
                        (group, smoothed.normals[group as usize])
                    }
                    _ => (NONE, normals[self.corners[corner as usize].normal as usize]),
                };
                let (position, uv, own) = self.sources(corner, group);
                let count = mesh.positions.len() as u32;
                let vertex = *known.entry([position, uv, own, group]).or_insert(count);
                if vertex == count {
                    self.push_vertex(&mut mesh, [position, uv], normal);
                }
                vertex
            });
            mesh.triangles.push(self.triangle(part, vertices));
        }
        drop_duplicates(&mut mesh);
        Ok(mesh)
    }

    /// What makes a vertex: its position, texture coordinates and normal of its own, if it has no smooth one.
    fn sources(&self, corner: u32, group: u32) -> (u32, u32, u32) {
        let corner = self.corners[corner as usize];
        (corner.position, corner.uv, if group == NONE { corner.normal } else { NONE })
    }

    fn push_vertex(&self, mesh: &mut Mesh, [position, uv]: [u32; 2], normal: Vec3) {
        mesh.positions.push(self.positions[position as usize]);
        mesh.normals.push(normal);
        mesh.colors.extend(self.colors.get(position as usize));
        if !self.uvs.is_empty() {
            let uv = self.uvs.get(uv as usize).copied().unwrap_or(Vec2::Y);
            // Modelling programs count v upwards.
            mesh.uvs.push([Vec2::new(uv.x, 1.0 - uv.y); 2]);
        }
    }

    fn triangle(&self, part: &Part, vertices: [u32; 3]) -> MeshTriangle {
        MeshTriangle { vertices, material: self.faces[part.face as usize].material }
    }

    /// Faces refer to what is there, and where they do it is finite.
    fn check(&mut self) -> Parsed<()> {
        if self.faces.is_empty() {
            return Err("it has no faces".into());
        }
        let count = self.positions.len();
        for position in self.corners.iter().map(|corner| corner.position) {
            match self.positions.get(position as usize) {
                None => return Err(format!("a face has vertex {position} of {count}; export it again")),
                Some(at) if !at.is_finite() => {
                    return Err(format!("its vertex {position} is at {at}; export it again"));
                }
                Some(_) => {}
            }
        }
        // Coordinates and normals are dispensable.
        let (uvs, normals) = (self.uvs.len(), self.normals.len());
        for corner in &mut self.corners {
            if corner.uv as usize >= uvs {
                corner.uv = NONE;
            }
            if corner.normal as usize >= normals {
                corner.normal = NONE;
            }
        }
        let is_used = self.corners.iter().any(|corner| corner.uv != NONE);
        if !is_used || !self.uvs.iter().all(|uv| uv.abs().max_element() < MOST_COORDINATE) {
            self.uvs.clear();
        }
        Ok(())
    }
}
