//! What candidates for light samples bring to the picture.
//!
//! 1. [View points](super::view_points) are what the views see, well spread over their pictures.
//! 2. Candidates are sorted into runs of neighbours. Each candidate is tested against a few of the points: `G · V` times what
//!    the point reflects. The pairs of a run have different points.
//! 3. A point counts for the inverse of its brightness, as all pairs estimate it: relative errors are what is seen. Where light is
//!    [guided](super::guide), without parallel light: what a window throws on few points is bright there and its shape is what is seen.
//! 4. What a run's pairs bring in the mean is the importance of its candidates, per unit of power. Where light is
//!    [guided](super::guide), it is the root of the mean square: of independent samples that leads to the least squared error, and
//!    what comes in through a window reaches few of the points. (Elsewhere it measures no better.)
//! 5. A candidate's weight is its power times a mixture of its importance and the mean of all of its kind, an environment's or
//!    other: none that could be seen is left out because none of its pairs happened to see it, and none becomes stronger than
//!    [`1 / PLAIN`](PLAIN) times what power alone would make it.
//!
//! Weights decide where samples are, never what light there is in the mean (`resample.rs`).

mod runs;

pub(super) use self::runs::halve;

use self::runs::{Node, Run, split_into_runs};
use super::brightness::Brightness;
use super::nearness::Seen;
use super::view_points::ViewPoint;
use super::{Clamp, LightSample, Profile, punctual};
use crate::brdf::Surface;
use crate::math::{sequence, warp};
use crate::parallel::{in_order, in_slices};
use crate::slices::pause;
use crate::trace::SceneTracer;
use glam::{DVec3, Vec2, Vec3};

/// Of the sequence that rays are spread by.
const RAYS_SEED: u32 = 0x3c6e_f372;
/// Points that a candidate is tested against, and candidates in a run at most.
const PAIRS_AND_RUN: [usize; 2] = [8, 64];
/// The same where light is guided: what lies within a beam of light from a window differs from what lies beside it, and gains
/// ([calibration](super::calibration)) are by the same pairs.
const GUIDED_PAIRS_AND_RUN: [usize; 2] = [24, 12];
/// Pairs of all punctual lights at most, but for one test of each. Each is tested as often as a run of others where there are few of
/// them, and has a run of its own then.
const PUNCTUAL_PAIRS: usize = 1 << 15;
/// Share of the weight that comes from power alone.
const PLAIN: f64 = 0.1;
/// An environment's light and all other light have means of their own: most of a sky's power may never come into a room. Either is
/// no less than this share of that of all.
const LEAST_PLAIN: f64 = 1e-2;
/// Share of the mean brightness that counts as dark.
const DARK: f64 = 0.3;
/// Changes of a point that are not seen, as a share of the mean brightness.
const UNSEEN: f32 = 1e-3;

/// Scale of normals relative to positions, as a share of the [free path](free_path): samples on two walls that meet differ by 0.57
/// times that.
pub(super) const NORMAL_SCALE: f32 = 0.4;
/// Where an environment's candidates lie among others, in the scene's size.
pub(super) const ELSEWHERE: f32 = 100.0;

/// Rays that measure how far light goes.
const FREE_PATH_RAYS: usize = 256;
/// Pairs of a slice.
const SLICE: usize = 1 << 13;

/// The power of a candidate: W/sr of its brightest channel; of parallel light, as much as a light at its position needs for the
/// same in the middle of the scene. It is always a number, so that light without one comes to the picture, which is refused.
pub(super) fn power(sample: &LightSample) -> f64 {
    let intensity = sample.intensity.max_element().min(f32::MAX);
    f64::from(intensity) * f64::from(distance_squared(sample))
}

/// The mean of its channels as a share of the brightest one.
fn grayness(sample: &LightSample) -> f64 {
    f64::from(sample.intensity.element_sum())
        / (3.0 * f64::from(sample.intensity.max_element())).max(f64::MIN_POSITIVE)
}

