//! What the specular lobe reflects in all of light that is the same from everywhere: f0 times a number plus f90 times another.

use super::specular_brdf;
use glam::{Vec2, Vec3};
use std::f32::consts::PI;
use std::sync::OnceLock;

/// Entries of the table by the cosine between the normal and the view, and by roughness.
pub const ALBEDO_ENTRIES: [usize; 2] = [32, 32];

/// Half vectors of an entry, by distance from the normal and around it.
const STEPS: [u32; 2] = [32, 16];

/// For each roughness √α (rows, from 0 to 1) and each cosine (from 0 to 1), the shares of f0 and f90.
pub fn albedo_table() -> &'static [Vec2] {
    static TABLE: OnceLock<Vec<Vec2>> = OnceLock::new();
    TABLE.get_or_init(|| {
        let [cosines, roughnesses] = ALBEDO_ENTRIES;
        let entry = |i: usize| {
            let cosine = (i % cosines) as f32 / (cosines - 1) as f32;
            let roughness = (i / cosines) as f32 / (roughnesses - 1) as f32;
            integrated(cosine.max(1e-3), (roughness * roughness).max(super::MIN_ALPHA))
        };
        (0..cosines * roughnesses).map(entry).collect()
    })
}

/// Shares of f0 and f90 in the directional albedo of the specular lobe, bilinear in [`albedo_table`]. Mirrored in
/// `shaders/lib/reflected_environment.wgsl`.
pub fn directional_albedo(cosine: f32, alpha: f32) -> Vec2 {
    let [columns, rows] = ALBEDO_ENTRIES;
    let at = |x: f32, n: usize| {
        let at = x.clamp(0.0, 1.0) * (n - 1) as f32;
        let low = (at as usize).min(n - 2);
        (low, at - low as f32)
    };
    let ((column, s), (row, t)) = (at(cosine, columns), at(alpha.max(0.0).sqrt(), rows));
    let table = albedo_table();
    let entry = |i: usize, j: usize| table[(row + j) * columns + column + i];
    entry(0, 0).lerp(entry(1, 0), s).lerp(entry(0, 1).lerp(entry(1, 1), s), t)
}

/// By half vectors that follow the distribution, on one side of the plane of the view.
fn integrated(cosine: f32, alpha: f32) -> Vec2 {
    let wo = Vec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
    let a2 = alpha * alpha;
    let mut sum = Vec2::ZERO;
    for (i, j) in (0..STEPS[0]).flat_map(|i| (0..STEPS[1]).map(move |j| (i, j))) {
        let (u, v) = ((i as f32 + 0.5) / STEPS[0] as f32, (j as f32 + 0.5) / STEPS[1] as f32);
        let cos2 = (1.0 - u) / (1.0 + u * (a2 - 1.0));
        let (sin, cos) = ((1.0 - cos2).max(0.0).sqrt(), cos2.sqrt());
        let (y, x) = libm::sincosf(v * PI);
        let h = Vec3::new(sin * x, sin * y, cos);
        let wi = h * (2.0 * h.dot(wo)) - wo;
        if wi.z <= 0.0 || h.dot(wo) <= 0.0 {
            continue;
        }
        let distribution = a2 / (PI * (cos2 * (a2 - 1.0) + 1.0) * (cos2 * (a2 - 1.0) + 1.0));
        let weight = wi.z * 4.0 * h.dot(wo) / (distribution * cos);
        // With an f0 of 1 and an f90 of 0, and the other way round.
        let share = |f0, f90| specular_brdf(Vec3::Z, wo, wi.normalize(), Vec3::splat(f0), f90, alpha).x;
        sum += Vec2::new(share(1.0, 0.0), share(0.0, 1.0)) * weight;
    }
    sum / (STEPS[0] * STEPS[1]) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_what_lobes_reflect() {
        // Known values: a smooth surface follows Fresnel; α = 1 along the normal reflects 1 − ln 2 (see `brdf`).
        for cosine in [0.25f32, 0.6, 1.0] {
            let found = directional_albedo(cosine, 0.002);
            let x5 = (1.0 - cosine).powi(5);
            assert!(found.abs_diff_eq(Vec2::new(1.0 - x5, x5), 0.01), "{cosine}: {found}");
        }
        let rough = directional_albedo(1.0, 1.0);
        assert!((rough.element_sum() - (1.0 - 2f32.ln())).abs() < 2e-3, "{rough}");
        // Between entries, against many more half vectors.
        let mut most: f32 = 0.0;
        for i in 0..100 {
            let cosine = 0.1 + 0.9 * ((i * 37 % 100) as f32) / 100.0;
            let alpha = ((i as f32 + 0.5) / 100.0).powi(2).max(crate::brdf::MIN_ALPHA);
            let error = (directional_albedo(cosine, alpha) - integrated(cosine, alpha)).abs().max_element();
            most = most.max(error);
        }
        assert!(most < 0.01, "{most}");
        // The control: other lobes have other shares.
        let other = directional_albedo(0.5, 0.5) - integrated(0.5, 0.3);
        assert!(other.abs().max_element() > 0.05, "{other}");
    }
}
