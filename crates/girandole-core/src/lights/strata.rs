//! Strata of candidates: clusters that are compact in position and normal, one for each light sample.
//!
//! They are made by splits, the cluster with the largest [error](Cluster::error) first. Where candidates change from frame to
//! frame the splits are held, so that what happens in one stratum changes no other; and a few strata a frame are merged and
//! others split where that lowers the largest error.

mod cluster;

pub(super) use self::cluster::{Cluster, Item};

use self::cluster::{Border, Halves};
use super::importance::Place;
use super::nearness::Seen;
use crate::parallel::map;
use rustc_hash::FxHashMap;
use std::cmp::Ordering;
use std::collections::{BTreeMap, BinaryHeap};

/// Clusters that are split on all cores before it is their turn: all but the last ones are split in the end.
const SPLIT_AHEAD: usize = if cfg!(feature = "parallel") { 256 } else { 1 };
/// Candidates that are worth a piece of work of their own.
const PIECE: usize = 4096;

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
    /// How many strata are theirs.
    pub count: u32,
    pub growth: Growth,
}

/// What becomes of strata that are apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Growth {
    /// There are so many at least.
    AtLeast,
    /// There are so many, which stay as they are.
    Held,
    /// There are so many, and their errors count for as much more as makes that the right number.
    Balanced,
}

/// Whose errors count so many times as much as others.
#[derive(Clone, Copy, Debug)]
struct Counted {
    axis: usize,
    border: f64,
    times: f64,
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
    counted: Option<Counted>,
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
        let mut result =
            Self { nodes: Vec::new(), free: Vec::new(), next_id: 0, seen, counted: None, is_balanced: true };
        if items.is_empty() || count == 0 {
            return result;
        }
        let mut rest = result.add(None, None, Cluster::new(items, None, seen));
        let mut own: Vec<(usize, Apart)> = Vec::new();
        for &part in apart {
            own.extend(result.set_apart(&mut rest, part).map(|node| (node, part)));
        }
        let (least, fixed): (Vec<_>, Vec<_>) =
            own.into_iter().partition(|(_, part)| part.growth == Growth::AtLeast);
        let mut open = vec![rest];
        for (node, part) in least {
            open.extend(result.grow(&[node], part.count));
        }
        let others = result.grow(&open, count - fixed.iter().map(|(_, part)| part.count).sum::<u32>());
        for (node, Apart { axis, border, count, growth }) in fixed {
            let first = result.nodes.len();
            let grown = result.grow(&[node], count);
            if growth == Growth::Held {
                let held = std::iter::once(node).chain(first..result.nodes.len());
                held.for_each(|node| result.nodes[node].is_held = true);
            } else {
                let times = result.largest_error(&others) / result.largest_error(&grown);
                result.counted =
                    Some(Counted { axis, border, times }).filter(|_| times.is_finite() && times > 0.0);
            }
        }
        result
    }

    fn largest_error(&self, nodes: &[usize]) -> f64 {
        nodes.iter().map(|&node| self.nodes[node].cluster.error()).fold(0.0, f64::max)
    }

    /// The error of a cluster, as far as it counts.
    fn error(&self, cluster: &Cluster) -> f64 {
        let is_counted = |counted: &Counted| {
            cluster.items.first().is_some_and(|item| f64::from(item.at[counted.axis]) > counted.border)
        };
        cluster.error() * self.counted.filter(is_counted).map_or(1.0, |counted| counted.times)
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
        let mut ahead = FxHashMap::default();
        while open.len() < count as usize
            && let Some(Open { node, .. }) = open.peek()
        {
            let node = *node;
            if !ahead.contains_key(&node) {
                let left = count as usize - open.len();
                self.split_ahead(&mut open, left.min(SPLIT_AHEAD), &mut ahead);
            }
            open.pop();
            for child in ahead.remove(&node).map(|halves| self.put_halves(node, halves)).into_iter().flatten()
            {
                open.push(Open { error: self.nodes[child].cluster.error(), node: child });
            }
        }
        open.into_iter().map(|Open { node, .. }| node).collect()
    }

    /// Finds what the first of these nodes would be split into, so many of them.
    fn split_ahead(&self, open: &mut BinaryHeap<Open>, most: usize, ahead: &mut FxHashMap<usize, Halves>) {
        let first: Vec<Open> = (0..most).map_while(|_| open.pop()).collect();
        let mut pieces: Vec<(Vec<usize>, usize)> = Vec::new();
        for node in first.iter().map(|open| open.node).filter(|node| !ahead.contains_key(node)) {
            if pieces.last().is_none_or(|(_, items)| *items >= PIECE) {
                pieces.push((Vec::new(), 0));
            }
            if let Some((nodes, items)) = pieces.last_mut() {
                nodes.push(node);
                *items += self.nodes[node].cluster.items.len();
            }
        }
        let halves = |node: &usize| (*node, self.nodes[*node].cluster.split(self.seen));
        let of_piece = |(nodes, _): &(Vec<usize>, usize)| nodes.iter().map(halves).collect::<Vec<_>>();
        ahead.extend(map(&pieces, of_piece).into_iter().flatten());
        open.extend(first);
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
        let halves = self.nodes[node].cluster.split(self.seen);
        self.put_halves(node, halves)
    }

    fn put_halves(&mut self, node: usize, Halves { parts, border }: Halves) -> [usize; 2] {
        let prior = Some(std::mem::take(&mut self.nodes[node].cluster).radius_squared);
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
                leaves.insert(node, self.error(&self.joined(&[node], None, weights)));
            }
            Some((Border::At { .. } | Border::After(_), children))
                if children.iter().all(|&child| self.nodes[child].split.is_none()) =>
            {
                let is_empty = |&child: &usize| self.nodes[child].cluster.items.is_empty();
                // To join nothing costs nothing.
                let is_free = children.iter().any(is_empty);
                let error = if is_free { 0.0 } else { self.error(&self.joined(&children, None, weights)) };
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

#[cfg(test)]
mod tests;
