//! Gains of light samples by which regions of what is seen are as bright as all candidates make them.
//!
//! A few hundred samples of the light that comes in through windows miss the brightness of whole walls by a tenth or two, which is what
//! is seen first. All candidates together, a hundred times as many, miss it by much less, and the pairs that they were
//! [weighed](super::importance) by tell it.
//!
//! 1. The view points are halved by place until there are regions enough. What all candidates bring to each region is `t`, and the sum of
//!    the squares of its pairs is its variance or more; `τ²` is the mean over regions. Samples are tested against the same points: sample `k` brings `x_k`.
//! 2. Gains `g` minimise `Σ (g_k − 1)² / σ² + Σ (t − Σ g_k x_k)² / τ²`, in shares of each region's brightness: calibration
//!    of the weights of a survey (Deville and Särndal 1992), by a ridge where totals are uncertain (Bardsley and Chambers 1984).
//! 3. `σ²` is what of `(t − Σ x_k)²` the variance `τ²` does not explain (moments, as DerSimonian and Laird 1986). In rooms where
//!    samples are right there is nothing left, and all gains are 1.
//!
//! For each channel; for what is near and for the sky apart. The sun and punctual lights stay as they are: all of either is there.

use super::brightness::{Kind, Measured};
use super::importance::{Place, halve, light_at, place};
use super::resample::Chosen;
use super::sampling::Sampling;
use super::view_points::ViewPoint;
use crate::parallel::in_slices;
use crate::trace::SceneTracer;
use glam::Vec3;

/// Regions of what is seen, for what is near and for the sky.
const REGIONS: [usize; 2] = [64, 16];
/// Pairs of samples and points at most: fewer points where there are more samples.
const MOST_PAIRS: usize = 1 << 18;
/// Samples of a slice.
const SLICE: usize = 8;
/// Share of the mean brightness of all regions that is added to that of each: what is dark need not be right by as little.
const DARK: f64 = 0.1;
/// The least and the largest gain.
const GAINS: [f64; 2] = [0.25, 4.0];

/// Gives samples their gains.
pub(super) async fn calibrate(tracer: &SceneTracer<'_>, sampling: &Sampling, chosen: &mut [Chosen]) {
    let Some(brightness) = &sampling.importance.of_points else { return };
    let count = sampling.points.len().min(MOST_PAIRS / chosen.len().max(1));
    let points = &sampling.points[..count];
    for ((kind, light), count) in brightness.by_kind().into_iter().zip(REGIONS) {
        let regions = regions(points, count, sampling.normal_scale);
        let members: Vec<usize> =
            (0..chosen.len()).filter(|&i| Kind::of(&chosen[i].sample) == Some(kind)).collect();
        let brought: Vec<Vec<Vec3>> = in_slices(members.len(), SLICE, |i| {
            let sample = &chosen[members[i]].sample;
            let bound = sampling.importance.bound_at(place(sample, sampling.normal_scale));
            let at = |&point: &u32| light_at(tracer, &points[point as usize], sample, bound);
            regions.iter().map(|region| region.iter().map(at).sum()).collect()
        })
        .await;
        let measured = |of: fn(&Measured) -> Vec3| -> Vec<Vec3> {
            let of_region = |region: &Vec<u32>| region.iter().map(|&point| of(&light[point as usize])).sum();
            regions.iter().map(of_region).collect()
        };
        let (light, variance) = (measured(|point| point.light), measured(|point| point.variance));
        for channel in 0..3 {
            let of = |values: &[Vec3]| -> Vec<f64> { values.iter().map(|v| f64::from(v[channel])).collect() };
            let brought: Vec<Vec<f64>> = brought.iter().map(|by_region| of(by_region)).collect();
            for (gain, &i) in gains(brought, &of(&light), &of(&variance)).into_iter().zip(&members) {
                let Chosen { sample, shares } = &mut chosen[i];
                let lights = shares.iter_mut().map(|(_, light)| light).chain([&mut sample.intensity]);
                lights.for_each(|light| light[channel] = (f64::from(light[channel]) * gain) as f32);
            }
        }
    }
}

/// So many sets of points, neighbours in each: halves of halves.
fn regions(points: &[ViewPoint], count: usize, normal_scale: f32) -> Vec<Vec<u32>> {
    let at = |point: &ViewPoint| -> Place {
        let (p, n) = (point.surface.position, point.surface.geometric_normal * normal_scale);
        [p.x, p.y, p.z, n.x, n.y, n.z]
    };
    let places: Vec<Place> = points.iter().map(at).collect();
    let mut regions = vec![(0..points.len() as u32).collect::<Vec<u32>>()];
    while regions.len() < count.min(points.len()) {
        let halves = regions.into_iter().flat_map(|mut first| {
            let second = if first.len() > 1 { halve(&mut first, &places).2 } else { Vec::new() };
            [first, second]
        });
        regions = halves.filter(|region| !region.is_empty()).collect();
    }
    regions
}

