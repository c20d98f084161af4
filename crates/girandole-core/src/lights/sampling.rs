//! What a set of light samples is chosen among: candidates on emitters and left by the random walk, and what they are worth.

use super::emission::{Emission, Emissions};
use super::guide::Guides;
use super::importance::Importance;
use super::resample::{Candidates, Chosen, resample};
use super::view_points::{POINTS, ViewPoint, view_points};
use super::walk::{Pilot, Walk, Walked};
use super::{
    BoundingSphere, LightSample, LightSettings, MAX_LIGHTS, direct, emitters, importance, punctual, sun, walk,
};
use crate::math::sequence;
use crate::scene::{Geometry, View};
use crate::slices::pause;
use crate::trace::SceneTracer;

/// Share of the candidates that lie on emitters.
const EMITTER_CANDIDATES: f32 = 0.25;
/// How many times as many candidates there are where an environment's light is guided: what brings most of it is a small part of them.
const GUIDED_CANDIDATES: u32 = 2;

/// How many samples, or shares of the candidates, are to be punctual lights, to lie on emitters and to be left by the walk.
struct Numbers {
    punctual: u32,
    emitters: u32,
    walked: u32,
}

impl Numbers {
    /// Where they are chosen alike; punctual lights are all among the candidates then.
    fn alike(settings: &LightSettings, punctual: u32, has_area: bool) -> Self {
        let emitters = if has_area { part(settings, EMITTER_CANDIDATES) } else { 0 };
        let walked = if settings.bounces == 0 { 0 } else { settings.count - emitters };
        Self { punctual, emitters, walked }
    }

    /// Where the share of those on emitters and punctual lights is given, of which emitters have this share of the power: half
    /// of the samples is the punctual lights' in any case, if there are as many.
    fn given(settings: &LightSettings, share: f32, punctual: u32, area: f64) -> Self {
        let has = [punctual > 0, area > 0.0];
        let mut direct = if has.contains(&true) { part(settings, share) } else { 0 };
        if direct == 1 && has == [true; 2] {
            direct = 2.min(settings.count);
        }
        let on_emitters = (f64::from(direct) * area).round().min(f64::from(direct / 2)).max(1.0) as u32;
        let punctual = punctual.min(if has[1] { direct.saturating_sub(on_emitters) } else { direct });
        let emitters = if has[1] { direct - punctual } else { 0 };
        let walked = if settings.bounces == 0 { 0 } else { settings.count - punctual - emitters };
        Self { punctual, emitters, walked }
    }
}

/// A share of the samples: one at least, unless there are to be none, and all of them for direct light alone.
fn part(settings: &LightSettings, share: f32) -> u32 {
    let part = (f64::from(share) * f64::from(settings.count)).round() as u32;
    let part = if settings.bounces == 0 { settings.count } else { part };
    part.max(u32::from(share > 0.0)).min(settings.count)
}

/// What candidates are weighed by.
struct Scales<'a> {
    tracer: &'a SceneTracer<'a>,
    points: &'a [ViewPoint],
    is_guided: bool,
}

impl Scales<'_> {
    /// What candidates bring, and the [scale](importance::place) of their normals.
    async fn measure(&self, candidates: &[LightSample]) -> (Importance, f32) {
        let Self { tracer, points, is_guided } = *self;
        let normal_scale = importance::NORMAL_SCALE * importance::free_path(tracer, candidates);
        let places: Vec<_> = candidates.iter().map(|c| importance::place(c, normal_scale)).collect();
        (importance::measure(tracer, points, candidates, &places, is_guided).await, normal_scale)
    }

    async fn weigh(&self, candidates: &[LightSample]) -> Vec<f64> {
        if candidates.is_empty() { Vec::new() } else { self.measure(candidates).await.0.weights(candidates) }
    }
}

