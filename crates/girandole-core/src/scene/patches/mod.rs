//! Finds planar convex patches in a mesh.
//!
//! 1. Vertices at the same position are one.
//! 2. Triangles are grown to planar regions across shared edges.
//! 3. A region with a convex outline is a patch; others are cut into convex [`polygons`].
//!
//! A patch consists of whole triangles, so an L-shaped floor becomes the convex parts that its triangulation allows.
//! Triangles meet only along whole edges: a vertex in the middle of a neighbour's edge (a T-junction) separates them.

mod polygons;
mod surface;

use super::{Mesh, MeshTriangle, Patch};
use polygons::{Polygon, convex_polygons, whole_polygon};
use surface::Surface;

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
    for (number, region) in surface.regions.iter().enumerate() {
        let area: f64 = region.iter().map(|&t| surface.areas[t as usize]).sum();
        if area < f64::from(min_area) {
            continue;
        }
        let flat = surface.flatten(number as u32);
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
