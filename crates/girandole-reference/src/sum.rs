//! Sums of pictures that come to the same bits in whatever order, and by however many, they are made.

use girandole_core::glam::Vec3;
use girandole_core::image::Image;

/// Fixed-point ones: bits after the point. What is less than half of the last one counts as nothing.
const FRACTION: i32 = 64;
/// Radiance counts as this much at most, W/(sr·m²): 2^20 pictures of it fit into a sum.
const MOST: f64 = (1_u64 << 42) as f64;
/// Keeps the relative error of dark pixels finite, (W/(sr·m²))², as in [`metrics`](crate::metrics).
const RELATIVE_EPSILON: f64 = 0.01;

/// The sum of several pictures of one size, by which their mean, and how much they differ. Sums of radiance are integers, so that
/// order changes no bit of them.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureSum {
    /// Pixels in x.
    pub width: u32,
    /// Pixels in y.
    pub height: u32,
    /// How many pictures it is of.
    pub count: u32,
    /// By pixel and channel, radiance in units of 2^-64 W/(sr·m²).
    pub(crate) sums: Vec<[i128; 3]>,
    /// By pixel and channel, squared differences from the mean (Welford 1962; Chan, Golub and LeVeque 1983).
    pub(crate) deviations: Vec<[f64; 3]>,
}

impl PictureSum {
    /// Of no picture.
    pub fn new(width: u32, height: u32) -> Self {
        let pixels = width as usize * height as usize;
        Self { width, height, count: 0, sums: vec![[0; 3]; pixels], deviations: vec![[0.0; 3]; pixels] }
    }

    /// Adds a picture. Pixels that are no numbers are taken for black; pictures of another size are refused by `false`.
    pub fn add(&mut self, picture: &Image) -> bool {
        let sums = picture.pixels.iter().map(|pixel| pixel.to_array().map(fixed)).collect();
        let deviations = vec![[0.0; 3]; picture.pixels.len()];
        self.merge(&Self { width: picture.width, height: picture.height, count: 1, sums, deviations })
    }

    /// Adds all pictures of another sum; those of another size are refused by `false`.
    pub fn merge(&mut self, other: &Self) -> bool {
        if (self.width, self.height) != (other.width, other.height) {
            return false;
        }
        let [a, b] = [self.count, other.count].map(f64::from);
        let between = if a > 0.0 && b > 0.0 { a * b / (a + b) } else { 0.0 };
        let ours = self.sums.iter_mut().zip(&mut self.deviations);
        for ((sum, deviation), (of_other, more)) in ours.zip(other.sums.iter().zip(&other.deviations)) {
            for channel in 0..3 {
                let step = mean(of_other[channel], b) - mean(sum[channel], a);
                deviation[channel] += more[channel] + step * step * between;
                // What no picture holds, but a broken file may, comes around.
                sum[channel] = sum[channel].wrapping_add(of_other[channel]);
            }
        }
        self.count += other.count;
        true
    }

    /// The mean of all pictures, black where there are none.
    pub fn mean(&self) -> Image {
        let count = f64::from(self.count);
        let pixel = |sum: &[i128; 3]| Vec3::from_array(sum.map(|sum| mean(sum, count) as f32));
        Image { width: self.width, height: self.height, pixels: self.sums.iter().map(pixel).collect() }
    }

    /// The error of the mean, estimated by how much the pictures differ: over pixels and channels the mean of σ² / (L² + 0.01), where L
    /// is the mean and σ² the variance of it. `None` of less than two pictures.
    pub fn relative_error(&self) -> Option<f64> {
        if self.count < 2 {
            return None;
        }
        let count = f64::from(self.count);
        let of_channel = |(sum, deviation): (&i128, &f64)| {
            let mean = mean(*sum, count);
            deviation / (count * (count - 1.0)) / (mean * mean + RELATIVE_EPSILON)
        };
        let errors = self.sums.iter().zip(&self.deviations);
        let total: f64 = errors.map(|(s, d)| s.iter().zip(d).map(of_channel).sum::<f64>()).sum();
        Some(total / (self.sums.len().max(1) * 3) as f64)
    }
}

