//! Tangents of meshes with normal maps.

use crate::scene::gltf::generate_tangents;
use crate::scene::{Material, MaterialId, Mesh};
use glam::{Affine2, Vec4};
use rustc_hash::FxHashMap;

/// Adds tangents where a material needs them, and splits vertices that have several.
pub(super) fn add(mesh: &mut Mesh, materials: &[Material]) {
    let has_map = |material: MaterialId| materials[material.index()].normal_texture.is_some();
    if mesh.uvs.is_empty() || !mesh.triangles.iter().any(|t| has_map(t.material)) {
        return;
    }
    let triangles: Vec<[u32; 3]> = mesh.triangles.iter().map(|t| t.vertices).collect();
    // By the vertices' coordinates: turning a map does not turn what its texels mean.
    let generated =
        generate_tangents(&mesh.positions, &mesh.normals, &mesh.uvs, 0, Affine2::IDENTITY, &triangles);
    mesh.tangents = vec![Vec4::ZERO; mesh.positions.len()];
    let mut first: Vec<Option<Vec4>> = vec![None; mesh.positions.len()];
    let mut known: FxHashMap<(u32, [u32; 4]), u32> = FxHashMap::default();
    for (number, tangents) in generated.iter().enumerate() {
        let is_mapped = has_map(mesh.triangles[number].material);
        for (corner, &tangent) in tangents.iter().enumerate() {
            let vertex = mesh.triangles[number].vertices[corner];
            let tangent = if is_mapped { tangent } else { Vec4::ZERO };
            let slot = &mut first[vertex as usize];
            if *slot.get_or_insert(tangent) == tangent {
                mesh.tangents[vertex as usize] = tangent;
                continue;
            }
            let next = mesh.positions.len() as u32;
            let split = *known.entry((vertex, tangent.to_array().map(f32::to_bits))).or_insert(next);
            if split == next {
                push_copy(mesh, vertex as usize, tangent);
            }
            mesh.triangles[number].vertices[corner] = split;
        }
    }
}

fn push_copy(mesh: &mut Mesh, vertex: usize, tangent: Vec4) {
    mesh.positions.push(mesh.positions[vertex]);
    mesh.normals.push(mesh.normals[vertex]);
    mesh.uvs.push(mesh.uvs[vertex]);
    if let Some(&color) = mesh.colors.get(vertex) {
        mesh.colors.push(color);
    }
    mesh.tangents.push(tangent);
}