/// What parallel light is divided by to be compared with other light, m²; 1 for that.
fn distance_squared(sample: &LightSample) -> f32 {
    match sample.profile {
        Profile::Distant { distance, .. } => distance * distance,
        // The origin is in the middle of the scene.
        Profile::Directional => sample.position.length_squared().max(f32::MIN_POSITIVE),
        _ => 1.0,
    }
}

/// Position and scaled normal, m.
pub(super) type Place = [f32; 6];

/// Where a candidate lies among others: its position, and its normal, or the axis of its lobe, as a position on a sphere with a radius of `normal_scale`
/// metres. Those of an environment lie as far apart as light from them that comes as far as other light does, all far away from others,
/// and its sun in a plane that is twice as far away.
pub(super) fn place(candidate: &LightSample, normal_scale: f32) -> Place {
    if candidate.punctual().is_some() {
        return punctual::place(candidate, normal_scale);
    }
    let n = candidate.profile.lobe().map_or(candidate.normal, |(axis, _)| axis.normalize()) * normal_scale;
    let p = match candidate.profile {
        Profile::Distant { distance, .. } => {
            let direction = candidate.normal * (normal_scale / NORMAL_SCALE);
            if candidate.is_of_sun() {
                (-direction).with_x(2.0 * ELSEWHERE * distance)
            } else {
                Vec3::X * (ELSEWHERE * distance) - direction
            }
        }
        _ => candidate.position,
    };
    [p.x, p.y, p.z, n.x, n.y, n.z]
}

/// What light from each place brings, per unit of power.
#[derive(Clone, Debug, Default)]
pub(super) struct Importance {
    /// Finds the run of a place; `None` where all places count alike.
    tree: Option<Node>,
    runs: Vec<Run>,
    /// Over all candidates that it was measured with.
    mean: f64,
    /// Of the points that are seen, among those that it was measured at: the light that they reflect in the mean, over channels
    /// too; 0 where there are none.
    pub brightness: f64,
    /// The part of what they reflect, each point counting as above, that is the environment's sun's: no more than is seen of it.
    pub of_sun: f64,
    /// Where that is which is seen of the points that it was measured at.
    pub seen: Option<Seen>,
    /// Where light is guided, what all candidates bring to the points.
    pub of_points: Option<Brightness>,
    /// There, too, once it is known: the share of samples that are to be the [sky](super::sky)'s.
    pub of_sky: Option<f64>,
}

impl Importance {
    /// Where all places count alike.
    pub fn uniform() -> Self {
        Self { mean: 1.0, ..Self::default() }
    }

    /// Weights of candidates at these [places](place).
    pub fn weights_at(&self, candidates: &[LightSample], places: &[Place]) -> Vec<f64> {
        let at = |place| self.run_at(place).map_or(1.0, |run| run.importance) / self.mean;
        candidates.iter().zip(places).map(|(candidate, place)| power(candidate) * at(*place)).collect()
    }

    /// The bound on `G` that it was measured with at a [place].
    pub fn bound_at(&self, place: Place) -> f32 {
        self.run_at(place).map_or(f32::MAX, |run| run.bound)
    }

    fn run_at(&self, place: Place) -> Option<&Run> {
        self.runs.get(self.tree.as_ref()?.run_at(place))
    }

    /// The weight of each of the candidates that it was measured with.
    pub fn weights(&self, candidates: &[LightSample]) -> Vec<f64> {
        let mut weights: Vec<f64> = candidates.iter().map(power).collect();
        for run in &self.runs {
            run.members.iter().for_each(|&i| weights[i as usize] *= run.importance);
        }
        weights
    }
}

