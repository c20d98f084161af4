//! Materials: metallic-roughness, with the extensions that the import reads.

use super::{Exporter, named};
use crate::Result;
use crate::scene::{ColorSpace, Material, NormalTexture, TextureRef};
use glam::Vec3;
use gltf::json;
use gltf::json::extensions::material::{
    EmissiveStrength, EmissiveStrengthFactor, Specular, SpecularColorFactor, SpecularFactor,
};
use gltf::json::material::{
    AlphaCutoff, AlphaMode, EmissiveFactor, PbrBaseColorFactor, PbrMetallicRoughness, StrengthFactor,
};
use gltf::json::texture::Info;
use gltf::json::validation::Checked::Valid;
use gltf::json::{Value, serialize};

impl Exporter<'_> {
    /// Writes all materials, so that their indices stay.
    pub(super) fn write_materials(&mut self) -> Result<()> {
        for material in &self.scene.materials {
            let json = self.material(material)?;
            self.root.push(json);
        }
        Ok(())
    }

    fn material(&mut self, material: &Material) -> Result<json::Material> {
        let color = material.base_color.max(Vec3::ZERO).min(Vec3::ONE);
        if color != material.base_color {
            self.leave_out(format!("what material `{}` reflects beyond all light", material.name));
        }
        let (factor, strength) = emission(self.emission(material));
        let mut extensions = json::extensions::material::Material::default();
        if let Some(strength) = strength {
            self.extensions.insert("KHR_materials_emissive_strength");
            let emissive_strength = EmissiveStrengthFactor(strength);
            extensions.emissive_strength = Some(EmissiveStrength { emissive_strength });
        }
        extensions.specular = self.specular(material)?;
        self.others(material, &mut extensions.others)?;
        let (alpha_mode, alpha_cutoff) = match (material.alpha_cutoff, material.blended) {
            (Some(cutoff), _) => (AlphaMode::Mask, Some(AlphaCutoff(cutoff))),
            (None, true) => (AlphaMode::Blend, None),
            (None, false) => (AlphaMode::Opaque, None),
        };
        Ok(json::Material {
            alpha_cutoff,
            alpha_mode: Valid(alpha_mode),
            double_sided: material.double_sided,
            name: named(&material.name),
            pbr_metallic_roughness: PbrMetallicRoughness {
                base_color_factor: PbrBaseColorFactor(color.extend(material.alpha.clamp(0.0, 1.0)).into()),
                base_color_texture: self.optional(material.base_color_texture, ColorSpace::Srgb)?,
                metallic_factor: StrengthFactor(material.metallic),
                roughness_factor: StrengthFactor(material.roughness),
                metallic_roughness_texture: self
                    .optional(material.metallic_roughness_texture, ColorSpace::Linear)?,
                extensions: None,
                extras: None,
            },
            normal_texture: material.normal_texture.map(|normal| self.normal(normal)).transpose()?,
            occlusion_texture: None,
            emissive_texture: self.optional(material.emission_texture, ColorSpace::Srgb)?,
            emissive_factor: EmissiveFactor(factor),
            extensions: Some(extensions),
            extras: None,
        })
    }

    fn optional(&mut self, used: Option<TextureRef>, space: ColorSpace) -> Result<Option<Info>> {
        used.map(|used| self.info(used, space)).transpose()
    }

    /// What it emits, as glTF has it: what is seen through is weakened there by its alpha.
    fn emission(&mut self, material: &Material) -> Vec3 {
        if !material.blended || material.emission == Vec3::ZERO {
            return material.emission;
        }
        if material.alpha > 0.0 {
            return material.emission / material.alpha;
        }
        self.leave_out(format!("the light of material `{}`, which covers nothing", material.name));
        Vec3::ZERO
    }

    /// `KHR_materials_specular`, where the dielectric lobe is not glTF's usual one.
    fn specular(&mut self, material: &Material) -> Result<Option<Specular>> {
        let Material { specular, specular_color, specular_texture, specular_color_texture, .. } = *material;
        let has_textures = specular_texture.is_some() || specular_color_texture.is_some();
        if material.unlit || specular == 1.0 && specular_color == Vec3::ONE && !has_textures {
            return Ok(None);
        }
        self.extensions.insert("KHR_materials_specular");
        Ok(Some(Specular {
            specular_factor: SpecularFactor(specular),
            specular_texture: self.optional(specular_texture, ColorSpace::Linear)?,
            specular_color_factor: SpecularColorFactor(specular_color.into()),
            specular_color_texture: self.optional(specular_color_texture, ColorSpace::Srgb)?,
            extras: None,
        }))
    }

    fn normal(&mut self, normal: NormalTexture) -> Result<json::material::NormalTexture> {
        let NormalTexture { texture, scale } = normal;
        let mut extensions = json::extensions::material::NormalTexture::default();
        if let Some(transform) = self.transform(&texture.transform) {
            extensions.others.insert("KHR_texture_transform".into(), value(&transform));
        }
        Ok(json::material::NormalTexture {
            index: self.texture(texture.texture, ColorSpace::Linear)?,
            scale,
            tex_coord: texture.uv_set,
            extensions: Some(extensions),
            extras: None,
        })
    }

    /// Extensions that the crate has no types for.
    fn others(&mut self, material: &Material, others: &mut json_map::Map) -> Result<()> {
        if material.unlit {
            self.extensions.insert("KHR_materials_unlit");
            others.insert("KHR_materials_unlit".into(), Value::Object(Default::default()));
        }
        if material.transmission > 0.0 {
            self.extensions.insert("KHR_materials_transmission");
            let mut transmission = json_map::Map::new();
            transmission.insert("transmissionFactor".into(), Value::from(material.transmission));
            if let Some(info) = self.optional(material.transmission_texture, ColorSpace::Linear)? {
                transmission.insert("transmissionTexture".into(), value(&info));
            }
            others.insert("KHR_materials_transmission".into(), Value::Object(transmission));
        }
        Ok(())
    }
}

/// JSON objects.
mod json_map {
    pub type Map = serde_json::Map<String, serde_json::Value>;
}

fn value<T: serde::Serialize>(of: &T) -> Value {
    serialize::to_value(of).unwrap_or_default()
}

/// Emission as a factor from 0 to 1 and its strength, whose product it is, to the bit: strengths are powers of two.
fn emission(emission: Vec3) -> ([f32; 3], Option<f32>) {
    let most = emission.max_element();
    if most <= 1.0 {
        return (emission.into(), None);
    }
    let strength = libm::exp2f(libm::ceilf(libm::log2f(most)));
    let strength = if strength < most { 2.0 * strength } else { strength };
    ((emission / strength).into(), Some(strength))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn emission_keeps_its_bits() {
        for light in
            [Vec3::ZERO, Vec3::ONE, Vec3::new(0.3, 1.0, 0.7), Vec3::new(17.1, 3.3, 1e-3), Vec3::splat(1e12)]
        {
            let (factor, strength) = emission(light);
            assert!(factor.iter().all(|x| (0.0..=1.0).contains(x)), "{light}: {factor:?}");
            assert_eq!(Vec3::from(factor) * strength.unwrap_or(1.0), light);
        }
    }
}
