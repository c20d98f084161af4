//! Sums from which what was added can be taken away without a trace.

/// Bits after the point.
const FRACTION: i32 = 50;
/// Each summand counts as no more than this: with up to 2¹⁴ of them nothing overflows.
const LARGEST: f64 = (1u64 << 62) as f64;

/// A sum in fixed point: it does not depend on the order of what was added and taken away.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct ExactSum(i128);

impl ExactSum {
    pub fn add(&mut self, value: f32) {
        self.0 += fixed(value);
    }

    /// Takes away what was added.
    pub fn subtract(&mut self, value: f32) {
        self.0 -= fixed(value);
    }

    pub fn value(self) -> f32 {
        (self.0 as f64 / scale()) as f32
    }
}

impl FromIterator<f32> for ExactSum {
    fn from_iter<T: IntoIterator<Item = f32>>(values: T) -> Self {
        let mut sum = Self::default();
        values.into_iter().for_each(|value| sum.add(value));
        sum
    }
}

fn fixed(value: f32) -> i128 {
    (f64::from(value).min(LARGEST) * scale()) as i128
}

fn scale() -> f64 {
    2f64.powi(FRACTION)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_taken_away_leaves_nothing() {
        let value = |i: i32| (i as f32 * 0.37).sin().abs() * 10f32.powi(i % 13 - 6);
        let values: Vec<f32> = (0..500).map(value).collect();
        let mut sum: ExactSum = values.iter().copied().collect();
        let mut float: f32 = values.iter().sum();
        assert!((sum.value() / float - 1.0).abs() < 1e-5);
        for extreme in [f32::MAX, f32::INFINITY] {
            sum.add(extreme);
        }
        for &odd in values.iter().skip(1).step_by(2) {
            sum.subtract(odd);
            float -= odd;
        }
        for extreme in [f32::MAX, f32::INFINITY] {
            sum.subtract(extreme);
        }
        let even = || values.iter().copied().step_by(2);
        assert_eq!(sum, even().collect());
        // The control: single precision leaves something.
        assert_ne!(float, even().sum::<f32>());
    }
}
