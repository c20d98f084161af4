//! Pictures on their way to files.

use anyhow::{Context, Result, bail};
use girandole::DebugView;
use girandole_core::image::Image;
use girandole_core::tonemap::{self, Exposure, Tonemap};
use girandole_reference::image_file;
use std::path::Path;

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

/// Writes an .exr with radiance, or a .png as it is shown. Returns the exposure in stops.
pub fn write(path: &Path, radiance: &Image, shown: Shown) -> Result<f32> {
    let broken = radiance.pixels.iter().filter(|p| !p.is_finite()).count();
    if broken > 0 {
        bail!(
            "{broken} of {} pixels are no numbers: light or lengths of the scene are beyond single precision; scale it, or dim its lights",
            radiance.pixels.len()
        );
    }
    let ev = shown.exposure.ev(radiance);
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
        image_file::write_exr(path, radiance)?;
    } else {
        let bytes = tonemap::to_srgb8(radiance, ev, shown.tonemap);
        image_file::write_png(path, radiance.width, radiance.height, &bytes)
            .context("the picture is rendered, but not saved")?;
    }
    Ok(ev)
}