/// What light samples are made of.
#[derive(Clone, Debug)]
pub(super) struct Sampling {
    /// Punctual lights and, after them, what lies on emitters: candidates, or samples as they are where their share is given.
    pub direct: Vec<LightSample>,
    /// How many of them are punctual lights.
    pub punctual: usize,
    /// What tells where emitters' samples matter, emitter by emitter.
    pub emitter_pilot: Vec<Vec<LightSample>>,
    /// How many candidates lie on emitters, and their seed.
    pub emitter_candidates: (u32, u32),
    /// What tells which emitters' paths matter.
    pub pilot: Option<Pilot>,
    pub walked: Walked,
    /// Of the walk.
    pub walk_seed: u32,
    /// Where light from infinitely far away is to come from; held, whatever follows.
    pub guides: Guides,
    pub importance: Importance,
    /// What that was measured at.
    pub points: Vec<ViewPoint>,
    /// Metres, see [`importance::place`].
    pub normal_scale: f32,
    /// What maps of an environment's samples show.
    pub shown: BoundingSphere,
    /// How many samples are chosen among the candidates.
    pub wanted: u32,
    /// Of the choice.
    pub seed: u32,
    /// Warnings for the user: one sentence each.
    pub warnings: Vec<String>,
    /// Whether direct samples are candidates.
    pub all_alike: bool,
}

impl Sampling {
    /// For what `views` see; none = by power. The settings are in range.
    pub async fn new(tracer: &SceneTracer<'_>, settings: &LightSettings, views: &[View]) -> Self {
        let (scene, geometry) = (tracer.scene(), tracer.geometry());
        let emissions = Emissions::of(scene);
        let groups = emitters::groups(scene, geometry, &emissions);
        let sources = emitters::punctual_sources(scene, geometry, &emissions);
        pause().await;
        let mut direct = punctual::shining(scene, geometry);
        let mut warnings = Vec::new();
        let power: Vec<f64> = groups.iter().map(|g| g.iter().map(|s| s.weight).sum()).collect();
        let lights = direct.len() as u32;
        let has_both = lights > 0 && !groups.is_empty();
        // A single sample cannot be a part of either kind's.
        let share = settings.direct_share.filter(|_| settings.count > 1 || !has_both);
        let numbers = match share {
            None => Numbers::alike(settings, lights, !groups.is_empty()),
            Some(share) => {
                let [area, points] =
                    [power.iter().sum::<f64>(), sources.iter().map(|s| s.weight).sum::<f64>()];
                let area = if groups.is_empty() { 0.0 } else { area / (area + points) };
                Numbers::given(settings, share, lights, area)
            }
        };
        let shown = if scene.environment.is_some() {
            BoundingSphere::seen(tracer, views).await
        } else {
            BoundingSphere::of_scene(geometry)
        };
        let points = view_points(tracer, views, POINTS);
        pause().await;
        let trees = emitters::trees(&groups, &sources);
        let guides = Guides::new(tracer, settings, &points, &groups, &trees).await;
        let is_guided = !guides.is_empty();
        let per_sample = settings.candidates.saturating_mul(if is_guided { GUIDED_CANDIDATES } else { 1 });
        let per_sample = per_sample.min(MAX_LIGHTS / settings.count).max(1);
        let scales = Scales { tracer, points: &points, is_guided };

        // What the walk leaves.
        let walk_seed = sequence::hash(settings.seed ^ 0x7f4a_7c15);
        let (mut walked, mut pilot) = (Walked::default(), None);
        if !trees.is_empty() && numbers.walked > 0 {
            let walk = Walk {
                tracer,
                world_from_nodes: &scene.world_from_nodes(),
                emissions: &emissions,
                emitters: &trees,
                guides: &guides,
                settings,
                seed: walk_seed,
            };
            let found = pilot.insert(Pilot::new(&walk, [numbers.walked, per_sample]).await);
            let weights = scales.weigh(&found.deposits).await;
            walked = walk::walk_as_found(&walk, found, &weights).await;
            pause().await;
            warnings.extend(exhausted(&walked, &numbers, !groups.is_empty()));
        }

        // Samples are chosen among that, or among that and candidates on emitters.
        let emitter_seed = sequence::hash(settings.seed ^ 0x2545_f491);
        let on_emitters = |weights: &[f64], count, seed| {
            direct::area((scene, geometry), &emissions, (&groups, &guides), weights, count, seed)
        };
        let all_alike = share.is_none();
        let count = numbers.emitters * per_sample;
        let mut emitter_pilot = Vec::new();
        let wanted = if all_alike {
            // The pilot has a seed of its own: how many candidates there are must not depend on them.
            let weights = sun::limited_candidates(&groups, power.clone());
            emitter_pilot = on_emitters(&weights, count / 8, sequence::hash(emitter_seed));
            let found = scales.weigh(&emitter_pilot.concat()).await;
            let weights = direct::worth(&power, &emitter_pilot, &found);
            let weights = sun::limited_candidates(&groups, weights);
            direct.extend(on_emitters(&weights, count, emitter_seed).into_iter().flatten());
            settings.count
        } else {
            let indirect = numbers.walked.min(walked.deposits());
            let rest = numbers.walked - indirect;
            if numbers.punctual < lights {
                let seed = sequence::hash(!emitter_seed);
                let (fewer, warning) = fewer_punctual(geometry, tracer, &direct, numbers.punctual, seed);
                direct = fewer;
                warnings.extend(warning);
            }
            let count = numbers.emitters + rest;
            let weights = sun::limited_samples(&groups, power, count);
            direct.extend(on_emitters(&weights, count, emitter_seed).into_iter().flatten());
            indirect
        };
        let mut result = Self {
            punctual: direct.iter().filter(|s| s.punctual().is_some()).count(),
            direct,
            emitter_pilot,
            emitter_candidates: (count, emitter_seed),
            pilot,
            walked,
            walk_seed,
            guides,
            importance: Importance::uniform(),
            points: Vec::new(),
            normal_scale: 0.0,
            shown,
            wanted,
            seed: sequence::hash(walk_seed),
            warnings,
            all_alike,
        };
        let candidates = result.candidates(geometry).0;
        result.wanted = wanted.min(candidates.len() as u32);
        (result.importance, result.normal_scale) = scales.measure(&candidates).await;
        result.points = points;
        result
    }

