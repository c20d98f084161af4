//! Strata of candidates: clusters that are compact in position and normal, one for each light sample.
//!
//! They are made by splits, the cluster with the largest [error](Cluster::error) first. Where candidates change from frame to
//! frame the splits are held, so that what happens in one stratum changes no other; and a few strata a frame are merged and
//! others split where that lowers the largest error.

use super::importance::{NORMAL_SCALE, Place};
use super::nearness::Seen;
use glam::DVec3;
use std::cmp::Ordering;
use std::collections::{BTreeMap, BinaryHeap};
use std::f64::consts::PI;

/// Power of a cluster's spread in its error. If light went unblocked, what a cluster brings to a point would differ in
/// proportion to its spread, at shadow edges to its root; splitting the largest error of all then puts samples to
/// the 2/3rd and 4/5th power of the density of light. In single rooms 0.75 to 2 are about equal, and 0, which is clusters of
/// equal weight, has a quarter more error; in a building 0.75 has a fifth less than 1.5.
const SPREAD_POWER: f64 = 0.75;
/// How many candidates the half of the parent's area counts for beside a cluster's own few.
const PRIOR: f64 = 1.0;

/// Strata are merged and others split where the error of the split one is so many times that of the merged ones.
const HYSTERESIS: f64 = 1.2;

/// Strata keep their weights up to this relative variance of the light that these leave, if what they were given for has
/// changed.
const STALE: f64 = 0.2;

/// Candidates that have strata of their own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Apart {
    /// They lie beyond this border along this axis of [places](Place).
    pub axis: usize,
    pub border: f64,
    /// How many strata, at least; or exactly so many, that stay as they are.
    pub count: u32,
    pub is_fixed: bool,
}

/// A candidate, or a part of one where clusters lie at one place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    pub index: u32,
    pub weight: f64,
    /// Position and scaled normal.
    at: Place,
}

/// Candidates of which one sample is chosen.
#[derive(Clone, Debug, Default)]
pub(super) struct Cluster {
    pub items: Vec<Item>,
    pub weight: f64,
    /// Variance along each axis, by weight, of places as [near](Seen::nearness) as theirs count.
    variance: [f64; 6],
    /// r² of the disc that a sample of the cluster stands for, m².
    pub radius_squared: f64,
}

