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

use super::{Mesh, MeshTriangle, Patch, Scene};
use glam::{DAffine3, DVec3, Vec3};
use polygons::{Polygon, convex_polygons, whole_polygon};
use surface::Surface;

/// Patches of an imported scene have at least this share of its diagonal squared.
const MIN_AREA: f64 = 1e-4;
/// A scene of more metres than this is a mistake, and its squares would leave the range of single precision.
pub(super) const MAX_EXTENT: f64 = 1e15;

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
