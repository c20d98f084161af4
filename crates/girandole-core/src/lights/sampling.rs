//! What a set of light samples is chosen among: candidates on emitters and left by the random walk, and what they are worth.

use super::emission::{Emission, Emissions};
use super::emitters::Source;
use super::guide::Guides;
use super::importance::Importance;
use super::resample::{Candidates, Chosen, resample};
use super::source_tree::SourceTree;
use super::view_points::{POINTS, ViewPoint, view_points};
use super::walk::{Pilot, Walk, Walked};
use super::{
    BoundingSphere, LightSample, LightSettings, MAX_LIGHTS, direct, emitters, importance, punctual, sky, sun,
    walk,
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
    /// Whether direct samples are candidates, too.
    all_alike: bool,
}

impl Numbers {
    /// With so many punctual lights, by the power of emitters and of those. Where all are chosen alike, punctual lights are all among
    /// the candidates; where the share of direct samples is given, half of these is theirs in any case, if there are as many.
    fn new(settings: &LightSettings, punctual: u32, [area, points]: [f64; 2]) -> Self {
        let left = |direct: u32| if settings.bounces == 0 { 0 } else { settings.count - direct };
        let has @ [has_points, has_area] = [punctual > 0, area > 0.0];
        // A single sample cannot be a part of either kind's.
        let Some(share) = settings.direct_share.filter(|_| settings.count > 1 || has != [true; 2]) else {
            let emitters = if has_area { part(settings, EMITTER_CANDIDATES) } else { 0 };
            return Self { punctual, emitters, walked: left(emitters), all_alike: true };
        };
        let mut direct = if has_points || has_area { part(settings, share) } else { 0 };
        if direct == 1 && has == [true; 2] {
            direct = 2.min(settings.count);
        }
        let area = f64::from(direct) * (area / (area + points));
        let on_emitters = area.round().min(f64::from(direct / 2)).max(1.0) as u32;
        let punctual = punctual.min(if has_area { direct.saturating_sub(on_emitters) } else { direct });
        let emitters = if has_area { direct - punctual } else { 0 };
        Self { punctual, emitters, walked: left(punctual + emitters), all_alike: false }
    }
}

/// A share of the samples: one at least, unless there are to be none, and all of them for direct light alone.
fn part(settings: &LightSettings, share: f32) -> u32 {
    let part = (f64::from(share) * f64::from(settings.count)).round() as u32;
    let part = if settings.bounces == 0 { settings.count } else { part };
    part.max(u32::from(share > 0.0)).min(settings.count)
}

/// What candidates are made of and weighed by.
struct Sampler<'a> {
    tracer: &'a SceneTracer<'a>,
    settings: &'a LightSettings,
    emissions: &'a Emissions,
    /// The sources on each emitter.
    groups: &'a [Vec<Source>],
    guides: &'a Guides,
    points: &'a [ViewPoint],
    numbers: Numbers,
}