/// Gains of samples, given what each brings to every region, what all candidates bring there, and the variance of that.
fn gains(mut brought: Vec<Vec<f64>>, light: &[f64], variance: &[f64]) -> Vec<f64> {
    let count = light.len();
    let mean = light.iter().sum::<f64>() / count as f64;
    let own: Vec<f64> = (0..count).map(|r| brought.iter().map(|by_region| by_region[r]).sum()).collect();
    // By either alone, regions would count for more where that happens to be low.
    let scales: Vec<f64> = light
        .iter()
        .zip(&own)
        .map(|(t, own)| 1.0 / (0.5 * (t + own) + DARK * mean).max(f64::MIN_POSITIVE))
        .collect();
    brought.iter_mut().for_each(|of| of.iter_mut().zip(&scales).for_each(|(x, scale)| *x *= scale));
    let missing: Vec<f64> = (0..count).map(|r| (light[r] - own[r]) * scales[r]).collect();
    // That of all regions: one pair that brings much makes a region bright, and would make it count for little.
    let noise =
        variance.iter().zip(&scales).map(|(variance, s)| variance * s * s).sum::<f64>() / count as f64;
    let unexplained = missing.iter().map(|m| m * m).sum::<f64>() - noise * count as f64;
    let all_squares = brought.iter().flatten().map(|x| x * x).sum::<f64>();
    if !(unexplained > 0.0 && all_squares > 0.0 && noise > 0.0) {
        return vec![1.0; brought.len()];
    }
    let spread = unexplained / all_squares;
    let mut equations: Vec<Vec<f64>> = (0..count)
        .map(|r| {
            let entry = |c: usize| {
                let product = spread * brought.iter().map(|of| of[r] * of[c]).sum::<f64>();
                product + if r == c { noise } else { 0.0 }
            };
            (0..count).map(entry).chain([missing[r]]).collect()
        })
        .collect();
    let solution = solve(&mut equations);
    let gain = |of: &Vec<f64>| {
        let change = spread * of.iter().zip(&solution).map(|(x, s)| x * s).sum::<f64>();
        (1.0 + change).clamp(GAINS[0], GAINS[1])
    };
    brought.iter().map(gain).collect()
}

