//! The sky among light samples, where its light comes in through openings.
//!
//! Each of its samples throws whole windows onto walls and floors. What clusters are split by (`strata.rs`) knows how much they bring and
//! how far apart they are, but not that; so a sky that is seen through windows would have one in ten samples, and their sharp edges
//! would be all over the room. Where light is [guided](super::guide), it has strata of its own, so many that what it and near things are
//! wrong by together is least:
//!
//! 1. A pilot has as many strata of either. Of each, two samples are chosen. Where they are seen, the two sets differ by `√2` times what
//!    one of them is wrong by.
//! 2. The error of stratified samples falls as `n^−3/4` where shadows have edges (Mitchell 1996). So it is known for any share what
//!    both are wrong by at each point: the root of the sum of squares.
//! 3. What is seen of it is the 0.7th power of the difference (FLIP, Andersson et al. 2020, §4.1). The share is the one for which that is
//!    least in the mean over the points.
//!
//! Worked examples: of 300 samples, the sky has about 75 in a classroom with a row of windows, and 135 in an empty room whose only
//! light comes in through blinds.

use super::LightSample;
use super::brightness::Kind;
use super::importance::{Importance, Place, light_at, place};
use super::resample::{Candidates, Chosen, choose};
use super::strata::{Apart, Growth, Strata};
use super::view_points::ViewPoint;
use crate::math::sequence;
use crate::parallel::in_slices;
use crate::trace::SceneTracer;

/// Strata of either kind in a pilot, and points that both are compared at.
const PILOT_STRATA: u32 = 64;
const PILOT_POINTS: usize = 256;
/// Sums over a set, at a point, of a slice.
const SLICE: usize = 16;
/// A pilot has so many candidates at most: every second, third …
const PILOT_CANDIDATES: usize = 1 << 15;
/// Share of the mean brightness that is added to that of each point: what is dark need not be right by as little.
const DARK: f64 = 0.3;
/// The error falls as the number of strata to the negative of this.
const CONVERGENCE: f64 = 0.75;
/// What is seen of an error is in proportion to this power of it.
const SEEN: f64 = 0.7;
/// Shares that are tried are so many parts of all.
const PARTS: u32 = 64;

/// Between near things and the sky, by [place].
fn border(candidates: &[LightSample], places: &[Place]) -> Option<f64> {
    let mut nearest = [f64::NEG_INFINITY, f64::INFINITY];
    for (candidate, place) in candidates.iter().zip(places) {
        let x = f64::from(place[0]);
        match Kind::of(candidate) {
            Some(Kind::Near) => nearest[0] = nearest[0].max(x),
            Some(Kind::Sky) => nearest[1] = nearest[1].min(x),
            None => {}
        }
    }
    Some((nearest[0] + nearest[1]) * 0.5).filter(|border| border.is_finite())
}

/// The sky's share of the samples that are its own and near things'; `None` where there is no light of either.
pub(super) async fn share(
    tracer: &SceneTracer<'_>,
    points: &[ViewPoint],
    candidates: Candidates<'_>,
    (importance, normal_scale): (&Importance, f32),
    seed: u32,
) -> Option<f64> {
    let Candidates { samples, weights, .. } = candidates;
    let places: Vec<Place> = samples.iter().map(|sample| place(sample, normal_scale)).collect();
    border(samples, &places)?;
    let count = points.len().min(PILOT_POINTS);
    let points: Vec<&ViewPoint> = (0..count).map(|i| &points[i * points.len() / count]).collect();
    let step = samples.len().div_ceil(PILOT_CANDIDATES).max(1);
    let mut brightness = vec![0.0; count];
    // At each point, of near things and of the sky.
    let mut differences = vec![[0.0; 2]; count];
    for kind in [Kind::Near, Kind::Sky] {
        let is_own = |i: usize| i.is_multiple_of(step) && Kind::of(&samples[i]) == Some(kind);
        let own = |i: usize| if is_own(i) { weights[i] } else { 0.0 };
        let own: Vec<f64> = (0..samples.len()).map(own).collect();
        let strata = Strata::new(&places, &own, (PILOT_STRATA, importance.seen), &[]);
        let clusters = strata.clusters();
        let set = |set: u32| {
            let chosen = |(_, cluster): &(u64, &_)| choose(candidates, cluster, sequence::hash(seed ^ set));
            let with_bound =
                |chosen: Chosen| (chosen.sample, importance.bound_at(place(&chosen.sample, normal_scale)));
            clusters.iter().filter_map(chosen).map(with_bound).collect::<Vec<(LightSample, f32)>>()
        };
        let sets = [set(1), set(2)];
        let light = in_slices(2 * count, SLICE, |i| {
            let at = |(sample, bound): &(LightSample, f32)| {
                f64::from(light_at(tracer, points[i / 2], sample, *bound).element_sum())
            };
            sets[i % 2].iter().map(at).sum::<f64>()
        })
        .await;
        for (point, pair) in light.chunks(2).enumerate() {
            brightness[point] += 0.5 * (pair[0] + pair[1]);
            differences[point][kind as usize] = pair[0] - pair[1];
        }
    }
    let mean = brightness.iter().sum::<f64>() / count as f64;
    for (differences, brightness) in differences.iter_mut().zip(&brightness) {
        *differences = differences.map(|difference| (difference / (brightness + DARK * mean)).powi(2));
    }
    Some(best_share(&differences)).filter(|_| mean > 0.0)
}

