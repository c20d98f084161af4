//! Meshes: the vertices as they are, and a primitive for each run of triangles of one material.

use super::{Exporter, named};
use crate::scene::{Mesh, MeshTriangle, MorphTarget};
use glam::{Vec3, Vec4};
use gltf::json::accessor::Type;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked::Valid;
use gltf::json::{self, Accessor, Index};
use std::collections::BTreeMap;

/// Meshes of more runs than this are sorted by material first: then the order of their triangles is another one.
const MOST_RUNS: usize = 256;

/// The vertex arrays of a mesh, as far as its primitives share them.
struct Vertices {
    positions: Index<Accessor>,
    normals: Index<Accessor>,
    tangents: Option<Index<Accessor>>,
    uvs: Option<[Index<Accessor>; 2]>,
    colors: Option<Index<Accessor>>,
    joints: Vec<[Index<Accessor>; 2]>,
    targets: Vec<json::mesh::MorphTarget>,
}

impl Exporter<'_> {
    /// The glTF mesh of a mesh of the scene; none where it has no triangles.
    pub(super) fn mesh(&mut self, index: usize) -> Option<Index<json::Mesh>> {
        if let Some(known) = self.meshes.get(&index) {
            return Some(*known);
        }
        let mesh = &self.scene.meshes[index];
        if mesh.triangles.is_empty() {
            return None;
        }
        let vertices = self.vertices(mesh);
        let runs = runs(mesh);
        let primitives = runs.iter().map(|run| self.primitive(mesh, run, &vertices)).collect();
        let written = self.root.push(json::Mesh {
            name: named(&mesh.name),
            primitives,
            weights: None,
            extensions: None,
            extras: None,
        });
        self.meshes.insert(index, written);
        Some(written)
    }

    fn vertices(&mut self, mesh: &Mesh) -> Vertices {
        let Self { root, buffers, .. } = self;
        let of3 = |values: &[Vec3]| values.iter().map(Vec3::to_array).collect::<Vec<_>>();
        let of4 = |values: &[Vec4]| values.iter().map(Vec4::to_array).collect::<Vec<_>>();
        let each = mesh.joint_weights.len() / mesh.positions.len().max(1);
        let sets = each.div_ceil(4);
        let set = |first: usize| {
            let of_vertex = |vertex: usize| {
                let held = &mesh.joint_weights_of(vertex)[first..each.min(first + 4)];
                let at = |i: usize| held.get(i).copied().unwrap_or_default();
                let joints: [u16; 4] = std::array::from_fn(|i| at(i).joint as u16);
                let weights: [f32; 4] = std::array::from_fn(|i| at(i).weight);
                (joints, weights)
            };
            (0..mesh.positions.len()).map(of_vertex).unzip::<_, _, Vec<_>, Vec<_>>()
        };
        let joints = (0..sets).map(|i| {
            let (joints, weights) = set(4 * i);
            [buffers.joints(root, &joints), buffers.floats(root, &weights, Type::Vec4, false)]
        });
        let joints = joints.collect();
        let targets =
            mesh.morph_targets.iter().map(|MorphTarget { positions, normals }| json::mesh::MorphTarget {
                positions: (!positions.is_empty())
                    .then(|| buffers.floats(root, &of3(positions), Type::Vec3, true)),
                normals: (!normals.is_empty())
                    .then(|| buffers.floats(root, &of3(normals), Type::Vec3, false)),
                tangents: None,
            });
        let targets = targets.collect();
        let uvs = [0, 1].map(|set| mesh.uvs.iter().map(|uv| uv[set].to_array()).collect::<Vec<_>>());
        Vertices {
            positions: buffers.floats(root, &of3(&mesh.positions), Type::Vec3, true),
            normals: buffers.floats(root, &of3(&mesh.normals), Type::Vec3, false),
            tangents: (!mesh.tangents.is_empty())
                .then(|| buffers.floats(root, &of4(&mesh.tangents), Type::Vec4, false)),
            uvs: (!mesh.uvs.is_empty()).then(|| uvs.map(|uv| buffers.floats(root, &uv, Type::Vec2, false))),
            colors: (!mesh.colors.is_empty())
                .then(|| buffers.floats(root, &of3(&mesh.colors), Type::Vec3, false)),
            joints,
            targets,
        }
    }

    fn primitive(&mut self, mesh: &Mesh, run: &[MeshTriangle], vertices: &Vertices) -> Primitive {
        let material = run[0].material;
        let shown = &self.scene.materials[material];
        let mut attributes = BTreeMap::from([(Valid(Semantic::Positions), vertices.positions)]);
        if !stays_flat(mesh, &run[0]) {
            attributes.insert(Valid(Semantic::Normals), vertices.normals);
            if let Some(tangents) = vertices.tangents.filter(|_| shown.normal_texture.is_some()) {
                attributes.insert(Valid(Semantic::Tangents), tangents);
            }
        }
        if let Some([first, second]) = vertices.uvs {
            attributes.insert(Valid(Semantic::TexCoords(0)), first);
            if shown.textures().any(|texture| texture.uv_set == 1) {
                attributes.insert(Valid(Semantic::TexCoords(1)), second);
            }
        }
        if let Some(colors) = vertices.colors.filter(|_| shown.vertex_colors) {
            attributes.insert(Valid(Semantic::Colors(0)), colors);
        }
        for (set, [joints, weights]) in (0..).zip(&vertices.joints) {
            attributes.insert(Valid(Semantic::Joints(set)), *joints);
            attributes.insert(Valid(Semantic::Weights(set)), *weights);
        }
        let indices: Vec<u32> = run.iter().flat_map(|triangle| triangle.vertices).collect();
        Primitive {
            attributes,
            indices: Some(self.buffers.indices(&mut self.root, &indices)),
            material: Some(Index::new(material.0)),
            mode: Valid(Mode::Triangles),
            targets: (!vertices.targets.is_empty()).then(|| vertices.targets.clone()),
            extensions: None,
            extras: None,
        }
    }
}

/// Whether a triangle is flat whatever deforms it: then its normals are the reader's to compute.
fn stays_flat(mesh: &Mesh, triangle: &MeshTriangle) -> bool {
    let is_deformed = !(mesh.joint_weights.is_empty() && mesh.morph_targets.is_empty());
    let vertex = triangle.vertices[0];
    let next = mesh.flat.partition_point(|range| range.end <= vertex);
    is_deformed && mesh.flat.get(next).is_some_and(|range| range.contains(&vertex))
}

/// The triangles in runs of one material, in their order where there are not too many.
fn runs(mesh: &Mesh) -> Vec<Vec<MeshTriangle>> {
    let kind = |triangle: &MeshTriangle| (triangle.material, stays_flat(mesh, triangle));
    let in_runs = |triangles: &[MeshTriangle]| {
        triangles.chunk_by(|a, b| kind(a) == kind(b)).map(<[_]>::to_vec).collect::<Vec<_>>()
    };
    let runs = in_runs(&mesh.triangles);
    if runs.len() <= MOST_RUNS {
        return runs;
    }
    let mut sorted = mesh.triangles.clone();
    sorted.sort_by_key(kind);
    in_runs(&sorted)
}
