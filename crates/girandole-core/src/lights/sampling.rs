//! What a set of light samples is chosen among: candidates on emitters and left by the random walk, and what they are worth.

use super::emission::{Emission, Emissions, Shares};
use super::guide::Guides;
use super::importance::Importance;
use super::resample::Chosen;
use super::view_points::{POINTS, view_points};
use super::walk::{Pilot, Walk, Walked};
use super::{
    BoundingSphere, LightSample, LightSettings, MAX_LIGHTS, direct, emitters, importance, sun, walk,
};
use crate::math::sequence;
use crate::scene::{Geometry, Scene, View};
use crate::trace::SceneTracer;

/// Share of the candidates that lie on emitters.
const EMITTER_CANDIDATES: f32 = 0.25;

/// How many samples, or shares of the candidates, are to lie on emitters and to be left by the walk.
struct Numbers {
    emitters: u32,
    walked: u32,
}

impl Numbers {
    fn new(settings: &LightSettings, punctual: u32, has_area: bool) -> Self {
        let spare = settings.count.saturating_sub(punctual);
        let share = settings.direct_share.unwrap_or(EMITTER_CANDIDATES);
        let of = f64::from(share)
            * f64::from(if settings.direct_share.is_some() { settings.count } else { spare });
        let punctual = if settings.direct_share.is_some() { punctual } else { 0 };
        let mut emitters =
            (of.round() as u32).saturating_sub(punctual).max(u32::from(share > 0.0)).min(spare);
        if !has_area {
            emitters = 0;
        }
        let walked = if settings.bounces == 0 { 0 } else { spare - emitters };
        if settings.bounces == 0 && has_area {
            emitters = spare;
        }
        Self { emitters, walked }
    }
}

/// What light samples are made of.
#[derive(Clone, Debug)]
pub(super) struct Sampling {
    pub punctual: Vec<LightSample>,
    /// On emitters: samples as they are, where their share is given, or candidates.
    pub on_emitters: Vec<LightSample>,
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
    /// Whether what lies on emitters are candidates.
    pub all_alike: bool,
}

