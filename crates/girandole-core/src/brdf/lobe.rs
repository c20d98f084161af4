//! The specular lobe as a whole: how much of the light from a direction it reflects, and where that goes.
//!
//! Directions are drawn by the normals of facets that are seen from where light comes (Heitz 2018), so that each carries the
//! Fresnel reflectance times `G2/G1`, which is at most 1. The mean of that is the directional albedo: `f0 · a + f90 · b` with two numbers
//! that depend on the angle and on α (Karis 2013). They are tabulated once, by the same directions.

use crate::math::warp;
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;
use std::sync::OnceLock;

/// Angles and roughnesses in the table.
const SIZE: [usize; 2] = [24, 20];
/// Directions squared by which a number of the table is found.
const STEPS: u32 = 24;

/// A direction of a lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LobeSample {
    /// Unit, away from the surface.
    pub direction: Vec3,
    /// BRDF times cosine by density.
    pub weight: Vec3,
}

/// What of a lobe goes with the reflectance at normal incidence and with that at grazing incidence: shares of the light that it reflects.
type Parts = [f32; 2];

/// A direction in which a GGX lobe reflects light from `wo`, for `at` in the unit square; `None` below the horizon. As
/// [`specular_brdf`](super::specular_brdf), with `normal` and `wo` unit vectors.
pub(crate) fn sample_lobe(
    (normal, wo): (Vec3, Vec3),
    (f0, f90, alpha): (Vec3, f32, f32),
    at: Vec2,
) -> Option<LobeSample> {
    let (x, y) = warp::frame(normal);
    let local = Vec3::new(x.dot(wo), y.dot(wo), normal.dot(wo));
    let (wi, parts) = sample_facets(local, alpha, at)?;
    let direction = (x * wi.x + y * wi.y + normal * wi.z).normalize();
    Some(LobeSample { direction, weight: f0 * parts[0] + f90 * parts[1] })
}

/// The share of light from a direction with this cosine to the normal that a GGX lobe reflects: the integral of
/// [`specular_brdf`](super::specular_brdf) times cosine.
pub(crate) fn lobe_albedo(cosine: f32, f0: Vec3, f90: f32, alpha: f32) -> Vec3 {
    static TABLE: OnceLock<Vec<Parts>> = OnceLock::new();
    let table = TABLE.get_or_init(tabulate);
    // More of the table is near grazing angles and smooth surfaces, where albedo changes most.
    let [i, j] = [cosine.clamp(0.0, 1.0).sqrt(), alpha.clamp(0.0, 1.0).sqrt()];
    let (i, j) = (i * (SIZE[0] - 1) as f32, j * (SIZE[1] - 1) as f32);
    let low = [(i as usize).min(SIZE[0] - 2), (j as usize).min(SIZE[1] - 2)];
    let (s, t) = (i - low[0] as f32, j - low[1] as f32);
    let entry = |di: usize, dj: usize| Vec2::from_array(table[(low[1] + dj) * SIZE[0] + low[0] + di]);
    let row = |dj: usize| entry(0, dj).lerp(entry(1, dj), s);
    let parts = row(0).lerp(row(1), t);
    f0 * parts.x + f90 * parts.y
}

/// Row by row of one roughness each.
fn tabulate() -> Vec<Parts> {
    let share = |index: usize, of: usize| index as f32 / (SIZE[of] - 1) as f32;
    (0..SIZE[0] * SIZE[1])
        .map(|entry| {
            let (cosine, roughness) = (share(entry % SIZE[0], 0).powi(2), share(entry / SIZE[0], 1));
            mean_parts(cosine, roughness * roughness)
        })
        .collect()
}

