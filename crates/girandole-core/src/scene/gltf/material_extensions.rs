//! What extensions make of a material in metallic-roughness terms.
//!
//! - `KHR_materials_ior`: reflectance at normal incidence, in the specular colour.
//! - `KHR_materials_clearcoat`: both lobes as one, of their common strength and mean width.
//! - `KHR_materials_sheen`: by its albedo, as part of the base colour.
//! - `KHR_materials_pbrSpecularGlossiness`: a dielectric with that specular colour.
//! - `KHR_materials_transmission`: a thin wall.
//! - `KHR_materials_unlit`.

use super::{Importer, Parsed};
use crate::scene::{ColorSpace, Material, Texture, TextureRef};
use glam::{Vec3, Vec4};
use gltf::json::texture::Info;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
use std::f32::consts::PI;

pub(super) const CLEARCOAT: &str = "KHR_materials_clearcoat";
pub(super) const IOR: &str = "KHR_materials_ior";
pub(super) const SHEEN: &str = "KHR_materials_sheen";
pub(super) const SPECULAR_GLOSSINESS: &str = "KHR_materials_pbrSpecularGlossiness";
pub(super) const TRANSMISSION: &str = "KHR_materials_transmission";
pub(super) const UNLIT: &str = "KHR_materials_unlit";

/// Reflectance at normal incidence of what has a refractive index of 1.5.
const DIELECTRIC: f32 = 0.04;

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
struct Clearcoat {
    clearcoat_factor: f32,
    clearcoat_roughness_factor: f32,
    clearcoat_texture: Option<Info>,
    clearcoat_roughness_texture: Option<Info>,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct Sheen {
    sheen_color_factor: [f32; 3],
    sheen_roughness_factor: f32,
    sheen_color_texture: Option<Info>,
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
        if let Some(sheen) = read(others, SHEEN)? {
            self.sheen(material, &sheen);
        }
        if let Some(clearcoat) = read(others, CLEARCOAT)? {
            self.clearcoat(material, &clearcoat);
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

    fn sheen(&mut self, material: &mut Material, json: &Sheen) {
        if json.sheen_color_texture.is_some() {
            self.scene.warn("textures of sheen are left out: it has the same colour all over".into());
        }
        let color = Vec3::from(json.sheen_color_factor.map(|c| c.clamp(0.0, 1.0)));
        let sheen = color * sheen_albedo(json.sheen_roughness_factor.clamp(0.0, 1.0));
        let texture = material.base_color_texture.map(|t| &self.scene.textures[t.texture as usize]);
        let mean = texture.map_or(Vec3::ONE, mean_color).max(Vec3::splat(1e-3));
        // Its mean is right; what varies is the base's.
        let below = material.base_color * (1.0 - sheen.max_element());
        material.base_color = (below + sheen / mean).min(Vec3::ONE / mean);
    }

    fn clearcoat(&mut self, material: &mut Material, json: &Clearcoat) {
        if json.clearcoat_texture.is_some() || json.clearcoat_roughness_texture.is_some() {
            self.scene.warn("textures of clear coats are left out: they are the same all over".into());
        }
        let strength = json.clearcoat_factor.clamp(0.0, 1.0);
        if strength <= 0.0 {
            return;
        }
        let coat = DIELECTRIC * strength;
        let dielectric = (DIELECTRIC * material.specular_color).min(Vec3::ONE) * material.specular;
        let base = dielectric.lerp(material.base_color, material.metallic).element_sum() / 3.0
            * (1.0 - coat).powi(2);
        let alpha = |roughness: f32| roughness.clamp(0.0, 1.0).powi(2);
        let mean = (alpha(material.roughness) * base + alpha(json.clearcoat_roughness_factor) * coat)
            / (base + coat);
        material.roughness = mean.sqrt();
        material.specular = material.specular.max(strength);
        // What the coat lets through and what it reflects itself.
        let both = coat + dielectric * (1.0 - coat).powi(2);
        material.specular_color = both / (DIELECTRIC * material.specular);
    }
}

fn read<T: DeserializeOwned>(others: &Map<String, Value>, name: &str) -> Parsed<Option<T>> {
    let value = others.get(name).map(|value| serde_json::from_value(value.clone()));
    value.transpose().map_err(|e| format!("its {name} is broken ({e}); export it again"))
}

fn mean_color(texture: &Texture) -> Vec3 {
    // Every texel of small ones, a few thousand of others.
    let step = (texture.texels.len() / 4096).max(1);
    let texels = (0..texture.texels.len()).step_by(step);
    let width = i64::from(texture.width);
    let (count, sum) = texels.fold((0.0, Vec4::ZERO), |(count, sum), i| {
        (count + 1.0, sum + texture.texel(i as i64 % width, i as i64 / width))
    });
    sum.truncate() / f32::max(count, 1.0)
}

/// The share of uniform light that sheen of this roughness reflects: the distribution of Estevez and Kulla ("Production Friendly
/// Microfacet Sheen BRDF", 2017) with the visibility of Neubelt and Pettineo (2013), as the extension asks for.
fn sheen_albedo(roughness: f32) -> f32 {
    const STEPS: usize = 24;
    let inverse = 1.0 / roughness.max(0.1).powi(2);
    let middle = |i: usize| (i as f32 + 0.5) / STEPS as f32;
    let mut sum = 0.0;
    for (view, light, azimuth) in (0..STEPS.pow(3))
        .map(|i| (middle(i % STEPS), middle(i / STEPS % STEPS), middle(i / STEPS / STEPS) * PI))
    {
        let [view_sine, light_sine] = [view, light].map(|c| (1.0 - c * c).sqrt());
        let half = Vec3::new(
            view_sine + light_sine * libm::cosf(azimuth),
            light_sine * libm::sinf(azimuth),
            view + light,
        );
        let sine = (1.0 - half.normalize().z.powi(2)).max(0.0).sqrt();
        let distribution = (2.0 + inverse) * libm::powf(sine, inverse) / (2.0 * PI);
        let visibility = 1.0 / (4.0 * (light + view - light * view));
        // What is reflected of a view, and views by their cosine.
        sum += distribution * visibility * light * 2.0 * view;
    }
    2.0 * PI * sum / STEPS.pow(3) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sheen_reflects_a_part_of_the_light() {
        let albedos = [0.1, 0.3, 0.5, 0.7, 1.0].map(sheen_albedo);
        assert!(albedos.is_sorted() && albedos[0] > 0.0 && albedos[4] < 0.6, "{albedos:?}");
    }
}
