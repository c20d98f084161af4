//! Radiance in eight bytes, as the picture is stored (shaders: lib/packed.wgsl).

use girandole_core::glam::Vec3;

/// From the two words of a pixel.
pub(crate) fn unpack_radiance([low, high]: [u32; 2]) -> Vec3 {
    let q = [low & 0x3ffff, low >> 18 | (high & 15) << 14, high >> 4 & 0x3ffff];
    let scale = f32::from_bits((high >> 22 & 0xff).saturating_sub(17) << 23);
    Vec3::from_array(q.map(|q| q as f32)) * scale
}
