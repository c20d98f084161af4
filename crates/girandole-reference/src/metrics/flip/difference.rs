//! FLIP of two pictures as they are shown: Andersson et al., "FLIP: A Difference Evaluator for Alternating
//! Images", HPG 2020, with the separable filters of its authors' own program ("Separable FLIP", their
//! repository). Held against that program in a test.

use girandole_core::glam::{Mat3, Vec3, Vec4, vec3, vec4};
use girandole_core::tonemap::srgb_decode;
use std::f32::consts::PI;

/// Pixels a degree of the visual field: a screen of 0.7 m and 3840 pixels, seen from 0.7 m.
const PIXELS_PER_DEGREE: f32 = 67.0;
/// The paper's q_c, p_c, p_t, w and q_f.
const COLOR_EXPONENT: f32 = 0.7;
const COLOR_SHARE: f32 = 0.4;
const COLOR_BEND: f32 = 0.95;
const FEATURE_WIDTH: f32 = 0.082;
const FEATURE_EXPONENT: f32 = 0.5;
/// Amplitudes and widths of the contrast sensitivity's Gaussians: of Y, of Cx, and the two of Cz.
const SENSITIVITY: [[f32; 2]; 4] = [[1.0, 0.0047], [1.0, 0.0053], [34.1, 0.04], [13.5, 0.025]];
/// White of D65.
const WHITE: Vec3 = vec3(0.950_428_5, 1.0, 1.088_900_4);

/// The difference of each pixel, 0 to 1. Pixels are sRGB, 0 to 1, row by row.
pub fn differences(reference: &[Vec3], test: &[Vec3], size: [usize; 2]) -> Vec<f32> {
    let [reference, test] = [reference, test].map(|pixels| Seen::new(pixels, size));
    let largest = largest_color_difference();
    let pixel = |i: usize| {
        let color = color_difference(reference.colors[i], test.colors[i], largest);
        let [a, b] = [&reference, &test].map(|seen| seen.features[i]);
        let (edges, points) = (length(a.x, a.z) - length(b.x, b.z), length(a.y, a.w) - length(b.y, b.w));
        let feature = edges.abs().max(points.abs()) * std::f32::consts::FRAC_1_SQRT_2;
        libm::powf(color, 1.0 - libm::powf(feature, FEATURE_EXPONENT))
    };
    (0..reference.colors.len()).map(pixel).collect()
}

/// What an observer sees of a picture.
struct Seen {
    /// CIELab with Hunt's adjustment.
    colors: Vec<Vec3>,
    /// First and second derivative of the brightness along x, and along y.
    features: Vec<Vec4>,
}

impl Seen {
    fn new(pixels: &[Vec3], size: [usize; 2]) -> Self {
        let opponents: Vec<Vec3> =
            pixels.iter().map(|p| opponent_from_xyz(xyz_from_rgb(*p, srgb_decode))).collect();
        let spread = opponents.iter().map(|c| vec4(c.x, c.y, c.z, c.z)).collect();
        let sensitivity = sensitivity();
        let filtered = convolved(convolved(spread, size, 0, &sensitivity), size, 1, &sensitivity);
        let colors = filtered.iter().map(|c| hunt(lab_from_opponent(vec3(c.x, c.y, c.z + c.w)))).collect();
        let brightness = opponents.iter().map(|c| Vec4::splat((c.x + 16.0) / 116.0)).collect();
        let detectors = detectors();
        let across: Vec<Vec4> = detectors.iter().map(|d| vec4(d.y, d.z, d.x, d.x)).collect();
        let down: Vec<Vec4> = detectors.iter().map(|d| vec4(d.x, d.x, d.y, d.z)).collect();
        let features = convolved(convolved(brightness, size, 0, &across), size, 1, &down);
        Self { colors, features }
    }
}

/// Each component with its own weights along x (0) or y (1); the picture's edges go on beyond it.
fn convolved(image: Vec<Vec4>, [width, height]: [usize; 2], axis: usize, weights: &[Vec4]) -> Vec<Vec4> {
    let radius = weights.len() / 2;
    let last = [width, height][axis] - 1;
    let pixel = |i: usize| {
        let at = [i % width, i / width];
        let term = |(k, weight): (usize, &Vec4)| {
            let mut from = at;
            from[axis] = (at[axis] + k).saturating_sub(radius).min(last);
            *weight * image[from[1] * width + from[0]]
        };
        weights.iter().enumerate().map(term).fold(Vec4::ZERO, |sum, term| sum + term)
    };
    (0..image.len()).map(pixel).collect()
}

