//! Stratified resampling: few, well spread samples with the expected light of many candidates.
//!
//! 1. Candidates have weights: what they bring to the picture (`importance.rs`), or their power.
//! 2. They are one cluster at first. Again and again the cluster with the largest [error](Cluster::error) is split in two,
//!    across the axis of position or normal along which it varies most, until there is a cluster for each sample.
//! 3. From each cluster one candidate is chosen in proportion to weight `w`, and its intensity is multiplied by `W / w`, with
//!    the cluster's weight `W`. It stands for the part of the cluster that lies in its plane: it takes the mean colour of
//!    that part, and gets a rectangle about it.
//!
//! A candidate is chosen with a probability proportional to its weight and multiplied by the inverse, so the expected light is
//! that of all candidates: the stratified resampling of particle filters (Kitagawa 1996), with strata that are compact in
//! position and normal like the clusters of lightcuts (Walter et al. 2005, §3). The mean colour keeps the light of the whole cluster
//! in each channel (what is lost is only that its one end may be redder than the other), and takes a quarter off the error: each
//! deposit has the colour of a single path.
//!
//! Which cluster is split decides where samples lie, on emitters or on what reflects. With clusters of equal weight a lamp
//! that brings half of the light gets half of the samples, though it is small and any of its points would do nearly as well.

use super::emission::{Emission, Shares};
use super::importance::power;
use super::{LightSample, Rectangle, SampleOrigin};
use crate::math::sequence;
use glam::DVec3;
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::f64::consts::PI;

/// Power of a cluster's spread in its error. If light went unblocked, what a cluster brings to a point would differ in
/// proportion to its spread, at shadow edges to its root; splitting the largest error of all then puts samples to
/// the 2/3rd and 4/5th power of the density of light. In single rooms 0.75 to 2 are about equal, and 0, which is clusters of
/// equal weight, has a quarter more error; in a building 0.75 has a fifth less than 1.5.
const SPREAD_POWER: f64 = 0.75;
/// How many candidates the half of the parent's area counts for beside a cluster's own few.
const PRIOR: f64 = 1.0;

/// A candidate, or a part of one where clusters lie at one place.
#[derive(Clone, Copy)]
struct Item {
    index: u32,
    weight: f64,
    /// Position and scaled normal.
    at: [f32; 6],
}

/// Candidates of which one sample is chosen.
struct Cluster {
    items: Vec<Item>,
    weight: f64,
    /// Variance along each axis, by weight.
    variance: [f64; 6],
    /// r² of the disc that a sample of the cluster stands for, m².
    radius_squared: f64,
}

impl Cluster {
    fn new(items: Vec<Item>, parent_radius_squared: Option<f64>) -> Self {
        let sum = |f: &dyn Fn(&Item) -> f64| items.iter().map(f).sum::<f64>();
        let weight = sum(&|i| i.weight);
        let variance = std::array::from_fn(|axis| {
            let at = |i: &Item| f64::from(i.at[axis]);
            let mean = sum(&|i| at(i) * i.weight) / weight;
            sum(&|i| (at(i) - mean).powi(2) * i.weight) / weight
        });
        // A disc's r² is twice the mean squared distance from its centre.
        let own = 2.0 * variance[..3].iter().sum::<f64>();
        // Few candidates say little of the area that they were left on: it is about half of the parent's.
        let candidates = weight * weight / sum(&|i| i.weight * i.weight);
        let radius_squared = match parent_radius_squared {
            Some(parent) => (candidates * own + PRIOR * 0.5 * parent) / (candidates - 1.0 + PRIOR),
            None => own,
        };
        Self { items, weight, variance, radius_squared }
    }

    /// How much a sample of the cluster may be wrong by, in arbitrary units.
    fn error(&self) -> f64 {
        self.weight * libm::pow(self.variance.iter().sum(), 0.5 * SPREAD_POWER)
    }

    /// Splits the cluster in two across the axis of largest variance, where that leaves the least variance on both sides. What
    /// all lies at one place is halved in weight.
    fn split(self) -> [Self; 2] {
        let Self { mut items, weight, variance, radius_squared } = self;
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
        let parts = match best {
            Some(border) => {
                let second = items.split_off(border);
                [items, second]
            }
            None => {
                items.iter_mut().for_each(|i| i.weight *= 0.5);
                [items.clone(), items]
            }
        };
        parts.map(|items| Self::new(items, Some(radius_squared)))
    }
}

/// A cluster that may be split, by error; of equal ones the older one comes first.
struct Open {
    error: f64,
    node: usize,
}

