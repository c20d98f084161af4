//! Well-spread sample points: Owen-scrambled Sobol (Burley 2020, from `sobol_burley`), without its limit of 2¹⁶
//! points a sequence.

/// Coordinate `dimension` of point `index` of the sequence with this seed, in [0, 1).
///
/// Every 2¹⁶ points the scramble changes, so longer sequences stay unbiased, block by block well spread.
pub fn sample(index: u32, dimension: u32, seed: u32) -> f32 {
    let block = index >> 16;
    let set = dimension / sobol_burley::NUM_DIMENSIONS;
    sobol_burley::sample(
        index & 0xffff,
        dimension % sobol_burley::NUM_DIMENSIONS,
        hash(seed ^ hash(block.wrapping_add(set << 16).wrapping_add(0x9e37_79b9))),
    )
}

/// A well-mixed hash (Wellons' lowbias32).
pub fn hash(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether 2ᵏ points put exactly one into each cell of every division into 2ⁱ × 2ᵏ⁻ⁱ.
    fn is_net(k: u32, point: impl Fn(u32) -> [f32; 2]) -> bool {
        (0..=k).all(|i| {
            let (columns, rows) = (1_usize << i, 1_usize << (k - i));
            let mut cells = vec![0; 1 << k];
            for p in (0..1 << k).map(&point) {
                cells[(p[0] * columns as f32) as usize * rows + (p[1] * rows as f32) as usize] += 1;
            }
            cells.iter().all(|&n| n == 1)
        })
    }

    fn random(index: u32, dimension: u32, seed: u32) -> f32 {
        (hash(index ^ hash(dimension ^ hash(seed))) >> 8) as f32 / (1 << 24) as f32
    }

    #[test]
    fn the_first_two_dimensions_fill_every_elementary_cell() {
        for seed in 0..20 {
            assert!(is_net(8, |i| [sample(i, 0, seed), sample(i, 1, seed)]), "{seed}");
            // The second block of 2¹⁶ too.
            assert!(is_net(8, |i| [sample(65536 + i, 0, seed), sample(65536 + i, 1, seed)]), "{seed}");
            // Negative control.
            assert!(!is_net(8, |i| [random(i, 0, seed), random(i, 1, seed)]));
        }
    }

    #[test]
    fn every_dimension_is_stratified_and_in_range() {
        for dimension in [0, 1, 5, 100, 255, 256, 300, 600] {
            let mut strata = [0; 256];
            for i in 0..256 {
                let x = sample(i, dimension, 9);
                assert!((0.0..1.0).contains(&x));
                strata[(x * 256.0) as usize] += 1;
            }
            assert!(strata.iter().all(|&n| n == 1), "{dimension}");
        }
        let mut strata = [0; 256];
        (0..256).for_each(|i| strata[(random(i, 0, 9) * 256.0) as usize] += 1);
        assert!(strata.iter().any(|&n| n != 1), "negative control");
    }

    #[test]
    fn long_sequences_seeds_and_dimensions_do_not_repeat() {
        let differ = |a: &dyn Fn(u32) -> f32, b: &dyn Fn(u32) -> f32| {
            (0..1000).filter(|&i| (a(i) - b(i)).abs() > 1e-6).count() > 950
        };
        assert!(differ(&|i| sample(i, 0, 1), &|i| sample(i + 65536, 0, 1)));
        assert!(differ(&|i| sample(i, 0, 1), &|i| sample(i, 0, 2)));
        assert!(differ(&|i| sample(i, 0, 1), &|i| sample(i, 256, 1)));
        assert!(!differ(&|i| sample(i, 0, 1), &|i| sample(i, 0, 1)), "negative control");
        // Over many blocks the mean stays that of a uniform variable.
        let n = 200_000;
        let mean = (0..n).map(|i| f64::from(sample(i, 3, 5))).sum::<f64>() / f64::from(n);
        assert!((mean - 0.5).abs() < 1e-4, "{mean}");
    }
}
