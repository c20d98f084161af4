//! What imported meshes lack or have too much of.

use super::Mesh;
use glam::{DVec3, Vec3};
use rustc_hash::{FxHashMap, FxHashSet};

/// The first vertex with the same position, for each vertex.
pub(crate) fn weld(positions: &[Vec3]) -> Vec<u32> {
    let mut first: FxHashMap<[u32; 3], u32> = FxHashMap::default();
    first.reserve(positions.len());
    let key = |p: &Vec3| (*p + Vec3::ZERO).to_array().map(f32::to_bits);
    positions.iter().enumerate().map(|(i, p)| *first.entry(key(p)).or_insert(i as u32)).collect()
}

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

/// Drops triangles of the same three positions, front and material as an earlier one, and returns their number. A ray
/// meets only one of them, so an emitter that is listed twice must not shine twice; and hierarchies over triangles
/// cannot part them.
pub(crate) fn drop_duplicates(mesh: &mut Mesh) -> usize {
    let welded = weld(&mesh.positions);
    let mut seen: FxHashSet<(u32, [u32; 3])> = FxHashSet::default();
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
