//! `girandole compare`: error metrics of two pictures, and thresholds on them.

use crate::args::CompareArgs;
use crate::output::{self, say};
use anyhow::{Result, bail};
use girandole_core::image::Image;
use girandole_core::tonemap::{Tonemap, to_srgb8};
use girandole_reference::image_file::{read, write_png};
use girandole_reference::metrics::{self, CompareOptions, Comparison, HeatMap};
use serde_json::json;
use std::path::PathBuf;
use std::process::ExitCode;

/// Compares, prints the metrics and checks the thresholds.
pub fn run(args: &CompareArgs) -> Result<ExitCode> {
    if let Some(heat) = &args.out {
        output::check_writable(heat, &["png"])?;
    }
    let reference = read(&args.reference)?;
    let test = read(&args.test)?;
    let mask = mask(&args.mask)?;
    let options = CompareOptions { mask, keep_edges: args.edges, trim: args.trim };
    let result = metrics::compare(&reference, &test, &options)?;
    if let Some(heat) = &args.out {
        let picture = metrics::heat_map(&reference, &test, &options, HeatMap::Relative)?;
        write_png(heat, picture.width, picture.height, &to_srgb8(&picture, 0.0, Tonemap::None))?;
    }
    output::data(&if args.json { as_json(&result)? } else { as_table(&result) })?;

    // Thresholds.
    let energy_error = (result.energy_ratio - 1.0).abs();
    let mut beyond = Vec::new();
    for (name, value, limit) in [
        ("relMSE", result.rel_mse, args.max_rel_mse),
        ("RMSE", result.rmse, args.max_rmse),
        ("FLIP", result.flip, args.max_flip),
        ("energy error", energy_error, args.max_energy_error),
    ] {
        // NaN exceeds every threshold.
        if let Some(limit) = limit.filter(|&limit| value.is_nan() || value > limit) {
            beyond.push(format!("{name} {value:.6} is more than {limit}"));
        }
    }
    if beyond.is_empty() {
        return Ok(ExitCode::SUCCESS);
    }
    say(&format!("beyond the thresholds: {}", beyond.join(", ")));
    Ok(ExitCode::from(1))
}

/// What any of the masks leaves out.
fn mask(paths: &[PathBuf]) -> Result<Option<Image>> {
    let Some((first, others)) = paths.split_first() else { return Ok(None) };
    let mut mask = read(first)?;
    for path in others {
        let other = read(path)?;
        if (other.width, other.height) != (mask.width, mask.height) {
            bail!("{} and {} are not of the same size: give masks that are", first.display(), path.display());
        }
        mask.pixels.iter_mut().zip(&other.pixels).for_each(|(m, o)| *m = m.max(*o));
    }
    Ok(Some(mask))
}

fn as_table(c: &Comparison) -> String {
    let [x, y] = c.worst_pixel;
    format!(
        "valid pixels  {}\n\
         energy ratio  {:.6}\n\
         relMSE        {:.6}\n\
         RMSE          {:.6}\n\
         FLIP          {:.6}\n\
         outliers      {}\n\
         worst pixel   {x},{y} (error {:.6})\n",
        c.valid_pixels, c.energy_ratio, c.rel_mse, c.rmse, c.flip, c.outliers, c.worst_error
    )
}

fn as_json(c: &Comparison) -> Result<String> {
    let [x, y] = c.worst_pixel;
    let object = json!({
        "valid_pixels": c.valid_pixels,
        "energy_ratio": c.energy_ratio,
        "rel_mse": c.rel_mse,
        "rmse": c.rmse,
        "flip": c.flip,
        "outliers": c.outliers,
        "worst_pixel_x": x,
        "worst_pixel_y": y,
        "worst_error": c.worst_error,
    });
    Ok(format!("{}\n", serde_json::to_string_pretty(&object)?))
}
