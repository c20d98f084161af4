//! The reflection model, mirrored in `shaders/lib/brdf.wgsl`: Lambert beside GGX in glTF's metallic-roughness terms.
//!
//! glTF 2.0 (appendix B) attenuates a dielectric's diffuse part by 1 − F(v·h), which depends on the light. Here the albedo has to
//! be a factor of the sum over lights, so it is attenuated by 1 − the mean of F(v·h) over light and view, both cosine-weighted:
//! F0 + 0.00367 (F90 − F0) for Schlick's Fresnel. Of light from everywhere a dielectric then reflects what glTF's does: 0.4 % less
//! seen head-on, 0.4 % more at 66°, 1.5 % more at 80°.
//!
//! As glTF's, it gains energy: what the lobe reflects more at grazing angles is not taken from the diffuse part. A perfectly white,
//! smooth dielectric reflects 1.042 of light from everywhere to everywhere, 1.19 at 74° and twice what arrives at 90°; at a roughness
//! of 1 it reflects 0.98. With an albedo of 0.9 nothing is gained in the mean.

mod albedo;

pub use albedo::{ALBEDO_ENTRIES, albedo_table, directional_albedo};

use glam::Vec3;

mod lobe;

pub(crate) use lobe::{lobe_albedo, sample_lobe};

/// The properties of a surface point that shading needs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Surface {
    /// Position relative to the geometry's origin.
    pub position: Vec3,
    /// Unit normal of the triangle, on the side that is seen.
    pub geometric_normal: Vec3,
    /// Unit shading normal, on the side that is seen.
    pub shading_normal: Vec3,
    /// Diffuse reflectance; reflection is this / π.
    pub albedo: Vec3,
    /// Specular reflectance at normal incidence.
    pub f0: Vec3,
    /// Specular reflectance at grazing incidence; 0 = no specular lobe.
    pub f90: f32,
    /// GGX α.
    pub alpha: f32,
    /// Emitted radiance, W/(sr·m²).
    pub emission: Vec3,
    /// Share of the radiance from straight behind that passes; 0 = opaque.
    pub transmittance: Vec3,
}

/// Smallest GGX α: a point light's reflection in a smoother surface would miss every pixel.
pub const MIN_ALPHA: f32 = 0.002;

/// What reflects more than this at normal incidence throws light as metals do.
pub(crate) const METAL: f32 = 0.2;
/// Mean of Schlick's (1 − v·h)⁵ over directions of light and view, both cosine-weighted.
const MEAN_SCHLICK: f32 = 0.00367;

impl Surface {
    /// The reflection of a glTF material (appendix B; `KHR_materials_specular`). Normals and position are left zero.
    pub fn from_metallic_roughness(
        base_color: Vec3,
        metallic: f32,
        roughness: f32,
        specular: f32,
        specular_color: Vec3,
    ) -> Self {
        let dielectric_f0 = (0.04 * specular_color).min(Vec3::ONE) * specular;
        let f0 = dielectric_f0.max_element();
        let mean_fresnel = f0 + (specular - f0) * MEAN_SCHLICK;
        let albedo = base_color * (1.0 - metallic) * (1.0 - mean_fresnel);
        Self {
            albedo,
            f0: dielectric_f0.lerp(base_color, metallic),
            f90: specular + (1.0 - specular) * metallic,
            alpha: (roughness * roughness).max(MIN_ALPHA),
            ..Self::default()
        }
    }

    /// Lets light through: of the surface only `opacity` is there, and of what enters it `transmission` passes, tinted, instead of
    /// being diffusely reflected (glTF's alpha blending and `KHR_materials_transmission`, as a thin wall). `cosine` is that of the
    /// angle between the normal and the ray. Mirrored in `shaders/lib/reflection.wgsl`.
    pub fn see_through(&mut self, opacity: f32, transmission: f32, tint: Vec3, cosine: f32) {
        let reflected = self.f0 + (self.f90 - self.f0) * (1.0 - cosine.clamp(0.0, 1.0)).powi(5);
        let passes = transmission * tint * (1.0 - reflected.min(Vec3::ONE));
        self.transmittance = Vec3::splat(1.0 - opacity) + opacity * passes;
        self.albedo *= opacity * (1.0 - transmission);
        self.f0 *= opacity;
        self.f90 *= opacity;
    }