/// What candidates at these [places](place) bring to these points; all alike if there are none, or no light reaches them. Whether those
/// of an environment's light are [guided](super::guide).
pub(super) async fn measure(
    tracer: &SceneTracer<'_>,
    points: &[ViewPoint],
    candidates: &[LightSample],
    places: &[Place],
    is_guided: bool,
) -> Importance {
    if points.is_empty() {
        return Importance::uniform();
    }
    let power: Vec<f64> = candidates.iter().map(power).collect();
    let [per_test, longest] = if is_guided { GUIDED_PAIRS_AND_RUN } else { PAIRS_AND_RUN };
    let lights = candidates.iter().filter(|c| c.punctual().is_some()).count();
    let times = (PUNCTUAL_PAIRS / (per_test * lights.max(1))).clamp(1, longest);
    let (tree, mut runs) = split_into_runs(candidates, places, [longest, longest / times]);
    let seen = Seen::new(points, candidates, places);
    let mut tests = Vec::new();
    for (index, run) in runs.iter_mut().enumerate() {
        let times = if candidates[run.members[0] as usize].punctual().is_some() { times } else { 1 };
        let tested: Vec<u32> = run.members.iter().flat_map(|&i| std::iter::repeat_n(i, times)).collect();
        run.bound = bound(candidates, &power, &tested);
        tests.extend(tested.into_iter().map(|i| {
            let (candidate, power) = (&candidates[i as usize], power[i as usize] / times as f64);
            Test { candidate, power, run: index }
        }));
    }
    pause().await;
    let reflected = in_slices(tests.len() * per_test, SLICE, |i| {
        let Test { candidate, run, .. } = tests[i / per_test];
        reflected(tracer, &points[i % points.len()], candidate, runs[run].bound)
    })
    .await;
    pause().await;
    let pairs = Pairs { points, candidates, is_guided, tests, per_test, reflected };
    let Some(counts) = pairs.point_weights() else { return Importance::uniform() };
    let light = pairs.by_test(&counts, |light| light);
    let of_sun = pairs.share_of_sun(&light);
    let brought = if is_guided { pairs.by_test(&counts, |light| light * light) } else { light };
    let mean = pairs.weigh(&mut runs, &brought);
    let of_points = is_guided.then(|| pairs.brightness_by_kind());
    Importance { tree, runs, mean, brightness: pairs.brightness(), of_sun, seen, of_points, of_sky: None }
}

/// Candidates that are tested against points.
struct Pairs<'a> {
    points: &'a [ViewPoint],
    candidates: &'a [LightSample],
    is_guided: bool,
    /// Run by run.
    tests: Vec<Test<'a>>,
    /// How many points each of them is against.
    per_test: usize,
    /// What is [reflected], test by test.
    reflected: Vec<f32>,
}

/// A test of a candidate: punctual lights may have several.
struct Test<'a> {
    candidate: &'a LightSample,
    /// What it stands for.
    power: f64,
    run: usize,
}

/// What candidates bring together, and their power.
#[derive(Clone, Copy, Default)]
struct Brought {
    light: f64,
    power: f64,
}

