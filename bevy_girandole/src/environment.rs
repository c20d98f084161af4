//! Cube maps as Girandole's environment.

use bevy::image::Image;
use bevy::math::Quat;
use bevy::render::render_resource::{TextureDataOrder, TextureFormat};
use girandole_core::glam::{self, Vec3};
use girandole_core::image;
use girandole_core::scene::{Environment, EnvironmentMap};
use half::f16;
use std::f32::consts::{PI, TAU};
use std::sync::Arc;

/// Rows of the picture of all directions at most: finer detail than that lights nothing.
const MOST_ROWS: u32 = 512;
/// The same at least: faces of one texel have edges, too.
const LEAST_ROWS: u32 = 32;

/// The largest level of six faces.
struct Cube {
    side: u32,
    /// +X, −X, +Y, −Y, +Z, −Z, rows from the top.
    faces: [Vec<Vec3>; 6],
}

/// Light from all around: a cube map times `nits`, turned as Bevy turns it. Bevy draws what is seen behind the scene.
///
/// # Errors
/// The second half of a sentence about a cube map that cannot be taken.
pub fn convert(image: &Image, nits: f32, rotation: Quat) -> Result<Environment, String> {
    let cube = Cube::new(image)?;
    let height = cube.side.saturating_mul(2).clamp(LEAST_ROWS, MOST_ROWS);
    let width = height * 2;
    let from_world = rotation.inverse();
    let radiance = |column: f32, row: f32| {
        let (longitude, polar) = (column / width as f32 * TAU - PI, row / height as f32 * PI);
        let (x, y, z) = (longitude.sin() * polar.sin(), polar.cos(), -longitude.cos() * polar.sin());
        let turned = from_world * bevy::math::Vec3::new(x, y, z);
        // Cube maps are left-handed.
        cube.sample(glam::vec3(turned.x, turned.y, -turned.z))
    };
    // As many samples along a pixel as it has texels, lest a sun between two of them be lost.
    let each = cube.side.saturating_mul(2).div_ceil(height);
    let mut picture = image::Image::new(width, height);
    for (pixel, at) in picture.pixels.iter_mut().zip(0..) {
        let place = |start: u32, i: u32| start as f32 + (i as f32 + 0.5) / each as f32;
        let all =
            (0..each * each).map(|i| radiance(place(at % width, i % each), place(at / width, i / each)));
        *pixel = all.sum::<Vec3>() / (each * each) as f32;
    }
    let map = EnvironmentMap::new(picture).map_err(|error| error.to_string())?;
    let strength = if nits.is_finite() { nits.max(0.0) } else { 0.0 };
    Ok(Environment { map: Arc::new(map), strength, rotation: 0.0, visible: false })
}

impl Cube {
    fn new(image: &Image) -> Result<Self, String> {
        let descriptor = &image.texture_descriptor;
        let (side, layers) = (image.width(), descriptor.size.depth_or_array_layers);
        if layers != 6 || image.height() != side || side == 0 {
            return Err(
                "is no cube map of six square faces; call Image::reinterpret_stacked_2d_as_array on it"
                    .into(),
            );
        }
        let data = image
            .data
            .as_deref()
            .ok_or("has left the main world; load it with RenderAssetUsages::default()")?;
        let format = descriptor.format;
        let bytes = match format {
            TextureFormat::Rgba32Float => 16,
            TextureFormat::Rgba16Float => 8,
            TextureFormat::Rgb9e5Ufloat | TextureFormat::Rgba8Unorm | TextureFormat::Rgba8UnormSrgb => 4,
            _ => return Err(format!("has the format {format:?}; convert it to Rgba16Float")),
        };
        let level = |level: u32| (side >> level).max(1) as usize;
        let texels = |levels: std::ops::Range<u32>| levels.map(|l| level(l) * level(l)).sum::<usize>();
        // From one face to the next.
        let stride = match image.data_order {
            TextureDataOrder::MipMajor => texels(0..1),
            TextureDataOrder::LayerMajor => texels(0..descriptor.mip_level_count),
        };
        let count = texels(0..1);
        if data.len() < (5 * stride + count) * bytes {
            return Err("has fewer texels than six faces; fill it".into());
        }
        let faces = std::array::from_fn(|face| {
            let start = face * stride * bytes;
            data[start..start + count * bytes].chunks_exact(bytes).map(|t| decode(t, format)).collect()
        });
        Ok(Self { side, faces })
    }

