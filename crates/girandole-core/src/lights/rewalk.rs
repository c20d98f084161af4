//! Light samples that follow a scene a few paths at a time.
//!
//! 1. The paths of the random walk are kept. A path is the same as long as its emitter stays and nothing that moves comes into its
//!    way or leaves it: as long as no box about what moved, before and after, touches one of its segments. That is exact where
//!    probing groups of paths for changes (Dmitriev et al. 2002) is a guess, and it costs no ray.
//! 2. Each frame walks so many of the others again, those first that have waited for longest, with the random numbers that they
//!    have: a path that nothing happened to ends where it did, and one from a lamp that moved moves with it. Until then what they
//!    left stays, or goes with the surface that it is on. (Laine et al. 2007 do the like for a single bounce and spot lights.)
//! 3. Samples are chosen among all deposits as ever (`resample.rs`), but by strata that are held: what does not change in a
//!    stratum changes nothing in its sample. A few strata a frame are merged and others split as light moves, or the view does.
//! 4. Where views move, samples are placed for these and for what is around the places that they are on their way to, that they
//!    look at, and to either side of their way (`rewalk/ahead.rs`), or for the views to come, where these are known: most of what
//!    another room needs then comes before it is seen.
//! 5. What is chosen comes and goes by [slots](super::slots), no faster than what is seen may change (`rewalk/watch.rs`).
//!
//! After all paths were walked again they are what a fresh walk of as many paths leaves, so that there is the same light in the
//! mean over seeds.

use super::ids::origin;
use super::importance::{Place, place};
use super::motion::Placement;
use super::resample::{Candidates, Chosen, choose, stand_in, strata};
use super::sampling::Sampling;
use super::slots::{Slots, Wanted};
use super::spread::spread;
use super::strata::{Cluster, Item, Strata};
use super::walk::{Path, Walk, Walked};
use super::{LightSample, LightSet, LightSettings, emitters, punctual, source_tree};
use crate::Result;
use crate::math::sequence;
use crate::parallel::in_order;
use crate::scene::{Geometry, Scene, View};
use crate::slices::{complete, pause};
use crate::trace::{HeldHierarchies, ray_offset_distance};
use crate::visibility::MOST_LIGHTS;
use glam::Vec3;

mod ahead;
mod allocation;
mod watch;

use self::ahead::Views;
use self::allocation::Allocation;

/// One slot more for so many samples is dark at rest, for samples that come while others go.
const SPARE: u32 = 4;
/// Slots that are dark at least.
const LEAST_SPARE: u32 = 4;

/// How fast light samples follow a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pace {
    /// Paths of the random walk that are walked again a frame, at most.
    pub paths: u32,
    /// Frames over which a change of a quarter of the picture's mean brightness is spread, wherever it is seen, where samples
    /// come or go; 0 = at once. Where something moved, samples go this part of the rest of their way a frame, so that light is not
    /// behind for longer.
    pub fade: u32,
}

impl Default for Pace {
    fn default() -> Self {
        Self { paths: 200, fade: 8 }
    }
}

/// Paths that wait to be walked again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WaitingPaths {
    /// How many.
    pub paths: u32,
    /// Frames that the first of them has waited.
    pub oldest: u32,
}

/// A light set in the making, frame by frame.
#[derive(Clone, Debug)]
pub(crate) struct IncrementalWalk {
    settings: LightSettings,
    pace: Pace,
    placements: Placements,
    sampling: Sampling,
    views: Views,
    allocation: Allocation,
    /// What is known of direct samples, if they are candidates.
    direct: Known,
    /// By path, of its deposits, and the frame in which it was found to be another one by now.
    paths: Vec<(Known, Option<u32>)>,
    strata: Strata,
    slots: Slots,
    frame: u32,
    hierarchies: HeldHierarchies,
}

/// Where everything was when light was sampled, and at the last frame.
#[derive(Clone, Debug)]
struct Placements {
    sampled: Placement,
    latest: Placement,
    /// By object, a box about it at the last frame.
    boxes: Vec<Option<Box3>>,
    /// Direct samples, where they were when light was sampled.
    at_rest: Vec<LightSample>,
    /// The frame in which something moved last.
    moved: Option<u32>,
}

