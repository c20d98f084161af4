//! Light samples: all light in a scene as oriented point lights (Barczak §4.1; Keller 1997).

mod brightness;
mod calibration;
mod changes;
mod direct;
mod emission;
mod emitters;
#[cfg(feature = "import")]
mod file;
mod geometric_factor;
mod guide;
mod ids;
mod importance;
mod motion;
mod nearness;
mod prefix;
mod punctual;
mod reach;
mod rectangle;
mod resample;
mod rewalk;
mod sampling;
mod scattering;
mod sets;
mod shown;
mod sky;
mod slots;
mod source_tree;
mod spread;
mod strata;
mod sun;
mod view_points;
mod walk;

pub use changes::LightChanges;
pub use geometric_factor::{Clamp, LOBE_SLOPE};
pub use ids::SampleId;
pub(crate) use motion::Placement;
pub(crate) use punctual::SpotCone;
pub(crate) use reach::share_reached;
pub use rectangle::Rectangle;
pub(crate) use rewalk::IncrementalWalk;
pub use rewalk::{Pace, WaitingPaths};
pub use shown::BoundingSphere;
pub use spread::SPREAD;
pub(crate) use view_points::{SeenPoint, seen_points};

use self::emission::Shares;
use self::resample::{Chosen, resample};
use self::sampling::Sampling;
use crate::generation::Generation;
use crate::scene::{Geometry, LightId, Scene, View};
use crate::slices::{complete, pause};
use crate::trace::SceneTracer;
use crate::{Error, Result};
use glam::Vec3;

/// How a light sample's intensity depends on direction.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "import", derive(serde::Serialize, serde::Deserialize))]
pub enum Profile {
    /// Falls with the cosine to the normal: light from or by way of a surface.
    Cosine,
    /// What smooth metal throws: the cosine to the normal, times `matt + (axis · ω)⁴ / (1 + 2.5 · cosine)` (Phong 1975, made symmetric);
    /// close to the sample's rectangle as [`Cosine`](Self::Cosine).
    Lobe {
        /// Where it is mirrored, of such a length that no light is lost.
        axis: Vec3,
        /// The share that is spread as from a matt surface.
        matt: f32,
    },
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
    /// The same from a part of an environment, one of many samples of it.
    Distant {
        /// From the sample's position to the middle of the scene, m: with it, light is compared with light that is not parallel.
        distance: f32,
        /// What its shadow map shows at least: what is seen, or all of the scene.
        shown: BoundingSphere,
        /// Of the directions that it stands for, sr.
        solid_angle: f32,
    },
}

impl Profile {
    /// Whether light is parallel.
    pub fn is_parallel(&self) -> bool {
        matches!(self, Self::Directional | Self::Distant { .. })
    }

    /// Axis and matt share of a lobe.
    pub fn lobe(&self) -> Option<(Vec3, f32)> {
        if let Self::Lobe { axis, matt } = *self { Some((axis, matt)) } else { None }
    }
}

