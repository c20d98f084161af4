//! From radiance to what a display shows: exposure, tone curve, sRGB transfer. Mirrored in `shaders/lib/tonemap.wgsl`.
//!
//! 1. [`Exposure::ev`] gives the exposure in stops. Automatic: [`luminance_histogram`] counts the pixels that are
//!    not black in 256 bins of luminance, eight a stop from 2⁻²⁰ up; [`auto_exposure`] puts the mean of their log2
//!    luminance, without the darkest and the brightest 5 %, on middle grey (0.18). Counts are integers and a bin is
//!    a few bits of the float itself, so another machine or a GPU counts exactly the same.
//! 2. [`Tonemap::apply`] maps radiance · 2^EV to linear display RGB from 0 to 1.
//! 3. [`srgb_encode`] applies the display's transfer function.
//!
//! Worked example: a grey wall of radiance 0.09 and a small lamp of radiance 100 have an automatic exposure of one
//! stop (the lamp is among the brightest 5 %); the wall comes to 0.18, which is 118 of 255 without a curve.

use crate::image::{Image, luminance};
use crate::parallel::in_order;
use glam::{Mat3, Vec3};

/// Number of bins of [`luminance_histogram`].
pub const HISTOGRAM_BINS: usize = 256;
/// Bins a stop: the top three bits of a float's mantissa.
const BINS_PER_STOP: u32 = 8;
/// log2 of the luminance at which the first bin starts; darker pixels count in it, and brighter ones than 2¹² in the
/// last one.
const MIN_LOG2: i32 = -20;
/// What automatic exposure maps the picture's mean to.
pub const MIDDLE_GREY: f32 = 0.18;

/// How radiance is scaled before the tone curve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Exposure {
    /// So that the picture's mean is middle grey; see [`auto_exposure`].
    #[default]
    Auto,
    /// By 2 to this power.
    Ev(f32),
}

impl Exposure {
    /// The exposure in stops for a picture.
    pub fn ev(self, image: &Image) -> f32 {
        match self {
            Self::Auto => auto_exposure(&luminance_histogram(&image.pixels)),
            Self::Ev(ev) => ev,
        }
    }
}

/// The curve from exposed radiance to the display's range.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tonemap {
    /// AgX (Sobotka, as fitted by Wrensch): soft, and keeps bright colours from turning garish.
    #[default]
    Agx,
    /// Contrasty, as in film: see [`aces`].
    Aces,
    /// Cut off at 1: what is below is shown as it is. (The renderer cuts nothing off on floating-point targets.)
    None,
}

impl Tonemap {
    /// Linear display RGB, 0 to 1, of exposed radiance. Not-a-number counts as black.
    pub fn apply(self, radiance: Vec3) -> Vec3 {
        Vec3::from_array(self.curve(radiance).to_array().map(|c| self.linear(c)))
    }

    /// What comes before the display's exponent.
    fn curve(self, radiance: Vec3) -> Vec3 {
        let radiance =
            Vec3::from_array(radiance.to_array().map(|c| if c > 0.0 { c.min(f32::MAX) } else { 0.0 }));
        match self {
            Self::Agx => agx_encoded(radiance),
            Self::Aces => aces(radiance),
            Self::None => radiance.min(Vec3::ONE),
        }
    }

    /// Undoes the display's exponent, if the curve's values have one.
    fn linear(self, encoded: f32) -> f32 {
        if self == Self::Agx { libm::powf(encoded, AGX_EXPONENT) } else { encoded }
    }
}

/// Counts pixels by luminance. Black ones and ones that are not finite are left out.
pub fn luminance_histogram(pixels: &[Vec3]) -> [u32; HISTOGRAM_BINS] {
    let mut histogram = [0; HISTOGRAM_BINS];
    for &pixel in pixels {
        let y = luminance(pixel);
        if y > 0.0 && y.is_finite() {
            histogram[histogram_bin(y) as usize] += 1;
        }
    }
    histogram
}

/// The bin of a positive luminance: exponent and three bits of the mantissa.
pub fn histogram_bin(luminance: f32) -> u32 {
    let first = ((127 + MIN_LOG2) as u32) * BINS_PER_STOP;
    (luminance.to_bits() >> 20).saturating_sub(first).min(HISTOGRAM_BINS as u32 - 1)
}

/// log2 of the luminance in the middle of a bin.
pub fn histogram_bin_log2(bin: u32) -> f32 {
    let (stop, step) = (bin / BINS_PER_STOP, bin % BINS_PER_STOP);
    (MIN_LOG2 + stop as i32) as f32 + libm::log2f(1.0 + (step as f32 + 0.5) / BINS_PER_STOP as f32)
}