    /// Bilinear within a face, in the directions of the cube map.
    fn sample(&self, direction: Vec3) -> Vec3 {
        let Vec3 { x, y, z } = direction;
        let a = direction.abs();
        let (face, major, u, v) = if a.x >= a.y && a.x >= a.z {
            if x > 0.0 { (0, a.x, -z, -y) } else { (1, a.x, z, -y) }
        } else if a.y >= a.z {
            if y > 0.0 { (2, a.y, x, z) } else { (3, a.y, x, -z) }
        } else if z > 0.0 {
            (4, a.z, x, -y)
        } else {
            (5, a.z, -x, -y)
        };
        let last = (self.side - 1) as f32;
        let place = |c: f32| ((c / major + 1.0) * 0.5 * self.side as f32 - 0.5).clamp(0.0, last);
        let (u, v) = (place(u), place(v));
        let texel = |x: f32, y: f32| {
            self.faces[face][y.min(last) as usize * self.side as usize + x.min(last) as usize]
        };
        let (x, y) = (u.floor(), v.floor());
        let row = |y: f32| texel(x, y).lerp(texel(x + 1.0, y), u - x);
        row(y).lerp(row(y + 1.0), v - y)
    }
}

/// Linear RGB; what is no light is dark.
fn decode(texel: &[u8], format: TextureFormat) -> Vec3 {
    let value: [f32; 3] = match format {
        TextureFormat::Rgba32Float => {
            std::array::from_fn(|i| f32::from_le_bytes(std::array::from_fn(|byte| texel[i * 4 + byte])))
        }
        TextureFormat::Rgba16Float => {
            std::array::from_fn(|i| f16::from_le_bytes([texel[i * 2], texel[i * 2 + 1]]).to_f32())
        }
        TextureFormat::Rgb9e5Ufloat => {
            let bits = u32::from_le_bytes(std::array::from_fn(|byte| texel[byte]));
            let scale = ((bits >> 27) as f32 - 15.0 - 9.0).exp2();
            std::array::from_fn(|i| ((bits >> (9 * i)) & 511) as f32 * scale)
        }
        TextureFormat::Rgba8UnormSrgb => {
            std::array::from_fn(|i| girandole_core::tonemap::srgb_decode(f32::from(texel[i]) / 255.0))
        }
        _ => std::array::from_fn(|i| f32::from(texel[i]) / 255.0),
    };
    Vec3::from(value.map(|v| if v.is_finite() { v.max(0.0) } else { 0.0 }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::asset::RenderAssetUsages;
    use bevy::render::render_resource::{Extent3d, TextureDimension};

    /// One texel a face: red +X, green −X, blue +Y, yellow −Y, cyan +Z, white −Z.
    fn cube() -> Image {
        let colors = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [0, 1, 1], [1, 1, 1]];
        let texel = |[r, g, b]: [u8; 3]| [r, g, b, 1].map(|c| f16::from_f32(f32::from(c)).to_le_bytes());
        let data = colors.into_iter().flat_map(texel).flatten().collect();
        let size = Extent3d { width: 1, height: 1, depth_or_array_layers: 6 };
        let (dimension, usage) = (TextureDimension::D2, RenderAssetUsages::default());
        Image::new(size, dimension, data, TextureFormat::Rgba16Float, usage)
    }

    #[test]
    fn faces_are_where_bevy_samples_them() {
        let environment = convert(&cube(), 5.0, Quat::IDENTITY).unwrap();
        assert!(!environment.visible);
        let seen = |d: Vec3| environment.radiance(d) / 5.0;
        // Bevy turns z around before it samples: the face of +Z is ahead, towards −Z.
        for (direction, color) in [
            (Vec3::X, [1.0, 0.0, 0.0]),
            (Vec3::NEG_X, [0.0, 1.0, 0.0]),
            (Vec3::Y, [0.0, 0.0, 1.0]),
            (Vec3::NEG_Y, [1.0, 1.0, 0.0]),
            (Vec3::NEG_Z, [0.0, 1.0, 1.0]),
            (Vec3::Z, [1.0, 1.0, 1.0]),
        ] {
            assert!(seen(direction).abs_diff_eq(color.into(), 1e-3), "{direction}: {}", seen(direction));
        }
    }

    #[test]
    fn a_turned_map_turns_in_the_world() {
        // A quarter turn about +Y takes what is at +X to −Z.
        let environment = convert(&cube(), 1.0, Quat::from_rotation_y(PI / 2.0)).unwrap();
        assert!(environment.radiance(Vec3::NEG_Z).abs_diff_eq(Vec3::X, 1e-3));
    }

    #[test]
    fn shared_exponents_are_decoded() {
        // 256 · 2^(16 − 24) = 1 in red, half of it in blue.
        let bits: u32 = 256 | (128 << 18) | (16 << 27);
        assert_eq!(decode(&bits.to_le_bytes(), TextureFormat::Rgb9e5Ufloat), Vec3::new(1.0, 0.0, 0.5));
    }

    #[test]
    fn flat_pictures_are_refused_with_a_sentence() {
        let mut flat = cube();
        flat.texture_descriptor.size.depth_or_array_layers = 1;
        assert!(convert(&flat, 1.0, Quat::IDENTITY).unwrap_err().contains("cube map"));
    }
}
