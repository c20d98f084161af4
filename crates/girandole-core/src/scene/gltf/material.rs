//! Materials: metallic-roughness with `KHR_materials_specular` and `KHR_materials_emissive_strength`; others make them into such,
//! see `material_extensions`.

use super::{Importer, Parsed};
use crate::scene::{ColorSpace, Material, MaterialId, NormalTexture, TextureRef};
use glam::Vec3;
use gltf::json;
use gltf::json::extensions::texture::TextureTransform;
use gltf::json::material::AlphaMode;
use gltf::json::validation::Checked;

/// Brighter than this, W/(sr·m²), is a mistake, and sums would leave the range of single precision.
const MAX_EMISSION: f32 = 1e12;

/// From this alpha on surfaces count as opaque.
pub(super) const OPAQUE: f32 = 0.995;
/// A blended texture is cut off where alpha is 0.5 if no more of it than this lies between.
const MOST_BETWEEN: f32 = 0.1;

impl Importer<'_> {
    /// Reads all materials, so that indices stay the file's.
    pub(super) fn read_materials(&mut self) -> Parsed<()> {
        for (index, json) in self.document.root.materials.iter().enumerate() {
            let material = self.material(json, index)?;
            self.scene.add_material(material);
        }
        Ok(())
    }

    /// The material of a primitive that names none.
    pub(super) fn default_material(&mut self) -> MaterialId {
        if let Some(known) = self.default_material {
            return known;
        }
        let material = Material {
            name: "default".into(),
            base_color: Vec3::ONE,
            metallic: 1.0,
            specular: 1.0,
            ..Material::default()
        };
        let index = self.scene.add_material(material);
        self.default_material = Some(index);
        index
    }

    /// What is broken of a material is left out.
    fn material(&mut self, json: &json::Material, index: usize) -> Parsed<Material> {
        let name = || match &json.name {
            Some(name) => format!("of material `{name}`"),
            None => format!("of material {index}"),
        };
        let pbr = &json.pbr_metallic_roughness;
        let [r, g, b, alpha] = pbr.base_color_factor.0.map(|c| c.clamp(0.0, 1.0));
        let extensions = json.extensions.as_ref();
        for name in extensions.iter().flat_map(|e| e.others.keys()) {
            self.meet_extension(name);
        }
        if json.occlusion_texture.is_some() {
            self.scene.warn("occlusion textures are left out: occlusion is computed here".into());
        }
        let strength =
            extensions.and_then(|e| e.emissive_strength.as_ref()).map_or(1.0, |s| s.emissive_strength.0);
        let emission = emission(Vec3::from(json.emissive_factor.0) * strength);
        let emission = self.or_without("emission", name, emission)?.unwrap_or_default();
        let mut material = Material {
            name: json.name.clone().unwrap_or_default(),
            base_color: Vec3::new(r, g, b),
            alpha,
            base_color_texture: self.info(pbr.base_color_texture.as_ref(), ColorSpace::Srgb)?,
            metallic: pbr.metallic_factor.0.clamp(0.0, 1.0),
            roughness: pbr.roughness_factor.0.clamp(0.0, 1.0),
            metallic_roughness_texture: self
                .info(pbr.metallic_roughness_texture.as_ref(), ColorSpace::Linear)?,
            specular: 1.0,
            emission,
            emission_texture: self.info(json.emissive_texture.as_ref(), ColorSpace::Srgb)?,
            double_sided: json.double_sided,
            ..Material::default()
        };
        if let Some(specular) = extensions.and_then(|e| e.specular.as_ref()) {
            material.specular = specular.specular_factor.0.clamp(0.0, 1.0);
            let tint = specular_color(Vec3::from(specular.specular_color_factor.0));
            material.specular_color = self.or_without("specular colour", name, tint)?.unwrap_or(Vec3::ONE);
            material.specular_texture = self.info(specular.specular_texture.as_ref(), ColorSpace::Linear)?;
            material.specular_color_texture =
                self.info(specular.specular_color_texture.as_ref(), ColorSpace::Srgb)?;
        }
        if let Some(normal) = &json.normal_texture {
            let others = normal.extensions.as_ref().map(|e| &e.others);
            let transform = others
                .and_then(|o| o.get("KHR_texture_transform"))
                .map(|v| json::deserialize::from_value::<TextureTransform>(v.clone()))
                .transpose()
                .map_err(|e| {
                    format!("its normal map's KHR_texture_transform is broken ({e}); export it again")
                });
            let transform = self.or_without("texture transform", name, transform)?.flatten();
            let texture = self.texture_ref(
                normal.index.value(),
                normal.tex_coord,
                transform.as_ref(),
                ColorSpace::Linear,
            )?;
            let scale = normal.scale.clamp(-1e3, 1e3);
            material.normal_texture = texture.map(|texture| NormalTexture { texture, scale });
        }
        if let Some(extensions) = extensions {
            let plain = material.clone();
            let extended = self.extend(&mut material, &extensions.others);
            if self.or_without("extension", name, extended)?.is_none() {
                material = plain;
            }
        }
        self.see_through(json, &mut material);
        Ok(material)
    }

    pub(super) fn info(
        &mut self,
        info: Option<&json::texture::Info>,
        color_space: ColorSpace,
    ) -> Parsed<Option<TextureRef>> {
        let Some(info) = info else { return Ok(None) };
        let transform = info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref());
        self.texture_ref(info.index.value(), info.tex_coord, transform, color_space)
    }

    /// What its alpha makes of a material, if anything of it is cut away or seen through at all: opaque surfaces are much cheaper
    /// to draw, and they cast shadows.
    fn see_through(&mut self, json: &json::Material, material: &mut Material) {
        let texture = material.base_color_texture.map(|t| t.texture);
        let Alphas { least, between } = texture.map_or(Alphas::OPAQUE, |t| self.alphas(t));
        let least = material.alpha * f32::from(least) / 255.0;
        match json.alpha_mode {
            Checked::Valid(AlphaMode::Mask) => {
                let cutoff = json.alpha_cutoff.map_or(0.5, |c| c.0.clamp(0.0, 2.0));
                material.alpha_cutoff = (least < cutoff).then_some(cutoff);
            }
            // Leaves and grids, whose shadows matter.
            Checked::Valid(AlphaMode::Blend) if material.alpha >= OPAQUE && between <= MOST_BETWEEN => {
                material.alpha_cutoff = (least < 0.5).then_some(0.5);
            }
            Checked::Valid(AlphaMode::Blend) if least < OPAQUE => {
                material.blended = true;
                material.emission *= material.alpha;
            }
            _ => {}
        }
    }

    fn alphas(&mut self, texture: u32) -> Alphas {
        let texels = &self.scene.textures[texture as usize].texels;
        *self.alphas.entry(texture).or_insert_with(|| Alphas::of(texels))
    }
}

fn emission(emission: Vec3) -> Parsed<Vec3> {
    if emission.is_finite() && emission.min_element() >= 0.0 && emission.max_element() <= MAX_EMISSION {
        return Ok(emission);
    }
    Err(format!(
        "it emits {emission} W/(sr·m²); emission must lie between 0 and {MAX_EMISSION:e}, correct it"
    ))
}

fn specular_color(tint: Vec3) -> Parsed<Vec3> {
    if tint.is_finite() && tint.min_element() >= 0.0 {
        return Ok(tint.min(Vec3::splat(f32::MAX.sqrt())));
    }
    Err("its specular colour is negative or infinite; correct it".into())
}

/// What textures are made of.
#[derive(Clone, Copy)]
pub(super) struct Alphas {
    least: u8,
    /// Share of the texels that are neither there nor not.
    between: f32,
}

impl Alphas {
    const OPAQUE: Self = Self { least: 255, between: 0.0 };

    fn of(texels: &[[u8; 4]]) -> Self {
        let between = texels.iter().filter(|[.., a]| (26..230).contains(a)).count();
        Self {
            least: texels.iter().map(|t| t[3]).min().unwrap_or(255),
            between: between as f32 / texels.len().max(1) as f32,
        }
    }
}
