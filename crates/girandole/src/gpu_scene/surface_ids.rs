//! Ids of surfaces: equal for triangles between whose pixels light may be interpolated.

use crate::shader_constants::{CURVED, SHINY};
use crate::{Error, Remedy, Result};
use girandole_core::glam::Vec3;
use girandole_core::scene::{Geometry, MaterialId, Scene, Triangle};
use std::collections::HashMap;

/// What tells surfaces apart.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Surface {
    /// [`CURVED`] and [`SHINY`].
    flags: u32,
    /// Index of the plane, or of a curved object.
    number: u32,
    /// Of what reflects: different reflections are not interpolated between.
    material: Option<MaterialId>,
}

/// The id of the surface of each triangle: surfaces are numbered from 1 in 22 bits, 0 is none, and the highest two bits
/// of 24 are [`CURVED`] and [`SHINY`].
///
/// # Errors
/// [`Error::TooLarge`] where there are too many surfaces.
pub(crate) fn surface_ids(scene: &Scene, geometry: &Geometry) -> Result<Vec<u32>> {
    let planes = planes(scene, geometry);
    let mut numbers = HashMap::new();
    geometry
        .triangles
        .iter()
        .map(|t| {
            let surface = surface(scene, t, planes.get(t.patch as usize).copied().flatten());
            let next = numbers.len() as u32 + 1;
            let number = *numbers.entry(surface).or_insert(next);
            if number >= SHINY {
                let what = format!("the scene has more than {} surfaces", SHINY - 1);
                return Err(Error::too_large(what, Remedy::SmallerScene));
            }
            Ok(surface.flags | number)
        })
        .collect()
}

/// For each patch whose shading normal is that of its plane, the number of that plane: coplanar patches that face the
/// same way share one.
fn planes(scene: &Scene, geometry: &Geometry) -> Vec<Option<u32>> {
    let tolerance = geometry.detail() * 1e-5;
    let mut known: Vec<(Vec3, f32)> = Vec::new();
    let mut found: HashMap<[i32; 4], Vec<u32>> = HashMap::new();
    geometry
        .patches
        .iter()
        .map(|patch| {
            if !geometry.is_flat(scene, patch) {
                return None;
            }
            let distance = patch.normal.dot(patch.outline[0]);
            let cell = |x: f32, size: f32| (x / size).round() as i32;
            let [x, y, z] = patch.normal.to_array().map(|x| cell(x, 1e-3));
            let candidates = found.entry([x, y, z, cell(distance, 10.0 * tolerance)]).or_default();
            let same = |&&plane: &&u32| {
                let (normal, d): (Vec3, f32) = known[plane as usize];
                normal.dot(patch.normal) > 1.0 - 1e-7 && (d - distance).abs() < tolerance
            };
            Some(candidates.iter().find(same).copied().unwrap_or_else(|| {
                known.push((patch.normal, distance));
                let plane = known.len() as u32 - 1;
                candidates.push(plane);
                plane
            }))
        })
        .collect()
}

fn surface(scene: &Scene, triangle: &Triangle, plane: Option<u32>) -> Surface {
    let material = &scene.materials[triangle.material];
    let reflects = material.specular > 0.0 || material.metallic > 0.0;
    // Sharp reflections change from pixel to pixel, and so do those of curved surfaces.
    let is_rough =
        plane.is_some() && material.metallic_roughness_texture.is_none() && material.roughness >= 0.5;
    let shiny = if reflects && !is_rough { SHINY } else { 0 };
    let curved = if plane.is_none() { CURVED } else { 0 };
    Surface {
        flags: curved | shiny,
        number: plane.unwrap_or(triangle.object),
        material: reflects.then_some(triangle.material),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use girandole_core::scene::builtin::{self, MovingObject};

    #[test]
    fn surfaces_with_one_id_are_one_surface() {
        let mut scene = builtin::build("table", MovingObject::Teapot).expect("table");
        for (index, material) in scene.materials.iter_mut().enumerate() {
            material.specular = (index % 2) as f32;
        }
        let geometry = Geometry::new(&scene);
        let ids = surface_ids(&scene, &geometry).expect("ids");
        let plane = |t: &Triangle| {
            let [a, b, c] = t.vertices.map(|v| geometry.positions[v as usize]);
            let normal = (b - a).cross(c - a).normalize();
            (normal, normal.dot(a))
        };
        // Each triangle beside the first one that has its id.
        let contradictions = |ids: &[u32]| {
            let mut first: HashMap<u32, &Triangle> = HashMap::new();
            let pairs = geometry.triangles.iter().zip(ids);
            pairs
                .filter(|&(t, &id)| {
                    let other = *first.entry(id).or_insert(t);
                    let ((n, d), (m, e)) = (plane(t), plane(other));
                    let is_plane = n.dot(m) > 0.9999 && (d - e).abs() < 1e-3;
                    let is_same = if id & CURVED == 0 { is_plane } else { t.object == other.object };
                    let reflects = scene.materials[t.material].specular > 0.0;
                    !is_same || (reflects && t.material != other.material)
                })
                .count()
        };
        assert_eq!(contradictions(&ids), 0);
        let mut numbers: Vec<u32> = ids.iter().map(|id| id & (SHINY - 1)).collect();
        numbers.sort_unstable();
        numbers.dedup();
        assert!(numbers.iter().copied().eq(1..=numbers.len() as u32), "numbers without gaps from 1");
        // The control: ids of fewer bits collide.
        let short: Vec<u32> = ids.iter().map(|id| id & (CURVED | SHINY | 15)).collect();
        assert!(contradictions(&short) > 0);
    }
}
