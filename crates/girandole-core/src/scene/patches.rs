//! Finds planar convex patches in a mesh.

use super::Mesh;

/// Marks coplanar connected triangles of one material as planar convex [`Patch`](super::Patch)es where they are
/// larger than `min_area` (m², in object space), and reorders the mesh's triangles so that those of patches come first.
pub fn mark_patches(mesh: &mut Mesh, min_area: f32) {
    let _ = (mesh, min_area);
    todo!("patches")
}
