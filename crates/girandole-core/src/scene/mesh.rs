//! Triangle meshes in object space, with their planar patches.

use super::{JointWeight, MaterialId, MorphTarget};
use crate::{Error, Result};
use glam::{Vec2, Vec3, Vec4};
use rustc_hash::FxHashMap;
use std::hash::Hash;
use std::ops::Range;

/// One triangle of a mesh, counter-clockwise seen from its front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshTriangle {
    /// Indices into the mesh's vertex arrays.
    pub vertices: [u32; 3],
    /// Its material.
    pub material: MaterialId,
}

/// A planar, convex polygon of a mesh that consists of whole triangles of one material.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Patch {
    /// Vertex indices around the outline, counter-clockwise seen from the front, without collinear corners.
    pub outline: Vec<u32>,
    /// The triangles that fill the outline: a range of [`Mesh::triangles`].
    pub triangles: Range<u32>,
}

/// An indexed triangle mesh. Vertex arrays have one element a vertex, or none at all where marked optional.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// The name; may be empty.
    pub name: String,
    /// Positions, metres.
    pub positions: Vec<Vec3>,
    /// Unit shading normals.
    pub normals: Vec<Vec3>,
    /// Unit tangents with the bitangent's sign in `w`; empty where no material of the mesh has a normal map.
    pub tangents: Vec<Vec4>,
    /// Texture coordinates of set 0 and 1; empty where the mesh has none.
    pub uvs: Vec<[Vec2; 2]>,
    /// Linear RGB that multiplies the base colour of materials with [`vertex_colors`](super::Material::vertex_colors), 0 to 1; empty
    /// where the mesh has none.
    pub colors: Vec<Vec3>,
    /// Triangles: those of patches first, patch by patch.
    pub triangles: Vec<MeshTriangle>,
    /// Planar convex parts, see [`mark_patches`](super::mark_patches). Where the mesh is deformed they do not count.
    pub patches: Vec<Patch>,
    /// The joints that hold each vertex where the mesh has a [`Skin`](super::Skin): vertex by vertex, the same number each, filled
    /// up with weights of 0. Empty where it never has one.
    pub joint_weights: Vec<JointWeight>,
    /// Shapes that the mesh is blended with, by [`Node::morph_weights`](super::Node::morph_weights).
    pub morph_targets: Vec<MorphTarget>,
    /// Vertices of triangles that have their own, three each, and stay flat: where they are deformed, normals are the triangle's.
    /// Ascending.
    pub flat: Vec<Range<u32>>,
}

impl Mesh {
    /// Whether all that it refers to exists, in a scene of so many materials.
    ///
    /// # Errors
    /// [`Error::Invalid`] that says what does not.
    pub fn check(&self, materials: usize) -> Result<()> {
        let vertices = self.positions.len();
        let optional = |count: usize| count == 0 || count == vertices;
        let is_known = |v: u32| (v as usize) < vertices;
        let triangles = self.triangles.len() as u32;
        let problem = if self.normals.len() != vertices {
            "does not have one normal a vertex"
        } else if !(optional(self.tangents.len()) && optional(self.uvs.len()) && optional(self.colors.len()))
        {
            "does not have tangents, texture coordinates or colours for all vertices"
        } else if !self.triangles.iter().all(|t| t.vertices.into_iter().all(is_known)) {
            "has a triangle with a vertex that does not exist"
        } else if !self.triangles.iter().all(|t| (t.material.index()) < materials) {
            "has a triangle with a material that does not exist; add the material first"
        } else if !self.patches.iter().all(|p| {
            p.triangles.start <= p.triangles.end
                && p.triangles.end <= triangles
                && p.outline.iter().copied().all(is_known)
        }) {
            "has a patch with a triangle or vertex that does not exist"
        } else if vertices > 0 && !self.joint_weights.len().is_multiple_of(vertices) {
            "does not have the same number of joint weights a vertex"
        } else if !self.morph_targets.iter().all(|t| optional(t.positions.len()) && optional(t.normals.len()))
        {
            "has a morph target that does not shift all vertices"
        } else {
            return Ok(());
        };
        Err(Error::Invalid(format!("the mesh `{}` {problem}", self.name)))
    }