impl Sampler<'_> {
    /// What candidates bring, and the [scale](importance::place) of their normals.
    async fn measure(&self, candidates: &[LightSample]) -> (Importance, f32) {
        let normal_scale = importance::NORMAL_SCALE * importance::free_path(self.tracer, candidates);
        let places: Vec<_> = candidates.iter().map(|c| importance::place(c, normal_scale)).collect();
        let is_guided = !self.guides.is_empty();
        (importance::measure(self.tracer, self.points, candidates, &places, is_guided).await, normal_scale)
    }

    async fn weigh(&self, candidates: &[LightSample]) -> Vec<f64> {
        if candidates.is_empty() { Vec::new() } else { self.measure(candidates).await.0.weights(candidates) }
    }

    /// How many candidates there are for each sample.
    fn per_sample(&self) -> u32 {
        let more = if self.guides.is_empty() { 1 } else { GUIDED_CANDIDATES };
        let per_sample = self.settings.candidates.saturating_mul(more);
        per_sample.min(MAX_LIGHTS / self.settings.count).max(1)
    }

    /// Paths from these emitters.
    async fn indirect(&self, emitters: &[SourceTree]) -> Indirect {
        let seed = sequence::hash(self.settings.seed ^ 0x7f4a_7c15);
        if emitters.is_empty() || self.numbers.walked == 0 {
            return Indirect { pilot: None, walked: Walked::default(), seed };
        }
        let Self { tracer, settings, emissions, guides, .. } = *self;
        let world_from_nodes = &tracer.scene().world_from_nodes();
        let walk = Walk { tracer, world_from_nodes, emissions, emitters, guides, settings, seed };
        let pilot = Pilot::new(&walk, [self.numbers.walked, self.per_sample()]).await;
        let weights = self.weigh(&pilot.deposits).await;
        let walked = walk::walk_as_found(&walk, &pilot, &weights).await;
        pause().await;
        Indirect { pilot: Some(pilot), walked, seed }
    }

    /// These punctual lights and what lies on emitters, where the walk left so many deposits; and a sentence where samples of
    /// punctual lights are too few.
    async fn direct(&self, mut samples: Vec<LightSample>, deposits: u32) -> (Direct, Option<String>) {
        let Self { tracer, emissions, groups, guides, ref numbers, .. } = *self;
        let power = emitters::power(groups);
        let scene = (tracer.scene(), tracer.geometry());
        let on_emitters = |weights: &[f64], count, seed| {
            direct::area(scene, emissions, (groups, guides), weights, count, seed)
        };
        let seed = sequence::hash(self.settings.seed ^ 0x2545_f491);
        let (mut pilot, mut warning) = (Vec::new(), None);
        let (weights, count) = if numbers.all_alike {
            let count = numbers.emitters * self.per_sample();
            // The pilot has a seed of its own: how many candidates there are must not depend on them.
            let weights = sun::limited_candidates(groups, power.clone());
            pilot = on_emitters(&weights, count / 8, sequence::hash(seed));
            let found = self.weigh(&pilot.concat()).await;
            (sun::limited_candidates(groups, direct::worth(&power, &pilot, &found)), count)
        } else {
            if (numbers.punctual as usize) < samples.len() {
                (samples, warning) =
                    fewer_punctual(tracer, &samples, numbers.punctual, sequence::hash(!seed));
            }
            let count = numbers.emitters + numbers.walked.saturating_sub(deposits);
            (sun::limited_samples(groups, power, count), count)
        };
        let punctual = samples.len();
        samples.extend(on_emitters(&weights, count, seed).into_iter().flatten());
        (Direct { samples, punctual, are_candidates: numbers.all_alike, pilot, count, seed }, warning)
    }
}

/// Punctual lights, and what lies on emitters.
#[derive(Clone, Debug)]
pub(super) struct Direct {
    /// Punctual lights first.
    pub samples: Vec<LightSample>,
    /// How many of them are punctual lights.
    pub punctual: usize,
    /// Whether they are candidates, or samples as they are: their share is given.
    pub are_candidates: bool,
    /// What tells where emitters' samples matter, emitter by emitter.
    pub pilot: Vec<Vec<LightSample>>,
    /// How many lie on emitters, and their seed.
    pub count: u32,
    pub seed: u32,
}

/// What the walk leaves.
#[derive(Clone, Debug)]
pub(super) struct Indirect {
    /// What tells which emitters' paths matter.
    pub pilot: Option<Pilot>,
    pub walked: Walked,
    pub seed: u32,
}

/// What light samples are made of.
#[derive(Clone, Debug)]
pub(super) struct Sampling {
    pub direct: Direct,
    pub indirect: Indirect,
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
}

