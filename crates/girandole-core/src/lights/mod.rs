//! Light samples: all light in a scene as oriented point lights (Barczak §4.1; Keller 1997).

mod direct;
mod walk;

use crate::scene::{Geometry, Scene};
use glam::Vec3;

/// How a light sample's intensity depends on direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Profile {
    /// Falls with the cosine to the normal: light from or by way of a surface.
    Cosine,
    /// Equal over the hemisphere about the normal: half of a point light.
    Hemisphere,
    /// glTF's spot: `saturate(cos · scale + offset)²` with the cosine to the normal.
    Spot {
        /// 1 / (cos inner − cos outer).
        scale: f32,
        /// −cos outer · scale.
        offset: f32,
    },
    /// Parallel light along the normal; the position lies outside the scene, distance does not count.
    Directional,
}

/// Where a light sample comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleOrigin {
    /// On an emitting triangle.
    Emitter {
        /// Index into [`Geometry::triangles`].
        triangle: u32,
    },
    /// A punctual light of the scene.
    Punctual {
        /// Index into the scene's lights.
        light: u32,
    },
    /// Left by a random walk.
    Bounce {
        /// Which path.
        path: u32,
        /// 1 for the first surface after the emitter.
        bounce: u32,
        /// The triangle that was hit.
        triangle: u32,
    },
}

/// An oriented point light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Position relative to the geometry's origin, lifted a little off the surface it lies on.
    pub position: Vec3,
    /// Unit normal; nothing is emitted behind it.
    pub normal: Vec3,
    /// Radiant intensity along the normal, W/sr, linear RGB (directional: irradiance, W/m²).
    pub intensity: Vec3,
    /// Dependence on direction.
    pub profile: Profile,
    /// Where it comes from.
    pub origin: SampleOrigin,
}

impl LightSample {
    /// The triangle that the sample lies on, [`NONE`](crate::scene::NONE) for punctual lights.
    pub fn triangle(&self) -> u32 {
        match self.origin {
            SampleOrigin::Emitter { triangle } | SampleOrigin::Bounce { triangle, .. } => triangle,
            SampleOrigin::Punctual { .. } => crate::scene::NONE,
        }
    }

    /// The geometric factor `G` of this sample at a point, m⁻² (directional: a cosine), bounded by `clamp`; and the
    /// unit direction to the light. `None` unless both cosines and the geometric one are positive. Spec: the pair
    /// counts only if the geometric normals of both face each other. Mirrored in `shaders/lib/light.wgsl`.
    pub fn geometric_factor(
        &self,
        position: Vec3,
        geometric_normal: Vec3,
        shading_normal: Vec3,
        clamp: f32,
    ) -> Option<(f32, Vec3)> {
        if self.profile == Profile::Directional {
            let wi = -self.normal;
            let cosine = shading_normal.dot(wi);
            return (cosine > 0.0 && geometric_normal.dot(wi) > 0.0).then_some((cosine, wi));
        }
        let to_light = self.position - position;
        let cos_x = shading_normal.dot(to_light);
        let cos_light = -self.normal.dot(to_light);
        if cos_x <= 0.0 || cos_light <= 0.0 || geometric_normal.dot(to_light) <= 0.0 {
            return None;
        }
        let r2 = to_light.length_squared();
        let inverse_r = 1.0 / r2.sqrt();
        let falloff = match self.profile {
            Profile::Cosine => cos_light * inverse_r,
            Profile::Spot { scale, offset } => {
                let x = (cos_light * inverse_r * scale + offset).clamp(0.0, 1.0);
                x * x
            }
            Profile::Hemisphere | Profile::Directional => 1.0,
        };
        Some(((cos_x * inverse_r * falloff / r2).min(clamp), to_light * inverse_r))
    }
}

/// How paths of the random walk end before the bounce limit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Termination {
    /// Never: every hit leaves a sample, weaker by the albedo each time.
    Throughput,
    /// With probability 1 − max(albedo) at every hit (Russian roulette): samples of even strength.
    #[default]
    Albedo,
}

/// How many light samples, of which kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSettings {
    /// How many samples in all; punctual lights count, and are never left out.
    pub count: u32,
    /// Share of direct samples, 0 to 1.
    pub direct_share: f32,
    /// Bounce limit of the random walk; 0 = direct light only.
    pub bounces: u32,
    /// Same seed, same samples, on every machine.
    pub seed: u32,
    /// How paths end before the bounce limit.
    pub termination: Termination,
}

impl Default for LightSettings {
    fn default() -> Self {
        Self { count: 300, direct_share: 0.25, bounces: 5, seed: 0, termination: Termination::default() }
    }
}

/// The light samples of a scene. A sample's index is its stable identity.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightSet {
    /// The samples: punctual, direct, then indirect.
    pub samples: Vec<LightSample>,
    /// How many of them are direct (punctual lights included).
    pub direct: u32,
    /// How many paths were started.
    pub paths: u32,
    /// What the user should know: one sentence each.
    pub warnings: Vec<String>,
}

/// An upper bound on `count`: more is refused with a sentence.
pub const MAX_LIGHTS: u32 = 1 << 20;

impl LightSet {
    /// Samples the light of a scene.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) where a setting is out of range or the scene has no light at all.
    pub fn sample(scene: &Scene, geometry: &Geometry, settings: &LightSettings) -> crate::Result<Self> {
        let _ = (scene, geometry, settings);
        todo!("lights")
    }
}