/// What is known of candidates.
#[derive(Clone, Debug)]
struct Known {
    /// As if what they lie on was where it was when light was sampled.
    places: Vec<Place>,
    /// What strata choose by.
    weights: Vec<f64>,
    /// Whether the strata do not know them yet.
    is_new: bool,
}

/// Lower and upper corner.
type Box3 = [Vec3; 2];

impl IncrementalWalk {
    /// Samples the light of a scene.
    ///
    /// # Errors
    /// As [`LightSet::sample_for`].
    pub async fn new(
        scene: &Scene,
        geometry: &Geometry,
        settings: &LightSettings,
        views: &[View],
        pace: Pace,
    ) -> Result<(Self, LightSet)> {
        settings.validate()?;
        geometry.belongs_to(scene)?;
        let mut hierarchies = HeldHierarchies::default();
        let mut sampling = Sampling::new(&hierarchies.tracer(scene, geometry), settings, views).await;
        pause().await;
        let (samples, sources) = sampling.candidates(geometry);
        let places: Vec<Place> = samples.iter().map(|s| place(s, sampling.normal_scale)).collect();
        let weights = sampling.importance.weights_at(&samples, &places);
        let [count, spare] =
            shown(sampling.wanted, MOST_LIGHTS.saturating_sub(sampling.given(geometry).count()));
        let strata = strata(&samples, &places, &weights, (count, &sampling.importance));
        let warning = punctual::warning(&samples, &strata.clusters());
        sampling.warnings.extend(warning);
        let mut rest = places.into_iter().zip(weights);
        let mut take = |count: usize, scale: f64| {
            let taken = rest.by_ref().take(count).map(|(place, weight)| (place, weight * scale));
            let (places, weights) = taken.unzip();
            Known { places, weights, is_new: false }
        };
        let candidates = sampling.direct.samples.iter().filter(|_| sampling.direct.are_candidates);
        let direct = take(candidates.count(), 1.0);
        let walked = &sampling.indirect.walked;
        let count_of = |path: &Path| f64::from(walked.counts[path.emitter(walked.counts.len())]);
        let paths = walked.paths.iter().map(|p| (take(p.deposits.len(), count_of(p)), None)).collect();
        let placement = Placement::of(scene, geometry);
        let warnings = std::mem::take(&mut sampling.warnings);
        for warning in &warnings {
            tracing::warn!("{warning}");
        }
        let mut result = Self {
            settings: *settings,
            pace,
            placements: Placements {
                latest: placement.clone(),
                sampled: placement,
                boxes: boxes(geometry),
                at_rest: sampling.direct.samples.clone(),
                moved: None,
            },
            views: Views { seen: views.to_vec(), is_still: true, ..Views::default() },
            allocation: Allocation {
                targets: sampling.indirect.walked.counts.clone(),
                ..Allocation::default()
            },
            sampling,
            direct,
            paths,
            strata,
            slots: Slots::new(Vec::new(), 0, 0),
            frame: 0,
            hierarchies,
        };
        let (places, weights) = result.known();
        // In the order that they will have from now on.
        result.strata.distribute(&places, &weights);
        let tracer = result.hierarchies.tracer(scene, geometry);
        let candidates = result.sampling.among((&samples, &sources, &weights), &tracer);
        let wanted = wanted(&result.strata.clusters(), candidates, result.sampling.seed);
        result.slots = Slots::new(wanted, spare as usize, pace.fade);
        let set = result.set(scene, geometry);
        if set.is_empty() {
            return Err(super::no_light(scene, geometry));
        }
        Ok((result, LightSet { warnings, ..set }))
    }

