//! What importers add to meshes and remove from them: normals, duplicate triangles, patches.

use super::MAX_EXTENT;
use super::mesh::{weld, weld_by};
use super::{MaterialId, Mesh, Scene, mark_patches};
use glam::{DVec3, Vec3};
use rustc_hash::FxHashSet;

/// Patches of an imported scene have at least this share of its diagonal squared, or of the square of so many times their object's own.
const MIN_AREA: f64 = 1e-4;
const MOST_OBJECTS_ACROSS: f64 = 32.0;

/// A unit normal for each vertex: the mean over all triangles at its position, weighted by their angle there.
pub(crate) fn smooth_normals(
    positions: &[Vec3],
    triangles: impl Iterator<Item = [u32; 3]> + Clone,
) -> Vec<Vec3> {
    let welded = weld(positions);
    let mut sums = vec![DVec3::ZERO; positions.len()];
    let mut any = vec![DVec3::ZERO; positions.len()];
    for corners in triangles {
        let p = corners.map(|v| positions[v as usize].as_dvec3());
        let normal = (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero();
        for i in 0..3 {
            let to_next = (p[(i + 1) % 3] - p[i]).normalize_or_zero();
            let to_last = (p[(i + 2) % 3] - p[i]).normalize_or_zero();
            let angle = libm::atan2(to_next.cross(to_last).length(), to_next.dot(to_last));
            let vertex = welded[corners[i] as usize] as usize;
            sums[vertex] += normal * angle;
            if normal != DVec3::ZERO {
                any[vertex] = normal;
            }
        }
    }
    // Where the faces cancel, one of them has to do.
    welded
        .iter()
        .map(|&v| {
            let sum = sums[v as usize];
            if sum.length() > 1e-6 { sum.normalize() } else { any[v as usize].normalize_or(DVec3::Y) }
        })
        .map(|n| n.as_vec3())
        .collect()
}

/// Turns the normals of vertices around if those of most triangles point away from their fronts: the side that shows would be black.
/// Whether that was so.
pub(crate) fn turn_normals(positions: &[Vec3], normals: &mut [Vec3], triangles: &[[u32; 3]]) -> bool {
    let mut balance = 0_i64;
    for corners in triangles {
        let [a, b, c] = corners.map(|v| positions[v as usize].as_dvec3());
        let front = (b - a).cross(c - a);
        let along = corners.map(|v| front.dot(normals[v as usize].as_dvec3()));
        let is_all = |of: fn(f64) -> bool| i64::from(along.into_iter().all(of));
        balance += is_all(|along| along < 0.0) - is_all(|along| along > 0.0);
    }
    if balance > 0 {
        normals.iter_mut().for_each(|normal| *normal = -*normal);
    }
    balance > 0
}

/// Drops triangles of the same three positions (and what deforms them), front and material as an earlier one, and returns their
/// number. A ray
/// meets only one of them, so an emitter that is listed twice must not shine twice; and hierarchies over triangles
/// cannot part them.
pub(crate) fn drop_duplicates(mesh: &mut Mesh) -> usize {
    let welded = if mesh.joint_weights.is_empty() && mesh.morph_targets.is_empty() {
        weld(&mesh.positions)
    } else {
        weld_by(0..mesh.positions.len(), |&v| deformation_bits(mesh, v))
    };
    let mut seen: FxHashSet<(MaterialId, [u32; 3])> = FxHashSet::default();
    seen.reserve(mesh.triangles.len());
    let before = mesh.triangles.len();
    mesh.triangles.retain(|t| {
        let mut points = t.vertices.map(|v| welded[v as usize]);
        let least = (0..3).min_by_key(|&i| points[i]).unwrap_or(0);
        points.rotate_left(least);
        seen.insert((t.material, points))
    });
    before - mesh.triangles.len()
}

/// What tells where a vertex is when its mesh is deformed.
fn deformation_bits(mesh: &Mesh, vertex: usize) -> Vec<u32> {
    let shifts = mesh.morph_targets.iter().map(|t| t.positions.get(vertex).copied().unwrap_or_default());
    let places = std::iter::once(mesh.positions[vertex]).chain(shifts);
    let joints = mesh.joint_weights_of(vertex).iter().map(|j| [j.joint, j.weight.to_bits()]);
    let places = places.flat_map(|p| (p + Vec3::ZERO).to_array().map(f32::to_bits));
    places.chain(joints.flatten()).collect()
}

/// Marks the patches of all meshes of an imported scene that are not deformed: those that are of some size where they are shown
/// largest.
/// Says what is wrong with scenes too large for single precision.
pub(crate) fn mark_scene(scene: &mut Scene) -> Result<(), String> {
    let world_from_nodes = scene.world_from_nodes();
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
    let mut extents = vec![0.0_f64; scene.meshes.len()];
    for object in &scene.objects {
        if scene.is_deformed(object) {
            let bounds = scene.world_bounds(object, &|node| world_from_nodes[node.index()]);
            (low, high) = (low.min(bounds.low), high.max(bounds.high));
            continue;
        }
        let ((min, max), affine) = (bounds[object.mesh], world_from_nodes[object.node.index()]);
        let (mut own_low, mut own_high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for corner in 0..8 {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { min[axis] } else { max[axis] };
            let p = affine.transform_point3(Vec3::new(pick(0), pick(1), pick(2)).as_dvec3());
            if !p.is_finite() {
                return Err("has an object without a finite place; check its transforms".into());
            }
            (own_low, own_high) = (own_low.min(p), own_high.max(p));
        }
        (low, high) = (low.min(own_low), high.max(own_high));
        extents[object.mesh] = extents[object.mesh].max((own_high - own_low).length());
        // How much areas grow at most, exact for those along two of the object's axes.
        let m = affine.matrix3;
        for (a, b) in [(m.x_axis, m.y_axis), (m.y_axis, m.z_axis), (m.z_axis, m.x_axis)] {
            scales[object.mesh] = scales[object.mesh].max(a.cross(b).length());
        }
    }
    let diagonal = (high - low).length();
    if !diagonal.is_finite() {
        return Err("has an object without a finite place; check its transforms".into());
    }
    if diagonal > MAX_EXTENT || low.abs().max(high.abs()).max_element() > MAX_EXTENT {
        return Err(format!("reaches {diagonal:.3e} m far; scale it to metres"));
    }
    for (mesh, (scale, extent)) in scene.meshes.iter_mut().zip(scales.into_iter().zip(extents)) {
        if scale > 0.0 {
            let least = MIN_AREA * diagonal.min(MOST_OBJECTS_ACROSS * extent).powi(2);
            mark_patches(mesh, (least / scale) as f32);
        }
    }
    Ok(())
}
