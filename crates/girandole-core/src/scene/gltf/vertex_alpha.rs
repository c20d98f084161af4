//! The alpha of vertices' colours, which multiplies that of their material where alpha counts at all. Where it is the same all over
//! a primitive, the primitive gets a material of that alpha; where it varies, one whose base colour texture is a ramp of alpha,
//! by texture coordinates that run along it.

use super::material::OPAQUE;
use super::mesh::Part;
use super::{Importer, Parsed};
use crate::scene::{ColorSpace, Filter, MaterialId, Texture, TextureRef, Wrap};
use glam::{Affine2, Vec2};
use gltf::json::material::AlphaMode;
use gltf::json::validation::Checked;

/// Texels of the ramp, one for each alpha.
const RAMP: u32 = 256;

/// What becomes of a material's alpha.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Fading {
    /// It is multiplied by the number of these bits.
    Even(u32),
    /// It is multiplied by a ramp, by this set of texture coordinates.
    Ramp(u32),
}

impl Importer<'_> {
    /// The material of a part whose vertices have these alphas, instead of that one.
    pub(super) fn faded(
        &mut self,
        material: MaterialId,
        part: &mut Part,
        alphas: &[f32],
    ) -> Parsed<MaterialId> {
        let (least, most) =
            alphas.iter().fold((1.0_f32, 0.0_f32), |(low, high), &a| (low.min(a), high.max(a)));
        let json = self.document.root.materials.get(material.index());
        let mode = json.map_or(AlphaMode::Opaque, |json| match json.alpha_mode {
            Checked::Valid(mode) => mode,
            Checked::Invalid => AlphaMode::Opaque,
        });
        if alphas.is_empty() || least >= OPAQUE || mode == AlphaMode::Opaque {
            return Ok(material);
        }
        let mean = alphas.iter().sum::<f32>() / alphas.len() as f32;
        let base = &self.scene.materials[material];
        let free = (0..2).find(|&set| base.textures().all(|texture| texture.uv_set != set));
        let fading = match free {
            _ if most - least < 1.0 / 512.0 => Fading::Even(mean.to_bits()),
            Some(set) if base.base_color_texture.is_none() => Fading::Ramp(set),
            _ => {
                self.scene.warn(
                    "alpha that varies over vertices of textured surfaces is averaged: paint it into the texture"
                        .into(),
                );
                Fading::Even(mean.to_bits())
            }
        };
        if let Fading::Ramp(set) = fading {
            part.uvs.resize(part.positions.len(), [Vec2::ZERO; 2]);
            for (uv, alpha) in part.uvs.iter_mut().zip(alphas) {
                // From the middle of the first texel to that of the last.
                uv[set as usize] = Vec2::new((alpha * (RAMP - 1) as f32 + 0.5) / RAMP as f32, 0.5);
            }
        }
        if let Some(&known) = self.faded.get(&(material, fading)) {
            return Ok(known);
        }
        let cutoff = json.and_then(|json| json.alpha_cutoff).map_or(0.5, |c| c.0.clamp(0.0, 2.0));
        let mut result = self.scene.materials[material].clone();
        match fading {
            Fading::Even(bits) => result.alpha *= f32::from_bits(bits),
            Fading::Ramp(uv_set) => {
                let texture = self.ramp()?;
                result.base_color_texture =
                    Some(TextureRef { texture, uv_set, transform: Affine2::IDENTITY });
            }
        }
        if mode == AlphaMode::Mask {
            result.alpha_cutoff = Some(cutoff);
        } else {
            result.alpha_cutoff = None;
            result.blended = true;
            result.emission *= mean;
        }
        let index = self.scene.add_material(result);
        self.faded.insert((material, fading), index);
        Ok(index)
    }

    /// White, with all alphas from 0 to 1.
    fn ramp(&mut self) -> Parsed<u32> {
        if let Some(known) = self.ramp {
            return Ok(known);
        }
        self.account_texels(RAMP as usize)?;
        self.scene.textures.push(Texture {
            name: "alpha of vertices".into(),
            width: RAMP,
            height: 1,
            texels: (0..=255).map(|alpha| [255, 255, 255, alpha]).collect(),
            color_space: ColorSpace::Srgb,
            wrap: [Wrap::Clamp; 2],
            filter: Filter::Linear,
        });
        let index = (self.scene.textures.len() - 1) as u32;
        self.ramp = Some(index);
        Ok(index)
    }
}
