//! Light from infinitely far away, as the integrator sees it.

use super::distant::Distant;
use super::random::Random;
use girandole_core::glam::Vec3;
use girandole_core::math::sh;
use std::f32::consts::{PI, TAU};

/// Where such light comes from.
pub(super) enum Sky<'a> {
    /// The scene's environment.
    Map(Distant<'a>),
    /// Coefficients of spherical harmonics; radiance may be negative.
    Harmonics(&'a [Vec3]),
}

impl Sky<'_> {
    /// Whether it is seen behind the scene.
    pub(super) fn is_visible(&self) -> bool {
        match self {
            Self::Map(distant) => distant.is_visible(),
            Self::Harmonics(_) => false,
        }
    }

    pub(super) fn radiance(&self, direction: Vec3) -> Vec3 {
        match self {
            Self::Map(distant) => distant.radiance(direction),
            Self::Harmonics(coefficients) => sh::evaluate(coefficients, direction),
        }
    }

    pub(super) fn sample(&self, from: Vec3, random: &mut Random) -> Vec3 {
        match self {
            Self::Map(distant) => distant.sample(from, random),
            Self::Harmonics(_) => {
                let z = 1.0 - 2.0 * random.unit();
                let (sin, cos) = libm::sincosf(TAU * random.unit());
                let r = (1.0 - z * z).max(0.0).sqrt();
                Vec3::new(r * cos, r * sin, z)
            }
        }
    }

    /// Density of a direction from a point, sr⁻¹.
    pub(super) fn pdf(&self, from: Vec3, direction: Vec3) -> f32 {
        match self {
            Self::Map(distant) => distant.pdf(from, direction),
            Self::Harmonics(_) => 0.25 / PI,
        }
    }
}