/// The exposure, in stops, that maps the mean log2 luminance between the 5th and the 95th percentile to middle grey.
/// A black picture has exposure 0.
pub fn auto_exposure(histogram: &[u32; HISTOGRAM_BINS]) -> f32 {
    let total: u64 = histogram.iter().map(|&n| u64::from(n)).sum();
    let (low, high) = (total * 5 / 100, total - total * 5 / 100);
    let (mut before, mut sum, mut counted) = (0u64, 0.0f64, 0u64);
    for (bin, &n) in histogram.iter().enumerate() {
        let after = before + u64::from(n);
        let within = after.min(high).saturating_sub(before.max(low));
        sum += within as f64 * f64::from(histogram_bin_log2(bin as u32));
        counted += within;
        before = after;
    }
    if counted == 0 { 0.0 } else { libm::log2f(MIDDLE_GREY) - (sum / counted as f64) as f32 }
}

/// What display values of [`agx_encoded`] are raised to.
const AGX_EXPONENT: f32 = 2.2;

/// AgX (Sobotka), its default look as fitted by a polynomial: Wrensch 2023, "Minimal AgX Implementation", with the
/// published matrices, the sixth-degree fit (the seventh-degree one is not monotone near black); the 2.2 display
/// exponent is still to be undone. `radiance` is not negative.
fn agx_encoded(radiance: Vec3) -> Vec3 {
    const INSET: Mat3 = Mat3::from_cols(
        Vec3::new(0.842_479_06, 0.042_328_242, 0.042_375_655),
        Vec3::new(0.078_433_6, 0.878_468_64, 0.078_433_6),
        Vec3::new(0.079_223_745, 0.079_166_13, 0.879_143),
    );
    const OUTSET: Mat3 = Mat3::from_cols(
        Vec3::new(1.196_879, -0.052_896_85, -0.052_971_635),
        Vec3::new(-0.098_020_88, 1.151_903_1, -0.098_043_45),
        Vec3::new(-0.099_029_74, -0.098_961_18, 1.151_073_7),
    );
    const MIN_EV: f32 = -12.473_93;
    const MAX_EV: f32 = 4.026_069;
    let log = Vec3::from_array((INSET * radiance).to_array().map(libm::log2f));
    let x = (log.clamp(Vec3::splat(MIN_EV), Vec3::splat(MAX_EV)) - MIN_EV) / (MAX_EV - MIN_EV);
    (OUTSET * agx_contrast(x)).clamp(Vec3::ZERO, Vec3::ONE)
}

/// The sigmoid of AgX on log-encoded values from 0 to 1.
fn agx_contrast(x: Vec3) -> Vec3 {
    let x2 = x * x;
    let x4 = x2 * x2;
    15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232
}

/// The ACES reference rendering and output transform for sRGB displays, as fitted by Stephen Hill (BakingLab,
/// `ACES.hlsl`). Divided by 0.6 first, as is custom, so that middle grey stays about where it is. `radiance` is not
/// negative.
pub fn aces(radiance: Vec3) -> Vec3 {
    const INPUT: Mat3 = Mat3::from_cols(
        Vec3::new(0.597_19, 0.076, 0.0284),
        Vec3::new(0.354_58, 0.908_34, 0.133_83),
        Vec3::new(0.048_23, 0.015_66, 0.837_77),
    );
    const OUTPUT: Mat3 = Mat3::from_cols(
        Vec3::new(1.604_75, -0.102_08, -0.003_27),
        Vec3::new(-0.531_08, 1.108_13, -0.072_76),
        Vec3::new(-0.073_67, -0.006_05, 1.076_02),
    );
    // Far above white the curve is flat; the bound keeps its square finite.
    let v = INPUT * (radiance / 0.6).min(Vec3::splat(1e6));
    let a = v * (v + 0.024_578_6) - 0.000_090_537;
    let b = v * (0.983_729 * v + 0.432_951) + 0.238_081;
    (OUTPUT * (a / b)).clamp(Vec3::ZERO, Vec3::ONE)
}

/// The sRGB transfer function (IEC 61966-2-1) of a linear value, 0 to 1.
pub fn srgb_encode(linear: f32) -> f32 {
    let c = linear.clamp(0.0, 1.0);
    if c <= 0.003_130_8 { c * 12.92 } else { 1.055 * libm::powf(c, 1.0 / 2.4) - 0.055 }
}

