//! Bevy's standard material in Girandole's terms.

use crate::units;
use bevy::asset::AssetId;
use bevy::color::{Alpha, Color};
use bevy::image::Image;
use bevy::material::AlphaMode;
use bevy::mesh::UvChannel;
use bevy::pbr::StandardMaterial;
use bevy::render::render_resource::Face;
use girandole_core::glam::Vec3;
use girandole_core::scene::{Material, NormalTexture, TextureRef};

/// Alpha below which Bevy's `AlphaToCoverage` is no surface, without the samples that it needs.
const COVERAGE_CUTOFF: f32 = 0.5;

/// A texture that a material asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Wanted {
    /// The image.
    pub image: AssetId<Image>,
    /// Whether its green channel is turned over.
    pub flips_green: bool,
}

/// Whether Girandole draws it: opaque, or with holes. What is blended or lets light through is left to Bevy.
pub fn is_taken(material: &StandardMaterial) -> bool {
    let is_opaque =
        matches!(material.alpha_mode, AlphaMode::Opaque | AlphaMode::Mask(_) | AlphaMode::AlphaToCoverage);
    is_opaque && material.specular_transmission <= 0.0
}

/// The material, with the textures that `texture` knows the index of; without its normal map where meshes have no tangents.
///
/// # Errors
/// What `texture` returns, of the first texture that is not there.
pub fn convert<E>(
    material: &StandardMaterial,
    has_tangents: bool,
    exposure: f32,
    mut texture: impl FnMut(Wanted) -> Result<u32, E>,
) -> Result<Material, E> {
    let transform = units::affine2(&material.uv_transform);
    let mut reference = |handle: Option<AssetId<Image>>, channel: &UvChannel, flips_green| {
        let wanted = handle.map(|image| texture(Wanted { image, flips_green })).transpose()?;
        let uv_set = u32::from(matches!(channel, UvChannel::Uv1));
        Ok(wanted.map(|index| TextureRef { uv_set, transform, ..TextureRef::new(index) }))
    };
    let id = |handle: &Option<bevy::asset::Handle<Image>>| handle.as_ref().map(|handle| handle.id());
    let normal_map = id(&material.normal_map_texture).filter(|_| has_tangents);
    let (specular, specular_color) = specular(material.reflectance, material.specular_tint);
    let base_color = units::rgb(material.base_color.to_linear());
    Ok(Material {
        name: String::new(),
        // Bevy shows what is unlit as it is, whatever the exposure.
        base_color: if material.unlit { base_color / exposure.max(f32::MIN_POSITIVE) } else { base_color },
        vertex_colors: true,
        alpha: material.base_color.alpha(),
        base_color_texture: reference(id(&material.base_color_texture), &material.base_color_channel, false)?,
        metallic: material.metallic.clamp(0.0, 1.0),
        roughness: material.perceptual_roughness.clamp(LEAST_ROUGHNESS, 1.0),
        metallic_roughness_texture: reference(
            id(&material.metallic_roughness_texture),
            &material.metallic_roughness_channel,
            false,
        )?,
        specular,
        specular_color,
        normal_texture: reference(normal_map, &material.normal_map_channel, material.flip_normal_map_y)?
            .map(|texture| NormalTexture { texture, scale: 1.0 }),
        emission: units::emission(material.emissive, material.emissive_exposure_weight, exposure),
        emission_texture: reference(id(&material.emissive_texture), &material.emissive_channel, false)?,
        alpha_cutoff: match material.alpha_mode {
            AlphaMode::Mask(cutoff) => Some(cutoff),
            AlphaMode::AlphaToCoverage => Some(COVERAGE_CUTOFF),
            _ => None,
        },
        double_sided: material.double_sided || material.cull_mode.is_none(),
        unlit: material.unlit,
        ..Material::default()
    })
}

/// Bevy's shaders go no lower.
const LEAST_ROUGHNESS: f32 = 0.089;

/// Strength and tint of the dielectric lobe: Bevy reflects 0.16 · reflectance² head on, glTF 0.04 · strength · tint.
fn specular(reflectance: f32, tint: Color) -> (f32, Vec3) {
    let share = 4.0 * reflectance.clamp(0.0, 1.0).powi(2);
    let strength = share.min(1.0);
    let tint = units::rgb(tint.to_linear());
    (strength, if strength > 0.0 { tint * (share / strength) } else { tint })
}

