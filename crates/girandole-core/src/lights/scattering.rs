//! What a surface makes of a path's light.
//!
//! Light that arrives leaves by the diffuse part and by the specular lobe. A deposit stands for all of it, as if it left cosine-weighted: a
//! lobe that is as narrow as it is would be a spike on whatever happens to lie in it, and a few samples would not make a picture of it. So
//! all of the energy is there, and what something rough throws is spread over what it faces (path-space regularisation taken to its
//! end: Kaplanyan and Dachsbacher 2013). Smooth metal throws light in a wide lobe about the mirrored direction. The path itself goes on
//! by one of the two parts, chosen by what either reflects, in a direction that is distributed as that reflects.
//!
//! Worked example: gold of roughness 0.3 reflects 0.93, 0.62, 0.31 of what arrives; the deposit has all of that, in a lobe, and the path
//! goes on in a direction of its own lobe. White plastic reflects 0.76 diffusely and 0.05 specularly: its deposits are cosine-weighted,
//! and one path in 16 goes on by the lobe.

use super::Profile;
use crate::brdf::{METAL, Surface, lobe_albedo, sample_lobe};
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

    /// How all of the light that leaves is taken to leave.
    pub fn profile(&self) -> Profile {
        let Surface { geometric_normal: normal, shading_normal, alpha, .. } = *self.surface;
        let [diffuse, specular] = [self.diffuse, self.specular].map(Vec3::max_element);
        if specular <= diffuse || self.surface.f0.max_element() <= METAL {
            return Profile::Cosine;
        }
        // Facets are spread about as a cosine to the power of 2 / α² − 2 is, and what they reflect about as one to a quarter of that.
        let sharp = ((0.5 / (alpha * alpha) - 0.5 - 1.0) / 2.0).clamp(0.0, 1.0);
        let share = sharp * (specular - diffuse) / (specular + diffuse);
        let mirrored = shading_normal * (2.0 * shading_normal.dot(self.towards)) - self.towards;
        let cosine = mirrored.dot(normal);
        if share == 0.0 || cosine <= 0.0 {
            return Profile::Cosine;
        }
        // What the lobe of an axis of length 1 sends, by what matt surfaces do: fitted, within 0.05 %.
        let whole = 0.03102 + cosine * (0.07009 + cosine * (0.03841 - cosine * 0.03219));
        Profile::Lobe { axis: mirrored * (share / whole).sqrt().sqrt(), matt: 1.0 - share }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lights::{Clamp, LightSample, SampleOrigin};
    use crate::math::sequence;

    #[test]
    fn lobes_send_as_much_as_matt_surfaces_and_most_of_it_where_they_mirror_it() {
        let (mut lobes, mut aside) = (0, 0);
        for (metallic, roughness) in [(1.0, 0.0), (1.0, 0.4), (1.0, 0.65), (1.0, 0.9), (0.0, 0.1), (0.0, 0.8)]
        {
            let mut surface =
                Surface::from_metallic_roughness(Vec3::splat(0.8), metallic, roughness, 1.0, Vec3::ONE);
            (surface.geometric_normal, surface.shading_normal) = (Vec3::Z, Vec3::Z);
            for cosine in [0.05_f32, 0.2, 0.4, 0.6, 0.8, 1.0] {
                let towards = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
                let profile = Scattering::new(&surface, towards).unwrap().profile();
                let Some((axis, matt)) = profile.lobe() else {
                    assert!(profile == Profile::Cosine && (metallic == 0.0 || roughness > 0.75));
                    continue;
                };
                assert!(metallic == 1.0 && (0.0..1.0).contains(&matt));
                let mirrored = Vec3::new(-towards.x, 0.0, towards.z);
                assert!(axis.normalize().abs_diff_eq(mirrored, 1e-5));
                let sample = LightSample {
                    position: Vec3::ZERO,
                    normal: Vec3::Z,
                    intensity: Vec3::ONE,
                    profile,
                    origin: SampleOrigin::Bounce { path: 0, bounce: 1, triangle: 0 },
                    rectangle: None,
                };
                let (count, mut sum, mut along) = (1 << 14, 0.0, Vec3::ZERO);
                for i in 0..count {
                    let at = Vec2::from_array([0, 1].map(|d| sequence::sample(i, d, 3)));
                    let direction = warp::cosine_hemisphere(at);
                    // What arrives at a distance of 1 m by what matt surfaces send.
                    let received = sample.geometric_factor(direction, -direction, -direction, Clamp::Own);
                    let (g, _) = received.unwrap();
                    sum += f64::from(g / direction.z) / f64::from(count);
                    along += direction * (g / direction.z / count as f32);
                }
                assert!((sum - 1.0).abs() < 2e-3, "{roughness} {cosine}: {sum}");
                lobes += 1;
                // Negative control: matt surfaces send as much to either side.
                aside += u32::from(along.x < -0.1);
            }
        }
        assert!(lobes > 15 && aside > 10, "{lobes} lobes, {aside} to a side");
    }
}
