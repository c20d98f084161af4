//! Error metrics of two pictures, and error images.

use girandole_core::glam::{DVec3, Vec3};
use girandole_core::image::Image;
use girandole_core::{Error, Result};

#[cfg(feature = "flip")]
mod flip;

#[cfg(feature = "flip")]
pub use flip::{HeatMap, heat_map};

/// Keeps the relative error of dark pixels finite, (W/(sr·m²))².
const RELATIVE_EPSILON: f64 = 0.01;

/// Which pixels count.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CompareOptions {
    /// Where a channel is above 0, a pixel shows: an emitter (R), background (G), an edge (B). Emitters and background
    /// are left out. `None` = all pixels count.
    pub mask: Option<Image>,
    /// Whether edge pixels count: only where both pictures are anti-aliased alike.
    pub keep_edges: bool,
    /// Share of the worst pixels that is left out of relMSE, in [0, 1): a few lights too close to a surface would
    /// otherwise dominate it. 0 = none.
    pub trim: f32,
}

/// The metrics of a comparison, over the pixels that count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// How many pixels count.
    pub valid_pixels: usize,
    /// Mean of the test over mean of the reference, all channels together; 1 = no light lost or gained.
    pub energy_ratio: f64,
    /// Mean of (t − r)² / (r² + 0.01) over pixels and channels, after trimming.
    pub rel_mse: f64,
    /// Root of the mean of (t − r)² over pixels and channels, W/(sr·m²).
    pub rmse: f64,
    /// Mean FLIP (Andersson et al. 2020), 0 = looks the same, 1 = as different as can be: both pictures exposed so
    /// that 95 % of the reference is below 0.8, clamped, sRGB, at 67 pixels a degree.
    #[cfg(feature = "flip")]
    pub flip: f64,
    /// Pixels that are more than ten times as bright as the reference is at them and at their neighbours: by the brightest channel,
    /// and by more than 0.1 W/(sr·m²).
    pub outliers: usize,
    /// Column and row of the pixel with the greatest relative error, trimmed or not.
    pub worst_pixel: [u32; 2],
    /// That pixel's mean of (t − r)² / (r² + 0.01) over its channels.
    pub worst_error: f64,
    /// Pixels left out by the mask that have a NaN or an infinity in either picture; among those that count, it would
    /// be an error.
    pub non_finite: usize,
}

/// Compares two pictures of the same size.
///
/// ```
/// use girandole_core::{glam::Vec3, image::Image};
/// use girandole_reference::metrics::{CompareOptions, compare};
/// let mut reference = Image::new(8, 8);
/// reference.pixels.fill(Vec3::splat(0.5));
/// let mut test = reference.clone();
/// assert_eq!(compare(&reference, &test, &CompareOptions::default())?.rel_mse, 0.0);
/// test.pixels.fill(Vec3::ONE);
/// assert!((compare(&reference, &test, &CompareOptions::default())?.energy_ratio - 2.0).abs() < 1e-6);
/// # Ok::<(), girandole_core::Error>(())
/// ```
///
/// # Errors
/// [`Error::Invalid`] where sizes differ, no pixel counts, or a pixel that counts is not finite.
pub fn compare(reference: &Image, test: &Image, options: &CompareOptions) -> Result<Comparison> {
    let valid = valid_pixels(reference, test, options)?;
    let count = valid.iter().filter(|&&v| v).count();
    if count == 0 {
        return Err(Error::Invalid("no pixel is left to compare: the mask covers them all".into()));
    }
    if !(0.0..1.0).contains(&options.trim) {
        return Err(Error::Invalid(format!("trim must be in [0, 1), not {}", options.trim)));
    }
    let finite = |i: usize| reference.pixels[i].is_finite() && test.pixels[i].is_finite();
    let bad: Vec<usize> = (0..valid.len()).filter(|&i| !finite(i)).collect();
    if let Some(&first) = bad.iter().find(|&&i| valid[i]) {
        let which = if reference.pixels[first].is_finite() { "test picture" } else { "reference" };
        let [x, y] = position(reference, first);
        let total = bad.iter().filter(|&&i| valid[i]).count();
        return Err(Error::Invalid(format!(
            "{total} pixels are not finite, the first is ({x}, {y}) of the {which}: render it again"
        )));
    }

    let (mut sum_reference, mut sum_test, mut squares) = (0.0, 0.0, 0.0);
    let mut errors = Vec::with_capacity(count);
    let mut worst = (0, f64::NEG_INFINITY);
    for i in (0..valid.len()).filter(|&i| valid[i]) {
        let (r, t) = (reference.pixels[i].as_dvec3(), test.pixels[i].as_dvec3());
        sum_reference += r.element_sum();
        sum_test += t.element_sum();
        squares += (t - r).length_squared();
        let error = relative_error(r, t);
        errors.push(error);
        if error > worst.1 {
            worst = (i, error);
        }
    }
    errors.sort_by(f64::total_cmp);
    let kept = &errors[..(count - (f64::from(options.trim) * count as f64) as usize).max(1)];
    Ok(Comparison {
        valid_pixels: count,
        energy_ratio: if sum_test == sum_reference { 1.0 } else { sum_test / sum_reference },
        rel_mse: kept.iter().sum::<f64>() / kept.len() as f64,
        rmse: (squares / (3 * count) as f64).sqrt(),
        #[cfg(feature = "flip")]
        flip: flip::mean(reference, test, &valid),
        outliers: (0..valid.len()).filter(|&i| valid[i] && is_outlier(reference, test, i)).count(),
        worst_pixel: position(reference, worst.0),
        worst_error: worst.1,
        non_finite: bad.len(),
    })
}

fn valid_pixels(reference: &Image, test: &Image, options: &CompareOptions) -> Result<Vec<bool>> {
    let same_size = |other: &Image, name: &str| {
        if (other.width, other.height) == (reference.width, reference.height)
            && other.pixels.len() == reference.pixels.len()
        {
            return Ok(());
        }
        Err(Error::Invalid(format!(
            "the {name} has {}×{} pixels and the reference {}×{}: render both at the same size",
            other.width, other.height, reference.width, reference.height
        )))
    };
    same_size(test, "test picture")?;
    let Some(mask) = &options.mask else { return Ok(vec![true; reference.pixels.len()]) };
    same_size(mask, "mask")?;
    let counts = |m: &Vec3| m.x <= 0.0 && m.y <= 0.0 && (options.keep_edges || m.z <= 0.0);
    Ok(mask.pixels.iter().map(counts).collect())
}

fn position(image: &Image, index: usize) -> [u32; 2] {
    let width = image.width.max(1) as usize;
    [(index % width) as u32, (index / width) as u32]
}

/// See [`Comparison::outliers`].
fn is_outlier(reference: &Image, test: &Image, index: usize) -> bool {
    let [x, y] = position(reference, index).map(i64::from);
    let is_inside = |x: i64, y: i64| {
        (0..i64::from(reference.width)).contains(&x) && (0..i64::from(reference.height)).contains(&y)
    };
    let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (x + dx, y + dy)));
    let at =
        |(x, y): (i64, i64)| reference.pixels[(y * i64::from(reference.width) + x) as usize].max_element();
    let brightest = around.filter(|&(x, y)| is_inside(x, y)).map(at).fold(0.0, f32::max);
    test.pixels[index].max_element() > (10.0 * brightest).max(brightest + 0.1)
}

fn relative_error(r: DVec3, t: DVec3) -> f64 {
    ((t - r) * (t - r) / (r * r + RELATIVE_EPSILON)).element_sum() / 3.0
}
