//! What lies on a material as parts of it: clear coats as one lobe with what they cover, of their common strength and mean width;
//! sheen by its albedo, as part of the base colour. Where textures say how much of them there is, textures of the result are made.

use super::material_extensions::DIELECTRIC;
use super::{Importer, Parsed};
use crate::scene::{ColorSpace, Material, Texture, TextureRef};
use crate::tonemap::srgb_encode;
use glam::{Vec2, Vec3, Vec4};
use gltf::json::texture::Info;
use serde::Deserialize;
use std::f32::consts::PI;

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Clearcoat {
    clearcoat_factor: f32,
    clearcoat_roughness_factor: f32,
    clearcoat_texture: Option<Info>,
    clearcoat_roughness_texture: Option<Info>,
    clearcoat_normal_texture: Option<serde_json::Value>,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Sheen {
    sheen_color_factor: [f32; 3],
    sheen_roughness_factor: f32,
    sheen_color_texture: Option<Info>,
    sheen_roughness_texture: Option<Info>,
}

impl Importer<'_> {
    pub(super) fn sheen(&mut self, material: &mut Material, json: &Sheen) -> Parsed<()> {
        let mut roughness = json.sheen_roughness_factor.clamp(0.0, 1.0);
        if let Some(texture) = self.info(json.sheen_roughness_texture.as_ref(), ColorSpace::Linear)? {
            self.scene.warn("textures of sheen's roughness are averaged: it is the same all over".into());
            roughness *= self.mean(texture).w;
        }
        let color = Vec3::from(json.sheen_color_factor.map(|c| c.clamp(0.0, 1.0)));
        let mut sheen = color * sheen_albedo(roughness);
        if sheen == Vec3::ZERO {
            return Ok(());
        }
        if let Some(texture) = self.info(json.sheen_color_texture.as_ref(), ColorSpace::Srgb)? {
            let base = material.base_color;
            let covered = |[tint, below]: [Vec4; 2]| {
                let sheen = sheen * tint.truncate();
                (base * below.truncate() * (1.0 - sheen.max_element()) + sheen).extend(below.w)
            };
            let uses = [Some(texture), material.base_color_texture];
            if let Some(baked) = self.baked(uses, ColorSpace::Srgb, covered)? {
                material.base_color = Vec3::ONE;
                material.base_color_texture = Some(baked);
                return Ok(());
            }
            sheen *= self.mean(texture).truncate();
        }
        let texture = material.base_color_texture;
        let mean = texture.map_or(Vec3::ONE, |t| self.mean(t).truncate()).max(Vec3::splat(1e-3));
        // Its mean is right; what varies is the base's.
        let below = material.base_color * (1.0 - sheen.max_element());
        material.base_color = (below + sheen / mean).min(Vec3::ONE / mean);
        Ok(())
    }

    pub(super) fn clearcoat(&mut self, material: &mut Material, json: &Clearcoat) -> Parsed<()> {
        let mut strength = json.clearcoat_factor.clamp(0.0, 1.0);
        if strength <= 0.0 {
            return Ok(());
        }
        if json.clearcoat_normal_texture.is_some() {
            self.scene
                .warn("normal maps of clear coats are left out: they are as even as what they cover".into());
        }
        let mut coat_roughness = json.clearcoat_roughness_factor.clamp(0.0, 1.0);
        let strengths = self.info(json.clearcoat_texture.as_ref(), ColorSpace::Linear)?;
        let widths = self.info(json.clearcoat_roughness_texture.as_ref(), ColorSpace::Linear)?;
        if strengths.is_some() || widths.is_some() {
            let coat = Coat { strength, roughness: coat_roughness };
            if self.textured_coat(material, &coat, [strengths, widths])? {
                return Ok(());
            }
            strength *= strengths.map_or(1.0, |t| self.mean(t).x);
            coat_roughness *= widths.map_or(1.0, |t| self.mean(t).y);
        }
        let Lobe { roughness, reflectance } = Coat { strength, roughness: coat_roughness }.over(material);
        material.roughness = roughness;
        material.specular = material.specular.max(strength);
        material.specular_color = reflectance / (DIELECTRIC * material.specular);
        Ok(())
    }

    /// A coat that textures say the strength and the roughness of. Whether it could be made part of the material.
    fn textured_coat(
        &mut self,
        material: &mut Material,
        coat: &Coat,
        [strengths, widths]: [Option<TextureRef>; 2],
    ) -> Parsed<bool> {
        if material.specular_texture.is_some() {
            self.scene.warn("textures of clear coats on surfaces of textured strength are averaged".into());
            return Ok(false);
        }
        let uses = [strengths, widths, material.metallic_roughness_texture, material.specular_color_texture];
        let specular = material.specular.max(coat.strength);
        // Nothing of it reflects more than this.
        let most = (DIELECTRIC * material.specular_color).min(Vec3::ONE) * material.specular
            + DIELECTRIC * coat.strength;
        let base = material.clone();
        let lobe = |[strength, width, surface, tint]: [Vec4; 4]| {
            let coat = Coat { strength: coat.strength * strength.x, roughness: coat.roughness * width.y };
            coat.over(&Material {
                roughness: base.roughness * surface.y,
                metallic: base.metallic * surface.z,
                specular_color: base.specular_color * tint.truncate(),
                ..Material { base_color: base.base_color, specular: base.specular, ..Material::default() }
            })
        };
        let roughness = |at: [Vec4; 4]| Vec4::new(1.0, lobe(at).roughness, at[2].z, 1.0);
        let Some(roughness) = self.baked(uses, ColorSpace::Linear, roughness)? else { return Ok(false) };
        let reflectance = |at: [Vec4; 4]| (lobe(at).reflectance / most).extend(1.0);
        material.specular_color_texture = self.baked(uses, ColorSpace::Srgb, reflectance)?;
        material.metallic_roughness_texture = Some(roughness);
        material.roughness = 1.0;
        material.specular = specular;
        material.specular_color = most / (DIELECTRIC * specular);
        Ok(true)
    }

    /// A texture that has everywhere what `value` makes of what these have there, 1 for those that are none. `None`, with a
    /// warning, where they do not lie on surfaces alike.
    fn baked<const N: usize>(
        &mut self,
        uses: [Option<TextureRef>; N],
        color_space: ColorSpace,
        value: impl Fn([Vec4; N]) -> Vec4,
    ) -> Parsed<Option<TextureRef>> {
        let there = || uses.iter().flatten();
        let Some(&first) = there().next() else { return Ok(None) };
        if there().any(|t| (t.uv_set, t.transform) != (first.uv_set, first.transform)) {
            self.scene
                .warn("textures of clear coats and sheen that lie otherwise than others are averaged".into());
            return Ok(None);
        }
        let textures = &self.scene.textures;
        let texture = |t: &TextureRef| &textures[t.texture as usize];
        let [width, height] =
            there().fold([1, 1], |[w, h], t| [w.max(texture(t).width), h.max(texture(t).height)]);
        let count = width as usize * height as usize;
        self.account_texels(count)?;
        let textures = &self.scene.textures;
        let size = Vec2::new(width as f32, height as f32);
        let texels = (0..count as u32).map(|i| {
            let at = (Vec2::new((i % width) as f32, (i / width) as f32) + 0.5) / size;
            let value = value(uses.map(|t| t.map_or(Vec4::ONE, |t| textures[t.texture as usize].sample(at))));
            let byte = |x: f32| (x.clamp(0.0, 1.0) * 255.0).round() as u8;
            let encode = |x: f32| match color_space {
                ColorSpace::Srgb => byte(srgb_encode(x.clamp(0.0, 1.0))),
                ColorSpace::Linear => byte(x),
            };
            [encode(value.x), encode(value.y), encode(value.z), byte(value.w)]
        });
        let texels = texels.collect();
        let Texture { wrap, filter, .. } = textures[first.texture as usize];
        let name = textures[first.texture as usize].name.clone();
        self.scene.textures.push(Texture { name, width, height, texels, color_space, wrap, filter });
        Ok(Some(TextureRef { texture: (self.scene.textures.len() - 1) as u32, ..first }))
    }

    fn mean(&self, texture: TextureRef) -> Vec4 {
        let texture = &self.scene.textures[texture.texture as usize];
        // Every texel of small ones, a few thousand of others.
        let step = (texture.texels.len() / 4096).max(1);
        let texels = (0..texture.texels.len()).step_by(step);
        let width = i64::from(texture.width);
        let (count, sum) = texels.fold((0.0, Vec4::ZERO), |(count, sum), i| {
            (count + 1.0, sum + texture.texel(i as i64 % width, i as i64 / width))
        });
        sum / f32::max(count, 1.0)
    }
}

/// A dielectric layer.
struct Coat {
    strength: f32,
    roughness: f32,
}

/// What a coat and what it covers are together.
struct Lobe {
    roughness: f32,
    /// Of the dielectric, at normal incidence.
    reflectance: Vec3,
}

impl Coat {
    fn over(&self, base: &Material) -> Lobe {
        let coat = DIELECTRIC * self.strength;
        let dielectric = (DIELECTRIC * base.specular_color).min(Vec3::ONE) * base.specular;
        // What the coat lets through and what it reflects itself.
        let below =
            dielectric.lerp(base.base_color, base.metallic).element_sum() / 3.0 * (1.0 - coat).powi(2);
        let alpha = |roughness: f32| roughness.clamp(0.0, 1.0).powi(2);
        let sum = below + coat;
        let mean = (alpha(base.roughness) * below + alpha(self.roughness) * coat) / sum;
        let roughness = if sum > 0.0 { mean.sqrt() } else { base.roughness };
        Lobe { roughness, reflectance: coat + dielectric * (1.0 - coat).powi(2) }
    }
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
