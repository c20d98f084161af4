//! Punctual lights among light samples.
//!
//! Each is a candidate like all others (`resample.rs`), weighed by what it brings to what is seen: a point light two, one for either
//! hemisphere. Alone in its stratum it is chosen for certain, as it is. Where there are many, those that matter little or lie close
//! to each other share a stratum: one of them shines for all, in its own place, with its own colour and profile, so that the light
//! of each is right in the mean.
//!
//! Nothing smooths what one that stands for others brings to what is close to it, unlike a sample that has a rectangle. So they
//! are split into strata as if they lay [farther apart](APART); and up to a [quarter](SHARE) of all samples is theirs in any case.
//!
//! Worked example: of 300 samples, 30 point lights have 60, each its two. 150 have about half of all: of most of them the lower
//! hemispheres alone, and few of their upper ones.

use super::emission::Shares;
use super::importance::{ELSEWHERE, NORMAL_SCALE, Place, power};
use super::resample::{Candidates, Chosen};
use super::strata::{Apart, Cluster, Growth};
use super::{LightId, LightSample, Profile, SampleOrigin};
use crate::scene::{Geometry, PunctualKind, Scene};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// Strata of punctual lights are split as if these lay so many times as far apart as they do.
const APART: f32 = 4.0;
/// One of so many samples is a punctual light's, if there are as many of them.
const SHARE: u32 = 4;
/// The axis of [places](place) along which they lie apart from all other candidates.
pub(super) const AXIS: usize = 3;
/// Where samples that stand for several lights would leave more than this as the standard error of all light, if what each brings were
/// off by all of itself, there are too few of them. Below, the light of a picture was within 3 % of what it is.
const ROUGH: f64 = 0.05;

/// A sample for each punctual light, dark ones too, light by light: a point light is two opposite hemispheres, a spot and a
/// directional light one sample each.
pub(super) fn all(scene: &Scene, geometry: &Geometry) -> Vec<LightSample> {
    let mut samples = Vec::new();
    let world_from_nodes = scene.world_from_nodes();
    for (id, light) in (0..).map(LightId).zip(&scene.lights) {
        let node = world_from_nodes[light.node.index()];
        let normal = node.transform_vector3(DVec3::NEG_Z).normalize_or(DVec3::NEG_Y).as_vec3();
        let mut sample = LightSample {
            position: geometry.light_position(id, &node),
            normal,
            intensity: light.intensity,
            profile: Profile::Hemisphere,
            origin: SampleOrigin::Punctual { light: id },
            rectangle: None,
        };
        match light.kind {
            PunctualKind::Point => {
                samples.push(LightSample { normal: Vec3::Y, ..sample });
                samples.push(LightSample { normal: Vec3::NEG_Y, ..sample });
            }
            PunctualKind::Spot { inner, outer } => {
                let cone = SpotCone::new(inner, outer);
                let scale = 1.0 / (cone.cos_inner - cone.cos_outer);
                let offset = (-cone.cos_outer * scale) as f32;
                sample.profile = Profile::Spot { scale: scale as f32, offset };
                samples.push(sample);
            }
            PunctualKind::Directional => {
                sample.position = geometry.center() - normal * geometry.extent();
                sample.profile = Profile::Directional;
                samples.push(sample);
            }
        }
    }
    samples
}

/// Those that shine.
pub(super) fn shining(scene: &Scene, geometry: &Geometry) -> Vec<LightSample> {
    let shines = |s: &LightSample| s.intensity.is_finite() && s.intensity.max_element() > 0.0;
    all(scene, geometry).into_iter().filter(shines).collect()
}

/// Which of its light's samples it is: of a point light, 0 is the one above and 1 the one below.
pub(super) fn side(sample: &LightSample) -> u32 {
    u32::from(sample.profile == Profile::Hemisphere && sample.normal.y < 0.0)
}

/// Which light, and which of its samples.
pub(super) fn key(sample: &LightSample) -> Option<(LightId, u32)> {
    Some((sample.punctual()?, side(sample)))
}

/// Whether a light shines from elsewhere, or elsewhere, after it was moved.
pub(super) fn has_moved(before: &LightSample, after: &LightSample) -> bool {
    let is_at = before.profile.is_parallel() || before.position == after.position;
    before.normal != after.normal || !is_at
}

/// Where it lies among other candidates (see [`place`](super::importance::place)): far from all that are no punctual lights; parallel
/// light by its direction, far from other light; spots farther out the narrower they are, so that what lies at one place is alike.
pub(super) fn place(sample: &LightSample, normal_scale: f32) -> Place {
    let is_parallel = sample.profile.is_parallel();
    let p = if is_parallel { -sample.normal * (normal_scale / NORMAL_SCALE) } else { sample.position };
    let narrowness = match sample.profile {
        // The cosine at which it has fallen to a half.
        Profile::Spot { scale, offset } => (std::f32::consts::FRAC_1_SQRT_2 - offset) / scale,
        _ => 0.0,
    };
    let n = sample.normal * (normal_scale * (1.0 + narrowness));
    let aside = ELSEWHERE * normal_scale;
    let n = n + Vec3::new(aside, if is_parallel { aside } else { 0.0 }, 0.0);
    [p.x, p.y, p.z, n.x, n.y, n.z].map(|x| x * APART)
}