impl Pairs<'_> {
    /// The test and the point of each pair, and what is reflected.
    fn iter(&self) -> impl Iterator<Item = (&Test<'_>, usize, f32)> {
        let pairs = self.reflected.iter().enumerate();
        pairs.map(|(i, &reflected)| (&self.tests[i / self.per_test], i % self.points.len(), reflected))
    }

    /// What all candidates bring to each point.
    fn brightness_by_kind(&self) -> Brightness {
        // Each pair stands for as many as a candidate could have been tested by.
        let stands_for = self.points.len() as f64 / self.per_test as f64;
        let pairs = self.iter().map(|(Test { candidate, power: part, .. }, point, reflected)| {
            let scale = (stands_for * part / power(candidate).max(f64::MIN_POSITIVE)) as f32;
            (*candidate, point, reflected_light(&self.points[point], candidate, reflected) * scale)
        });
        Brightness::of(self.points.len(), pairs)
    }

    /// The light that points that are seen reflect in the mean.
    fn brightness(&self) -> f64 {
        let seen = self.points.iter().filter(|point| point.is_seen).count();
        // Each point is one of so many that a candidate could have been tested against.
        let each = self.points.len() as f64 / (self.per_test * seen.max(1)) as f64;
        let shown = self.iter().map(|(test, point, reflected)| {
            let share = if self.points[point].is_seen { grayness(test.candidate) } else { 0.0 };
            f64::from(reflected) * test.power * share
        });
        shown.sum::<f64>() * each
    }

    /// What each point counts for; `None` where no light reaches them.
    fn point_weights(&self) -> Option<Vec<f64>> {
        let brightness = |counts: fn(&LightSample) -> bool| {
            let mut brightness = vec![0.0; self.points.len()];
            for (test, point, reflected) in self.iter().filter(|(test, ..)| counts(test.candidate)) {
                brightness[point] += f64::from(reflected) * test.power;
            }
            brightness
        };
        let near = if self.is_guided { brightness(|c| !c.profile.is_parallel()) } else { Vec::new() };
        let brightness = if near.iter().any(|&b| b > 0.0) { near } else { brightness(|_| true) };
        let mean = brightness.iter().sum::<f64>() / self.points.len() as f64;
        let weights = || brightness.iter().map(|b| 1.0 / (b + DARK * mean)).collect();
        if mean <= 0.0 { None } else { Some(weights()) }
    }

    /// By test, the sum of `f` of what its pairs bring to points that count for so much.
    fn by_test(&self, counts: &[f64], f: impl Fn(f64) -> f64) -> Vec<f64> {
        let sum = |(at, test): (usize, &Test)| {
            let pairs = at * self.per_test..(at + 1) * self.per_test;
            let brought = |i| f(f64::from(self.reflected[i]) * counts[i % self.points.len()]);
            pairs.map(brought).sum::<f64>() * test.power
        };
        self.tests.iter().enumerate().map(sum).collect()
    }

    /// The sun's part of the light that tests bring.
    fn share_of_sun(&self, light: &[f64]) -> f64 {
        let all: f64 = light.iter().sum();
        let of_sun = self.tests.iter().zip(light).filter(|(test, _)| test.candidate.is_of_sun());
        if all > 0.0 { of_sun.map(|(_, light)| light).sum::<f64>() / all } else { 0.0 }
    }

    /// Gives runs their importance, and returns the mean over all candidates. `brought` is by test: squares where light is guided.
    fn weigh(&self, runs: &mut [Run], brought: &[f64]) -> f64 {
        let mut by_run = vec![Brought::default(); runs.len()];
        for (test, light) in self.tests.iter().zip(brought) {
            by_run[test.run].light += light;
            by_run[test.run].power += test.power;
        }
        for run in by_run.iter_mut().filter(|_| self.is_guided) {
            run.light = (run.light * run.power * self.per_test as f64).sqrt();
        }
        let all = self.candidates.iter().map(power).sum::<f64>();
        let mean = by_run.iter().map(|run| run.light).sum::<f64>() / all;
        let kind = |run: &Run| usize::from(self.candidates[run.members[0] as usize].profile.is_parallel());
        let mut kinds = [Brought::default(); 2];
        for (run, own) in runs.iter().zip(&by_run) {
            kinds[kind(run)].light += own.light;
            kinds[kind(run)].power += own.power;
        }
        let is_mixed = kinds.iter().all(|kind| kind.power > 0.0);
        let plain = kinds.map(|k| if is_mixed { (k.light / k.power).max(LEAST_PLAIN * mean) } else { mean });
        // Where paths are guided (`guide.rs`), those that start where little is seen from are few and strong: candidates count alike.
        let each = all / self.candidates.len() as f64;
        for (run, brought) in runs.iter_mut().zip(by_run) {
            let members = run.members.iter().map(|&i| power(&self.candidates[i as usize]));
            let own = members.sum::<f64>() / run.members.len() as f64;
            let alike = if self.is_guided && own > 0.0 { each / own } else { 1.0 };
            let plain = plain[kind(run)] * alike;
            run.importance = PLAIN * plain + (1.0 - PLAIN) * (brought.light / brought.power);
        }
        mean
    }
}

/// How far light that leaves the candidates goes, metres: the median of a few rays, which is what a room is large by,
/// whatever lies about it. 1 m where nothing is hit.
pub(super) fn free_path(tracer: &SceneTracer, candidates: &[LightSample]) -> f32 {
    let rays = FREE_PATH_RAYS.min(candidates.len());
    let length = |i: usize| {
        let candidate = &candidates[i * candidates.len() / rays];
        let s = [0, 1].map(|d| sequence::sample(i as u32, d, RAYS_SEED));
        let local = warp::cosine_hemisphere(Vec2::from_array(s));
        let (x, y) = warp::frame(candidate.normal);
        let direction = (x * local.x + y * local.y + candidate.normal * local.z).normalize();
        tracer
            .closest_hit(candidate.position, direction, f32::INFINITY, candidate.triangle())
            .map(|hit| hit.t)
    };
    let mut lengths: Vec<f32> = (0..rays).filter_map(length).collect();
    lengths.sort_unstable_by(f32::total_cmp);
    lengths.get(lengths.len() / 2).copied().unwrap_or(1.0)
}

