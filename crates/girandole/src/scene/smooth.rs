//! Which surfaces are smooth enough for mirrored rays.

use girandole_core::scene::{Geometry, Material, ObjectRange, Scene};

/// Roughness from which on light samples show all that is reflected, however few there are.
const MIRROR_ROUGHNESS: f32 = 0.75;

/// Whether some of what a material reflects is sharper than light samples can show.
pub(crate) fn is_smooth(material: &Material) -> bool {
    let reflects = material.specular > 0.0 || material.metallic > 0.0;
    reflects && (material.roughness < MIRROR_ROUGHNESS || material.metallic_roughness_texture.is_some())
}

/// Which surfaces are smooth enough for mirrored rays.
pub(crate) struct Smooth {
    patches: Vec<bool>,
    objects: Vec<bool>,
}

impl Smooth {
    pub fn of(scene: &Scene, geometry: &Geometry) -> Self {
        let is_smooth = |material: u32| is_smooth(&scene.materials[material as usize]);
        let object = |range: &ObjectRange| {
            let triangles = range.triangles.start as usize..range.triangles.end as usize;
            geometry.triangles[triangles].iter().any(|t| is_smooth(t.material))
        };
        Self {
            patches: geometry.patches.iter().map(|patch| is_smooth(patch.material)).collect(),
            objects: geometry.objects.iter().map(object).collect(),
        }
    }

    /// Whether a surface is: a patch, or, where it is part of none, an object.
    pub fn is(&self, (patch, object): (u32, u32)) -> bool {
        let of = |all: &[bool], index: u32| all.get(index as usize).copied();
        of(&self.patches, patch).or_else(|| of(&self.objects, object)).unwrap_or(false)
    }
}