    /// Whether there is a specular lobe.
    pub fn is_specular(&self) -> bool {
        self.f90 > 0.0
    }
}

/// GGX α of a lobe that is wide enough to show what is between light samples that stand for a `solid_angle` each, sr: a mirror then
/// reflects them as discs that meet. In the limit of many samples nothing changes (path-space regularisation: Kaplanyan and
/// Dachsbacher 2013). Mirrored in `shaders/lib/brdf.wgsl`.
pub fn widened_alpha(alpha: f32, solid_angle: f32) -> f32 {
    // A half vector turns by half of what light does, and at 0.64 α the distribution is at half of its peak.
    (alpha * alpha + 0.25 * solid_angle).sqrt().min(1.0)
}

/// What a widened lobe is multiplied by to reflect as much as before in all: the wider a lobe, the more of it is lost between facets. Within 7 %
/// of the ratio of both lobes' directional albedos with an f0 of 1 (a fit). `cosine` is that of the angle between normal and view. Mirrored
/// in `shaders/lib/brdf.wgsl`.
pub fn widened_gain(cosine: f32, alpha: f32, widened: f32) -> f32 {
    let nv = cosine.clamp(0.0, 1.0);
    let (along, across) = (3.29 * nv - 0.86, 0.95 * (1.0 - nv) * (1.0 - nv));
    let lost = |alpha: f32| 1.0 + alpha * (alpha * along + across);
    lost(widened) / lost(alpha)
}

/// GGX α of a lobe that is seen through a pixel across which the reflected direction changes by so much, in x and in y: as wide as both
/// together, at most half of a hemisphere. Mirrored in `shaders/lib/brdf.wgsl`.
pub fn footprint_alpha(alpha: f32, footprint: [Vec3; 2]) -> f32 {
    let [x, y] = footprint.map(Vec3::length_squared);
    let seen = alpha * alpha + (x + y) * (1.0 / 16.0);
    // Where normals turn within a pixel there may be no number.
    if seen.is_finite() { seen.sqrt().min(alpha.max(0.5)) } else { alpha.max(0.5) }
}

/// The share of a lobe that is left where light samples that stand for a `solid_angle` each widen it: as much as of its tail is right. The
/// rest of what an environment sends is taken from its [prefiltered maps](crate::scene::PrefilteredEnvironment). Mirrored in
/// `shaders/lib/brdf.wgsl`.
pub fn resolved_share(alpha: f32, solid_angle: f32) -> f32 {
    alpha * alpha / (alpha * alpha + 0.25 * solid_angle)
}

/// Shares of a lobe that light samples do not resolve of which no mirrored ray is sent.
pub const MIRROR_LEAST: f32 = 0.1;
/// Shares of a lobe that light samples resolve that are left to mirrored rays as well.
pub const MIRROR_REST: f32 = 0.02;
/// Fresnel reflectance that is not worth a mirrored ray.
pub const MIRROR_LEAST_FRESNEL: f32 = 0.004;

/// What `lights` light samples stand for in the mean, sr: about twice what they would if they lay evenly all around, as half of them
/// face away.
pub fn mirror_solid_angle(lights: usize) -> f32 {
    8.0 * std::f32::consts::PI / lights.max(1) as f32
}

