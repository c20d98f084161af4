//! Random numbers of the path tracer's own: PCG-XSH-RR (O'Neill 2014), one stream a pixel.

use girandole_core::glam::Vec2;

#[derive(Clone, Debug)]
pub(super) struct Random {
    state: u64,
    increment: u64,
}

impl Random {
    /// Streams with different seeds or numbers have nothing to do with each other.
    pub(super) fn new(seed: u32, stream: u64) -> Self {
        let start = mix(mix(stream) ^ u64::from(seed));
        let mut this = Self { state: start, increment: mix(start) | 1 };
        this.bits();
        this
    }

    fn bits(&mut self) -> u32 {
        let old = self.state;
        self.state = old.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(self.increment);
        let shifted = ((old >> 18 ^ old) >> 27) as u32;
        shifted.rotate_right((old >> 59) as u32)
    }

    /// Uniform in [0, 1).
    pub(super) fn unit(&mut self) -> f32 {
        (self.bits() >> 8) as f32 * (1.0 / (1 << 24) as f32)
    }

    /// Uniform in [0, 1) with 53 bits.
    pub(super) fn fine_unit(&mut self) -> f64 {
        let bits = u64::from(self.bits()) << 32 | u64::from(self.bits());
        (bits >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Uniform in the unit square.
    pub(super) fn square(&mut self) -> Vec2 {
        Vec2::new(self.unit(), self.unit())
    }

    /// Uniform in `0..count`, `count` > 0.
    pub(super) fn below(&mut self, count: usize) -> usize {
        ((self.fine_unit() * count as f64) as usize).min(count - 1)
    }
}

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014).
fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ x >> 31
}
