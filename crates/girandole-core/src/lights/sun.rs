//! The environment's sun among light samples.
//!
//! It brings most of the light outdoors, and any of its points would do nearly as well as all of them: by what clusters are split by
//! (`strata.rs`) it would be one sample with a hard shadow, and by power most samples would be its. So it has strata of its own: its part of
//! the light that the picture gets, up to one in [`FIRST`] of all, and beyond that a [`SHARE`] of its part. Where its light does not come in,
//! it is one or two.
//!
//! Worked examples: of 300 samples, the sun gets 21 where it brings 70 % of the light, and 6 where it brings 2 %, as through windows.

use super::LightSample;
use super::emitters::Source;
use super::importance::Place;
use super::strata::{Apart, Growth};

/// The most of all samples that are the sun's: one in so many.
const SHARE: u32 = 10;
/// Up to one in so many, its samples are as its part of the light is.
const FIRST: f64 = 40.0;
/// The most of the candidates on emitters that are.
const CANDIDATES: f64 = 0.4;

/// The sun's strata, if it is one among candidates, and other light; `count` is the number of all strata, `seen` the sun's part of the light
/// that was found at what is seen.
pub(super) fn apart(
    candidates: &[LightSample],
    places: &[Place],
    weights: &[f64],
    (count, seen): (u32, f64),
) -> Option<Apart> {
    let (mut sun, mut all) = (0.0, 0.0);
    let mut nearest = [f64::NEG_INFINITY, f64::INFINITY];
    for ((candidate, place), &weight) in candidates.iter().zip(places).zip(weights) {
        let x = f64::from(place[0]);
        all += weight;
        if candidate.is_of_sun() {
            sun += weight;
            nearest[1] = nearest[1].min(x);
        } else if weight > 0.0 && candidate.punctual().is_none() {
            nearest[0] = nearest[0].max(x);
        }
    }
    let border = (nearest[0] + nearest[1]) * 0.5;
    (sun > 0.0 && border.is_finite() && count > 1).then(|| {
        let share = (sun / all / f64::from(SHARE)).max(seen.min(1.0 / FIRST)) * f64::from(count);
        Apart { axis: 0, border, count: (share.round() as u32).clamp(1, most(count)), growth: Growth::Held }
    })
}

/// How many of so many samples are the sun's at most.
fn most(count: u32) -> u32 {
    (count / SHARE).max(1)
}

/// Weights of emitters by which the sun gets no more than its share of so many samples.
pub(super) fn limited_samples(groups: &[Vec<Source>], weights: Vec<f64>, count: u32) -> Vec<f64> {
    limited(groups, weights, f64::from(most(count)) / f64::from(count.max(2)))
}

/// Weights of emitters by which the sun leaves most of the candidates to others.
pub(super) fn limited_candidates(groups: &[Vec<Source>], weights: Vec<f64>) -> Vec<f64> {
    limited(groups, weights, CANDIDATES)
}

fn limited(groups: &[Vec<Source>], mut weights: Vec<f64>, most: f64) -> Vec<f64> {
    // It is the last one.
    let has_sun = groups.last().is_some_and(|group| group.iter().any(Source::is_sun));
    if let (true, Some((sun, others))) = (has_sun, weights.split_last_mut()) {
        let others: f64 = others.iter().sum();
        if others > 0.0 {
            *sun = sun.min(others * most / (1.0 - most));
        }
    }
    weights
}