/// How much of what a surface reflects is found by rays that it mirrors, where light samples stand for `solid_angle`, sr, in the mean: what
/// these do not [resolve](resolved_share), less a tenth, all where they resolve next to nothing, and less where hardly anything is reflected. `fresnel` is the largest component of
/// its reflectance.
pub fn mirror_share(alpha: f32, fresnel: f32, solid_angle: f32) -> f32 {
    if solid_angle <= 0.0 {
        return 0.0;
    }
    let unresolved = 1.0 - resolved_share(alpha, solid_angle);
    let worth = (fresnel - MIRROR_LEAST_FRESNEL) / (2.0 * MIRROR_LEAST_FRESNEL);
    ((unresolved - MIRROR_LEAST) / (1.0 - MIRROR_LEAST - MIRROR_REST)).clamp(0.0, 1.0) * worth.clamp(0.0, 1.0)
}

/// The largest alpha of lobes that mirrored rays show [all](mirror_share) of.
pub fn polished_alpha(solid_angle: f32) -> f32 {
    (0.25 * solid_angle * MIRROR_REST / (1.0 - MIRROR_REST)).sqrt()
}

/// What samples of an environment stand for at least where it is asked what lies behind a reflection, sr: what a texel of the
/// prefiltered maps spreads over. The sun's samples stand for less.
pub const LEAST_SOLID_ANGLE: f32 = 1e-3;

/// About how much of what a lobe about the direction `reflected` reflects comes from the directions that a sample of an environment stands
/// for, in any unit, for its radiance times its solid angle of 1. As a lobe's tail is far beyond a sample's extent, and no wider than
/// what the sample stands for where the lobe is narrow. Mirrored in `shaders/lib/brdf.wgsl`.
pub fn sample_weight(reflected: Vec3, wi: Vec3, alpha: f32, solid_angle: f32) -> f32 {
    let cosine = reflected.dot(wi);
    // The squared tangent of half of the angle is the slope of the half vector.
    let slope2 = ((1.0 - cosine) / (1.0 + cosine).max(1e-3)).max(0.0);
    let width2 = alpha * alpha + 0.25 * solid_angle.max(LEAST_SOLID_ANGLE);
    let share = alpha * alpha / width2;
    let tail = width2 / ((slope2 + width2) * (slope2 + width2));
    share * tail + (1.0 - share) * libm::expf(-slope2 / width2) / width2
}