impl Cluster {
    fn new(items: Vec<Item>, parent_radius_squared: Option<f64>, seen: Option<Seen>) -> Self {
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
    fn error(&self) -> f64 {
        if self.items.len() < 2 {
            return -1.0;
        }
        self.weight * libm::pow(self.variance.iter().sum(), 0.5 * SPREAD_POWER)
    }

    /// Splits the cluster in two across the axis of largest variance, where that leaves the least variance on both sides. What
    /// all lies at one place is halved in number, a single candidate in weight.
    fn split(self, seen: Option<Seen>) -> ([Self; 2], Border) {
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
        (parts.map(|items| Self::new(items, Some(radius_squared), seen)), border)
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

/// Where a cluster was split.
#[derive(Clone, Copy, Debug)]
enum Border {
    /// Between two places along an axis.
    At { axis: usize, border: f64 },
    /// At one place, after a candidate.
    After(u32),
    /// Nowhere: both halves have all of it, with half the weight.
    None,
}

/// A cluster, or the two that it was split into.
#[derive(Clone, Debug)]
struct Stratum {
    /// Tells it from all others that there ever are.
    id: u64,
    parent: Option<usize>,
    /// r² of the disc of the cluster that it was split from, m².
    prior: Option<f64>,
    split: Option<(Border, [usize; 2])>,
    /// Whether it stays as it is, whatever its error.
    is_held: bool,
    /// Without candidates, if it is split.
    cluster: Cluster,
}

/// A hierarchy of clusters, of which those that are not split are the strata.
#[derive(Clone, Debug)]
pub(super) struct Strata {
    nodes: Vec<Stratum>,
    /// Places of nodes that are gone.
    free: Vec<usize>,
    next_id: u64,
    /// Where what is seen is, by which distances count.
    seen: Option<Seen>,
    /// Whether they need not be merged and split as things are.
    is_balanced: bool,
}

/// Relative variance of what a candidate brings by the weights that there are now, chosen by those held.
fn staleness(items: &[Item], held: &[f64], now: &[f64]) -> f64 {
    let (mut weight, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for item in items {
        let ratio = now[item.index as usize] / held[item.index as usize];
        weight += item.weight;
        sum += item.weight * ratio;
        squares += item.weight * ratio * ratio;
    }
    if sum > 0.0 { weight * squares / (sum * sum) - 1.0 } else { 0.0 }
}

impl Strata {
    /// `count` of them, over candidates at these [places](Place), some of which may have theirs apart: fewer than
    /// that. Weights are not negative, and positive where there is light.
    pub fn new(
        places: &[Place],
        weights: &[f64],
        (count, seen): (u32, Option<Seen>),
        apart: &[Apart],
    ) -> Self {
        let items: Vec<Item> = (0..)
            .zip(places.iter().zip(weights))
            .map(|(index, (&at, &weight))| Item { index, weight, at })
            .filter(|i| i.weight > 0.0)
            .collect();
        let mut result = Self { nodes: Vec::new(), free: Vec::new(), next_id: 0, seen, is_balanced: true };
        if items.is_empty() || count == 0 {
            return result;
        }
        let mut rest = result.add(None, None, Cluster::new(items, None, seen));
        let mut own: Vec<(usize, Apart)> = Vec::new();
        for &part in apart {
            own.extend(result.set_apart(&mut rest, part).map(|node| (node, part)));
        }
        let (fixed, least): (Vec<_>, Vec<_>) = own.into_iter().partition(|(_, part)| part.is_fixed);
        let mut open = vec![rest];
        for (node, part) in least {
            open.extend(result.grow(&[node], part.count));
        }
        result.grow(&open, count - fixed.iter().map(|(_, part)| part.count).sum::<u32>());
        for (node, part) in fixed {
            let first = result.nodes.len();
            result.grow(&[node], part.count);
            let held = std::iter::once(node).chain(first..result.nodes.len());
            held.for_each(|node| result.nodes[node].is_held = true);
        }
        result
    }

    /// Takes what is to have its own strata from the rest, and returns the node that it becomes, unless one of both is nothing.
    fn set_apart(&mut self, rest: &mut usize, Apart { axis, border, .. }: Apart) -> Option<usize> {
        let is_apart = |item: &Item| f64::from(item.at[axis]) > border;
        let all = &self.nodes[*rest].cluster.items;
        let (part, others): (Vec<Item>, Vec<Item>) = all.iter().partition(|item| is_apart(item));
        if part.is_empty() || others.is_empty() {
            return None;
        }
        let seen = self.seen;
        let children =
            [others, part].map(|items| self.add(Some(*rest), None, Cluster::new(items, None, seen)));
        let node = &mut self.nodes[*rest];
        (node.split, node.is_held) = (Some((Border::At { axis, border }, children)), true);
        node.cluster = Cluster::default();
        *rest = children[0];
        Some(children[1])
    }

    /// Splits nodes until there are so many of them, the largest error first; returns those.
    fn grow(&mut self, nodes: &[usize], count: u32) -> Vec<usize> {
        let mut open = BinaryHeap::new();
        open.extend(nodes.iter().map(|&node| Open { error: self.nodes[node].cluster.error(), node }));
        while open.len() < count as usize
            && let Some(Open { node, .. }) = open.pop()
        {
            for child in self.split(node) {
                open.push(Open { error: self.nodes[child].cluster.error(), node: child });
            }
        }
        open.into_iter().map(|Open { node, .. }| node).collect()
    }

    fn add(&mut self, parent: Option<usize>, prior: Option<f64>, cluster: Cluster) -> usize {
        let stratum = Stratum { id: self.next_id, parent, prior, split: None, is_held: false, cluster };
        self.next_id += 1;
        match self.free.pop() {
            Some(place) => {
                self.nodes[place] = stratum;
                place
            }
            None => {
                self.nodes.push(stratum);
                self.nodes.len() - 1
            }
        }
    }

    fn split(&mut self, node: usize) -> [usize; 2] {
        let cluster = std::mem::take(&mut self.nodes[node].cluster);
        let prior = Some(cluster.radius_squared);
        let (parts, border) = cluster.split(self.seen);
        let children = parts.map(|part| self.add(Some(node), prior, part));
        self.nodes[node].split = Some((border, children));
        children
    }

    /// Those with candidates, in a spatial order, with what tells each from all others.
    pub fn clusters(&self) -> Vec<(u64, &Cluster)> {
        let mut result = Vec::new();
        let mut open = if self.nodes.is_empty() { Vec::new() } else { vec![0] };
        while let Some(node) = open.pop() {
            let Stratum { id, split, cluster, .. } = &self.nodes[node];
            match split {
                Some((_, [first, second])) => open.extend([*second, *first]),
                None if cluster.items.is_empty() => {}
                None => result.push((*id, cluster)),
            }
        }
        result
    }

    /// Distances count by what is seen there from now on, where strata are split and merged.
    pub fn look_at(&mut self, seen: Option<Seen>) {
        (self.seen, self.is_balanced) = (seen, false);
    }

    /// Whether none would be merged and split, were nothing to change.
    pub fn is_balanced(&self) -> bool {
        self.is_balanced
    }

    /// Gives other candidates to the same strata: those at these places, with these weights.
    pub fn distribute(&mut self, places: &[Place], weights: &[f64]) {
        let mut items = vec![Vec::new(); self.nodes.len()];
        for (index, (&at, &weight)) in (0..).zip(places.iter().zip(weights)) {
            let mut open =
                if weight > 0.0 && !self.nodes.is_empty() { vec![(0, weight)] } else { Vec::new() };
            while let Some((node, weight)) = open.pop() {
                match self.nodes[node].split {
                    Some((Border::At { axis, border }, halves)) => {
                        open.push((halves[usize::from(f64::from(at[axis]) > border)], weight));
                    }
                    Some((Border::After(last), halves)) => {
                        open.push((halves[usize::from(index > last)], weight));
                    }
                    Some((Border::None, halves)) => open.extend(halves.map(|half| (half, weight * 0.5))),
                    None => items[node].push(Item { index, weight, at }),
                }
            }
        }
        for (stratum, items) in self.nodes.iter_mut().zip(items) {
            stratum.cluster = Cluster::new(items, stratum.prior, self.seen);
        }
    }

    /// In strata with new candidates, or whose weights are too far from those that there are now, gives all of them the latter:
    /// those of other times may be of other orders of magnitude.
    pub fn weigh_alike(&mut self, places: &[Place], weights: &mut [f64], now: &[f64], is_new: &[bool]) {
        let mut changed = false;
        for Stratum { cluster: Cluster { items, .. }, .. } in &self.nodes {
            if items.iter().any(|item| is_new[item.index as usize]) || staleness(items, weights, now) > STALE
            {
                changed = true;
                items.iter().for_each(|item| weights[item.index as usize] = now[item.index as usize]);
            }
        }
        if changed {
            self.distribute(places, weights);
        }
    }

    /// Merges strata and splits others, at most so many times, as long as that lowers the largest error by much, and gives
    /// them the same candidates again. Where weights are other ones by now, these decide, and those of candidates in strata that
    /// change take their place.
    /// Returns the strata that are gone and those that came in pairs, each with the one that two became or that became two.
    pub fn rebalance(
        &mut self,
        most: usize,
        places: &[Place],
        weights: &mut [f64],
        now: &[f64],
    ) -> Vec<(u64, u64)> {
        let count = self.nodes.len();
        let mut leaves: BTreeMap<usize, f64> = BTreeMap::new();
        let mut pairs: BTreeMap<usize, f64> = BTreeMap::new();
        let is_gone: Vec<bool> = (0..count).map(|node| self.free.contains(&node)).collect();
        for node in (0..count).filter(|&node| !is_gone[node]) {
            self.note_error(node, (weights, now), (&mut leaves, &mut pairs));
        }
        let mut lineage = Vec::new();
        for _ in 0..most {
            let extreme = |errors: &BTreeMap<usize, f64>, sign: f64| {
                let better = |a: &(&usize, &f64), b: &(&usize, &f64)| (sign * a.1).total_cmp(&(sign * b.1));
                errors.iter().max_by(better).map(|(&node, &error)| (node, error))
            };
            let Some((worst, most_error)) = extreme(&leaves, 1.0) else { break };
            let own_pair = self.nodes[worst].parent.and_then(|parent| pairs.remove(&parent));
            let least = extreme(&pairs, -1.0);
            if let (Some(parent), Some(error)) = (self.nodes[worst].parent, own_pair) {
                pairs.insert(parent, error);
            }
            let Some((merged, least_error)) = least else { break };
            if most_error <= HYSTERESIS * least_error {
                break;
            }
            let Some((_, children)) = self.nodes[merged].split.take() else { break };
            let joined = self.joined(&children, self.nodes[merged].prior, (weights, now));
            self.nodes[worst].cluster = self.joined(&[worst], self.nodes[worst].prior, (weights, now));
            for item in joined.items.iter().chain(&self.nodes[worst].cluster.items) {
                weights[item.index as usize] = now[item.index as usize];
            }
            lineage.extend(children.map(|child| (self.nodes[child].id, self.next_id)));
            let stratum = &mut self.nodes[merged];
            (stratum.cluster, stratum.id) = (joined, self.next_id);
            self.next_id += 1;
            for child in children {
                self.nodes[child].cluster = Cluster::default();
                leaves.remove(&child);
                self.free.push(child);
            }
            leaves.remove(&worst);
            pairs.remove(&merged);
            let parts = self.split(worst);
            lineage.extend(parts.map(|part| (self.nodes[part].id, self.nodes[worst].id)));
            let parents = [merged, worst].map(|node| self.nodes[node].parent);
            for node in parts.into_iter().chain([merged, worst]).chain(parents.into_iter().flatten()) {
                self.note_error(node, (weights, now), (&mut leaves, &mut pairs));
            }
        }
        self.is_balanced = lineage.is_empty() && most > 0;
        if !lineage.is_empty() {
            self.distribute(places, weights);
        }
        lineage
    }

    /// The error of a node that is not split, or that two such nodes would have as one.
    fn note_error(
        &self,
        node: usize,
        weights: (&[f64], &[f64]),
        (leaves, pairs): (&mut BTreeMap<usize, f64>, &mut BTreeMap<usize, f64>),
    ) {
        match self.nodes[node].split {
            _ if self.nodes[node].is_held => {}
            None => {
                leaves.insert(node, self.joined(&[node], None, weights).error());
            }
            Some((Border::At { .. } | Border::After(_), children))
                if children.iter().all(|&child| self.nodes[child].split.is_none()) =>
            {
                let is_empty = |&child: &usize| self.nodes[child].cluster.items.is_empty();
                // To join nothing costs nothing.
                let is_free = children.iter().any(is_empty);
                let error = if is_free { 0.0 } else { self.joined(&children, None, weights).error() };
                pairs.insert(node, error);
            }
            Some(_) => {
                pairs.remove(&node);
            }
        }
    }

    /// What nodes hold as one, by the weights that there are now.
    fn joined(&self, nodes: &[usize], prior: Option<f64>, (weights, now): (&[f64], &[f64])) -> Cluster {
        let parts = nodes.iter().flat_map(|&node| &self.nodes[node].cluster.items);
        let weighed = |item: &Item| {
            let index = item.index as usize;
            Item { weight: item.weight * (now[index] / weights[index]), ..*item }
        };
        Cluster::new(parts.map(weighed).collect(), prior, self.seen)
    }
}
