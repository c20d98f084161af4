//! How much of a picture's structure is another one, as structural similarity sees it: details hide what is weaker
//! than they are.

use girandole_core::image::{Image, luminance};
use girandole_core::tonemap::srgb_encode;

/// Pixels across a window, and from one to the next.
const WINDOW: usize = 8;
const STEP: usize = 4;
/// The constants of Wang et al.
const STABILISERS: [f64; 2] = [0.01 * 0.01, 0.03 * 0.03];

/// 1 − the mean structural similarity (Wang, Bovik, Sheikh and Simoncelli 2004) of luminance in windows of 8 × 8
/// pixels, both pictures exposed so that 95 % of the reference is below 0.8, as sRGB. Unlike FLIP it divides by the
/// reference's own contrast.
pub fn dissimilarity(reference: &Image, test: &Image) -> f64 {
    let mut brightness: Vec<f32> = reference.pixels.iter().map(|&p| luminance(p)).collect();
    brightness.sort_by(f32::total_cmp);
    let bright = brightness.get(brightness.len() * 95 / 100).copied().filter(|&b| b > 0.0).unwrap_or(0.8);
    let shown = |image: &Image| -> Vec<f64> {
        image.pixels.iter().map(|&p| f64::from(srgb_encode(luminance(p) * 0.8 / bright))).collect()
    };
    let (r, t) = (shown(reference), shown(test));
    let [width, height] = [reference.width, reference.height].map(|side| side as usize);
    let starts = |side: usize| (0..(side + 1).saturating_sub(WINDOW)).step_by(STEP);
    let window =
        |x: usize, y: usize| (0..WINDOW * WINDOW).map(move |i| (y + i / WINDOW) * width + x + i % WINDOW);
    let windows = starts(height).flat_map(|y| starts(width).map(move |x| (x, y)));
    let similarities: Vec<f64> =
        windows.map(|(x, y)| similarity(window(x, y).map(|i| (r[i], t[i])))).collect();
    1.0 - similarities.iter().sum::<f64>() / similarities.len().max(1) as f64
}

fn similarity(pairs: impl Iterator<Item = (f64, f64)> + Clone) -> f64 {
    let count = (WINDOW * WINDOW) as f64;
    let mean = |value: &dyn Fn((f64, f64)) -> f64| pairs.clone().map(value).sum::<f64>() / count;
    let [r, t] = [mean(&|p| p.0), mean(&|p| p.1)];
    let [rr, tt, rt] = [mean(&|p| p.0 * p.0), mean(&|p| p.1 * p.1), mean(&|p| p.0 * p.1)];
    let [r_variance, t_variance, covariance] = [rr - r * r, tt - t * t, rt - r * t];
    let [c1, c2] = STABILISERS;
    (2.0 * r * t + c1) * (2.0 * covariance + c2) / ((r * r + t * t + c1) * (r_variance + t_variance + c2))
}