/// Solves linear equations whose matrix is symmetric and positive definite; each has its right side at its end.
fn solve(equations: &mut [Vec<f64>]) -> Vec<f64> {
    let count = equations.len();
    for pivot in 0..count {
        let (above, below) = equations.split_at_mut(pivot + 1);
        let row = &above[pivot];
        for other in below {
            let factor = other[pivot] / row[pivot];
            (pivot..=count).for_each(|c| other[c] -= factor * row[c]);
        }
    }
    let mut solution = vec![0.0; count];
    for r in (0..count).rev() {
        let known: f64 = (r + 1..count).map(|c| equations[r][c] * solution[c]).sum();
        solution[r] = (equations[r][count] - known) / equations[r][r];
    }
    solution
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lights::guide::tests::{room, sky};
    use crate::lights::view_points::{POINTS, view_points};
    use crate::lights::{LightSet, LightSettings};
    use crate::math::sequence;
    use crate::scene::Geometry;
    use crate::slices::complete;

    #[test]
    fn gains_bring_what_is_missing_as_far_as_it_is_known() {
        const COUNT: usize = 8;
        let random = |i: usize, d: usize| f64::from(sequence::sample(i as u32, d as u32, 3));
        let brought: Vec<Vec<f64>> = (0..40)
            .map(|k| (0..COUNT).map(|r| if (k + r) % 3 == 0 { random(k, r) } else { 0.0 }).collect())
            .collect();
        let with = |gains: &[f64]| -> Vec<f64> {
            (0..COUNT).map(|r| brought.iter().zip(gains).map(|(x, gain)| x[r] * gain).sum()).collect()
        };
        let right: Vec<f64> = (0..40).map(|k| 0.8 + 0.8 * random(k, COUNT)).collect();
        let (light, own) = (with(&right), with(&[1.0; 40]));
        let furthest = |from: &[f64]| {
            from.iter().zip(&light).map(|(is, should)| (is / should - 1.0).abs()).fold(0.0, f64::max)
        };
        let of = |share: f64| {
            let variance: Vec<f64> = light.iter().map(|t| (share * t).powi(2)).collect();
            gains(brought.clone(), &light, &variance)
        };
        // Known to a thousandth, and no better than it is wrong by.
        let (known, unknown) = (of(1e-3), of(0.5));
        assert!(furthest(&own) > 0.1, "{}", furthest(&own));
        assert!(furthest(&with(&known)) < 0.01, "{}", furthest(&with(&known)));
        assert_eq!(unknown, vec![1.0; 40]);
        // What is known by half lies between.
        let between = furthest(&with(&of(0.1)));
        assert!(between > 0.01 && between < 0.7 * furthest(&own), "{between}");
    }

    #[test]
    fn equations_are_solved() {
        let mut equations =
            vec![vec![4.0, 2.0, 1.0, 11.0], vec![2.0, 5.0, 3.0, 21.0], vec![1.0, 3.0, 6.0, 25.0]];
        for (is, should) in solve(&mut equations).into_iter().zip([1.0, 2.0, 3.0]) {
            assert!((is - should).abs() < 1e-12, "{is} for {should}");
        }
    }

    #[test]
    fn gains_are_those_of_what_emits_too_and_later_sets_have_none() {
        let (scene, view) = room(sky());
        let geometry = Geometry::new(&scene);
        let settings = LightSettings { count: 64, ..LightSettings::default() };
        let sampled = |settings, is_calibrated| {
            complete(LightSet::sample_as(&scene, &geometry, settings, &[view], is_calibrated)).expect("light")
        };
        let set = sampled(&settings, true);
        for (sample, shares) in set.samples.iter().zip(&set.shares) {
            let all: Vec3 = shares.iter().map(|(_, light)| *light).sum();
            assert!(all.distance(sample.intensity) <= 1e-4 * all.length(), "{all} {}", sample.intensity);
        }
        let intensities = |set: &LightSet| set.samples.iter().map(|s| s.intensity).collect::<Vec<Vec3>>();
        let later = settings.of_set(1);
        let set = LightSet::sample_set(&scene, &geometry, &settings, &[view], 1).expect("light");
        assert_eq!(intensities(&set), intensities(&sampled(&later, false)));
        // The control: calibrated ones are others.
        assert_ne!(intensities(&set), intensities(&sampled(&later, true)));
    }

    #[test]
    fn a_room_with_a_window_is_as_bright_with_any_seed() {
        let (scene, view) = room(sky());
        let geometry = Geometry::new(&scene);
        let tracer = SceneTracer::new(&scene, &geometry);
        let points = view_points(&tracer, &[view], POINTS);
        let parts = regions(&points, 16, 1.0);
        assert_eq!((parts.len(), parts.concat().len()), (16, points.len()));
        // Neighbours, which any sixteenth is not.
        let spread = |part: &[u32]| {
            let at = |&point: &u32| points[point as usize].surface.position;
            let mean = part.iter().map(at).sum::<Vec3>() / part.len() as f32;
            part.iter().map(|point| at(point).distance(mean)).sum::<f32>() / part.len() as f32
        };
        let widest = parts.iter().map(|part| spread(part)).fold(0.0, f32::max);
        let any: Vec<u32> = (0..points.len() as u32).step_by(16).collect();
        assert!(widest < 0.8 * spread(&any), "{widest} for {}", spread(&any));
        // By seed and region, in all channels.
        let brightness = |count, seeds: u32, is_calibrated| -> Vec<Vec<f64>> {
            let of = |seed| {
                let settings = LightSettings { count, seed, ..LightSettings::default() };
                let views = [view];
                let set = LightSet::sample_as(&scene, &geometry, &settings, &views, is_calibrated);
                let set = complete(set).expect("light");
                let at = |point: u32| {
                    let light =
                        |sample| light_at(&tracer, &points[point as usize], sample, 1.0).element_sum();
                    set.samples().iter().map(|sample| f64::from(light(sample))).sum::<f64>()
                };
                parts.iter().map(|part| part.iter().map(|&point| at(point)).sum()).collect()
            };
            (0..seeds).map(of).collect()
        };
        // All light, and how far regions are from their means.
        let mean_and_deviation = |found: &[Vec<f64>]| {
            let seeds = found.len() as f64;
            let of_region = |r: usize| {
                let mean = found.iter().map(|of| of[r]).sum::<f64>() / seeds;
                (mean, found.iter().map(|of| (of[r] / mean - 1.0).powi(2)).sum::<f64>() / (seeds - 1.0))
            };
            let (mean, variance) =
                (0..16).map(of_region).fold((0.0, 0.0), |sum, of| (sum.0 + of.0, sum.1 + of.1 / 16.0));
            (mean, variance.sqrt())
        };
        let (right, _) = mean_and_deviation(&brightness(1024, 4, false));
        let (mean, deviation) = mean_and_deviation(&brightness(64, 16, true));
        let (_, plain) = mean_and_deviation(&brightness(64, 16, false));
        assert!(deviation < 0.75 * plain, "{deviation} for {plain}");
        // Two standard errors.
        assert!((mean / right - 1.0).abs() < 0.06, "{mean} for {right}");
    }
}