    /// The samples a frame later, after objects and lights moved, or were dimmed or coloured. `None` where more changed than that,
    /// or something emits in a channel in which it did not: then light is to be sampled anew.
    pub fn follow(&mut self, scene: &Scene, geometry: &Geometry) -> Option<LightSet> {
        let to = Placement::of(scene, geometry);
        let Placements { sampled, latest, .. } = &self.placements;
        if !sampled.leads_to(&to) {
            return None;
        }
        self.frame += 1;
        let (moved, moved_lights) = (latest.moved_objects(&to), latest.moved_lights(&to));
        let groups = emitters::groups(scene, geometry, sampled.emissions());
        let punctual = emitters::punctual_sources(scene, geometry, sampled.emissions());
        let trees = emitters::trees(&groups, &punctual);
        if trees.len() != self.sampling.indirect.walked.counts.len() && !self.paths.is_empty() {
            return None;
        }
        let has_moved = moved.contains(&true) || moved_lights.contains(&true);
        if has_moved {
            self.placements.moved = Some(self.frame);
            let is_moved = |source: &emitters::Source| match (source.triangle(), source.punctual()) {
                (Some(triangle), _) => moved[geometry.triangles[triangle as usize].object as usize],
                (_, Some(light)) => moved_lights[light.index()],
                _ => false,
            };
            let moved_trees: Vec<bool> =
                trees.iter().map(|tree| tree.sources().iter().any(is_moved)).collect();
            self.find_changed(&moved_trees, &moved, geometry);
            self.carry(&to, geometry)?;
        }
        self.placements.latest = to;
        self.measure_moved(scene, geometry, has_moved);
        self.walk(scene, geometry, &trees);
        self.choose(scene, geometry);
        Some(self.set(scene, geometry))
    }

    /// Whether nothing is on its way: as long as nothing else changes, the set stays as it is.
    pub fn is_settled(&self) -> bool {
        self.strata.is_balanced()
            && !self.allocation.is_outdated
            && self.slots.is_settled()
            && self.waiting().paths == 0
            && self.allocation.targets == self.sampling.indirect.walked.counts
    }

    /// What waits to be walked again.
    pub fn waiting(&self) -> WaitingPaths {
        let waiting = self.paths.iter().filter_map(|(_, since)| *since);
        waiting.fold(WaitingPaths::default(), |found, since| WaitingPaths {
            paths: found.paths + 1,
            oldest: found.oldest.max(self.frame - since + 1),
        })
    }

    /// Finds the paths that are other ones by now.
    fn find_changed(&mut self, moved_trees: &[bool], moved: &[bool], geometry: &Geometry) {
        let after = boxes(geometry);
        let margin =
            4.0 * ray_offset_distance(geometry, geometry.bounds.0.abs().max(geometry.bounds.1.abs()));
        let in_the_way: Vec<Box3> = [&self.placements.boxes, &after]
            .into_iter()
            .flat_map(|boxes| boxes.iter().zip(moved).filter(|(_, moved)| **moved).filter_map(|(b, _)| *b))
            .map(|[low, high]| [low - margin, high + margin])
            .collect();
        let emitters = moved_trees.len();
        for ((_, since), path) in self.paths.iter_mut().zip(&self.sampling.indirect.walked.paths) {
            let meets = || {
                let points: Vec<Vec3> = path.points().collect();
                let touches = |ends: &[Vec3]| in_the_way.iter().any(|b| touches(*b, [ends[0], ends[1]]));
                self.settings.walk_dynamic && points.windows(2).any(touches)
            };
            if since.is_none() && (moved_trees[path.emitter(emitters)] || meets()) {
                *since = Some(self.frame);
            }
        }
        self.placements.boxes = after;
    }

    /// Takes what lies on moving surfaces along. `None` where a surface collapses.
    fn carry(&mut self, to: &Placement, geometry: &Geometry) -> Option<()> {
        let Placements { sampled, latest, at_rest, .. } = &self.placements;
        for path in &mut self.sampling.indirect.walked.paths {
            for deposit in &mut path.deposits {
                *deposit = latest.carry(to, geometry, deposit)?;
            }
        }
        for (sample, at_rest) in self.sampling.direct.samples.iter_mut().zip(at_rest) {
            *sample = sampled.carry(to, geometry, at_rest)?;
        }
        self.slots.carry(|sample| latest.carry(to, geometry, sample));
        Some(())
    }

