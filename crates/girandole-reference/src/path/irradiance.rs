//! What a point receives from an environment that is given by spherical harmonics.

use super::random::Random;
use super::sky::Sky;
use super::{Integrator, PathSettings, bsdf};
use girandole_core::brdf::Surface;
use girandole_core::glam::{DVec3, Vec3};
use girandole_core::trace::SceneTracer;
use std::f32::consts::PI;

/// Groups of paths, by which the variance is known.
const GROUPS: u32 = 16;

/// What a point receives, W/m², and its variance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Irradiance {
    /// By channel.
    pub mean: Vec3,
    /// Variance of that mean, by channel: that of the means of independent groups of paths, divided by their number.
    pub variance: Vec3,
}

/// What a point with a unit normal receives of the environment that these coefficients of spherical harmonics stand for
/// (`girandole_core::math::sh`; radiance may be negative in places), of nothing else but what emits, and of what the scene
/// reflects of both.
///
/// 0 bounces are what comes without being reflected. Paths are in 16 groups, each with a path in each cell of a square grid of directions, so
/// that there are more than `settings.paths` where those make no squares. `start` is the point, offset from its surface by
/// [`SceneTracer::offset_ray_origin`].
pub fn irradiance(
    tracer: &SceneTracer,
    harmonics: &[Vec3],
    start: Vec3,
    normal: Vec3,
    settings: &PathSettings,
) -> Irradiance {
    let mut integrator = Integrator::new(tracer, settings.bounces, &[]);
    integrator.distant = Some(Sky::Harmonics(harmonics));
    let side = settings.paths.div_ceil(GROUPS).max(1).isqrt().max(1);
    let (mut mean, mut squares) = (DVec3::ZERO, DVec3::ZERO);
    for group in 0..GROUPS {
        let mut random = Random::new(settings.seed, u64::from(group));
        let cells = (0..side * side).map(|cell| {
            let at = (Vec3::new((cell % side) as f32, (cell / side) as f32, 0.0)
                + random.square().extend(0.0))
                / side as f32;
            let wi = bsdf::cosine_direction(normal, at.x, at.y);
            integrator.incident(start, wi, &mut random).as_dvec3()
        });
        // Cosine-weighted directions have the density cos θ / π.
        let of_group = cells.sum::<DVec3>() * f64::from(PI) / f64::from(side * side);
        let step = of_group - mean;
        mean += step / f64::from(group + 1);
        squares += step * (of_group - mean);
    }
    let variance = squares / f64::from(GROUPS * (GROUPS - 1));
    Irradiance { mean: mean.as_vec3(), variance: variance.as_vec3() }
}

impl Integrator<'_> {
    /// The radiance that one random path finds along a ray that starts on a surface.
    fn incident(&self, start: Vec3, wi: Vec3, random: &mut Random) -> Vec3 {
        let mut beta = Vec3::ONE;
        let hit = self.tracer.closest_hit(start, wi, f32::INFINITY, girandole_core::scene::NONE);
        let Some(vertex) = self.scattering((start, wi), hit, |_| true, &mut beta, random) else {
            return beta * self.distant.as_ref().map_or(Vec3::ZERO, |distant| distant.radiance(wi));
        };
        let Surface { emission, .. } = vertex.surface;
        let emitted = if self.emits(vertex.triangle) { beta * emission } else { Vec3::ZERO };
        self.reflected(emitted, vertex, (beta, 1), random)
    }
}
