//! Settings of a frame that are out of range.

use crate::points::multipass_plan::MAX_LIGHTS_PER_PASS;
use crate::settings::{DebugView, Mode, RenderSettings, Shading};
use crate::{Error, Remedy, Result};
use girandole_core::lights::Clamp;
use girandole_core::tonemap::Exposure;

/// Exposures beyond this many stops leave the range of floats.
const MAX_EV: f32 = 64.0;

/// Refuses settings out of range.
pub(crate) fn check(
    size: [u32; 2],
    settings: &RenderSettings,
    lights: u32,
    limits: &wgpu::Limits,
) -> Result<()> {
    let largest = limits.max_texture_dimension_2d;
    if size.contains(&0) || size.iter().any(|&s| s > largest) {
        let what = format!("a picture of {} × {} pixels is not possible here", size[0], size[1]);
        return Err(Error::too_large(what, Remedy::PictureSize { to: largest }));
    }
    if let Some(region) = settings.region
        && !region.is_in(size)
    {
        return Err(Error::invalid(format!(
            "the part {region} does not lie in a picture of {} × {} pixels",
            size[0], size[1]
        )));
    }
    if settings.region.is_some() && settings.debug.is_some() {
        return Err(Error::invalid("a debug view has no parts; leave the part out"));
    }
    if !(1..=16).contains(&settings.samples_per_axis) {
        return Err(Error::invalid(format!(
            "{} samples per axis are not possible; take 1 to 16",
            settings.samples_per_axis
        )));
    }
    if settings.mirrors > 16 {
        return Err(Error::invalid(format!(
            "{} mirrored rays one after another are not possible; take 0 to 16",
            settings.mirrors
        )));
    }
    match settings.debug {
        None | Some(DebugView::LightPositions | DebugView::Atlas) => {}
        Some(_) if settings.mode == Mode::Naive => {
            return Err(Error::invalid(
                "the naive mode has no receivers and levels to show; choose another mode",
            ));
        }
        Some(DebugView::States(Some(light))) if light >= lights => {
            return Err(Error::invalid(format!(
                "there is no light {light}; the last one is {}",
                lights.saturating_sub(1)
            )));
        }
        Some(_) => {}
    }
    if let Shading::Multipass { lights_per_pass } = settings.shading {
        if !(1..=MAX_LIGHTS_PER_PASS).contains(&lights_per_pass) {
            return Err(Error::invalid(format!(
                "{lights_per_pass} lights a pass are not possible; take 1 to {MAX_LIGHTS_PER_PASS}"
            )));
        }
        if settings.mode == Mode::Naive {
            return Err(Error::invalid("the naive mode has no passes; choose another mode or fused shading"));
        }
    }
    if settings.mode == Mode::Naive && settings.light_maps == Some(true) {
        return Err(Error::invalid(
            "the naive mode has no light maps; choose another mode or leave them out",
        ));
    }
    if !settings.tolerance.is_finite() || settings.tolerance < 0.0 {
        return Err(Error::invalid("the tolerance of interpolation has to be 0 or positive"));
    }
    if let Clamp::At(bound) = settings.clamp
        && !(bound.is_finite() && bound > 0.0)
    {
        return Err(Error::invalid(
            "the bound on the geometric factor has to be positive; `Clamp::Off` is no bound",
        ));
    }
    Ok(())
}

/// Refuses what cannot be shown on.
pub(crate) fn check_display(exposure: Exposure, format: wgpu::TextureFormat) -> Result<()> {
    if let Exposure::Ev(ev) = exposure
        && (ev.is_nan() || ev.abs() > MAX_EV)
    {
        return Err(Error::invalid(format!(
            "an exposure of {ev} stops is not possible; take -{MAX_EV} to {MAX_EV}"
        )));
    }
    let is_color = format.has_color_aspect()
        && matches!(format.sample_type(None, None), Some(wgpu::TextureSampleType::Float { .. }));
    if is_color && !format.is_compressed() {
        return Ok(());
    }
    Err(Error::invalid(format!(
        "{format:?} is no format to show on; take one of normalised or floating-point colours"
    )))
}
