//! Where candidates are made: what lights nothing that is seen gets few, until the view moves to where it does.

use super::{IncrementalWalk, Known, Placements};
use crate::lights::direct::{allocate, area, worth};
use crate::lights::importance::{self, place};
use crate::lights::sampling::Direct;
use crate::lights::sun::limited_candidates;
use crate::lights::view_points::{self, POINTS, view_points};
use crate::lights::walk::Path;
use crate::lights::{LightSample, emitters};
use crate::scene::{Geometry, Scene, View};
use crate::slices::complete;

/// Numbers of candidates stay as they are unless they should be more or fewer by this factor.
const FACTOR: f64 = 2.0;
/// Points around where the views will be, beside those that they see.
const POINTS_AHEAD: u32 = POINTS;
/// Frames between two measurements while things move.
const EVERY: u32 = 8;
/// Share of the last frame in the weights of pilots: single ones are noisy.
const LAST: f64 = 0.2;

/// How many candidates are made where.
#[derive(Clone, Debug, Default)]
pub(super) struct Allocation {
    /// How many lie on each emitter.
    pub emitter_counts: Vec<u32>,
    /// How many paths each emitter is to have.
    pub targets: Vec<u32>,
    /// Of deposits and samples on emitters of pilots, as a mean over the last frames.
    pub pilot_weights: [Vec<f64>; 2],
    /// The frame in which it was last measured what places bring to the views, and whether something has moved since.
    pub measured: u32,
    pub is_outdated: bool,
}

/// Whether a number should be another one.
fn differs(is: u32, should: u32) -> bool {
    let ratio = f64::from(should.max(1)) / f64::from(is.max(1));
    !(1.0 / FACTOR..=FACTOR).contains(&ratio)
}

/// Takes a frame's weights into the mean, with this share.
fn blend(mean: &mut Vec<f64>, now: Vec<f64>, share: f64) {
    if mean.len() != now.len() {
        *mean = now;
        return;
    }
    mean.iter_mut().zip(now).for_each(|(mean, now)| *mean += share * (now - *mean));
}

impl IncrementalWalk {
    /// Takes other views for those that samples are placed for, and looks ahead from these, unless it is known which views
    /// come. Views that stay where they are do so once more: they are on their way to nowhere then.
    pub fn place_for(&mut self, scene: &Scene, geometry: &Geometry, views: &[View], to_come: &[View]) {
        let is_still = self.views.seen == views && self.views.to_come == to_come;
        if is_still && self.views.is_still {
            return;
        }
        let tracer = self.hierarchies.tracer(scene, geometry);
        self.views.go_on(&tracer, views, to_come, self.frame);
        self.views.is_still = is_still;
        if scene.environment.is_some() {
            self.sampling.shown = self.sampling.shown.or_seen(&tracer, views);
        }
        self.measure(scene, geometry, LAST);
    }

    /// Measures anew what places bring to the views, where something moved: as often as that may be while it moves, and once it
    /// has come to rest.
    pub(super) fn measure_moved(&mut self, scene: &Scene, geometry: &Geometry, has_moved: bool) {
        self.allocation.is_outdated |= has_moved && !self.views.seen.is_empty();
        let is_due = !has_moved || self.frame - self.allocation.measured >= EVERY;
        if self.allocation.is_outdated && is_due {
            self.measure(scene, geometry, if has_moved { LAST } else { 1.0 });
        }
    }

    /// Measures what places bring to the views, of pilots with this share in the mean.
    fn measure(&mut self, scene: &Scene, geometry: &Geometry, share: f64) {
        (self.allocation.measured, self.allocation.is_outdated) = (self.frame, false);
        let tracer = self.hierarchies.tracer(scene, geometry);
        let (samples, _) = self.sampling.candidates(geometry);
        let points = view_points::with_ahead(
            view_points(&tracer, &self.views.seen, POINTS),
            view_points(&tracer, &self.views.ahead, POINTS_AHEAD),
        );
        let is_guided = !self.sampling.guides.is_empty();
        self.sampling.importance =
            complete(importance::measure(&tracer, &points, &samples, &self.known().0, is_guided));
        self.strata.look_at(self.sampling.importance.seen);
        // What pilots left is weighed by itself: where candidates are few, these say little of places.
        let weigh = |samples: &[LightSample]| {
            let places: Vec<_> = samples.iter().map(|s| place(s, self.sampling.normal_scale)).collect();
            complete(importance::measure(&tracer, &points, samples, &places, is_guided)).weights(samples)
        };
        let on_emitters = weigh(&self.sampling.direct.pilot.concat());
        let Allocation { targets, pilot_weights: [of_deposits, of_emitters], .. } = &mut self.allocation;
        // Pilots have seeds of their own: how many candidates there are must not depend on them.
        let pilot = self.sampling.indirect.pilot.as_ref();
        if let Some(pilot) = pilot.filter(|pilot| !pilot.deposits.is_empty()) {
            blend(of_deposits, weigh(&pilot.deposits), share);
            for (target, count) in targets.iter_mut().zip(pilot.counts(of_deposits)) {
                if differs(*target, count) {
                    *target = count;
                }
            }
        }
        blend(of_emitters, on_emitters, share);
        self.allocate_emitters(scene, geometry);
    }