/// The linear value of an sRGB value, 0 to 1: undoes [`srgb_encode`].
pub fn srgb_decode(encoded: f32) -> f32 {
    if encoded <= 0.04045 { encoded / 12.92 } else { libm::powf((encoded + 0.055) / 1.055, 2.4) }
}

/// A picture as 8-bit sRGB, three bytes a pixel, rows from the top down.
pub fn to_srgb8(image: &Image, ev: f32, tonemap: Tonemap) -> Vec<u8> {
    let scale = libm::exp2f(ev);
    let bytes = Bytes::new(|encoded| (srgb_encode(tonemap.linear(encoded)) * 255.0 + 0.5) as u8);
    let pixel = |i: usize| tonemap.curve(image.pixels[i] * scale).to_array().map(|c| bytes.of(c));
    in_order(image.pixels.len(), pixel).into_flattened()
}

/// A function from 0 to 1 to bytes that never falls, looked up instead of computed: two powers a value are most of what a picture takes.
struct Bytes {
    /// The least value of each byte.
    least: [f32; 256],
    /// The byte of the least value of each cell.
    cells: Vec<u8>,
}

impl Bytes {
    /// In the dark, where a transfer function is steepest, a cell has about one byte.
    const CELLS: usize = 4096;

    fn new(byte: impl Fn(f32) -> u8) -> Self {
        let mut least = [0.0; 256];
        for (wanted, least) in least.iter_mut().enumerate().skip(1) {
            let (mut low, mut high) = (0, f32::to_bits(1.0) + 1);
            while high - low > 1 {
                let middle = low + (high - low) / 2;
                let is_enough = usize::from(byte(f32::from_bits(middle))) >= wanted;
                *if is_enough { &mut high } else { &mut low } = middle;
            }
            *least = f32::from_bits(high);
        }
        let cells = (0..=Self::CELLS).map(|i| byte(i as f32 / Self::CELLS as f32)).collect();
        Self { least, cells }
    }

    fn of(&self, value: f32) -> u8 {
        let mut byte = self.cells[(value * Self::CELLS as f32) as usize];
        while byte < 255 && value >= self.least[usize::from(byte) + 1] {
            byte += 1;
        }
        byte
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Tonemap; 3] = [Tonemap::Agx, Tonemap::Aces, Tonemap::None];

    fn greys() -> impl Iterator<Item = f32> {
        (0..=640).map(|i| libm::exp2f(i as f32 / 20.0 - 20.0))
    }

    #[test]
    fn greys_stay_grey_and_rise() {
        for tonemap in ALL {
            let mut last = tonemap.apply(Vec3::ZERO);
            for y in greys() {
                let shown = tonemap.apply(Vec3::splat(y));
                assert!((shown.max_element() - shown.min_element()) < 2e-3, "{tonemap:?} tints {y}: {shown}");
                assert!(shown.cmpge(last - 1e-6).all(), "{tonemap:?} falls at {y}");
                last = shown;
            }
            assert!(tonemap.apply(Vec3::splat(4.0)).x > tonemap.apply(Vec3::splat(0.1)).x + 0.3);
        }
    }

    #[test]
    fn bytes_are_those_of_the_formula() {
        let values = (0..20_000).map(|i| libm::exp2f(i as f32 / 1000.0 - 14.0));
        let pixels: Vec<Vec3> = values.map(|y| Vec3::new(y, 0.7 * y, 0.1 * y)).collect();
        let image = Image { width: 200, height: 100, pixels };
        for tonemap in ALL {
            let byte = |c: f32| (srgb_encode(c) * 255.0 + 0.5) as u8;
            let direct = image.pixels.iter().flat_map(|p| tonemap.apply(*p * 2.0).to_array().map(byte));
            assert!(direct.eq(to_srgb8(&image, 1.0, tonemap)), "{tonemap:?}");
        }
    }

    #[test]
    fn black_is_black_and_white_is_white() {
        for tonemap in ALL {
            assert!(tonemap.apply(Vec3::ZERO).max_element() < 1e-3, "{tonemap:?}");
            for bright in [1e4, f32::MAX, f32::INFINITY] {
                let white = tonemap.apply(Vec3::splat(bright));
                assert!(white.min_element() > 0.98 && white.max_element() <= 1.0, "{tonemap:?} {white}");
            }
            assert!(tonemap.apply(Vec3::splat(-1.0)).max_element() < 1e-3);
            assert!(tonemap.apply(Vec3::splat(f32::NAN)).is_finite());
        }
    }

