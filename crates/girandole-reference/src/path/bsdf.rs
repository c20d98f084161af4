//! Reflection for the path tracer: the renderer's BRDF, with sampling of its own.

use super::random::Random;
use girandole_core::brdf::{Surface, specular_brdf};
use girandole_core::glam::Vec3;
use std::f32::consts::{FRAC_1_PI, TAU};

/// BRDF × cosine, 0 where `wi` is behind the surface or its shading.
pub(super) fn evaluate(surface: &Surface, wo: Vec3, wi: Vec3) -> Vec3 {
    let cosine = surface.shading_normal.dot(wi);
    if cosine <= 0.0 || surface.geometric_normal.dot(wi) <= 0.0 {
        return Vec3::ZERO;
    }
    let mut brdf = surface.albedo * FRAC_1_PI;
    if surface.is_specular() {
        brdf += specular_brdf(surface.shading_normal, wo, wi, surface.f0, surface.f90, surface.alpha);
    }
    brdf * cosine
}

/// The probability that a direction is sampled from the specular lobe. Less than 1, so that directions which sampling
/// the lobe cannot produce still have a density.
fn specular_probability(surface: &Surface, wo: Vec3) -> f32 {
    let nv = surface.shading_normal.dot(wo);
    if !surface.is_specular() || nv <= 1e-4 {
        return 0.0;
    }
    let x = 1.0 - nv.min(1.0);
    let specular = surface.f0.max_element() + (surface.f90 - surface.f0.max_element()) * x * x * x * x * x;
    let diffuse = surface.albedo.max_element();
    (specular / (specular + diffuse).max(f32::MIN_POSITIVE)).clamp(0.1, 0.95)
}

/// A direction and its density per solid angle, sr⁻¹; `None` if it points below the surface.
pub(super) fn sample(surface: &Surface, wo: Vec3, random: &mut Random) -> Option<(Vec3, f32)> {
    let n = surface.shading_normal;
    let (t, b) = tangents(n);
    let specular = random.unit() < specular_probability(surface, wo);
    let (u, phi) = (random.unit(), TAU * random.unit());
    let (sin, cos) = libm::sincosf(phi);
    let wi = if specular {
        // Visible normals by spherical caps (Dupuy and Benyoub 2023).
        let alpha = surface.alpha;
        let view = Vec3::new(t.dot(wo) * alpha, b.dot(wo) * alpha, n.dot(wo)).normalize();
        let z = (1.0 - u) * (1.0 + view.z) - view.z;
        let r = (1.0 - z * z).max(0.0).sqrt();
        let cap = Vec3::new(r * cos, r * sin, z) + view;
        let m = Vec3::new(cap.x * alpha, cap.y * alpha, cap.z.max(0.0)).try_normalize()?;
        let half = t * m.x + b * m.y + n * m.z;
        half * (2.0 * half.dot(wo)) - wo
    } else {
        let r = u.sqrt();
        t * (r * cos) + b * (r * sin) + n * (1.0 - u).sqrt()
    };
    let wi = wi.try_normalize()?;
    let pdf = pdf(surface, wo, wi);
    (pdf > 0.0).then_some((wi, pdf))
}

/// The density with which [`sample`] draws `wi`, sr⁻¹.
pub(super) fn pdf(surface: &Surface, wo: Vec3, wi: Vec3) -> f32 {
    let n = surface.shading_normal;
    let cosine = n.dot(wi);
    if cosine <= 0.0 {
        return 0.0;
    }
    let specular = specular_probability(surface, wo);
    let mut result = (1.0 - specular) * cosine * FRAC_1_PI;
    if specular > 0.0 {
        let half = (wo + wi).normalize_or_zero();
        let (nv, nh) = (n.dot(wo), n.dot(half));
        let a2 = surface.alpha * surface.alpha;
        let d = n.cross(half).length_squared() + a2 * nh * nh;
        let distribution = a2 * FRAC_1_PI / (d * d);
        result += specular * distribution * 0.5 / (nv + (a2 + (1.0 - a2) * nv * nv).sqrt());
    }
    result
}

/// Two unit vectors that form an orthonormal basis with `n`.
fn tangents(n: Vec3) -> (Vec3, Vec3) {
    let other = if n.x.abs() < 0.6 { Vec3::X } else { Vec3::Y };
    let t = n.cross(other).normalize();
    (t, n.cross(t))
}

/// A direction of the hemisphere about `n`, cosine-weighted where both numbers, from 0 to 1, are uniform.
pub(super) fn cosine_direction(n: Vec3, u: f32, v: f32) -> Vec3 {
    let (t, b) = tangents(n);
    let (sin, cos) = libm::sincosf(TAU * v);
    let r = u.sqrt();
    (t * (r * cos) + b * (r * sin) + n * (1.0 - u).sqrt()).normalize()
}