impl Ord for Open {
    fn cmp(&self, other: &Self) -> Ordering {
        self.error.total_cmp(&other.error).then(other.node.cmp(&self.node))
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Open {}

/// A cluster, or what became of it.
enum Node {
    Leaf(Cluster),
    Split([usize; 2]),
}

/// A sample that was chosen.
pub(super) struct Chosen {
    pub sample: LightSample,
    /// Where its light comes from.
    pub shares: Shares,
}

/// `count` samples with the expected light of all candidates, in a spatial order; each has the area that it stands for. If there are
/// too few to choose from, some are repeated. Weights are not negative, and positive where there is light; normals
/// count as positions on a sphere with a radius of `normal_scale` metres.
pub(super) fn resample(
    (candidates, sources): (&[LightSample], &[Emission]),
    weights: &[f64],
    count: u32,
    normal_scale: f32,
    seed: u32,
) -> Vec<Chosen> {
    let item = |(index, (s, &weight)): (usize, (&LightSample, &f64))| {
        let (p, n) = (s.position, s.normal * normal_scale);
        Item { index: index as u32, weight, at: [p.x, p.y, p.z, n.x, n.y, n.z] }
    };
    let items: Vec<Item> =
        candidates.iter().zip(weights).enumerate().map(item).filter(|i| i.weight > 0.0).collect();
    if items.is_empty() || count == 0 {
        return Vec::new();
    }
    let mut nodes = vec![Node::Leaf(Cluster::new(items, None))];
    let mut open = BinaryHeap::from([Open { error: f64::INFINITY, node: 0 }]);
    while open.len() < count as usize
        && let Some(Open { node, .. }) = open.pop()
    {
        let children = [nodes.len(), nodes.len() + 1];
        if let Node::Leaf(cluster) = std::mem::replace(&mut nodes[node], Node::Split(children)) {
            for part in cluster.split() {
                open.push(Open { error: part.error(), node: nodes.len() });
                nodes.push(Node::Leaf(part));
            }
        }
    }
    let mut result = Vec::with_capacity(count as usize);
    let mut path = vec![0];
    while let Some(node) = path.pop() {
        match &nodes[node] {
            Node::Split([first, second]) => path.extend([*second, *first]),
            Node::Leaf(cluster) => {
                result.extend(choose((candidates, sources), weights, cluster, seed));
            }
        }
    }
    result
}

/// A number in [0, 1) that belongs to where a candidate comes from.
fn own_random(candidate: &LightSample, seed: u32) -> f64 {
    let [a, b] = match candidate.origin {
        SampleOrigin::Emitter { triangle, point } => [triangle.wrapping_add(1 << 31), point],
        SampleOrigin::Bounce { path, bounce, .. } => [path, bounce],
        SampleOrigin::Punctual { light } => [light, 0],
    };
    let low = sequence::hash(a ^ sequence::hash(b ^ seed));
    let high = sequence::hash(low ^ 0x68bc_21eb);
    (f64::from(high) + f64::from(low) / 4_294_967_296.0) / 4_294_967_296.0
}

/// A candidate of the cluster in proportion to weight: the first to come, where each comes at a time distributed
/// exponentially with its weight as the rate. Its random number is its own, so that what is chosen changes little if weights
/// or clusters do (permanent random numbers: Ohlsson 1995).
fn choose(
    (candidates, sources): (&[LightSample], &[Emission]),
    weights: &[f64],
    cluster: &Cluster,
    seed: u32,
) -> Option<Chosen> {
    let time = |i: &Item| -libm::log(1.0 - own_random(&candidates[i.index as usize], seed)) / i.weight;
    let times = cluster.items.iter().map(|i| (time(i), i.index));
    let (_, index) = times.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))?;
    let index = index as usize;
    let sample = candidates[index];
    let area = (PI * cluster.radius_squared) as f32;
    let member = |i: &Item| &candidates[i.index as usize];
    let in_plane = |i: &&Item| Rectangle::shares_plane(&sample, member(i), area);
    let coplanar: Vec<&Item> = cluster.items.iter().filter(in_plane).collect();
    let positions = coplanar.iter().map(|i| member(i).position);
    let rectangle = Some(Rectangle::about(&sample, positions, area));
    // A candidate may be there in part.
    let part = |i: &Item| i.weight / weights[i.index as usize];
    let light: DVec3 = coplanar.iter().map(|i| member(i).intensity.as_dvec3() * part(i)).sum();
    let in_all = coplanar.iter().map(|i| power(member(i)) * part(i)).sum::<f64>();
    let scale = power(&sample) * cluster.weight / weights[index];
    let intensity = light / in_all * scale;
    // The same, by what emits.
    let scale = scale / in_all;
    let mut shares = Shares::new();
    for item in coplanar {
        let (source, member) = (sources[item.index as usize], member(item));
        let share = (member.intensity.as_dvec3() * part(item) * scale).as_vec3();
        match shares.iter_mut().find(|(known, _)| *known == source) {
            Some((_, sum)) => *sum += share,
            None => shares.push((source, share)),
        }
    }
    Some(Chosen { sample: LightSample { intensity: intensity.as_vec3(), rectangle, ..sample }, shares })
}