    /// All candidates, and where the light of each comes from: direct ones, then path by path.
    pub fn candidates(&self, geometry: &Geometry) -> (Vec<LightSample>, Vec<Emission>) {
        let direct = self.direct.iter().filter(|_| self.all_alike);
        let mut sources: Vec<Emission> =
            direct.clone().filter_map(|sample| Emission::of_direct(geometry, sample)).collect();
        let mut samples: Vec<LightSample> = direct.copied().collect();
        for path in &self.walked.paths {
            samples.extend(self.walked.shares_of(path));
            sources.extend(path.deposits.iter().map(|_| path.emission));
        }
        (samples, sources)
    }

    /// Samples that there are in any case.
    pub fn given<'a>(&'a self, geometry: &'a Geometry) -> impl Iterator<Item = Chosen> + 'a {
        self.direct.iter().filter(|_| !self.all_alike).map(|&sample| Chosen {
            sample,
            shares: Emission::of_direct(geometry, &sample)
                .map(|emission| (emission, sample.intensity))
                .into_iter()
                .collect(),
        })
    }
}

/// A sentence where the walk left fewer deposits than samples were wanted of it.
fn exhausted(walked: &Walked, numbers: &Numbers, has_area: bool) -> Option<String> {
    let rest = if has_area { "; the others lie on the emitters" } else { "" };
    walked.exhausted.then(|| {
        format!(
            "{} paths of light left only {} of {} indirect light samples, because little of it is reflected{rest}",
            walked.walked,
            walked.deposits(),
            numbers.walked,
        )
    })
}

/// So many punctual lights, by power, for all of them; and a sentence where these are too few.
fn fewer_punctual(
    geometry: &Geometry,
    tracer: &SceneTracer,
    punctual: &[LightSample],
    count: u32,
    seed: u32,
) -> (Vec<LightSample>, Option<String>) {
    let sources: Vec<Emission> =
        punctual.iter().filter_map(|sample| Emission::of_direct(geometry, sample)).collect();
    let weights = Importance::uniform().weights(punctual);
    let candidates = Candidates { samples: punctual, sources: &sources, weights: &weights };
    let normal_scale = importance::NORMAL_SCALE * importance::free_path(tracer, punctual);
    let (chosen, warning) = resample(candidates, (count, &Importance::uniform()), normal_scale, seed);
    (chosen.into_iter().map(|chosen| chosen.sample).collect(), warning)
}
