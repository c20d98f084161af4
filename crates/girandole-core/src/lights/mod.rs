//! Light samples: all light in a scene as oriented point lights (Barczak §4.1; Keller 1997).

mod direct;
mod emitters;
mod thin;
mod walk;

use crate::math::sequence;
use crate::scene::{Geometry, Scene};
use crate::{Error, Result};
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
    /// unit direction to the light. `None` unless both cosines and the geometric one are positive. The pair
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
    /// At every hit with the probability that the path's brightest channel is absorbed, 1 − max(ρΦ) / max(Φ), on
    /// grey surfaces 1 − ρ (Russian roulette): samples of even strength. With 16
    /// [candidates](LightSettings::candidates) both do equally well; with one, this has a fifth less error.
    #[default]
    Albedo,
}

/// How many light samples, of which kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSettings {
    /// How many samples in all; punctual lights count, and are never left out.
    pub count: u32,
    /// Share of direct samples, 0 to 1. Less leaves more samples to indirect light, which needs them more: 0.1 has the
    /// least error on the built-in rooms, 0.2 a tenth more, with finer steps in soft shadows; 0.4 has half as much again.
    pub direct_share: f32,
    /// Bounce limit of the random walk; 0 = direct light only.
    pub bounces: u32,
    /// Same seed, same samples, on every machine.
    pub seed: u32,
    /// How paths end before the bounce limit.
    pub termination: Termination,
    /// How many deposits the random walk leaves for each sample that is kept, at least 1: samples are chosen among
    /// them so that they are well spread and carry their light. More costs time in proportion (some 20 ms for 300
    /// samples at 16) and lowers the error, less and less. Never more than [`MAX_LIGHTS`] deposits are made.
    pub candidates: u32,
    /// Whether the random walk sees objects that are marked [`dynamic`](crate::scene::Object::dynamic). `true` gives
    /// the right light for the scene as it stands; `false` is the thesis's mode: samples stay where they are when
    /// such objects move, and miss the light that those reflect or intercept.
    pub walk_dynamic: bool,
}

impl Default for LightSettings {
    fn default() -> Self {
        Self {
            count: 300,
            direct_share: 0.25,
            bounces: 5,
            seed: 0,
            termination: Termination::default(),
            candidates: 16,
            walk_dynamic: true,
        }
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

/// An upper bound on `bounces`: more is refused with a sentence.
pub const MAX_BOUNCES: u32 = 64;

impl LightSettings {
    /// Whether every setting is in range.
    ///
    /// # Errors
    /// [`Error::Invalid`] that names the setting and its range.
    pub fn validate(&self) -> Result<()> {
        let refuse = |sentence: String| Err(Error::Invalid(sentence));
        if self.count == 0 || self.count > MAX_LIGHTS {
            return refuse(format!(
                "{} light samples are not possible; choose 1 to {MAX_LIGHTS}",
                self.count
            ));
        }
        if !(0.0..=1.0).contains(&self.direct_share) {
            return refuse(format!(
                "a direct share of {} is not possible; choose a number from 0 to 1",
                self.direct_share
            ));
        }
        if self.candidates == 0 {
            return refuse("0 candidates for each light sample are not possible; choose 1 or more".into());
        }
        if self.bounces > MAX_BOUNCES {
            return refuse(format!("{} bounces are not possible; choose 0 to {MAX_BOUNCES}", self.bounces));
        }
        Ok(())
    }
}

impl LightSet {
    /// Samples the light of a scene. There are exactly [`LightSettings::count`] samples wherever the scene allows it:
    /// punctual lights all have theirs, `direct_share` of all are direct, the rest is left by the random walk.
    ///
    /// # Errors
    /// [`Error::Invalid`] where a setting is out of range or the scene has no light at all.
    pub fn sample(scene: &Scene, geometry: &Geometry, settings: &LightSettings) -> Result<Self> {
        settings.validate()?;
        let groups = emitters::area_groups(scene, geometry);
        let punctual = emitters::punctual_sources(scene, geometry);
        let mut samples = direct::punctual(scene, geometry);
        if groups.is_empty() && samples.is_empty() {
            return Err(no_light());
        }
        let mut set = Self::default();
        let lights = samples.len() as u32;
        let spare = settings.count.saturating_sub(lights);
        if lights > settings.count {
            set.warnings.push(format!(
                "the scene's punctual lights need {lights} light samples and {} were asked for; \
                 ask for more, or area lights and indirect light stay dark",
                settings.count
            ));
        }
        // How many samples are direct; all of them where light is not to bounce.
        let has_area = !groups.is_empty();
        let asked = (f64::from(settings.direct_share) * f64::from(settings.count)).round() as u32;
        let wants_area = has_area && settings.direct_share > 0.0;
        let mut area = asked.saturating_sub(lights).max(u32::from(wants_area)).min(spare);
        if !has_area {
            area = 0;
        }
        if settings.bounces == 0 && has_area {
            area = spare;
        }
        // The walk; what it leaves over becomes direct light.
        let mut indirect = Vec::new();
        let wanted = if settings.bounces == 0 { 0 } else { spare - area };
        if let Some(tree) = emitters::SourceTree::new([groups.concat(), punctual].concat())
            && wanted > 0
        {
            let seed = sequence::hash(settings.seed ^ 0x7f4a_7c15);
            let candidates = settings.candidates.min(MAX_LIGHTS / wanted).max(1);
            let walked = walk::walk(scene, geometry, &tree, settings, [wanted, candidates], seed);
            set.paths = walked.paths;
            indirect = walked.samples;
            if !walked.exhausted {
                indirect = thin::thin(&indirect, wanted, geometry.diagonal(), sequence::hash(seed));
            } else {
                set.warnings.push(format!(
                    "{} paths of light left only {} of {wanted} indirect light samples, because little of it is \
                     reflected{}",
                    walked.paths,
                    indirect.len(),
                    if has_area { "; the others lie on the emitters" } else { "" }
                ));
            }
            if has_area {
                area += wanted - indirect.len() as u32;
            }
        }
        let seed = sequence::hash(settings.seed ^ 0x2545_f491);
        samples.extend(direct::area(scene, geometry, &groups, area, seed));
        set.direct = samples.len() as u32;
        samples.extend(indirect);
        set.samples = samples;
        if set.samples.is_empty() {
            return Err(no_light());
        }
        for warning in &set.warnings {
            tracing::warn!("{warning}");
        }
        Ok(set)
    }

    /// A bound on [`LightSample::geometric_factor`], m⁻², that about minimises the error: 0.2 · N / diagonal², because
    /// what it should cut off is the neighbourhood of each sample, which shrinks as they get more. On the built-in
    /// table room it takes away 1 to 2 % of the energy and half of relMSE at 300 and at 1024 samples.
    pub fn suggested_clamp(&self, geometry: &Geometry) -> f32 {
        0.2 * self.samples.len() as f32 / geometry.diagonal().powi(2)
    }
}

fn no_light() -> Error {
    Error::Invalid("the scene has no light; give a surface an emission, or add a punctual light".into())
}

#[cfg(test)]
mod tests;