/// What a lobe reflects of light with this cosine to the normal: the mean over directions on a grid that is finer for the facets that lie
/// flattest, of which few are seen.
fn mean_parts(cosine: f32, alpha: f32) -> Parts {
    let wo = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
    let mut sum = [0.0; 2];
    for (i, j) in (0..STEPS).flat_map(|i| (0..STEPS).map(move |j| (i, j))) {
        let s = (Vec2::new(i as f32, j as f32) + 0.5) / STEPS as f32;
        let left = 1.0 - s.x;
        if let Some((_, parts)) = sample_facets(wo, alpha, Vec2::new(1.0 - left * left, s.y)) {
            sum = [0, 1].map(|k| sum[k] + f64::from(2.0 * left * parts[k]));
        }
    }
    sum.map(|sum| (sum / f64::from(STEPS * STEPS)) as f32)
}

/// A reflected direction about +Z by the normals of facets that are visible from `wo` (spherical caps: Dupuy and Benyoub 2023), and
/// its weights: BRDF times cosine by density, apart from the reflectances.
fn sample_facets(wo: Vec3, alpha: f32, at: Vec2) -> Option<(Vec3, Parts)> {
    let seen = Vec3::new(wo.x * alpha, wo.y * alpha, wo.z).normalize();
    let z = (1.0 - at.x) * (1.0 + seen.z) - seen.z;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = libm::sincosf(TAU * at.y);
    let cap = Vec3::new(r * cos, r * sin, z) + seen;
    let facet = Vec3::new(cap.x * alpha, cap.y * alpha, cap.z.max(0.0)).try_normalize()?;
    let vh = wo.dot(facet).clamp(0.0, 1.0);
    let wi = (facet * (2.0 * vh) - wo).try_normalize()?;
    if wi.z <= 0.0 {
        return None;
    }
    // G2/G1 of height-correlated Smith masking.
    let a2 = alpha * alpha;
    let lambda = |cosine: f32| (cosine * cosine * (1.0 - a2) + a2).sqrt();
    let smith = wi.z * lambda(wo.z) + wo.z * lambda(wi.z);
    let passed = wi.z * (wo.z + lambda(wo.z)) / smith.max(f32::MIN_POSITIVE);
    let x = 1.0 - vh;
    let grazing = x * x * x * x * x;
    Some((wi, [passed * (1.0 - grazing), passed * grazing]))
}

#[cfg(test)]
mod tests {
    use super::super::{MIN_ALPHA, specular_brdf};
    use super::*;
    use crate::math::sequence;