impl Sampling {
    /// For what `views` see; none = by power. The settings are in range.
    pub async fn new(tracer: &SceneTracer<'_>, settings: &LightSettings, views: &[View]) -> Self {
        let (scene, geometry) = (tracer.scene(), tracer.geometry());
        let emissions = &Emissions::of(scene);
        let groups = &emitters::groups(scene, geometry, emissions)[..];
        let sources = emitters::punctual_sources(scene, geometry, emissions);
        pause().await;
        let punctual = punctual::shining(scene, geometry);
        let power = [emitters::power(groups).iter().sum(), sources.iter().map(|s| s.weight).sum()];
        let numbers = Numbers::new(settings, punctual.len() as u32, power);
        let shown = if scene.environment.is_some() {
            BoundingSphere::seen(tracer, views).await
        } else {
            BoundingSphere::of_scene(geometry)
        };
        let points = view_points(tracer, views, POINTS);
        pause().await;
        let trees = emitters::trees(groups, &sources);
        let guides = Guides::new(tracer, settings, &points, groups, &trees).await;
        let sampler =
            Sampler { tracer, settings, emissions, groups, guides: &guides, points: &points, numbers };
        let indirect = sampler.indirect(&trees).await;
        let (direct, warning) = sampler.direct(punctual, indirect.walked.deposits()).await;
        let (candidates, sources) = candidates(&direct, &indirect, geometry);
        let (mut importance, normal_scale) = sampler.measure(&candidates).await;
        let seed = sequence::hash(indirect.seed);
        if !guides.is_empty() {
            pause().await;
            let weights = importance.weights(&candidates);
            let all = Candidates {
                samples: &candidates,
                sources: &sources,
                weights: &weights,
                is_guided: true,
                tracer: None,
            };
            importance.of_sky =
                sky::share(tracer, &points, all, (&importance, normal_scale), sequence::hash(seed)).await;
        }
        let numbers = sampler.numbers;
        let wanted = if numbers.all_alike { settings.count } else { numbers.walked };
        let exhausted = exhausted(&indirect.walked, &numbers, !groups.is_empty());
        Self {
            seed,
            direct,
            indirect,
            guides,
            importance,
            points,
            normal_scale,
            shown,
            wanted: wanted.min(candidates.len() as u32),
            warnings: exhausted.into_iter().chain(warning).collect(),
        }
    }

    /// All candidates, and where the light of each comes from: direct ones, then path by path.
    pub fn candidates(&self, geometry: &Geometry) -> (Vec<LightSample>, Vec<Emission>) {
        candidates(&self.direct, &self.indirect, geometry)
    }

    /// What samples are chosen among: these candidates with these weights, by what finds which lie in narrow gaps.
    pub fn among<'a>(
        &self,
        (samples, sources, weights): (&'a [LightSample], &'a [Emission], &'a [f64]),
        tracer: &'a SceneTracer<'a>,
    ) -> Candidates<'a> {
        Candidates { samples, sources, weights, is_guided: !self.guides.is_empty(), tracer: Some(tracer) }
    }

    /// Samples that there are in any case.
    pub fn given<'a>(&'a self, geometry: &'a Geometry) -> impl Iterator<Item = Chosen> + 'a {
        self.direct.samples.iter().filter(|_| !self.direct.are_candidates).map(|&sample| Chosen {
            sample,
            shares: Emission::of_direct(geometry, &sample)
                .map(|emission| (emission, sample.intensity))
                .into_iter()
                .collect(),
        })
    }
}

fn candidates(
    direct: &Direct,
    indirect: &Indirect,
    geometry: &Geometry,
) -> (Vec<LightSample>, Vec<Emission>) {
    let direct = direct.samples.iter().filter(|_| direct.are_candidates);
    let mut sources: Vec<Emission> =
        direct.clone().filter_map(|sample| Emission::of_direct(geometry, sample)).collect();
    let mut samples: Vec<LightSample> = direct.copied().collect();
    for path in &indirect.walked.paths {
        samples.extend(indirect.walked.shares_of(path));
        sources.extend(path.deposits.iter().map(|_| path.emission));
    }
    (samples, sources)
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
    tracer: &SceneTracer,
    punctual: &[LightSample],
    count: u32,
    seed: u32,
) -> (Vec<LightSample>, Option<String>) {
    let sources: Vec<Emission> =
        punctual.iter().filter_map(|sample| Emission::of_direct(tracer.geometry(), sample)).collect();
    let weights = Importance::uniform().weights(punctual);
    let candidates = Candidates {
        samples: punctual,
        sources: &sources,
        weights: &weights,
        is_guided: false,
        tracer: None,
    };
    let normal_scale = importance::NORMAL_SCALE * importance::free_path(tracer, punctual);
    let (chosen, warning) = resample(candidates, (count, &Importance::uniform()), normal_scale, seed);
    (chosen.into_iter().map(|chosen| chosen.sample).collect(), warning)
}