impl Sampling {
    /// For what `views` see; none = by power. The settings are in range, and the geometry is the scene's.
    pub fn new(scene: &Scene, geometry: &Geometry, settings: &LightSettings, views: &[View]) -> Self {
        let emissions = Emissions::of(scene);
        let groups = emitters::groups(scene, geometry, &emissions);
        let sources = emitters::punctual_sources(scene, geometry, &emissions);
        let punctual = direct::punctual(scene, geometry, |_, light| direct::shines(light));
        let lights = punctual.len() as u32;
        let mut warnings = Vec::new();
        if lights > settings.count {
            warnings.push(format!(
                "the scene's punctual lights need {lights} light samples and {} were asked for; \
                 ask for more, or area lights and indirect light stay dark",
                settings.count
            ));
        }
        let spare = settings.count.saturating_sub(lights);
        let numbers = Numbers::new(settings, lights, !groups.is_empty());
        let per_sample = settings.candidates.min(MAX_LIGHTS / spare.max(1)).max(1);
        let tracer = SceneTracer::new(scene, geometry);

        let shown = if scene.environment.is_some() {
            BoundingSphere::seen(&tracer, views)
        } else {
            BoundingSphere::of_scene(geometry)
        };
        let points = view_points(&tracer, views, POINTS);
        let trees = emitters::trees(&groups, &sources);
        let guides = Guides::new(&tracer, settings, &points, &groups, &trees);
        let is_guided = !guides.is_empty();
        let measure = |candidates: &[LightSample]| {
            let normal_scale = importance::NORMAL_SCALE * importance::free_path(&tracer, candidates);
            let places: Vec<[f32; 6]> =
                candidates.iter().map(|c| importance::place(c, normal_scale)).collect();
            (importance::measure(&tracer, &points, candidates, &places, is_guided), normal_scale)
        };
        let weigh = |candidates: &[LightSample]| measure(candidates).0.weights(candidates);

        // What the walk leaves.
        let walk_seed = sequence::hash(settings.seed ^ 0x7f4a_7c15);
        let (mut walked, mut pilot) = (Walked::default(), None);
        if !trees.is_empty() && numbers.walked > 0 {
            let walk = Walk {
                tracer: &tracer,
                world_from_nodes: &scene.world_from_nodes(),
                emissions: &emissions,
                emitters: &trees,
                guides: &guides,
                settings,
                seed: walk_seed,
            };
            let found = pilot.insert(Pilot::new(&walk, [numbers.walked, per_sample]));
            walked = if found.deposits.is_empty() {
                Walked { walked: found.walked(), exhausted: true, ..Walked::default() }
            } else {
                walk::walk(&walk, found, found.counts(&weigh(&found.deposits)))
            };
            if walked.exhausted {
                let rest = if groups.is_empty() { "" } else { "; the others lie on the emitters" };
                warnings.push(format!(
                    "{} paths of light left only {} of {} indirect light samples, because little of it is reflected{rest}",
                    walked.walked,
                    walked.deposits(),
                    numbers.walked,
                ));
            }
        }

        // Samples are chosen among that, or among that and candidates on emitters.
        let power: Vec<f64> = groups.iter().map(|g| g.iter().map(|s| s.weight).sum()).collect();
        let emitter_seed = sequence::hash(settings.seed ^ 0x2545_f491);
        let on_emitters = |weights: &[f64], count, seed| {
            direct::area((scene, geometry), &emissions, (&groups, &guides), weights, count, seed)
        };
        let all_alike = settings.direct_share.is_none();
        let count = numbers.emitters * per_sample;
        let mut emitter_pilot = Vec::new();
        let (on_emitters, wanted) = if all_alike {
            // The pilot has a seed of its own: how many candidates there are must not depend on them.
            let weights = sun::limited_candidates(&groups, power.clone());
            emitter_pilot = on_emitters(&weights, count / 8, sequence::hash(emitter_seed));
            let weights = direct::worth(&power, &emitter_pilot, &weigh(&emitter_pilot.concat()));
            let weights = sun::limited_candidates(&groups, weights);
            (on_emitters(&weights, count, emitter_seed).concat(), spare)
        } else {
            let indirect = numbers.walked.min(walked.deposits());
            let rest = numbers.walked - indirect;
            let count = spare.min(numbers.emitters + rest);
            let weights = sun::limited_samples(&groups, power, count);
            (on_emitters(&weights, count, emitter_seed).concat(), indirect)
        };
        let mut result = Self {
            punctual,
            on_emitters,
            emitter_pilot,
            emitter_candidates: (count, emitter_seed),
            pilot,
            walked,
            walk_seed,
            guides,
            importance: Importance::uniform(),
            normal_scale: 0.0,
            shown,
            wanted,
            seed: sequence::hash(walk_seed),
            warnings,
            all_alike,
        };
        let candidates = result.candidates(geometry).0;
        result.wanted = wanted.min(candidates.len() as u32);
        (result.importance, result.normal_scale) = measure(&candidates);
        result
    }

    /// All candidates, and where the light of each comes from: on emitters, then path by path.
    pub fn candidates(&self, geometry: &Geometry) -> (Vec<LightSample>, Vec<Emission>) {
        let on_emitters = self.on_emitters.iter().filter(|_| self.all_alike);
        let mut sources: Vec<Emission> =
            on_emitters.clone().filter_map(|sample| Emission::of_direct(geometry, sample)).collect();
        let mut samples: Vec<LightSample> = on_emitters.copied().collect();
        for path in &self.walked.paths {
            samples.extend(self.walked.shares_of(path));
            sources.extend(path.deposits.iter().map(|_| path.emission));
        }
        (samples, sources)
    }

    /// Samples that there are in any case.
    pub fn given<'a>(&'a self, geometry: &'a Geometry) -> impl Iterator<Item = Chosen> + 'a {
        let punctual = self.punctual.iter().map(|&sample| Chosen { sample, shares: Shares::new() });
        let on_emitters = self.on_emitters.iter().filter(|_| !self.all_alike).map(|&sample| Chosen {
            sample,
            shares: Emission::of_direct(geometry, &sample)
                .map(|emission| (emission, sample.intensity))
                .into_iter()
                .collect(),
        });
        punctual.chain(on_emitters)
    }
}
