//! The reflection model, mirrored in `shaders/lib/brdf.wgsl`: Lambert beside GGX in glTF's metallic-roughness terms.
//!
//! glTF attenuates a dielectric's diffuse part by 1 − F(v·h), which depends on the light. Here the albedo has to be
//! a factor of the sum over lights, so it is attenuated by 1 − the cosine-weighted mean of F over the hemisphere,
//! which for Schlick's Fresnel is F0 + (F90 − F0)/21: what is reflected of light from everywhere to everywhere is
//! then at most what arrives.

use glam::Vec3;

/// What shading needs to know about a point of a surface.
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
}

/// Smallest GGX α: a point light's reflection in a smoother surface would miss every pixel.
pub const MIN_ALPHA: f32 = 0.002;

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
        let mean_fresnel = f0 + (specular - f0) * (1.0 / 21.0);
        let albedo = base_color * (1.0 - metallic) * (1.0 - mean_fresnel);
        Self {
            albedo,
            f0: dielectric_f0.lerp(base_color, metallic),
            f90: specular + (1.0 - specular) * metallic,
            alpha: (roughness * roughness).max(MIN_ALPHA),
            ..Self::default()
        }
    }

    /// Whether there is a specular lobe.
    pub fn is_specular(&self) -> bool {
        self.f90 > 0.0
    }
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