/// Contrast sensitivity: weights of Y, Cx and the two parts of Cz.
fn sensitivity() -> Vec<Vec4> {
    let widest = SENSITIVITY.iter().fold(0.0, |widest: f32, [_, b]| widest.max(*b));
    let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
    let weight = |x: i32, channel: usize| {
        let [a, b] = SENSITIVITY[channel];
        let x = x as f32 / PIXELS_PER_DEGREE;
        let amplitude = a * (PI / b).sqrt();
        // That of a sum of two is split between the two passes.
        let amplitude = if channel < 2 { amplitude } else { amplitude.sqrt() };
        amplitude * libm::expf(-PI * PI * x * x / b)
    };
    let weights: Vec<Vec4> =
        (-radius..=radius).map(|x| Vec4::from([0, 1, 2, 3].map(|channel| weight(x, channel)))).collect();
    let sum: Vec4 = weights.iter().sum();
    let both = length(sum.z, sum.w);
    weights.iter().map(|w| *w / vec4(sum.x, sum.y, both, both)).collect()
}

/// Gaussian and its first and second derivative; positive and negative weights each have the sum 1 or −1.
fn detectors() -> Vec<Vec3> {
    let deviation = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
    let radius = (3.0 * deviation).ceil() as i32;
    let weight = |x: i32| {
        let x = x as f32;
        let gaussian = libm::expf(-x * x / (2.0 * deviation * deviation));
        gaussian * vec3(1.0, -x, x * x / (deviation * deviation) - 1.0)
    };
    let weights: Vec<Vec3> = (-radius..=radius).map(weight).collect();
    let positive = weights.iter().fold(Vec3::ZERO, |sum, w| sum + w.max(Vec3::ZERO));
    let negative = weights.iter().fold(Vec3::ZERO, |sum, w| sum - w.min(Vec3::ZERO));
    weights.iter().map(|w| *w / Vec3::select(w.cmpgt(Vec3::ZERO), positive, negative)).collect()
}

fn color_difference(reference: Vec3, test: Vec3, largest: f32) -> f32 {
    let difference = libm::powf(hyab(reference, test), COLOR_EXPONENT);
    let bend = COLOR_SHARE * largest;
    if difference < bend {
        difference * COLOR_BEND / bend
    } else {
        COLOR_BEND + (difference - bend) / (largest - bend) * (1.0 - COLOR_BEND)
    }
}

/// That of green and blue.
fn largest_color_difference() -> f32 {
    let [green, blue] = [Vec3::Y, Vec3::Z].map(|rgb| hunt(lab_from_xyz(xyz_from_rgb(rgb, |x| x))));
    libm::powf(hyab(green, blue), COLOR_EXPONENT)
}

/// City block in lightness, Euclidean in chroma.
fn hyab(a: Vec3, b: Vec3) -> f32 {
    (a.x - b.x).abs() + length(a.y - b.y, a.z - b.z)
}

/// Chroma counts for less where it is dark.
fn hunt(lab: Vec3) -> Vec3 {
    vec3(lab.x, 0.01 * lab.x * lab.y, 0.01 * lab.x * lab.z)
}

fn length(x: f32, y: f32) -> f32 {
    (x * x + y * y).sqrt()
}

/// Column by column, Rec. 709 and D65.
const XYZ_FROM_RGB: Mat3 = Mat3::from_cols_array(&[
    10_135_552.0 / 24_577_794.0,
    2_613_072.0 / 12_288_897.0,
    1_425_312.0 / 73_733_382.0,
    8_788_810.0 / 24_577_794.0,
    8_788_810.0 / 12_288_897.0,
    8_788_810.0 / 73_733_382.0,
    4_435_075.0 / 24_577_794.0,
    887_015.0 / 12_288_897.0,
    70_074_185.0 / 73_733_382.0,
]);
const RGB_FROM_XYZ: Mat3 = Mat3::from_cols_array(&[
    3.241_003_3,
    -0.969_224_3,
    0.055_639_423,
    -1.537_398_9,
    1.875_930_1,
    -0.204_011_2,
    -0.498_615_86,
    0.041_554_224,
    1.057_149,
]);

