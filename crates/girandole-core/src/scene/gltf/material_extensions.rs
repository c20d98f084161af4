//! What extensions make of a material in metallic-roughness terms.
//!
//! - `KHR_materials_ior`: reflectance at normal incidence, in the specular colour.
//! - `KHR_materials_clearcoat` and `KHR_materials_sheen`: see `coats`.
//! - `KHR_materials_pbrSpecularGlossiness`: a dielectric with that specular colour.
//! - `KHR_materials_transmission`: a thin wall.
//! - `KHR_materials_unlit`.

use super::coats::{Clearcoat, Sheen};
use super::{Importer, Parsed};
use crate::scene::{ColorSpace, Material, Texture, TextureRef};
use glam::Vec3;
use gltf::json::texture::Info;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

pub(super) const CLEARCOAT: &str = "KHR_materials_clearcoat";
pub(super) const IOR: &str = "KHR_materials_ior";
pub(super) const SHEEN: &str = "KHR_materials_sheen";
pub(super) const SPECULAR_GLOSSINESS: &str = "KHR_materials_pbrSpecularGlossiness";
pub(super) const TRANSMISSION: &str = "KHR_materials_transmission";
pub(super) const UNLIT: &str = "KHR_materials_unlit";

/// Reflectance at normal incidence of what has a refractive index of 1.5.
pub(super) const DIELECTRIC: f32 = 0.04;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct SpecularGlossiness {
    diffuse_factor: [f32; 4],
    diffuse_texture: Option<Info>,
    specular_factor: [f32; 3],
    glossiness_factor: f32,
    specular_glossiness_texture: Option<Info>,
}

impl Default for SpecularGlossiness {
    fn default() -> Self {
        Self {
            diffuse_factor: [1.0; 4],
            diffuse_texture: None,
            specular_factor: [1.0; 3],
            glossiness_factor: 1.0,
            specular_glossiness_texture: None,
        }
    }
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct Transmission {
    transmission_factor: f32,
    transmission_texture: Option<Info>,
}

#[derive(Deserialize)]
struct Ior {
    #[serde(default = "usual_ior")]
    ior: f32,
}

fn usual_ior() -> f32 {
    1.5
}

impl Importer<'_> {
    /// Makes of a material what the extensions that it has say, all of `others`.
    pub(super) fn extend(&mut self, material: &mut Material, others: &Map<String, Value>) -> Parsed<()> {
        if let Some(extension) = read::<SpecularGlossiness>(others, SPECULAR_GLOSSINESS)? {
            self.specular_glossiness(material, extension)?;
        }
        if let Some(Ior { ior }) = read(others, IOR)? {
            material.specular_color *= self.reflectance(ior) / DIELECTRIC;
        }
        if let Some(sheen) = read::<Sheen>(others, SHEEN)? {
            self.sheen(material, &sheen)?;
        }
        if let Some(clearcoat) = read::<Clearcoat>(others, CLEARCOAT)? {
            self.clearcoat(material, &clearcoat)?;
        }
        if let Some(Transmission { transmission_factor, transmission_texture }) = read(others, TRANSMISSION)?
        {
            material.transmission = transmission_factor.clamp(0.0, 1.0);
            material.transmission_texture = self.info(transmission_texture.as_ref(), ColorSpace::Linear)?;
        }
        if others.contains_key(UNLIT) {
            material.unlit = true;
            material.emission = Vec3::ZERO;
            material.metallic = 0.0;
            material.specular = 0.0;
        }
        Ok(())
    }

    /// Of a refractive index, at normal incidence; 0 stands for a mirror.
    fn reflectance(&mut self, ior: f32) -> f32 {
        match ior {
            0.0 => 1.0,
            1.0..1e6 => ((ior - 1.0) / (ior + 1.0)).powi(2),
            _ => {
                self.scene.warn("refractive indices below 1 are taken for 1.5".into());
                DIELECTRIC
            }
        }
    }

    fn specular_glossiness(&mut self, material: &mut Material, json: SpecularGlossiness) -> Parsed<()> {
        let [r, g, b, alpha] = json.diffuse_factor.map(|c| c.clamp(0.0, 1.0));
        material.base_color = Vec3::new(r, g, b);
        material.alpha = alpha;
        material.base_color_texture = self.info(json.diffuse_texture.as_ref(), ColorSpace::Srgb)?;
        let specular = json.specular_glossiness_texture.as_ref();
        material.metallic = 0.0;
        material.specular = 1.0;
        material.specular_texture = None;
        material.specular_color = Vec3::from(json.specular_factor.map(|c| c.clamp(0.0, 1.0))) / DIELECTRIC;
        material.specular_color_texture = self.info(specular, ColorSpace::Srgb)?;
        let gloss = json.glossiness_factor.clamp(0.0, 1.0);
        material.roughness = 1.0 - gloss;
        material.metallic_roughness_texture = None;
        if let Some(shininess) = material.specular_color_texture {
            material.roughness = 1.0;
            let texel = |[.., a]: [u8; 4]| [255, 255 - (f32::from(a) * gloss).round() as u8, 255, 255];
            material.metallic_roughness_texture = Some(self.derived(shininess, texel)?);
        }
        Ok(())
    }

    /// The same use of a linear texture whose texels are these functions of the other's.
    fn derived(&mut self, from: TextureRef, texel: impl Fn([u8; 4]) -> [u8; 4]) -> Parsed<TextureRef> {
        let count = self.scene.textures[from.texture as usize].texels.len();
        self.account_texels(count)?;
        let texture = &self.scene.textures[from.texture as usize];
        let texels = texture.texels.iter().map(|&t| texel(t)).collect();
        let Texture { width, height, wrap, filter, .. } = *texture;
        let name = texture.name.clone();
        let texture = Texture { name, width, height, texels, color_space: ColorSpace::Linear, wrap, filter };
        self.scene.textures.push(texture);
        Ok(TextureRef { texture: (self.scene.textures.len() - 1) as u32, ..from })
    }
}

fn read<T: DeserializeOwned>(others: &Map<String, Value>, name: &str) -> Parsed<Option<T>> {
    let value = others.get(name).map(|value| serde_json::from_value(value.clone()));
    value.transpose().map_err(|e| format!("its {name} is broken ({e}); export it again"))
}