/// The strata that are theirs in any case, of so many, if there are other candidates too: up to one for each.
pub(super) fn apart(candidates: &[LightSample], places: &[Place], count: u32) -> Option<Apart> {
    let (mut lights, mut nearest) = (0, [f64::NEG_INFINITY, f64::INFINITY]);
    for (candidate, place) in candidates.iter().zip(places) {
        let at = f64::from(place[AXIS]);
        if candidate.punctual().is_some() {
            lights += 1;
            nearest[1] = nearest[1].min(at);
        } else {
            nearest[0] = nearest[0].max(at);
        }
    }
    let border = (nearest[0] + nearest[1]) * 0.5;
    let own = (count / SHARE).max(1);
    border.is_finite().then(|| Apart {
        axis: AXIS,
        border,
        count: own.min(lights),
        growth: if lights <= own { Growth::Held } else { Growth::AtLeast },
    })
}

/// A punctual light of a cluster that shines for all of those: as it is, but stronger. Each of them is taken to emit its part
/// of that in each channel.
pub(super) fn stand_in(candidates: Candidates, cluster: &Cluster, index: usize) -> Chosen {
    let Candidates { samples, sources, weights, .. } = candidates;
    let sample = samples[index];
    let intensity = sample.intensity.as_dvec3() * (cluster.weight / weights[index]);
    let lights = || cluster.items.iter().filter(|item| samples[item.index as usize].punctual().is_some());
    let brought = |index: u32, weight: f64| {
        let light = &samples[index as usize];
        light.intensity.as_dvec3() * (weight / power(light))
    };
    let all: DVec3 = lights().map(|item| brought(item.index, item.weight)).sum();
    let mut shares = Shares::new();
    for item in lights() {
        let part = brought(item.index, item.weight) / all;
        let share = DVec3::select(all.cmpgt(DVec3::ZERO), intensity * part, DVec3::ZERO).as_vec3();
        let source = sources[item.index as usize];
        match shares.iter_mut().find(|(known, _)| *known == source) {
            Some((_, sum)) => *sum += share,
            None => shares.push((source, share)),
        }
    }
    Chosen { sample: LightSample { intensity: intensity.as_vec3(), ..sample }, shares }
}

/// A sentence where so many strata are too few for the punctual lights among candidates.
pub(super) fn warning(candidates: &[LightSample], clusters: &[(u64, &Cluster)]) -> Option<String> {
    let (mut all, mut rough, mut strata, mut shared) = (0.0, 0.0, 0_u32, 0_u32);
    let mut lights = Vec::new();
    for (_, cluster) in clusters {
        (all, strata) = (all + cluster.weight, strata + 1);
        let known = lights.len();
        lights.extend(cluster.items.iter().filter_map(|item| candidates[item.index as usize].punctual()));
        if lights.len() > known {
            shared += 1;
            rough += if cluster.items.len() > 1 { cluster.weight * cluster.weight } else { 0.0 };
        }
    }
    let error = rough.sqrt() / all;
    lights.sort_unstable();
    lights.dedup();
    (error > ROUGH).then(|| {
        // It falls with the root at best: others are split, too.
        let enough = f64::from(strata) * (error / ROUGH).powi(3);
        let all_alone = SHARE * candidates.iter().filter(|c| c.punctual().is_some()).count() as u32;
        format!(
            "{} punctual lights share {shared} of {strata} light samples, so that some places are too bright and others too dark; \
             ask for {} light samples or more",
            lights.len(),
            (enough.ceil() as u32).clamp(strata + 1, all_alone.max(strata + 1)),
        )
    })
}

/// glTF's spot: full intensity above one cosine, none below the other, the square of a ramp in between.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SpotCone {
    pub cos_inner: f64,
    pub cos_outer: f64,
}

impl SpotCone {
    pub fn new(inner: f32, outer: f32) -> Self {
        let cos_inner = libm::cos(f64::from(inner));
        let cos_outer = libm::cos(f64::from(outer)).min(cos_inner - 1e-6);
        Self { cos_inner, cos_outer }
    }

    /// The integral of the profile over directions, sr.
    pub fn solid_angle(&self) -> f64 {
        2.0 * PI * ((1.0 - self.cos_inner) + (self.cos_inner - self.cos_outer) / 3.0)
    }

    /// The cosine that a share `s` of the light stays above or below: distributed as the profile.
    pub fn cosine(&self, s: f64) -> f64 {
        let ramp = (self.cos_inner - self.cos_outer) / 3.0;
        let at = s * (ramp + 1.0 - self.cos_inner);
        if at < ramp {
            self.cos_outer + (self.cos_inner - self.cos_outer) * libm::cbrt(at / ramp)
        } else {
            (self.cos_inner + at - ramp).min(1.0)
        }
    }
}