    /// The joints that hold a vertex.
    pub(super) fn joint_weights_of(&self, vertex: usize) -> &[JointWeight] {
        let each = self.joint_weights.len() / self.positions.len().max(1);
        &self.joint_weights[vertex * each..(vertex + 1) * each]
    }

    /// Adds a planar convex polygon as a patch, fanned from its first corner. Corners are counter-clockwise seen
    /// from the front. Call it before any triangle that belongs to no patch is added.
    pub fn add_polygon(&mut self, corners: &[Vec3], material: MaterialId) {
        debug_assert_eq!(
            self.triangles.len(),
            self.patches.last().map_or(0, |p| p.triangles.end as usize),
            "patches come first"
        );
        let normal = polygon_normal(corners);
        let first = self.positions.len() as u32;
        let count = corners.len() as u32;
        self.positions.extend_from_slice(corners);
        self.normals.extend(corners.iter().map(|_| normal));
        if !self.uvs.is_empty() || first == 0 {
            let square = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
            self.uvs.extend((0..corners.len()).map(|i| [square[i % 4]; 2]));
        }
        if !self.colors.is_empty() {
            self.colors.resize(self.positions.len(), Vec3::ONE);
        }
        let start = self.triangles.len() as u32;
        self.triangles.extend(
            (1..count - 1).map(|i| MeshTriangle { vertices: [first, first + i, first + i + 1], material }),
        );
        self.patches.push(Patch {
            outline: (first..first + count).collect(),
            triangles: start..self.triangles.len() as u32,
        });
    }

    /// Adds an axis-aligned box as six patches that face outwards.
    pub fn add_box(&mut self, min: Vec3, max: Vec3, material: MaterialId) {
        let corner = |x: bool, y: bool, z: bool| {
            Vec3::new(
                if x { max.x } else { min.x },
                if y { max.y } else { min.y },
                if z { max.z } else { min.z },
            )
        };
        let (f, t) = (false, true);
        for side in [
            [corner(f, f, f), corner(f, f, t), corner(f, t, t), corner(f, t, f)],
            [corner(t, f, t), corner(t, f, f), corner(t, t, f), corner(t, t, t)],
            [corner(f, f, f), corner(t, f, f), corner(t, f, t), corner(f, f, t)],
            [corner(f, t, t), corner(t, t, t), corner(t, t, f), corner(f, t, f)],
            [corner(t, f, f), corner(f, f, f), corner(f, t, f), corner(t, t, f)],
            [corner(f, f, t), corner(t, f, t), corner(t, t, t), corner(f, t, t)],
        ] {
            self.add_polygon(&side, material);
        }
    }
}

/// Unit normal of a planar polygon by Newell's method: counter-clockwise seen from where it points.
pub(crate) fn polygon_normal(corners: &[Vec3]) -> Vec3 {
    let mut sum = glam::DVec3::ZERO;
    for (i, a) in corners.iter().enumerate() {
        let b = corners[(i + 1) % corners.len()];
        sum += a.as_dvec3().cross(b.as_dvec3());
    }
    sum.normalize_or_zero().as_vec3()
}

/// The first vertex with the same position, for each vertex.
pub(crate) fn weld(positions: &[Vec3]) -> Vec<u32> {
    weld_by(positions, |p| (**p + Vec3::ZERO).to_array().map(f32::to_bits))
}

/// The first vertex with the same key, for each vertex.
pub(crate) fn weld_by<V, K: Eq + Hash>(
    vertices: impl IntoIterator<Item = V, IntoIter: ExactSizeIterator>,
    key: impl Fn(&V) -> K,
) -> Vec<u32> {
    let vertices = vertices.into_iter();
    let mut first: FxHashMap<K, u32> = FxHashMap::default();
    first.reserve(vertices.len());
    (0..).zip(vertices).map(|(i, vertex)| *first.entry(key(&vertex)).or_insert(i)).collect()
}