/// Radiance in units of the sums.
fn fixed(radiance: f32) -> i128 {
    (f64::from(radiance).clamp(-MOST, MOST) * unit().recip()) as i128
}

fn mean(sum: i128, count: f64) -> f64 {
    if count > 0.0 { sum as f64 * unit() / count } else { 0.0 }
}

fn unit() -> f64 {
    2_f64.powi(-FRACTION)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn picture(values: &[f32]) -> Image {
        let pixels = values.iter().map(|&v| Vec3::new(v, v * 0.5, -v)).collect();
        Image { width: values.len() as u32, height: 1, pixels }
    }

    fn sum(pictures: &[Image]) -> PictureSum {
        let mut sum = PictureSum::new(pictures[0].width, 1);
        assert!(pictures.iter().all(|picture| sum.add(picture)));
        sum
    }

    /// Radiance of all sizes that pictures may have.
    fn radiance() -> impl Strategy<Value = f32> {
        prop_oneof![Just(0.0), -1e13_f32..1e13, 0.0_f32..1.0, (-60_i32..60).prop_map(|e| 2_f32.powi(e))]
    }

    proptest! {
        #[test]
        fn order_and_parts_change_no_bit(
            values in prop::collection::vec(prop::collection::vec(radiance(), 3), 1..9),
            order in any::<u64>(),
            cut in 0..9_usize,
        ) {
            let pictures: Vec<Image> = values.iter().map(|values| picture(values)).collect();
            let all = sum(&pictures);
            let mut shuffled = pictures.clone();
            let mut state = order | 1;
            for i in (1..shuffled.len()).rev() {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                shuffled.swap(i, (state >> 33) as usize % (i + 1));
            }
            prop_assert_eq!(&sum(&shuffled).sums, &all.sums);
            let (first, rest) = shuffled.split_at(cut.min(shuffled.len()));
            let mut parts = PictureSum::new(3, 1);
            for part in [first, rest].into_iter().filter(|part| !part.is_empty()) {
                prop_assert!(parts.merge(&sum(part)));
            }
            prop_assert_eq!(parts.count as usize, pictures.len());
            prop_assert_eq!(parts.mean(), all.mean());
            let [a, b] = [&parts, &all].map(|sum| sum.relative_error().unwrap_or(0.0));
            prop_assert!((a - b).abs() <= 1e-9 * b.max(1e-12), "{} {}", a, b);
        }
    }

    #[test]
    fn means_and_errors_are_those_of_the_pictures() {
        let values = [1.0_f32, 2.0, 4.5, 0.25];
        let pictures: Vec<Image> = values.iter().map(|&v| picture(&[v])).collect();
        let sum = sum(&pictures);
        let mean = values.iter().sum::<f32>() / 4.0;
        assert_eq!(sum.mean().pixels, [Vec3::new(mean, mean * 0.5, -mean)]);
        let variance = values.iter().map(|v| f64::from(v - mean).powi(2)).sum::<f64>() / (4.0 * 3.0);
        let of = |factor: f64| {
            let square = (f64::from(mean) * factor).powi(2);
            variance * factor * factor / (square + RELATIVE_EPSILON)
        };
        let expected = (of(1.0) + of(0.5) + of(1.0)) / 3.0;
        let found = sum.relative_error().expect("of four");
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        assert_eq!(PictureSum::new(1, 1).relative_error(), None);
        assert!(!PictureSum::new(2, 1).add(&pictures[0]), "another size");
        // One picture is its own mean, as far as sums are fine.
        assert_eq!(super::tests::sum(&pictures[..1]).mean(), pictures[0]);
        // Beyond what is kept: no overflow, and no panic.
        let huge = picture(&[f32::MAX, f32::NAN, f32::INFINITY]);
        let many = (0..4).fold(PictureSum::new(3, 1), |mut sum, _| {
            assert!(sum.add(&huge));
            sum
        });
        assert_eq!(many.mean().pixels[0].x, MOST as f32);
        assert_eq!(many.mean().pixels[1].x, 0.0);
    }
}