    /// Walks paths that wait for it, and some that are there to be more or fewer.
    fn walk(&mut self, scene: &Scene, geometry: &Geometry, trees: &[source_tree::SourceTree]) {
        self.drop_paths();
        let since = |(i, (_, since)): (usize, &(Known, Option<u32>))| Some((*since.as_ref()?, i));
        let mut waiting: Vec<(u32, usize)> = self.paths.iter().enumerate().filter_map(since).collect();
        waiting.sort_unstable_by_key(|&(since, i)| (since, sequence::hash(i as u32)));
        waiting.truncate(self.pace.paths as usize);
        let more = self.more_paths(self.pace.paths - waiting.len() as u32);
        if waiting.is_empty() && more.is_empty() {
            return;
        }
        let tracer = self.hierarchies.tracer(scene, geometry);
        let walk = Walk {
            tracer: &tracer,
            world_from_nodes: &scene.world_from_nodes(),
            emissions: self.placements.sampled.emissions(),
            emitters: trees,
            guides: &self.sampling.guides,
            settings: &self.settings,
            seed: self.sampling.indirect.seed,
        };
        let indices = waiting.iter().map(|&(_, i)| self.sampling.indirect.walked.paths[i].index).collect();
        let (again, more) = (complete(walk.paths(indices)), complete(walk.paths(more)));
        for (path, (_, i)) in again.into_iter().zip(waiting) {
            self.paths[i] = (self.know(geometry, &path), None);
            self.sampling.indirect.walked.paths[i] = path;
        }
        self.add_paths(geometry, more);
    }

    /// What there is to know of a path that was just walked.
    fn know(&self, geometry: &Geometry, path: &Path) -> Known {
        // Where a deposit would lie, had nothing moved.
        let Placements { sampled, latest, .. } = &self.placements;
        let at_rest = |deposit: &LightSample| {
            let back = latest.carry(sampled, geometry, deposit).unwrap_or(*deposit);
            place(&back, self.sampling.normal_scale)
        };
        let places: Vec<Place> = path.deposits.iter().map(at_rest).collect();
        let weights = self.sampling.importance.weights_at(&path.deposits, &places);
        Known { weights, places, is_new: true }
    }

    /// Places of all candidates, and what strata choose by.
    fn known(&self) -> (Vec<Place>, Vec<f64>) {
        let (mut places, mut weights) = (self.direct.places.clone(), self.direct.weights.clone());
        for ((known, _), scale) in self.paths.iter().zip(self.scales()) {
            places.extend_from_slice(&known.places);
            weights.extend(known.weights.iter().map(|weight| weight * scale));
        }
        (places, weights)
    }

    /// By candidate, whether the strata do not know it yet.
    fn is_new(&self) -> Vec<bool> {
        let all = std::iter::once(&self.direct).chain(self.paths.iter().map(|(known, _)| known));
        all.flat_map(|known| known.places.iter().map(|_| known.is_new)).collect()
    }

