//! What a surface makes of a path's light.
//!
//! Light that arrives leaves by the diffuse part and by the specular lobe. A deposit stands for all of it, as if it left cosine-weighted: a
//! lobe that is as narrow as it is would be a spike on whatever happens to lie in it, and a few samples would not make a picture of it. So
//! all of the energy is there, and what a metal throws on a wall is spread over what the metal faces (path-space regularisation taken to
//! its end: Kaplanyan and Dachsbacher 2013). The path itself goes on by one of the two, chosen by what either reflects, in a
//! direction that is distributed as that reflects.
//!
//! Worked example: gold of roughness 0.3 reflects 0.93, 0.62, 0.31 of what arrives; the deposit has all of that, and the path goes on
//! in a direction of the lobe. White plastic reflects 0.76 diffusely and 0.05 specularly: one path in 16 goes on by the lobe.

use crate::brdf::{Surface, lobe_albedo, sample_lobe};
use crate::math::warp;
use glam::{Vec2, Vec3};

/// Upper bound of the factor by which a shading normal brightens what leaves.
const MAX_SHADING_FACTOR: f32 = 8.0;

/// Reflection of light that arrives from a direction.
pub(super) struct Scattering<'a> {
    surface: &'a Surface,
    /// Unit, to where light comes from.
    towards: Vec3,
    /// Photons arrive by the geometric normal, radiance is received by the shading normal: corrects for the difference (Veach
    /// 1996, §5.3.2).
    factor: f32,
    diffuse: Vec3,
    specular: Vec3,
}

impl<'a> Scattering<'a> {
    /// Of light from a unit direction; `None` if that is behind the surface or its shading.
    pub fn new(surface: &'a Surface, towards: Vec3) -> Option<Self> {
        let arriving = surface.geometric_normal.dot(towards);
        let shading = surface.shading_normal.dot(towards);
        if arriving <= 0.0 || shading <= 0.0 {
            return None;
        }
        let factor = (shading / arriving).min(MAX_SHADING_FACTOR);
        let mut specular = Vec3::ZERO;
        if surface.is_specular() {
            specular = lobe_albedo(shading, surface.f0, surface.f90, surface.alpha) * factor;
        }
        Some(Self { surface, towards, factor, diffuse: surface.albedo * factor, specular })
    }

    /// What share of the light leaves.
    pub fn albedo(&self) -> Vec3 {
        self.diffuse + self.specular
    }

    /// Where light that arrives with this flux, and leaves with the probability `survival`, goes on, and with what flux: by numbers
    /// in [0, 1) that choose a lobe and a direction of it. `None` if it would go below the surface.
    pub fn go_on(&self, flux: Vec3, survival: f32, lobe: f32, at: Vec2) -> Option<(Vec3, Vec3)> {
        let [diffuse, specular] = [self.diffuse, self.specular].map(|share| (share * flux).max_element());
        let probability = if specular > 0.0 { specular / (specular + diffuse) } else { 0.0 };
        let normal = self.surface.geometric_normal;
        if lobe >= probability {
            return Some((
                cosine_weighted(normal, at),
                flux * (self.diffuse / (survival * (1.0 - probability))),
            ));
        }
        let Surface { shading_normal, f0, f90, alpha, .. } = *self.surface;
        let sample = sample_lobe((shading_normal, self.towards), (f0, f90, alpha), at)?;
        let (leaving, shading) = (normal.dot(sample.direction), shading_normal.dot(sample.direction));
        let factor = self.factor * (leaving / shading).min(MAX_SHADING_FACTOR);
        let flux = flux * sample.weight * (factor / (survival * probability));
        let is_above = leaving > 0.0 && shading > 0.0;
        (is_above && flux.max_element() > 0.0).then_some((sample.direction, flux))
    }
}

/// A cosine-weighted direction from a surface.
pub(super) fn cosine_weighted(normal: Vec3, at: Vec2) -> Vec3 {
    let local = warp::cosine_hemisphere(at);
    let (x, y) = warp::frame(normal);
    (x * local.x + y * local.y + normal * local.z).normalize()
}