    /// Makes other candidates on emitters, if some should have many more or fewer.
    fn allocate_emitters(&mut self, scene: &Scene, geometry: &Geometry) {
        let Direct { are_candidates, ref pilot, count, seed, .. } = self.sampling.direct;
        let Placements { sampled, latest, at_rest, .. } = &mut self.placements;
        let groups = emitters::groups(scene, geometry, sampled.emissions());
        if !are_candidates || groups.is_empty() || groups.len() > count as usize {
            return;
        }
        let Allocation { emitter_counts, pilot_weights: [_, pilot_weights], .. } = &mut self.allocation;
        let weights = limited_candidates(&groups, worth(&emitters::power(&groups), pilot, pilot_weights));
        let counts = allocate(&weights, count);
        let is_other = counts.iter().zip(&*emitter_counts).any(|(&should, &is)| differs(is, should));
        if !is_other && counts.len() == emitter_counts.len() {
            return;
        }
        *emitter_counts = counts;
        let groups = (&groups[..], &self.sampling.guides);
        let samples = area((scene, geometry), sampled.emissions(), groups, &weights, count, seed).concat();
        // Punctual lights stay.
        at_rest.truncate(self.sampling.direct.punctual);
        self.sampling.direct.samples.truncate(self.sampling.direct.punctual);
        at_rest.extend(samples.iter().map(|s| latest.carry(sampled, geometry, s).unwrap_or(*s)));
        self.sampling.direct.samples.extend(samples);
        let places: Vec<_> = at_rest.iter().map(|s| place(s, self.sampling.normal_scale)).collect();
        let weights = self.sampling.importance.weights_at(at_rest, &places);
        self.direct = Known { places, weights, is_new: true };
    }

    /// Takes paths away that there are too many of.
    pub(super) fn drop_paths(&mut self) {
        let walked = &mut self.sampling.indirect.walked;
        let all = walked.counts.len();
        let are_too_many = |(count, target): (&u32, &u32)| count > target;
        if !walked.counts.iter().zip(&self.allocation.targets).any(are_too_many) {
            return;
        }
        let is_kept = |path: &Path| path.index / (all as u32) < self.allocation.targets[path.emitter(all)];
        let mut kept = walked.paths.iter().map(is_kept);
        self.paths.retain(|_| kept.next().unwrap_or(false));
        walked.paths.retain(is_kept);
        walked
            .counts
            .iter_mut()
            .zip(&self.allocation.targets)
            .for_each(|(count, &target)| *count = target.min(*count));
        walked.walked = walked.counts.iter().sum();
    }

    /// Which paths to walk beside, so many at most; they count from now on.
    pub(super) fn more_paths(&mut self, most: u32) -> Vec<u32> {
        let walked = &mut self.sampling.indirect.walked;
        let all = walked.counts.len() as u32;
        let mut lacking: Vec<usize> = (0..walked.counts.len()).collect();
        lacking.retain(|&e| walked.counts[e] < self.allocation.targets[e]);
        let lack = |&e: &usize| f64::from(self.allocation.targets[e]) / f64::from(walked.counts[e]);
        lacking.sort_by(|a, b| lack(b).total_cmp(&lack(a)));
        let mut more = Vec::new();
        for emitter in lacking {
            let count = &mut walked.counts[emitter];
            let added = (self.allocation.targets[emitter] - *count).min(most - more.len() as u32);
            more.extend((*count..*count + added).map(|index| index * all + emitter as u32));
            *count += added;
        }
        walked.walked = walked.counts.iter().sum();
        more
    }

    /// Takes new paths.
    pub(super) fn add_paths(&mut self, geometry: &Geometry, more: Vec<Path>) {
        if more.is_empty() {
            return;
        }
        let known: Vec<Known> = more.iter().map(|path| self.know(geometry, path)).collect();
        let walked = &mut self.sampling.indirect.walked;
        let held = std::mem::take(&mut walked.paths).into_iter().zip(std::mem::take(&mut self.paths));
        let new = more.into_iter().zip(known.into_iter().map(|known| (known, None)));
        let mut all: Vec<_> = held.chain(new).collect();
        all.sort_by_key(|(path, _)| path.index);
        (walked.paths, self.paths) = all.into_iter().unzip();
    }
}
