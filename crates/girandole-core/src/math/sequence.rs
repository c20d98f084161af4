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