/// The second kind's share of all samples that leaves the least to be seen, where as many of either differ by these squares.
fn best_share(squares: &[[f64; 2]]) -> f64 {
    let seen = |part: &u32| {
        let share = f64::from(*part) / f64::from(PARTS);
        let [first, second] = [1.0 - share, share].map(|n| libm::pow(n, -2.0 * CONVERGENCE));
        squares.iter().map(|s| libm::pow(first * s[0] + second * s[1], 0.5 * SEEN)).sum::<f64>()
    };
    let parts = (1..PARTS).map(|part| (part, seen(&part)));
    let best = parts.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(part, _)| part);
    f64::from(best) / f64::from(PARTS)
}

/// The sky's strata, where it has a share of so many strata.
pub(super) fn apart(
    candidates: &[LightSample],
    places: &[Place],
    (count, share): (u32, Option<f64>),
) -> Option<Apart> {
    let (share, border) = (share?, border(candidates, places)?);
    let count = (share * f64::from(count)).round() as u32;
    (count > 0).then_some(Apart { axis: 0, border, count, growth: Growth::Balanced })
}

#[cfg(test)]
mod tests {
    use super::best_share;
    use crate::lights::brightness::Kind;
    use crate::lights::guide::tests::{room, sky};
    use crate::lights::importance::{Importance, light_at};
    use crate::lights::resample::{Candidates, resample};
    use crate::lights::sampling::Sampling;
    use crate::lights::{LightSample, LightSettings};
    use crate::scene::Geometry;
    use crate::slices::complete;
    use crate::trace::SceneTracer;

    #[test]
    fn shares_leave_the_least_error() {
        // Alike at all points: (1 - share) to share as differences to the power of 0.8.
        for (squares, share) in [([1.0, 1.0], 0.5), ([1.0, 16.0], 0.752), ([16.0, 1.0], 0.248)] {
            let found = best_share(&[squares; 3]);
            assert!((found - share).abs() <= 1.0 / 128.0, "{squares:?}: {found}");
        }
        assert_eq!([[1.0, 0.0], [0.0, 1.0]].map(|squares| best_share(&[squares])), [1.0 / 64.0, 63.0 / 64.0]);
        // One point that differs much counts for less than many that differ as much together.
        let few = |largest: f64| best_share(&[[1.0, largest], [1.0, 0.0], [1.0, 0.0], [1.0, 0.0]]);
        assert!(few(16.0) < best_share(&[[1.0, 1.0]; 4]), "{}", few(16.0));
    }

    #[test]
    fn a_sky_behind_a_window_has_as_many_samples_as_leave_the_least_error() {
        const COUNTS: [u32; 2] = [96, 4096];
        let (scene, view) = room(sky());
        let geometry = Geometry::new(&scene);
        let tracer = SceneTracer::new(&scene, &geometry);
        let (mut errors, mut counts) = ([0.0; 3], [0; 3]);
        for seed in 0..6 {
            let settings = LightSettings { count: COUNTS[0], seed, ..LightSettings::default() };
            let sampling = complete(Sampling::new(&tracer, &settings, &[view]));
            let (samples, sources) = sampling.candidates(&geometry);
            let weights = sampling.importance.weights(&samples);
            // At points, and how many samples are the sky's.
            let light = |count: u32, importance: &Importance| -> (Vec<f64>, usize) {
                let candidates = Candidates {
                    samples: &samples,
                    sources: &sources,
                    weights: &weights,
                    is_guided: false,
                    tracer: None,
                };
                let chosen =
                    resample(candidates, (count, importance), sampling.normal_scale, sampling.seed).0;
                let samples: Vec<LightSample> = chosen.into_iter().map(|chosen| chosen.sample).collect();
                let of_sky = samples.iter().filter(|s| Kind::of(s) == Some(Kind::Sky)).count();
                let points = sampling.points.iter().step_by(4);
                let at = |point| {
                    let of = |sample| f64::from(light_at(&tracer, point, sample, 1.0).element_sum());
                    samples.iter().map(of).sum()
                };
                (points.map(at).collect(), of_sky)
            };
            let of = |of_sky| {
                let mut importance = sampling.importance.clone();
                importance.of_sky = of_sky;
                importance
            };
            let found = sampling.importance.of_sky.expect("its light is guided");
            // Nearly all candidates.
            let (right, _) = light(COUNTS[1], &of(None));
            let mean = right.iter().sum::<f64>() / right.len() as f64;
            // As found; the controls: by what clusters are split by alone, and still fewer.
            let cases = [Some(found), None, Some(0.05)];
            for ((error, count), case) in errors.iter_mut().zip(&mut counts).zip(cases) {
                let (light, of_sky) = light(COUNTS[0], &of(case));
                let relative = light.iter().zip(&right).map(|(a, b)| (a - b).abs() / (b + 0.3 * mean));
                *error += relative.sum::<f64>() / right.len() as f64;
                *count += of_sky;
            }
        }
        assert!(2 * counts[1] < counts[0] && 2 * counts[2] < counts[1], "{counts:?}");
        assert!(errors[0] < 0.8 * errors[1] && errors[0] < 0.8 * errors[2], "{errors:?}");
    }
}
