//! FLIP of radiance, and pictures of errors.

mod difference;

use super::{CompareOptions, relative_error, valid_pixels};
use girandole_core::Result;
use girandole_core::glam::Vec3;
use girandole_core::image::Image;
use girandole_core::tonemap::{srgb_decode, srgb_encode};

/// What a heat map shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HeatMap {
    /// The root of a pixel's (t − r)² / (r² + 0.01), mean over the channels: 0.1 is about 10 % off.
    #[default]
    Relative,
    /// FLIP, see [`Comparison::flip`](super::Comparison::flip).
    Flip,
}

/// A picture of where two pictures differ: black = equal, by violet, red and yellow (magma) to white = 1 or more.
/// The colours are linear Rec. 709, so a PNG of it shows magma as it is. Pixels that do not count are dark green,
/// those that are not finite cyan.
///
/// # Errors
/// [`girandole_core::Error::Invalid`] where sizes differ.
pub fn heat_map(reference: &Image, test: &Image, options: &CompareOptions, kind: HeatMap) -> Result<Image> {
    let valid = valid_pixels(reference, test, options)?;
    let errors: Vec<f32> = match kind {
        HeatMap::Flip => flip_map(reference, test, &valid),
        HeatMap::Relative => reference
            .pixels
            .iter()
            .zip(&test.pixels)
            .map(|(r, t)| relative_error(r.as_dvec3(), t.as_dvec3()).sqrt() as f32)
            .collect(),
    };
    let pixel = |i: usize| {
        if !valid[i] {
            return Vec3::new(0.0, 0.05, 0.0);
        }
        if !(reference.pixels[i].is_finite() && test.pixels[i].is_finite()) {
            return Vec3::new(0.0, 1.0, 1.0);
        }
        let colour = colorous::MAGMA.eval_continuous(f64::from(errors[i].clamp(0.0, 1.0)));
        Vec3::from([colour.r, colour.g, colour.b].map(|byte| srgb_decode(f32::from(byte) / 255.0)))
    };
    let pixels = (0..valid.len()).map(pixel).collect();
    Ok(Image { width: reference.width, height: reference.height, pixels })
}

/// Mean FLIP over the pixels that count.
pub fn mean(reference: &Image, test: &Image, valid: &[bool]) -> f64 {
    let map = flip_map(reference, test, valid);
    let errors = map.iter().zip(valid).filter(|(_, v)| **v).map(|(e, _)| f64::from(*e));
    errors.sum::<f64>() / valid.iter().filter(|&&v| v).count() as f64
}

/// The factor that brings 95 % of the reference's pixels below 0.8; 1 for a black picture.
fn exposure(reference: &Image, valid: &[bool]) -> f32 {
    let counted = reference.pixels.iter().zip(valid).filter(|(p, v)| **v && p.is_finite());
    let mut brightness: Vec<f32> = counted.map(|(p, _)| p.max_element()).collect();
    brightness.sort_by(f32::total_cmp);
    let at = (brightness.len() as f64 * 0.95) as usize;
    match brightness.get(at.min(brightness.len().saturating_sub(1))) {
        Some(&bright) if bright > 0.0 => 0.8 / bright,
        _ => 1.0,
    }
}

/// FLIP of every pixel. Pixels that do not count are the reference's in both pictures, so that their error is 0.
fn flip_map(reference: &Image, test: &Image, valid: &[bool]) -> Vec<f32> {
    if valid.is_empty() {
        return Vec::new();
    }
    let exposure = exposure(reference, valid);
    let encode = |p: Vec3| {
        // A NaN becomes 0 by the cast.
        let byte = |x: f32| (srgb_encode(x) * 255.0).round() as u8;
        Vec3::from((p * exposure).to_array().map(|x| f32::from(byte(x)) / 255.0))
    };
    let shown = |image: &Image| -> Vec<Vec3> {
        (0..valid.len())
            .map(|i| encode(if valid[i] { image.pixels[i] } else { reference.pixels[i] }))
            .collect()
    };
    let size = [reference.width, reference.height].map(|side| side as usize);
    difference::differences(&shown(reference), &shown(test), size)
}