    fn facing(cosine: f32) -> Vec3 {
        Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine)
    }

    /// The integral of the BRDF times cosine over a regular grid of half vectors, distributed as GGX facets are.
    fn integrated(cosine: f32, f0: f32, f90: f32, alpha: f32) -> f64 {
        let (wo, steps, a2) = (facing(cosine), 256, f64::from(alpha).powi(2));
        let mut sum = 0.0;
        for (i, j) in (0..steps).flat_map(|i| (0..steps).map(move |j| (i, j))) {
            let [left, v] = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(steps));
            let u = 1.0 - left * left;
            let cos2 = (1.0 - u) / (1.0 + u * (a2 - 1.0));
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * v);
            let across = (1.0 - cos2).sqrt();
            let h = glam::DVec3::new(across * cos, across * sin, cos2.sqrt()).as_vec3();
            let wi = h * (2.0 * h.dot(wo)) - wo;
            if wi.z > 0.0 && h.dot(wo) > 0.0 {
                let f = specular_brdf(Vec3::Z, wo, wi.normalize(), Vec3::splat(f0), f90, alpha).x;
                let density = a2 / (std::f64::consts::PI * (cos2 * (a2 - 1.0) + 1.0).powi(2)) * cos2.sqrt();
                sum += f64::from(f * wi.z * 4.0 * h.dot(wo)) / density * 2.0 * left;
            }
        }
        sum / f64::from(steps * steps)
    }

    #[test]
    fn albedo_is_the_integral_of_the_brdf() {
        let mut differs = 0.0_f64;
        for roughness in [0.1_f32, 0.22, 0.37, 0.5, 0.71, 0.88, 1.0] {
            for cosine in [0.06_f32, 0.13, 0.31, 0.47, 0.66, 0.83, 1.0] {
                for (f0, f90) in [(1.0, 1.0), (0.04, 1.0), (0.0, 0.3), (0.5, 0.0)] {
                    let alpha = roughness * roughness;
                    let expected = integrated(cosine, f0, f90, alpha);
                    let found = f64::from(lobe_albedo(cosine, Vec3::splat(f0), f90, alpha).x);
                    let error = (found - expected).abs();
                    assert!(
                        error < 0.006,
                        "roughness {roughness}, cosine {cosine}, {f0} to {f90}: {found} for {expected}"
                    );
                    // Negative control: Fresnel's reflectance of a mirror.
                    let mirror = f0 + (f90 - f0) * (1.0 - cosine).powi(5);
                    differs = differs.max((f64::from(mirror) - expected).abs());
                }
            }
        }
        assert!(differs > 0.3, "{differs}");
    }

    #[test]
    fn directions_are_distributed_as_light_is_reflected() {
        let (normal, f0, f90) = (Vec3::new(0.6, -0.48, 0.64), Vec3::new(0.9, 0.5, 0.2), 1.0);
        let (x, y) = warp::frame(normal);
        for (alpha, cosine) in [(0.1_f32, 0.8_f32), (0.4, 0.3), (1.0, 0.6)] {
            let local = facing(cosine);
            let wo = x * local.x + y * local.y + normal * local.z;
            let (mut sum, mut along, count) = (Vec3::ZERO, Vec3::ZERO, 1 << 14);
            for i in 0..count {
                let at = Vec2::from_array([0, 1].map(|d| sequence::sample(i, d, 7)));
                let Some(sample) = sample_lobe((normal, wo), (f0, f90, alpha), at) else { continue };
                assert!(sample.direction.is_normalized() && sample.direction.dot(normal) > 0.0);
                assert!(sample.weight.min_element() >= 0.0 && sample.weight.max_element() < 1.001);
                sum += sample.weight / count as f32;
                along += sample.direction * sample.weight.x / count as f32;
            }
            let albedo = lobe_albedo(cosine, f0, f90, alpha);
            assert!(sum.abs_diff_eq(albedo, 6e-3), "α {alpha}: {sum} for {albedo}");
            // Where it goes, by the BRDF over the whole hemisphere.
            let (mut expected, steps) = (Vec3::ZERO, 1 << 18);
            for i in 0..steps {
                let at = Vec2::from_array([0, 1].map(|d| sequence::sample(i, d, 8)));
                let up = warp::cosine_hemisphere(at);
                let wi = (x * up.x + y * up.y + normal * up.z).normalize();
                let brdf = specular_brdf(normal, wo, wi, f0, f90, alpha).x;
                expected += wi * (brdf * std::f32::consts::PI / steps as f32);
            }
            assert!(along.abs_diff_eq(expected, 0.01), "α {alpha}: {along} for {expected}");
            // Negative control: light does not leave about the normal.
            let about = normal * along.length();
            assert!(alpha > 0.5 || !about.abs_diff_eq(expected, 0.1), "α {alpha}");
        }
    }

    #[test]
    fn mirrors_reflect_about_the_normal() {
        let wo = facing(0.6);
        let at = Vec2::new(0.3, 0.8);
        let sample = sample_lobe((Vec3::Z, wo), (Vec3::ONE, 1.0, MIN_ALPHA), at).expect("above the horizon");
        assert!(sample.direction.abs_diff_eq(Vec3::new(-wo.x, 0.0, wo.z), 0.02), "{sample:?}");
        assert!(sample.weight.abs_diff_eq(Vec3::ONE, 1e-3));
        // Straight along the surface nothing breaks.
        for cosine in [0.0, 1e-6, 1e-3] {
            let albedo = lobe_albedo(cosine, Vec3::ONE, 1.0, 0.25);
            assert!(
                albedo.is_finite() && albedo.max_element() <= 1.0 && albedo.min_element() > 0.5,
                "{albedo}"
            );
            let found = sample_lobe((Vec3::Z, facing(cosine)), (Vec3::ONE, 1.0, 0.25), at);
            assert!(found.is_none_or(|s| s.weight.is_finite() && s.direction.is_finite()), "{found:?}");
        }
    }
}
