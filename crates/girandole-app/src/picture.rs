//! Pictures on their way to files.

use anyhow::{Context, Result, bail};
use girandole::DebugView;
use girandole_core::glam::Vec3;
use girandole_core::image::Image;
use girandole_core::tonemap::{self, Exposure, Tonemap};
use girandole_reference::Provenance;
use girandole_reference::image_file::{self, Pixels};
use std::path::Path;

/// Pixels that a picture, or a part that is rendered alone, may have: 3 GiB of them.
pub const MOST_PIXELS: u64 = 1 << 28;

/// How radiance becomes what is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shown {
    /// Scale before the tone curve.
    pub exposure: Exposure,
    /// The tone curve.
    pub tonemap: Tonemap,
}

impl Shown {
    /// As asked for; debug views are display colours already, but for the one that is drawn over the picture.
    pub fn new(exposure: Exposure, tonemap: Tonemap, debug: Option<DebugView>) -> Self {
        match debug {
            None | Some(DebugView::LightPositions) => Self { exposure, tonemap },
            Some(_) => Self { exposure: Exposure::Ev(0.0), tonemap: Tonemap::None },
        }
    }
}

/// Writes an .exr with radiance, or a .png as it is shown, either with alpha where the share of each pixel that
/// is covered is given, and with what it was made by. Returns the exposure in stops.
pub fn write(
    path: &Path,
    (radiance, coverage): (&Image, Option<&[f32]>),
    shown: Shown,
    made_by: &Provenance,
) -> Result<f32> {
    let broken = radiance.pixels.iter().filter(|p| !p.is_finite()).count();
    if broken > 0 {
        bail!(
            "{broken} of {} pixels are no numbers: light or lengths of the scene are beyond single precision; scale it, or dim its lights",
            radiance.pixels.len()
        );
    }
    let ev = shown.exposure.ev(radiance);
    let size = [radiance.width, radiance.height];
    let saved = if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
        image_file::write_exr_with(path, radiance, coverage, Some(made_by))
    } else {
        let bytes = display_bytes(radiance, coverage, (ev, shown.tonemap));
        let pixels = if coverage.is_some() { Pixels::Rgba(&bytes) } else { Pixels::Rgb(&bytes) };
        image_file::write_png_with(path, size, pixels, Some(made_by))
    };
    saved.context("the picture is rendered, but not saved")?;
    Ok(ev)
}

/// Three bytes a pixel, or four with alpha, by which colours are not multiplied.
fn display_bytes(radiance: &Image, coverage: Option<&[f32]>, (ev, curve): (f32, Tonemap)) -> Vec<u8> {
    let Some(coverage) = coverage else { return tonemap::to_srgb8(radiance, ev, curve) };
    let straight = |(p, c): (&Vec3, &f32)| if *c > 0.0 { *p / *c } else { Vec3::ZERO };
    let pixels = radiance.pixels.iter().zip(coverage).map(straight).collect();
    let colors = tonemap::to_srgb8(&Image { pixels, ..*radiance }, ev, curve);
    let with_alpha = |(rgb, c): (&[u8], &f32)| [rgb[0], rgb[1], rgb[2], (c * 255.0 + 0.5) as u8];
    colors.chunks(3).zip(coverage).flat_map(with_alpha).collect()
}
