//! Some of the samples for the light of all: what a picture can be begun with.
//!
//! Each sample has a priority, its power divided by a random number in (0, 1]. Those with the highest priorities shine, and the
//! highest that is left out, τ, is what each of them has at least as its power: priority sampling (Duffield, Lund and Thorup 2007,
//! §2). The light is that of all in the mean, strong samples come first, and those of a smaller number are among those of a larger one.

use super::importance::power;
use super::punctual::side;
use super::{LightSample, LightSet};
use crate::generation::Generation;
use crate::math::sequence;
use glam::Vec3;

impl LightSet {
    /// The set with `most` of its samples lit and the others dark, which has the light of all in the mean over seeds. All samples keep
    /// their places, and one of them at least is lit. A larger `most` lights the same samples and others; a set that has no more
    /// is as it is.
    pub fn prefix(&self, most: usize) -> Self {
        let most = most.max(1);
        let priority = |sample: &LightSample| power(sample) / random(sample);
        let mut order: Vec<(f64, usize)> = self.samples.iter().map(priority).zip(0..).collect();
        order.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let Some(&(threshold, _)) = order.get(most) else { return self.clone() };
        let mut samples = self.samples.clone();
        for (rank, &(_, i)) in order.iter().enumerate() {
            let sample = &mut samples[i];
            let own = power(sample);
            let scale = if rank < most && own > 0.0 { own.max(threshold) / own } else { 0.0 };
            sample.intensity =
                if scale > 0.0 { (sample.intensity.as_dvec3() * scale).as_vec3() } else { Vec3::ZERO };
        }
        Self { samples, generation: Generation::fresh(), ..self.clone() }
    }
}

/// A number in (0, 1] that belongs to where a sample is.
fn random(sample: &LightSample) -> f64 {
    let place = sample.position.to_array().map(f32::to_bits);
    // Both halves of a point light are at one place.
    let seed = 0x51ed_270b ^ side(sample);
    let low = place.iter().fold(seed, |hash, &bits| sequence::hash(hash ^ bits));
    (f64::from(low) + 1.0) / 4_294_967_296.0
}