    /// By path, its part of the light of its emitter.
    fn scales(&self) -> impl Iterator<Item = f64> + '_ {
        let Walked { paths, counts, .. } = &self.sampling.indirect.walked;
        paths.iter().map(|path| 1.0 / f64::from(counts[path.emitter(counts.len())]))
    }

    /// Gives candidates to strata, and samples for those to slots.
    fn choose(&mut self, scene: &Scene, geometry: &Geometry) {
        let (places, mut weights) = self.known();
        let (samples, sources) = self.sampling.candidates(geometry);
        let now = self.sampling.importance.weights_at(&samples, &places);
        let held = weights.clone();
        self.strata.distribute(&places, &weights);
        self.strata.weigh_alike(&places, &mut weights, &now, &self.is_new());
        // Each takes up to three.
        let most = self.slots.free() / 3;
        let lineage = self.strata.rebalance(most, &places, &mut weights, &now);
        self.keep_weights(&held, &weights);
        self.direct.is_new = false;
        self.paths.iter_mut().for_each(|(known, _)| known.is_new = false);
        let tracer = self.hierarchies.tracer(scene, geometry);
        let candidates = self.sampling.among((&samples, &sources, &weights), &tracer);
        let clusters = self.strata.clusters();
        let stay = |stratum: u64, shown: &LightSample| {
            let (_, cluster) = clusters.iter().find(|(id, _)| *id == stratum)?;
            let is_shown = |item: &&Item| origin(&samples[item.index as usize]) == origin(shown);
            let item = cluster.items.iter().find(is_shown)?;
            Some(stand_in(candidates, cluster, item.index as usize))
        };
        self.slots.show(wanted(&clusters, candidates, self.sampling.seed), &lineage, stay);
        self.advance(scene, geometry);
    }

    /// Takes note of what strata choose by from now on; where that is as it was, to the bit.
    fn keep_weights(&mut self, before: &[f64], after: &[f64]) {
        let scales: Vec<f64> = self.scales().collect();
        let mut pairs = before.iter().zip(after);
        let paths = self.paths.iter_mut().map(|(known, _)| known).zip(scales);
        for (known, scale) in std::iter::once((&mut self.direct, 1.0)).chain(paths) {
            for (weight, (before, after)) in known.weights.iter_mut().zip(&mut pairs) {
                if before != after {
                    *weight = after / scale;
                }
            }
        }
    }

    /// All samples as they are shown.
    fn set(&mut self, scene: &Scene, geometry: &Geometry) -> LightSet {
        let Placements { sampled, latest, .. } = &self.placements;
        let emissions = [sampled.emissions(), latest.emissions()];
        let given = self.sampling.given(geometry).map(|Chosen { sample, shares }| {
            let intensity = emissions[0].carried(emissions[1], sample.intensity, &shares);
            LightSample { intensity: intensity.unwrap_or(sample.intensity), ..sample }
        });
        let mut samples: Vec<LightSample> = given.chain(self.slots.samples(emissions)).collect();
        self.sampling.shown.fit(&mut samples);
        spread(&self.hierarchies.tracer(scene, geometry), &mut samples);
        LightSet { paths: self.sampling.indirect.walked.walked, ..LightSet::from_samples(geometry, samples) }
    }
}

/// How many samples are shown at rest, and how many more slots there are for those that come and go; not more than `most` in all
/// unless as many samples are wanted: then fewer are shown.
fn shown(wanted: u32, most: usize) -> [u32; 2] {
    let spare = (wanted / SPARE).max(LEAST_SPARE);
    let slots = (wanted + spare).min(wanted.max(u32::try_from(most).unwrap_or(u32::MAX)));
    let spare = spare.min(slots.saturating_sub(1));
    [wanted.min(slots - spare), spare]
}

/// A sample for each stratum.
fn wanted(clusters: &[(u64, &Cluster)], candidates: Candidates, seed: u32) -> Vec<Wanted> {
    let of = |i: usize| {
        let (stratum, cluster) = clusters[i];
        choose(candidates, cluster, seed).map(|chosen| Wanted { stratum, chosen })
    };
    in_order(clusters.len(), of).into_iter().flatten().collect()
}

/// By object, a box about it.
fn boxes(geometry: &Geometry) -> Vec<Option<Box3>> {
    let of = |range: &crate::scene::ObjectRange| {
        let vertices = range.vertices.start as usize..range.vertices.end as usize;
        geometry.positions[vertices].iter().fold(None, |found: Option<Box3>, &p| {
            let [low, high] = found.unwrap_or([p; 2]);
            Some([low.min(p), high.max(p)])
        })
    };
    geometry.objects.iter().map(of).collect()
}

/// Whether a segment has a point in a box.
fn touches([low, high]: Box3, [from, to]: [Vec3; 2]) -> bool {
    let (mut enter, mut leave) = (0.0_f32, 1.0_f32);
    for axis in 0..3 {
        let along = to[axis] - from[axis];
        let (near, far) = ((low[axis] - from[axis]) / along, (high[axis] - from[axis]) / along);
        if along == 0.0 {
            if from[axis] < low[axis] || from[axis] > high[axis] {
                return false;
            }
            continue;
        }
        enter = enter.max(near.min(far));
        leave = leave.min(near.max(far));
    }
    enter <= leave
}

#[cfg(test)]
mod tests;