fn xyz_from_rgb(rgb: Vec3, decode: impl Fn(f32) -> f32) -> Vec3 {
    XYZ_FROM_RGB * Vec3::from(rgb.to_array().map(decode))
}

/// Y, Cx and Cz, which are linear in XYZ.
fn opponent_from_xyz(xyz: Vec3) -> Vec3 {
    let xyz = xyz / WHITE;
    vec3(116.0 * xyz.y - 16.0, 500.0 * (xyz.x - xyz.y), 200.0 * (xyz.y - xyz.z))
}

/// Of what a screen can show of it.
fn lab_from_opponent(opponent: Vec3) -> Vec3 {
    let y = (opponent.x + 16.0) / 116.0;
    let xyz = vec3(y + opponent.y / 500.0, y, y - opponent.z / 200.0) * WHITE;
    let rgb = (RGB_FROM_XYZ * xyz).clamp(Vec3::ZERO, Vec3::ONE);
    lab_from_xyz(XYZ_FROM_RGB * rgb)
}

fn lab_from_xyz(xyz: Vec3) -> Vec3 {
    let delta = 6.0_f32 / 29.0;
    let bent = |x: f32| {
        if x > delta * delta * delta { libm::cbrtf(x) } else { x / (3.0 * delta * delta) + 4.0 / 29.0 }
    };
    let [x, y, z] = (xyz / WHITE).to_array().map(bent);
    vec3(116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [48, 40];

    /// Picture `which` of pair `pair`, sRGB in bytes.
    fn picture(pair: u32, which: u32) -> Vec<Vec3> {
        let pixel = |i: u32| -> [u32; 3] {
            let (x, y) = (i % 48, i / 48);
            match pair {
                0 => [x * 5 + which * 8, y * 6, 128],
                1 => {
                    let mix =
                        |n: u32| ((x + which) * 73 + y * 151 + n * 37).wrapping_mul(2_654_435_761) >> 24;
                    [mix(0), mix(1), mix(2)]
                }
                2 => [if which == 0 { (x + y) % 2 * 255 } else { 128 }; 3],
                3 => {
                    let is_in = which == 1 && (x as i32 - 24).pow(2) + (y as i32 - 20).pow(2) < 64;
                    if is_in { [200, 30, 20] } else { [40, 60, 160] }
                }
                _ => [255 * which; 3],
            }
        };
        (0..48 * 40).map(|i| Vec3::from(pixel(i).map(|b| b as f32 / 255.0))).collect()
    }

    /// By the authors' program (nv-flip 0.1.2): the mean, and at (0, 0), (24, 20), (31, 17) and (47, 39).
    const EXPECTED: [[f32; 5]; 5] = [
        [0.101803, 0.037621, 0.108263, 0.126995, 0.145650],
        [0.166915, 0.358902, 0.124237, 0.147143, 0.907322],
        [0.520297, 0.607664, 0.508783, 0.508783, 0.607664],
        [0.113220, 0.000000, 0.930728, 0.593172, 0.000000],
        [0.967401, 0.967392, 0.967392, 0.967392, 0.967392],
    ];

    #[test]
    fn differences_are_those_of_the_authors_program() {
        for (pair, expected) in (0..).zip(EXPECTED) {
            let map = differences(&picture(pair, 0), &picture(pair, 1), SIZE);
            let mean = map.iter().sum::<f32>() / map.len() as f32;
            let found = [mean, map[0], map[20 * 48 + 24], map[17 * 48 + 31], map[39 * 48 + 47]];
            for (found, expected) in found.into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-4, "pair {pair}: {found} instead of {expected}");
            }
            // The control, and which of the two is the reference makes no difference.
            let same = differences(&picture(pair, 0), &picture(pair, 0), SIZE);
            assert!(same.iter().all(|d| *d == 0.0) && mean > 1e-3);
            let turned = differences(&picture(pair, 1), &picture(pair, 0), SIZE);
            assert!(turned.iter().zip(&map).all(|(a, b)| (a - b).abs() < 1e-6));
        }
    }
}