/// Where a light sample comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "import", derive(serde::Serialize, serde::Deserialize))]
pub enum SampleOrigin {
    /// On an emitting triangle.
    Emitter {
        /// Index into [`Geometry::triangles`].
        triangle: u32,
        /// Which point of the emitter's sequence.
        point: u32,
    },
    /// A punctual light of the scene.
    Punctual {
        /// The light.
        light: LightId,
    },
    /// A direction of the scene's environment.
    Environment {
        /// Which point of its sequence.
        point: u32,
        /// Whether it is one of the sun's, which have a sequence of their own.
        sun: bool,
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
#[cfg_attr(feature = "import", derive(serde::Serialize, serde::Deserialize))]
pub struct LightSample {
    /// Position relative to the geometry's origin, offset from the surface like a ray origin.
    pub position: Vec3,
    /// Unit normal; nothing is emitted behind it.
    pub normal: Vec3,
    /// Radiant intensity along the normal, W/sr, linear RGB (parallel light: irradiance, W/m²).
    pub intensity: Vec3,
    /// Dependence on direction.
    pub profile: Profile,
    /// Where it comes from.
    pub origin: SampleOrigin,
    /// The surface that it stands for: its share of an emitter, or what the deposits that it was chosen from are spread
    /// over. In the sample's plane, on its side. `None` for lights that are points indeed.
    pub rectangle: Option<Rectangle>,
}

/// The mean solid angle, sr, that samples of an environment but for its sun stand for; 0 where there are none. With it,
/// [`resolved_share`](crate::brdf::resolved_share) says what of their lobes is resolved.
pub fn mean_solid_angle(samples: &[LightSample]) -> f32 {
    let of = |sample: &LightSample| match sample.profile {
        Profile::Distant { solid_angle, .. } if sample.intensity != Vec3::ZERO && !sample.is_of_sun() => {
            Some(f64::from(solid_angle))
        }
        _ => None,
    };
    let count = samples.iter().filter_map(of).count();
    (samples.iter().filter_map(of).sum::<f64>() / count.max(1) as f64) as f32
}

impl LightSample {
    /// The triangle that the sample lies on, [`NONE`](crate::scene::NONE) for those that lie on none.
    pub fn triangle(&self) -> u32 {
        match self.origin {
            SampleOrigin::Emitter { triangle, .. } | SampleOrigin::Bounce { triangle, .. } => triangle,
            SampleOrigin::Punctual { .. } | SampleOrigin::Environment { .. } => crate::scene::NONE,
        }
    }

    /// Where a shadow ray from a point ends: at the sample, or beyond the scene where its light is parallel.
    pub fn shadow_ray_end(&self, from: Vec3, geometry: &Geometry) -> Vec3 {
        if !self.profile.is_parallel() {
            return self.position;
        }
        from - self.normal * (from.length() + 2.0 * geometry.extent())
    }

    /// The punctual light that it is of.
    pub(crate) fn punctual(&self) -> Option<LightId> {
        match self.origin {
            SampleOrigin::Punctual { light } => Some(light),
            _ => None,
        }
    }

    /// Whether it is one of those of an environment's sun.
    pub fn is_of_sun(&self) -> bool {
        matches!(self.origin, SampleOrigin::Environment { sun: true, .. })
    }

    /// The solid angle at a point, sr, of what this sample stands for; 0 for lights that are points indeed. Mirrored in
    /// `shaders/lib/light.wgsl`.
    pub fn solid_angle(&self, position: Vec3) -> f32 {
        match (self.profile, &self.rectangle) {
            (Profile::Distant { solid_angle, .. }, _) => solid_angle,
            (Profile::Cosine | Profile::Lobe { .. }, Some(rectangle)) => {
                let area = rectangle.area() / if self.is_spread() { SPREAD * SPREAD } else { 1.0 };
                let to_light = self.position - position;
                let r2 = to_light.length_squared();
                let cos_light = -self.normal.dot(to_light);
                (area * cos_light / (r2 * r2.sqrt())).clamp(0.0, std::f32::consts::TAU)
            }
            _ => 0.0,
        }
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
    /// How many samples at most, and wherever there is as much to sample. Where there are more punctual lights than a quarter of
    /// that, those that matter little share samples.
    pub count: u32,
    /// Share of samples on emitters and punctual lights, 0 to 1, which then are spread evenly by power. `None` = as the light
    /// demands: these samples and those left by the walk are chosen alike, wherever they lower the error most.
    pub direct_share: Option<f32>,
    /// Bounce limit of the random walk; 0 = direct light only.
    pub bounces: u32,
    /// Same seed, same samples, on every machine.
    pub seed: u32,
    /// How paths end before the bounce limit.
    pub termination: Termination,
    /// How many candidates there are for each sample, on emitters and left by the random walk, at least 1: samples are chosen
    /// among them so that they are well spread and carry the light that matters. More costs time in proportion (some
    /// 20 ms for 300 samples at 16) and lowers the error, less and less. Twice as many where an environment shines in through
    /// windows. Never more than [`MAX_LIGHTS`] are made.
    pub candidates: u32,
    /// Whether the random walk sees objects that are marked [`dynamic`](crate::scene::Object::dynamic). `true` gives
    /// the right light for the scene as it stands; `false` is the thesis's mode: samples stay where they are when
    /// such objects move, and miss the light that those reflect or intercept.
    pub walk_dynamic: bool,
    /// Whether a scene without any light is dark, with a warning, as one is whose lights were switched off; else it
    /// is refused.
    pub dark: bool,
}

impl Default for LightSettings {
    fn default() -> Self {
        Self {
            count: 300,
            direct_share: None,
            bounces: 5,
            seed: 0,
            termination: Termination::default(),
            candidates: 16,
            walk_dynamic: true,
            dark: false,
        }
    }
}

/// The light samples of a scene, each with an identity that survives updates.
#[derive(Clone, Debug)]
pub struct LightSet {
    samples: Vec<LightSample>,
    ids: Vec<SampleId>,
    /// For each sample, where its light comes from; none where it is not known.
    shares: Vec<Shares>,
    /// How many of them are direct (punctual lights included).
    pub direct: u32,
    /// How many paths were started.
    pub paths: u32,
    /// Warnings for the user: one sentence each.
    pub warnings: Vec<String>,
    generation: Generation,
    geometry: Generation,
    /// Which set of a refinement it is.
    set: u32,
}

impl PartialEq for LightSet {
    /// Whether the samples and their ids are equal, whatever generation they are of.
    fn eq(&self, other: &Self) -> bool {
        self.samples == other.samples
            && self.ids == other.ids
            && (self.direct, self.paths, &self.warnings) == (other.direct, other.paths, &other.warnings)
    }
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
        if let Some(share) = self.direct_share.filter(|share| !(0.0..=1.0).contains(share)) {
            return refuse(format!("a direct share of {share} is not possible; choose a number from 0 to 1"));
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
    /// Samples the light of a scene for no view in particular: by power.
    ///
    /// # Errors
    /// As [`LightSet::sample_for`].
    pub fn sample(scene: &Scene, geometry: &Geometry, settings: &LightSettings) -> Result<Self> {
        Self::sample_for(scene, geometry, settings, &[])
    }

    /// Samples the light of a scene, placed where it matters to what `views` see (all alike; none = by power). There are
    /// exactly [`LightSettings::count`] samples wherever the scene allows it, and never more. What light there is in the mean over
    /// seeds does not depend on the views, or nearly so: where an environment shines in through windows, samples are calibrated, so that
    /// regions of what is seen are as bright as all candidates make them.
    ///
    /// # Errors
    /// [`Error::Invalid`] where a setting is out of range, the scene has no light at all, or the geometry is not this
    /// scene's.
    pub fn sample_for(
        scene: &Scene,
        geometry: &Geometry,
        settings: &LightSettings,
        views: &[View],
    ) -> Result<Self> {
        complete(Self::sample_as(scene, geometry, settings, views, true))
    }

    /// The same, calibrated or not: the mean of many sets is the right light without that.
    pub(crate) async fn sample_as(
        scene: &Scene,
        geometry: &Geometry,
        settings: &LightSettings,
        views: &[View],
        is_calibrated: bool,
    ) -> Result<Self> {
        settings.validate()?;
        geometry.belongs_to(scene)?;
        Self::sample_by(&SceneTracer::in_slices(scene, geometry).await, settings, views, is_calibrated).await
    }

    /// The same by a tracer that is there. The settings are in range.
    pub(crate) async fn sample_by(
        tracer: &SceneTracer<'_>,
        settings: &LightSettings,
        views: &[View],
        is_calibrated: bool,
    ) -> Result<Self> {
        let (scene, geometry) = (tracer.scene(), tracer.geometry());
        let mut sampling = Sampling::new(tracer, settings, views).await;
        let (samples, sources) = sampling.candidates(geometry);
        let weights = sampling.importance.weights(&samples);
        let candidates = sampling.among((&samples, &sources, &weights), tracer);
        let wanted = (sampling.wanted, &sampling.importance);
        pause().await;
        let (mut chosen, warning) = resample(candidates, wanted, sampling.normal_scale, sampling.seed);
        sampling.warnings.extend(warning);
        if is_calibrated {
            pause().await;
            calibration::calibrate(tracer, &sampling, &mut chosen).await;
        }
        pause().await;
        let mut set = Self::from_chosen(geometry, sampling.given(geometry).chain(chosen));
        sampling.shown.fit(&mut set.samples);
        spread::spread(tracer, &mut set.samples);
        if set.is_empty() {
            let error = no_light(scene, geometry);
            return if settings.dark { Self::dark(geometry, &error).ok_or(error) } else { Err(error) };
        }
        for warning in &sampling.warnings {
            tracing::warn!("{warning}");
        }
        Ok(Self { paths: sampling.indirect.walked.walked, warnings: sampling.warnings, ..set })
    }

    /// A set that lights nothing, with what is wrong as its warning; `None` where there is no surface.
    fn dark(geometry: &Geometry, error: &Error) -> Option<Self> {
        geometry.triangles.first()?;
        let sample = LightSample {
            position: geometry.center(),
            normal: Vec3::NEG_Y,
            intensity: Vec3::ZERO,
            profile: Profile::Cosine,
            origin: SampleOrigin::Emitter { triangle: 0, point: 0 },
            rectangle: None,
        };
        let warnings = vec![error.to_string()];
        Some(Self { warnings, ..Self::from_samples(geometry, vec![sample]) })
    }

    /// A set of samples of which it is known where their light comes from, direct ones first.
    fn from_chosen(geometry: &Geometry, chosen: impl Iterator<Item = Chosen>) -> Self {
        let (direct, indirect): (Vec<Chosen>, Vec<Chosen>) =
            chosen.partition(|c| !matches!(c.sample.origin, SampleOrigin::Bounce { .. }));
        let (samples, shares) = direct.into_iter().chain(indirect).map(|c| (c.sample, c.shares)).unzip();
        Self { shares, ..Self::from_samples(geometry, samples) }
    }

    /// A set of samples that were made otherwise; those that are no bounces count as direct.
    pub fn from_samples(geometry: &Geometry, samples: Vec<LightSample>) -> Self {
        let is_direct = |s: &&LightSample| !matches!(s.origin, SampleOrigin::Bounce { .. });
        Self {
            ids: ids::identify(geometry, &samples),
            direct: samples.iter().filter(is_direct).count() as u32,
            shares: vec![Shares::new(); samples.len()],
            samples,
            paths: 0,
            warnings: Vec::new(),
            generation: Generation::fresh(),
            geometry: geometry.generation(),
            set: 0,
        }
    }

    /// The samples: direct ones, then indirect ones.
    pub fn samples(&self) -> &[LightSample] {
        &self.samples
    }

    /// Their identities, in the same order; no two are equal.
    pub fn ids(&self) -> &[SampleId] {
        &self.ids
    }

    /// How many samples there are.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// Which set of samples this is; copies keep it.
    pub fn generation(&self) -> Generation {
        self.generation
    }

    /// Whether the samples were made for this geometry.
    ///
    /// # Errors
    /// [`Error::Invalid`] where they were made for another one.
    pub fn belongs_to(&self, geometry: &Geometry) -> Result<()> {
        self.geometry.expect(
            geometry.generation(),
            "these light samples belong to another scene or to an earlier version of it; sample the scene's light anew",
        )
    }
}

fn no_light(scene: &Scene, geometry: &Geometry) -> Error {
    if geometry.triangles.is_empty() {
        let what = "no surface of the scene has an area: all of it has collapsed; check its transforms";
        return Error::Invalid(what.into());
    }
    let what = if scene.shines() {
        "nothing of the scene that emits has an area, or all of it is cut away or black; enlarge it,"
    } else {
        "the scene has no light; give a surface an emission,"
    };
    Error::Invalid(format!("{what} add a punctual light, or an environment"))
}

#[cfg(test)]
mod tests;