/// Sentences about what of it is left out.
pub fn left_out(material: &StandardMaterial) -> impl Iterator<Item = &'static str> {
    let sentences = [
        (material.clearcoat > 0.0, "a StandardMaterial's clearcoat is left out; lower its roughness instead"),
        (
            material.anisotropy_strength > 0.0,
            "a StandardMaterial's anisotropy is left out; its highlights are round",
        ),
        (
            material.diffuse_transmission > 0.0,
            "a StandardMaterial's diffuse transmission is left out; it is opaque",
        ),
        (material.depth_map.is_some(), "a StandardMaterial's parallax map is left out; use a normal map"),
        (
            material.cull_mode == Some(Face::Front),
            "a StandardMaterial that culls its fronts is drawn from the front; turn its mesh inside out instead",
        ),
        (
            matches!(material.alpha_mode, AlphaMode::AlphaToCoverage),
            "AlphaMode::AlphaToCoverage needs Msaa, which is off; it is taken for AlphaMode::Mask(0.5)",
        ),
    ];
    sentences.into_iter().filter(|(applies, _)| *applies).map(|(_, sentence)| sentence)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::asset::{Handle, uuid::Uuid};
    use bevy::color::LinearRgba;
    use bevy::math::{Affine2, Vec2};

    fn plain(material: &StandardMaterial) -> Material {
        convert(material, true, 1.0, |_| Err(())).unwrap()
    }

    fn handle(number: u128) -> Option<Handle<Image>> {
        Some(Handle::Uuid(Uuid::from_u128(number), std::marker::PhantomData))
    }

    #[test]
    fn factors_keep_their_meaning() {
        let material = plain(&StandardMaterial {
            base_color: Color::linear_rgba(0.2, 0.4, 0.6, 0.9),
            metallic: 0.25,
            perceptual_roughness: 0.7,
            emissive: LinearRgba::rgb(3.0, 2.0, 1.0),
            ..Default::default()
        });
        assert!(material.base_color.abs_diff_eq(Vec3::new(0.2, 0.4, 0.6), 1e-6));
        assert_eq!((material.metallic, material.roughness, material.alpha), (0.25, 0.7, 0.9));
        assert_eq!(material.emission, Vec3::new(3.0, 2.0, 1.0));
        assert_eq!((material.alpha_cutoff, material.double_sided, material.unlit), (None, false, false));
    }

    #[test]
    fn reflectance_keeps_what_is_reflected_head_on() {
        for reflectance in [0.0, 0.35, 0.5, 0.8, 1.0] {
            let (strength, tint) = specular(reflectance, Color::WHITE);
            assert!((0.0..=1.0).contains(&strength));
            let (ours, bevys) = (0.04 * strength * tint.x, 0.16 * reflectance * reflectance);
            assert!((ours - bevys).abs() < 1e-6, "{reflectance}: {ours} {bevys}");
        }
    }

    #[test]
    fn what_is_unlit_looks_the_same_at_any_exposure() {
        let unlit = StandardMaterial {
            unlit: true,
            base_color: Color::linear_rgb(0.5, 0.5, 0.5),
            ..Default::default()
        };
        let material = convert(&unlit, true, 0.001, |_| Err(())).unwrap();
        assert!((material.base_color.x * 0.001 - 0.5).abs() < 1e-6 && material.unlit);
    }

    #[test]
    fn textures_go_to_their_places() {
        let material = StandardMaterial {
            base_color_texture: handle(1),
            metallic_roughness_texture: handle(2),
            normal_map_texture: handle(3),
            emissive_texture: handle(4),
            emissive_channel: UvChannel::Uv1,
            flip_normal_map_y: true,
            uv_transform: Affine2::from_scale(Vec2::new(2.0, 3.0)),
            ..Default::default()
        };
        let number = |wanted: Wanted| match wanted.image {
            AssetId::Uuid { uuid } => {
                Ok::<u32, ()>(uuid.as_u128() as u32 + 10 * u32::from(wanted.flips_green))
            }
            AssetId::Index { .. } => Err(()),
        };
        let taken = convert(&material, true, 1.0, number).unwrap();
        let index = |reference: Option<TextureRef>| reference.map(|r| (r.texture, r.uv_set));
        assert_eq!(index(taken.base_color_texture), Some((1, 0)));
        assert_eq!(index(taken.metallic_roughness_texture), Some((2, 0)));
        assert_eq!(index(taken.normal_texture.map(|n| n.texture)), Some((13, 0)));
        assert_eq!(index(taken.emission_texture), Some((4, 1)));
        let uv = taken.base_color_texture.unwrap().transform.transform_point2((1.0, 1.0).into());
        assert_eq!(uv.to_array(), [2.0, 3.0]);
        assert!(convert(&material, false, 1.0, number).unwrap().normal_texture.is_none());
        assert!(convert(&material, true, 1.0, |_| Err(())).is_err());
    }

    #[test]
    fn holes_are_taken_and_glass_is_left_to_bevy() {
        let with = |alpha_mode| StandardMaterial { alpha_mode, ..Default::default() };
        assert!(is_taken(&with(AlphaMode::Opaque)) && is_taken(&with(AlphaMode::Mask(0.3))));
        assert!(!is_taken(&with(AlphaMode::Blend)) && !is_taken(&with(AlphaMode::Add)));
        assert!(!is_taken(&StandardMaterial { specular_transmission: 0.5, ..Default::default() }));
        assert_eq!(plain(&with(AlphaMode::Mask(0.3))).alpha_cutoff, Some(0.3));
        assert!(plain(&StandardMaterial { cull_mode: None, ..Default::default() }).double_sided);
    }

    #[test]
    fn what_is_left_out_is_said() {
        assert_eq!(left_out(&StandardMaterial::default()).count(), 0);
        let coated = StandardMaterial { clearcoat: 1.0, ..Default::default() };
        assert!(left_out(&coated).all(|sentence| sentence.contains("clearcoat")));
        assert_eq!(left_out(&coated).count(), 1);
    }
}