    #[test]
    fn middle_grey_stays_in_the_middle() {
        // AgX pivots at half of the display's range, 0.5^2.2 = 0.218; Hill's ACES after 1/0.6 gives 0.213.
        for (tonemap, expected) in [(Tonemap::Agx, 0.218), (Tonemap::Aces, 0.213), (Tonemap::None, 0.18)] {
            let shown = tonemap.apply(Vec3::splat(MIDDLE_GREY)).y;
            assert!((shown - expected).abs() < 0.005, "{tonemap:?}: {shown}");
        }
    }

    #[test]
    fn hues_keep_their_order() {
        for tonemap in ALL {
            for scale in [0.05, 0.2, 0.6] {
                for (r, g, b) in [(1.0, 0.4, 0.1), (0.1, 0.4, 1.0), (0.4, 1.0, 0.1)] {
                    let colour = Vec3::new(r, g, b) * scale;
                    let shown = tonemap.apply(colour);
                    assert_eq!(shown.max_position(), colour.max_position(), "{tonemap:?} {colour}");
                    assert_eq!(shown.min_position(), colour.min_position(), "{tonemap:?} {colour}");
                }
            }
        }
        // AgX turns what is far too bright towards white; clamping does not.
        let lamp = Vec3::new(60.0, 6.0, 2.0);
        let saturation = |c: Vec3| 1.0 - c.min_element() / c.max_element();
        assert!(saturation(Tonemap::Agx.apply(lamp)) < saturation(Tonemap::Agx.apply(lamp * 0.01)) - 0.2);
    }

    #[test]
    fn bins_are_eighths_of_a_stop() {
        assert_eq!(histogram_bin(libm::exp2f(-20.0)), 0);
        assert_eq!(histogram_bin(1.0), 160);
        assert_eq!(histogram_bin(1.99), 167);
        assert_eq!(histogram_bin(2.0), 168);
        assert_eq!(histogram_bin(1e-30), 0);
        assert_eq!(histogram_bin(1e30), 255);
        for y in greys().filter(|&y| y < 4000.0) {
            let error = (histogram_bin_log2(histogram_bin(y)) - libm::log2f(y)).abs();
            assert!(error < 0.1, "{y}: {error}");
        }
    }

    fn exposure_of(pixels: Vec<Vec3>) -> f32 {
        Exposure::Auto.ev(&Image { width: pixels.len() as u32, height: 1, pixels })
    }

    #[test]
    fn exposure_of_known_pictures() {
        assert_eq!(exposure_of(vec![Vec3::ZERO; 100]), 0.0);
        assert_eq!(exposure_of(vec![]), 0.0);
        assert_eq!(exposure_of(vec![Vec3::NAN, Vec3::INFINITY]), 0.0);
        let wall = exposure_of(vec![Vec3::splat(0.09); 100]);
        assert!((wall - 1.0).abs() < 0.1, "{wall}");
        // One lamp, and black pixels in any number, change nothing.
        let mut room = vec![Vec3::splat(0.09); 100];
        room[3] = Vec3::splat(100.0);
        room.extend(vec![Vec3::ZERO; 500]);
        assert_eq!(exposure_of(room), wall);
        // A quarter of the picture does.
        let mut lit = vec![Vec3::splat(0.09); 75];
        lit.extend(vec![Vec3::splat(9.0); 25]);
        assert!(exposure_of(lit) < wall - 1.0);
        // A stop more light is a stop less exposure.
        let ramp = |scale: f32| exposure_of((1..1000).map(|i| Vec3::splat(i as f32 * scale)).collect());
        assert!((ramp(0.001) - ramp(0.002) - 1.0).abs() < 1e-5);
        assert_eq!(Exposure::Ev(-2.5).ev(&Image::new(4, 4)), -2.5);
    }

    #[test]
    fn bytes_are_srgb() {
        for byte in 0..=255u8 {
            let linear = srgb_decode(f32::from(byte) / 255.0);
            assert_eq!((srgb_encode(linear) * 255.0 + 0.5) as u8, byte);
        }
        let image = Image {
            width: 3,
            height: 1,
            pixels: vec![Vec3::ZERO, Vec3::splat(0.09), Vec3::new(9.0, f32::NAN, -1.0)],
        };
        assert_eq!(to_srgb8(&image, 1.0, Tonemap::None), [0, 0, 0, 118, 118, 118, 255, 0, 0]);
    }
}
