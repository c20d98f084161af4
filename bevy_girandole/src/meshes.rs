//! Bevy's meshes in Girandole's terms.

use bevy::mesh::{Mesh, PrimitiveTopology, VertexAttributeValues};
use girandole_core::glam::{Vec2, Vec3, Vec4};
use girandole_core::scene::{self, MaterialId, MeshTriangle, mark_patches};

/// Flat parts of at least this share of the square of a mesh's extent are lit as a whole.
const PATCH_SHARE: f32 = 1e-4;

/// Whether normal maps have something to stand on.
pub fn has_tangents(mesh: &Mesh) -> bool {
    matches!(
        mesh.try_attribute_option(Mesh::ATTRIBUTE_TANGENT),
        Ok(Some(VertexAttributeValues::Float32x4(_)))
    )
}

/// A mesh of one material.
///
/// # Errors
/// The second half of a sentence about a mesh that cannot be taken.
pub fn convert(mesh: &Mesh, material: MaterialId) -> Result<scene::Mesh, &'static str> {
    let three = |attribute| -> Result<Option<Vec<Vec3>>, &'static str> {
        let values = mesh.try_attribute_option(attribute).map_err(|_| GONE)?;
        Ok(values.and_then(VertexAttributeValues::as_float3).map(|v| v.iter().map(|&v| v.into()).collect()))
    };
    let positions = three(Mesh::ATTRIBUTE_POSITION)?
        .ok_or("has no positions of three 32-bit floats; give it Mesh::ATTRIBUTE_POSITION in that format")?;
    let normals = three(Mesh::ATTRIBUTE_NORMAL)?
        .ok_or("has no normals of three 32-bit floats; call Mesh::compute_normals on it")?;
    let two = |attribute| match mesh.try_attribute_option(attribute) {
        Ok(Some(VertexAttributeValues::Float32x2(values))) => Some(values),
        _ => None,
    };
    let four = |attribute| match mesh.try_attribute_option(attribute) {
        Ok(Some(VertexAttributeValues::Float32x4(values))) => Some(values),
        _ => None,
    };
    let (first, second) = (two(Mesh::ATTRIBUTE_UV_0), two(Mesh::ATTRIBUTE_UV_1));
    let uvs = match (first.or(second), second.or(first)) {
        (Some(a), Some(b)) => a.iter().zip(b).map(|(&a, &b)| [Vec2::from(a), Vec2::from(b)]).collect(),
        _ => Vec::new(),
    };
    let tangents = four(Mesh::ATTRIBUTE_TANGENT);
    let colors = four(Mesh::ATTRIBUTE_COLOR);
    let mut result = scene::Mesh {
        triangles: triangles(mesh, positions.len())?
            .into_iter()
            .map(|vertices| MeshTriangle { vertices, material })
            .collect(),
        positions,
        normals: normals.into_iter().map(|n| n.try_normalize().unwrap_or(Vec3::Y)).collect(),
        tangents: tangents.map_or_else(Vec::new, |t| t.iter().map(|&t| Vec4::from(t)).collect()),
        uvs,
        colors: colors.map_or_else(Vec::new, |c| c.iter().map(|&[r, g, b, _]| Vec3::new(r, g, b)).collect()),
        ..Default::default()
    };
    if !result.positions.iter().chain(&result.normals).all(|p| p.is_finite()) {
        return Err("has positions or normals that are not finite; mend it");
    }
    let low = result.positions.iter().copied().fold(Vec3::INFINITY, Vec3::min);
    let high = result.positions.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
    if low.is_finite() {
        mark_patches(&mut result, PATCH_SHARE * (high - low).length_squared());
    }
    Ok(result)
}

const GONE: &str =
    "has left the main world; create it with RenderAssetUsages::default(), which keeps it there";

/// Vertices of triangles, in the order of their fronts.
fn triangles(mesh: &Mesh, vertices: usize) -> Result<Vec<[u32; 3]>, &'static str> {
    let indices: Vec<u32> = match mesh.try_indices_option().map_err(|_| GONE)? {
        Some(indices) => indices.iter().map(|i| u32::try_from(i).unwrap_or(u32::MAX)).collect(),
        None => (0..u32::try_from(vertices).map_err(|_| "has too many vertices; split it")?).collect(),
    };
    let triangles: Vec<[u32; 3]> = match mesh.primitive_topology() {
        PrimitiveTopology::TriangleList => indices.as_chunks().0.to_vec(),
        PrimitiveTopology::TriangleStrip => (0..)
            .zip(indices.windows(3))
            .map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] })
            .collect(),
        _ => return Err("consists of points or lines, which take no light; make it of triangles"),
    };
    if triangles.iter().flatten().any(|&v| v as usize >= vertices) {
        return Err("has indices of vertices that do not exist; mend it");
    }
    Ok(triangles)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::asset::RenderAssetUsages;
    use bevy::mesh::Indices;
    use bevy::prelude::Cuboid;

    fn strip() -> Mesh {
        let positions = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
        Mesh::new(PrimitiveTopology::TriangleStrip, RenderAssetUsages::default())
            .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, vec![[0.0, 0.0, 1.0]; 4])
            .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
    }

    #[test]
    fn a_cuboid_is_six_flat_sides_that_face_outwards() {
        let mesh = convert(&Mesh::from(Cuboid::new(2.0, 4.0, 6.0)), MaterialId(3)).unwrap();
        assert_eq!((mesh.triangles.len(), mesh.patches.len()), (12, 6));
        assert!(mesh.check(4).is_ok() && mesh.check(3).is_err());
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.vertices.map(|v| mesh.positions[v as usize]);
            let normal = (b - a).cross(c - a);
            assert!(normal.dot(a + b + c) > 0.0);
            assert!(normal.dot(mesh.normals[triangle.vertices[0] as usize]) > 0.0);
        }
    }

    #[test]
    fn all_triangles_of_a_strip_face_alike() {
        let mesh = convert(&strip(), MaterialId(0)).unwrap();
        assert_eq!(mesh.triangles.len(), 2);
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.vertices.map(|v| mesh.positions[v as usize]);
            assert!((b - a).cross(c - a).z > 0.0);
        }
    }

    #[test]
    fn what_cannot_be_drawn_is_refused_with_a_sentence() {
        let lines = Mesh::new(PrimitiveTopology::LineList, RenderAssetUsages::default())
            .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, vec![[0.0, 0.0, 1.0]; 2])
            .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, vec![[0.0; 3]; 2]);
        assert!(convert(&lines, MaterialId(0)).unwrap_err().contains("triangles"));
        let missing = strip().with_inserted_indices(Indices::U32(vec![0, 1, 9]));
        assert!(convert(&missing, MaterialId(0)).unwrap_err().contains("do not exist"));
        let bare = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default());
        assert!(convert(&bare, MaterialId(0)).is_err());
    }
}