/// Light from a candidate that a point reflects, per unit of [power]; by luminance, in arbitrary units.
fn reflected(tracer: &SceneTracer, point: &ViewPoint, candidate: &LightSample, bound: f32) -> f32 {
    let Surface { position, geometric_normal, shading_normal, .. } = point.surface;
    match candidate.geometric_factor(position, geometric_normal, shading_normal, Clamp::At(bound)) {
        Some((g, _))
            if !tracer.occluded(
                position,
                point.triangle,
                candidate.shadow_ray_end(position, tracer.geometry()),
                candidate.triangle(),
            ) =>
        {
            g * reflectance(point, candidate) / distance_squared(candidate)
        }
        _ => 0.0,
    }
}

/// How much of a candidate's light a point reflects, as far as it counts.
fn reflectance(point: &ViewPoint, candidate: &LightSample) -> f32 {
    if matches!(candidate.profile, Profile::Distant { .. }) {
        point.reflectance
    } else {
        point.local_reflectance
    }
}

/// The same light by channel, of all of the candidate.
fn reflected_light(point: &ViewPoint, candidate: &LightSample, reflected: f32) -> Vec3 {
    let Surface { albedo, f0, .. } = point.surface;
    let per_intensity = reflected * distance_squared(candidate) / reflectance(point, candidate);
    candidate.intensity * (albedo + f0) * per_intensity
}

/// What a sample at a [place] brings to a point, by channel, with the bound that candidates there were measured with.
pub(super) fn light_at(tracer: &SceneTracer, point: &ViewPoint, sample: &LightSample, bound: f32) -> Vec3 {
    reflected_light(point, sample, reflected(tracer, point, sample, bound))
}

/// What samples bring to points, by sample and then by point: per unit of intensity, as a share of a brightness. Shadows are
/// left out where a change of the intensity by so much could not be seen anyway.
pub(super) fn brought(
    tracer: &SceneTracer,
    points: &[ViewPoint],
    samples: &[(LightSample, Vec3)],
    brightness: f64,
) -> Vec<f32> {
    in_order(samples.len() * points.len(), |i| {
        let ((sample, change), point) = (&samples[i / points.len()], &points[i % points.len()]);
        let Surface { position, geometric_normal, shading_normal, .. } = point.surface;
        let factor = sample.geometric_factor(position, geometric_normal, shading_normal, Clamp::Own);
        let reflectance = (point.surface.albedo + point.surface.f0).max_element();
        let share = factor.map_or(0.0, |(g, _)| g * reflectance) / brightness as f32;
        let end = sample.shadow_ray_end(position, tracer.geometry());
        let blocked = || {
            sample.is_before(position, geometric_normal, shading_normal)
                && tracer.occluded(position, point.triangle, end, sample.triangle())
        };
        if change.abs().max_element() * share > UNSEEN && blocked() { 0.0 } else { share }
    })
}

/// The bound on `G` of a sample that stands for a whole run, lest single pairs decide.
fn bound(candidates: &[LightSample], power: &[f64], run: &[u32]) -> f32 {
    let sum =
        |f: &dyn Fn(usize) -> DVec3| run.iter().map(|&i| f(i as usize) * power[i as usize]).sum::<DVec3>();
    let at = |i: usize| candidates[i].position.as_dvec3();
    let total: f64 = run.iter().map(|&i| power[i as usize]).sum();
    let mean = sum(&at) / total;
    let variance = sum(&|i| (at(i) - mean) * (at(i) - mean)).element_sum() / total;
    (1.0 / (2.0 * variance)).min(f64::from(f32::MAX)) as f32
}

#[cfg(test)]
mod tests;
