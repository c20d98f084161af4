//! The geometric factor between a light sample and a point.

use super::{LightSample, Profile};
use glam::Vec3;

/// What the geometric factor is near light samples, where a sample is a poor stand-in for the surface about it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Clamp {
    /// Close to a sample, the mean over the [rectangle](LightSample::rectangle) that it stands for, and no bound. For a rectangle of the
    /// area A it is at most π / A.
    #[default]
    Own,
    /// At most so much, the same for all samples, m⁻².
    At(f32),
    /// None: the sum over point lights as it is, with bright spots next to them.
    Off,
}

/// How a lobe falls with the cosine at the sample: by 1 / (1 + LOBE_SLOPE · cosine). Before and after, that makes it symmetric, and as
/// bright in all directions in a uniform field as what is matt, within 2.5 % (Sinkhorn 1964: scaled so that all rows sum to 1).
pub const LOBE_SLOPE: f32 = 2.5;

impl LightSample {
    /// Whether its place lies before the planes of a receiver; of parallel light, whether it comes from there. Where not, part of its
    /// rectangle may still do, and lights the receiver: what lies in a plane before another one is seen from there, and no shadow
    /// ray is asked.
    pub fn is_before(&self, position: Vec3, geometric_normal: Vec3, shading_normal: Vec3) -> bool {
        let to_light = if self.profile.is_parallel() { -self.normal } else { self.position - position };
        geometric_normal.dot(to_light) > 0.0 && shading_normal.dot(to_light) > 0.0
    }

    /// The geometric factor `G` of this sample at a point, m⁻² (parallel light: a cosine); and the unit direction that light comes
    /// from. `None` unless both cosines and the geometric one are positive: a pair counts only if the geometric normals of
    /// both face each other; or, close to the sample, if part of its rectangle lies before the receiver's plane, and it is open. Mirrored in
    /// `shaders/lib/light.wgsl`.
    pub fn geometric_factor(
        &self,
        position: Vec3,
        geometric_normal: Vec3,
        shading_normal: Vec3,
        clamp: Clamp,
    ) -> Option<(f32, Vec3)> {
        if self.profile.is_parallel() {
            let is_before = self.is_before(position, geometric_normal, shading_normal);
            return is_before.then(|| (shading_normal.dot(-self.normal), -self.normal));
        }
        let to_light = self.position - position;
        let cos_light = -self.normal.dot(to_light);
        if cos_light <= 0.0 {
            return None;
        }
        let r2 = to_light.length_squared();
        let is_before = self.is_before(position, geometric_normal, shading_normal);
        if let (Clamp::Own, Some(rectangle)) = (clamp, &self.rectangle) {
            let share = rectangle.point_share(position);
            if share < 1.0 && (is_before || rectangle.is_open) {
                let point = if is_before { to_light * (self.sent(to_light) / (r2 * r2)) } else { Vec3::ZERO };
                let mean = rectangle.mean_vector(position, shading_normal).lerp(point, share);
                let g = mean.dot(shading_normal);
                return (g > 0.0).then(|| (g, mean.normalize()));
            }
        }
        if !is_before {
            return None;
        }
        let cos_x = shading_normal.dot(to_light);
        let inverse_r = 1.0 / r2.sqrt();
        let falloff = match self.profile {
            Profile::Cosine | Profile::Lobe { .. } => self.sent(to_light) * inverse_r,
            Profile::Spot { scale, offset } => {
                let x = (cos_light * inverse_r * scale + offset).clamp(0.0, 1.0);
                x * x
            }
            Profile::Hemisphere | Profile::Directional | Profile::Distant { .. } => 1.0,
        };
        let bound = if let Clamp::At(bound) = clamp { bound } else { f32::MAX };
        Some(((cos_x * inverse_r * falloff / r2).min(bound), to_light * inverse_r))
    }

    /// The cosine at the sample times the distance, or what stands for it in a lobe.
    fn sent(&self, to_light: Vec3) -> f32 {
        let cosine = -self.normal.dot(to_light);
        let Some((axis, matt)) = self.profile.lobe() else { return cosine };
        let (along, r2) = ((-axis.dot(to_light)).max(0.0), to_light.length_squared());
        let along2 = along * along / r2;
        cosine * (matt + along2 * along2 / (1.0 + LOBE_SLOPE * (cosine / r2.sqrt()).max(0.0)))
    }
}
