//! Clusters of candidates, and how they are split.

use crate::lights::importance::{NORMAL_SCALE, Place};
use crate::lights::nearness::Seen;
use glam::DVec3;
use std::f64::consts::PI;

/// Power of a cluster's spread in its error. If light went unblocked, what a cluster brings to a point would differ in
/// proportion to its spread, at shadow edges to its root; splitting the largest error of all then puts samples to
/// the 2/3rd and 4/5th power of the density of light. In single rooms 0.75 to 2 are about equal, and 0, which is clusters of
/// equal weight, has a quarter more error; in a building 0.75 has a fifth less than 1.5.
const SPREAD_POWER: f64 = 0.75;
/// How many candidates the half of the parent's area counts for beside a cluster's own few.
const PRIOR: f64 = 1.0;

/// A candidate, or a part of one where clusters lie at one place.
#[derive(Clone, Copy, Debug)]
pub(in crate::lights) struct Item {
    pub index: u32,
    pub weight: f64,
    /// Position and scaled normal.
    pub at: Place,
}

/// Candidates of which one sample is chosen.
#[derive(Clone, Debug, Default)]
pub(in crate::lights) struct Cluster {
    pub items: Vec<Item>,
    pub weight: f64,
    /// Variance along each axis, by weight, of places as [near](Seen::nearness) as theirs count.
    variance: [f64; 6],
    /// r² of the disc that a sample of the cluster stands for, m².
    pub radius_squared: f64,
}

impl Cluster {
    pub fn new(items: Vec<Item>, parent_radius_squared: Option<f64>, seen: Option<Seen>) -> Self {
        if items.is_empty() {
            return Self::default();
        }
        let sum = |f: &dyn Fn(&Item) -> f64| items.iter().map(f).sum::<f64>();
        let weight = sum(&|i| i.weight);
        let mean: [f64; 6] = std::array::from_fn(|axis| sum(&|i| f64::from(i.at[axis]) * i.weight) / weight);
        let mut variance: [f64; 6] = std::array::from_fn(|axis| {
            sum(&|i| (f64::from(i.at[axis]) - mean[axis]).powi(2) * i.weight) / weight
        });
        // A disc's r² is twice the mean squared distance from its centre.
        let own = 2.0 * variance[..3].iter().sum::<f64>();
        // Few candidates say little of the area that they were left on: it is about half of the parent's.
        let candidates = weight * weight / sum(&|i| i.weight * i.weight);
        let radius_squared = match parent_radius_squared {
            Some(parent) => (candidates * own + PRIOR * 0.5 * parent) / (candidates - 1.0 + PRIOR),
            None => own,
        };
        let nearness = seen.map_or(1.0, |seen| seen.nearness(DVec3::new(mean[0], mean[1], mean[2])));
        variance[..3].iter_mut().for_each(|v| *v *= nearness * nearness);
        Self { items, weight, variance, radius_squared }
    }

    /// Where candidates are directions of an environment, what a sample of the cluster stands for, sr.
    pub fn solid_angle(&self) -> f64 {
        // They lie on a sphere, and so do their scaled normals.
        let scaled_normal = |i: &Item| i.at[3..].iter().map(|&x| f64::from(x).powi(2)).sum::<f64>();
        let sphere = self.items.first().map_or(1.0, scaled_normal) / f64::from(NORMAL_SCALE).powi(2);
        (PI * self.radius_squared / sphere).min(4.0 * PI)
    }

    /// How much a sample of the cluster may be wrong by, in arbitrary units; less than nothing for what stands for itself alone.
    pub fn error(&self) -> f64 {
        if self.items.len() < 2 {
            return -1.0;
        }
        self.weight * libm::pow(self.variance.iter().sum(), 0.5 * SPREAD_POWER)
    }

    /// Splits the cluster in two across the axis of largest variance, where that leaves the least variance on both sides. What
    /// all lies at one place is halved in number, a single candidate in weight.
    pub(super) fn split(&self, seen: Option<Seen>) -> Halves {
        let Self { ref items, weight, variance, radius_squared } = *self;
        let mut items = items.clone();
        let axis = (1..6).fold(0, |best, axis| if variance[axis] > variance[best] { axis } else { best });
        let at = |i: &Item| f64::from(i.at[axis]);
        items.sort_unstable_by(|a, b| a.at[axis].total_cmp(&b.at[axis]).then(a.index.cmp(&b.index)));
        let moment: f64 = items.iter().map(|i| at(i) * i.weight).sum();
        // Between two different places: weights of both sides times the squared distance of their means (Otsu 1979).
        let (mut best, mut most) = (None, 0.0);
        let (mut left, mut left_moment) = (0.0, 0.0);
        for (border, pair) in (1..).zip(items.windows(2)) {
            left += pair[0].weight;
            left_moment += at(&pair[0]) * pair[0].weight;
            let right = weight - left;
            let apart = left_moment / left - (moment - left_moment) / right;
            let between = left * right * apart * apart;
            if at(&pair[0]) < at(&pair[1]) && between > most {
                (best, most) = (Some(border), between);
            }
        }
        let (parts, border) = match best {
            Some(first) => {
                let border = (at(&items[first - 1]) + at(&items[first])) * 0.5;
                let second = items.split_off(first);
                ([items, second], Border::At { axis, border })
            }
            None if items.len() > 1 => {
                let second = items.split_off(items.len() / 2);
                let border = Border::After(second[0].index - 1);
                ([items, second], border)
            }
            None => {
                items.iter_mut().for_each(|i| i.weight *= 0.5);
                ([items.clone(), items], Border::None)
            }
        };
        Halves { parts: parts.map(|items| Self::new(items, Some(radius_squared), seen)), border }
    }
}

/// Where a cluster was split.
#[derive(Clone, Copy, Debug)]
pub(super) enum Border {
    /// Between two places along an axis.
    At { axis: usize, border: f64 },
    /// At one place, after a candidate.
    After(u32),
    /// Nowhere: both halves have all of it, with half the weight.
    None,
}

/// What a cluster is split into.
pub(super) struct Halves {
    pub parts: [Cluster; 2],
    pub border: Border,
}