/// The specular BRDF, 1/sr: GGX distribution, height-correlated Smith visibility (Heitz 2014, eq. 99), Schlick's
/// Fresnel. `wo` and `wi` are unit vectors away from the surface with positive cosines to `normal`.
pub fn specular_brdf(normal: Vec3, wo: Vec3, wi: Vec3, f0: Vec3, f90: f32, alpha: f32) -> Vec3 {
    let h = (wo + wi).normalize_or_zero();
    let (nv, nl) = (normal.dot(wo).max(1e-4), normal.dot(wi).max(0.0));
    let (nh, vh) = (normal.dot(h).clamp(0.0, 1.0), wo.dot(h).clamp(0.0, 1.0));
    let a2 = alpha * alpha;
    // |n × h|² in place of 1 − (n·h)², of which nothing is left near the peak of a smooth surface.
    let d = normal.cross(h).length_squared() + a2 * nh * nh;
    let distribution = a2 / (std::f32::consts::PI * d * d);
    let smith = nl * (nv * nv * (1.0 - a2) + a2).sqrt() + nv * (nl * nl * (1.0 - a2) + a2).sqrt();
    let x = 1.0 - vh;
    let x5 = x * x * x * x * x;
    let fresnel = f0 + (Vec3::splat(f90) - f0) * x5;
    fresnel * (distribution * 0.5 / smith.max(1e-7))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    fn direction(cosine: f32, phi: f32) -> Vec3 {
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        Vec3::new(sine * phi.cos(), sine * phi.sin(), cosine)
    }

    /// What share of light from `wo` the lobe reflects: half vectors on a grid that follows the distribution.
    fn directional_albedo(cosine: f32, f0: f32, f90: f32, alpha: f32) -> f64 {
        let wo = direction(cosine, 0.0);
        let a2 = f64::from(alpha).powi(2);
        let steps = 128;
        let mut sum = 0.0;
        for i in 0..steps {
            for j in 0..steps {
                let (u, v) =
                    ((f64::from(i) + 0.5) / f64::from(steps), (f64::from(j) + 0.5) / f64::from(steps));
                let cos2 = (1.0 - u) / (1.0 + u * (a2 - 1.0));
                let h = direction(cos2.sqrt() as f32, (TAU * v) as f32);
                let wi = h * (2.0 * h.dot(wo)) - wo;
                if wi.z > 0.0 && h.dot(wo) > 0.0 {
                    let f = specular_brdf(Vec3::Z, wo, wi.normalize(), Vec3::splat(f0), f90, alpha).x;
                    let distribution = a2 / (PI * (cos2 * (a2 - 1.0) + 1.0).powi(2));
                    sum += f64::from(f * wi.z * 4.0 * h.dot(wo)) / (distribution * cos2.sqrt());
                }
            }
        }
        sum / f64::from(steps * steps)
    }

    /// Mean of [`directional_albedo`] over directions, cosine-weighted.
    fn albedo(f0: f32, f90: f32, alpha: f32) -> f64 {
        let mean = (0..64).map(|i| directional_albedo(((i as f32 + 0.5) / 64.0).sqrt(), f0, f90, alpha));
        mean.sum::<f64>() / 64.0
    }

    #[test]
    fn lobes_of_neighbouring_samples_meet() {
        assert_eq!(widened_alpha(0.3, 0.0), 0.3);
        assert!(widened_alpha(MIN_ALPHA, 100.0) <= 1.0);
        // Of two samples that stand for squares side by side, a mirror shows half of its brightest between them.
        let solid_angle: f32 = 0.04;
        let alpha = widened_alpha(MIN_ALPHA, solid_angle);
        let lobe = |angle: f32| {
            let light = direction(angle.cos(), 0.0);
            specular_brdf(Vec3::Z, Vec3::Z, light, Vec3::ONE, 1.0, alpha).x * light.z
        };
        let half = lobe(0.5 * solid_angle.sqrt()) / lobe(0.0);
        assert!((0.45..0.75).contains(&half), "{half}");
    }

    #[test]
    fn widened_lobes_keep_what_they_reflect() {
        for cosine in [0.15, 0.4, 0.7, 1.0] {
            for (alpha, widened) in [(0.01, 0.2), (0.01, 0.6), (0.1, 1.0), (0.5, 0.8), (0.9, 1.0)] {
                let reflected = |alpha| directional_albedo(cosine, 1.0, 1.0, alpha);
                let gain = f64::from(widened_gain(cosine, alpha, widened));
                let found = gain * reflected(widened) / reflected(alpha);
                assert!((found - 1.0).abs() < 0.12, "{cosine}, {alpha} to {widened}: {found}");
            }
        }
        // The control: without, two thirds of the light would be lost.
        assert!(directional_albedo(1.0, 1.0, 1.0, 1.0) < 0.35);
        assert_eq!(widened_gain(0.5, 0.3, 0.3), 1.0);
    }

    #[test]
    fn is_reciprocal() {
        let f0 = Vec3::new(0.9, 0.4, 0.1);
        for i in 0..200 {
            let a = direction(0.05 + 0.9 * (i % 7) as f32 / 7.0, i as f32);
            let b = direction(0.05 + 0.9 * (i % 11) as f32 / 11.0, 2.3 * i as f32);
            let alpha = 0.05 + 0.9 * (i % 13) as f32 / 13.0;
            let (forth, back) =
                (specular_brdf(Vec3::Z, a, b, f0, 1.0, alpha), specular_brdf(Vec3::Z, b, a, f0, 1.0, alpha));
            assert!((forth - back).abs().max_element() <= 1e-5 * forth.max_element(), "{forth} {back}");
            // Negative control: another pair is not the same.
            let other = specular_brdf(Vec3::Z, a, direction(a.z * 0.5, 1.0), f0, 1.0, alpha);
            assert!((forth - other).abs().max_element() > 1e-5 * forth.max_element());
        }
    }

    #[test]
    fn mirrored_rays_show_all_of_what_is_polished() {
        for solid_angle in [0.01, 0.1] {
            let share = |scale: f32| mirror_share(scale * polished_alpha(solid_angle), 0.04, solid_angle);
            assert_eq!([0.1, 0.999].map(share), [1.0; 2]);
            assert!((0.99..0.9999).contains(&share(1.1)), "{}", share(1.1));
        }
        assert_eq!(mirror_share(0.01, 0.04, 0.0), 0.0);
    }

    #[test]
    fn a_mirror_of_facets_reflects_at_most_everything() {
        for alpha in [MIN_ALPHA, 0.05, 0.3, 1.0] {
            for cosine in [0.1, 0.5, 0.9, 1.0] {
                let share = directional_albedo(cosine, 1.0, 1.0, alpha);
                assert!(share < 1.001, "α {alpha}, cosine {cosine}: {share}");
                if alpha < 0.01 {
                    assert!(share > 0.998, "cosine {cosine}: a smooth one keeps all but {share}");
                }
            }
        }
        // Known value: α = 1 at normal incidence. With D = 1/π, V = 1/(2(1 + cos i)), it is ∫ cos/(1 + cos) = 1 − ln 2.
        let share = directional_albedo(1.0, 1.0, 1.0, 1.0);
        assert!((share - (1.0 - 2f64.ln())).abs() < 1e-3, "{share}");
    }

    #[test]
    fn smooth_surfaces_follow_fresnel() {
        for cosine in [0.2f32, 0.6, 1.0] {
            let expected = 0.04 + 0.96 * f64::from(1.0 - cosine).powi(5);
            let share = directional_albedo(cosine, 0.04, 1.0, 0.004);
            assert!((share / expected - 1.0).abs() < 0.01, "{cosine}: {share} for {expected}");
        }
    }

    /// Mean of Schlick's (1 − v·h)⁵ over cosine-weighted light.
    fn mean_schlick(cosine: f32) -> f64 {
        let (wo, steps) = (direction(cosine, 0.0), 256);
        let of = |i: i32, j: i32| {
            let light = direction(((i as f32 + 0.5) / 256.0).sqrt(), (j as f32 + 0.5) / 256.0 * TAU as f32);
            f64::from(1.0 - wo.dot((wo + light).normalize())).powi(5)
        };
        (0..steps).flat_map(|i| (0..steps).map(move |j| of(i, j))).sum::<f64>() / f64::from(steps * steps)
    }

    #[test]
    fn a_chart_of_dielectrics_is_as_bright_as_by_gltf() {
        let mean = (0..64).map(|i| mean_schlick(((i as f32 + 0.5) / 64.0).sqrt())).sum::<f64>() / 64.0;
        assert!((mean - f64::from(MEAN_SCHLICK)).abs() < 2e-5, "{mean}");
        let mut wrong: f64 = 0.0;
        for cosine in [1.0f32, 0.8, 0.6, 0.4, 0.17] {
            let schlick = mean_schlick(cosine);
            for (color, roughness, specular) in
                [(0.05, 0.1, 1.0), (0.2, 0.4, 1.0), (0.5, 0.7, 0.5), (0.8, 1.0, 1.0), (1.0, 0.2, 0.3)]
            {
                let base = Vec3::splat(color);
                let s = Surface::from_metallic_roughness(base, 0.0, roughness, specular, Vec3::ONE);
                let lobe = directional_albedo(cosine, s.f0.x, s.f90, s.alpha);
                let f0 = f64::from(s.f0.x);
                // glTF 2.0, appendix B: mix(diffuse, specular, F) with F of the half vector, over light from everywhere.
                let gltf = f64::from(color) * (1.0 - f0 - (f64::from(specular) - f0) * schlick) + lobe;
                let ratio = (f64::from(s.albedo.x) + lobe) / gltf;
                let bound = if cosine > 0.3 { 0.005 } else { 0.015 };
                assert!((ratio - 1.0).abs() < bound, "{color} {roughness} {specular} at {cosine}: {ratio}");
                // Negative control: the mean of F(n·l), by which the diffuse part was attenuated once.
                let taken = (specular - s.f0.x) * (1.0 / 21.0 - MEAN_SCHLICK) * color;
                wrong = wrong.max(1.0 - (f64::from(s.albedo.x - taken) + lobe) / gltf);
            }
        }
        assert!(wrong > 0.03, "{wrong}");
    }

    #[test]
    fn metals_and_matte_surfaces_win_no_energy_and_dielectrics_what_is_said() {
        for roughness in [0.0, 0.2, 0.5, 0.8, 1.0] {
            let metal = Surface::from_metallic_roughness(Vec3::ONE, 1.0, roughness, 1.0, Vec3::ONE);
            assert_eq!(metal.albedo, Vec3::ZERO);
            assert!(albedo(metal.f0.x, metal.f90, metal.alpha) < 1.002);
            let matte = Surface::from_metallic_roughness(Vec3::ONE, 0.0, roughness, 0.0, Vec3::ONE);
            assert_eq!((matte.albedo, matte.f90), (Vec3::ONE, 0.0));
        }
        let white = |color, roughness| {
            let s = Surface::from_metallic_roughness(Vec3::splat(color), 0.0, roughness, 1.0, Vec3::ONE);
            let at = |cosine| f64::from(s.albedo.x) + directional_albedo(cosine, s.f0.x, s.f90, s.alpha);
            (f64::from(s.albedo.x) + albedo(s.f0.x, s.f90, s.alpha), at(74f32.to_radians().cos()))
        };
        let (mean, at_74_degrees) = white(1.0, 0.0);
        assert!((mean - 1.042).abs() < 2e-3 && (at_74_degrees - 1.19).abs() < 0.01, "{mean} {at_74_degrees}");
        let (rough, _) = white(1.0, 1.0);
        assert!((rough - 0.98).abs() < 5e-3, "{rough}");
        assert!(white(0.9, 0.0).0 < 1.0);
    }

    #[test]
    fn the_peak_keeps_its_precision() {
        let alpha = f64::from(MIN_ALPHA);
        for degrees in [0.0f64, 0.02, 0.1, 0.3] {
            // Half vector off the normal by an angle, both directions mirrored about it, in double precision.
            let (h, wide) = (degrees.to_radians(), 0.5f64);
            let at = |angle: f64| Vec3::new(angle.sin() as f32, 0.0, angle.cos() as f32);
            let (o, i) = (h - wide, h + wide);
            let found = specular_brdf(Vec3::Z, at(o), at(i), Vec3::ONE, 1.0, MIN_ALPHA).x;
            let a2 = alpha * alpha;
            let distribution = a2 / (PI * (h.cos().powi(2) * (a2 - 1.0) + 1.0).powi(2));
            let lambda = |c: f64| (c * c * (1.0 - a2) + a2).sqrt();
            let smith = i.cos() * lambda(o.cos()) + o.cos() * lambda(i.cos());
            let expected = distribution * 0.5 / smith;
            assert!((f64::from(found) / expected - 1.0).abs() < 2e-3, "{degrees}°: {found} for {expected}");
        }
    }

    #[test]
    fn a_material_without_specular_is_lambertian() {
        let s = Surface::from_metallic_roughness(Vec3::new(0.2, 0.5, 0.9), 0.0, 0.3, 0.0, Vec3::ONE);
        assert_eq!((s.albedo, s.f0, s.is_specular()), (Vec3::new(0.2, 0.5, 0.9), Vec3::ZERO, false));
        assert!(Surface::from_metallic_roughness(Vec3::ONE, 0.0, 0.3, 0.1, Vec3::ONE).is_specular());
    }
}
