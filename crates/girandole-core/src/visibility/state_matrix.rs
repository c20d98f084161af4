//! What a database stores: by node and light a state, and the blocker that decides it.

use super::State;
use super::node_visibility::{Entry, NodeVisibility};
use std::ops::Range;

/// The blocker that decides a state, if there is one: a node of a hierarchy of blockers, with the lowest bit set if it is full.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Decider(u32);

impl Decider {
    const NONE: Self = Self(u32::MAX);

    fn of(entry: &Entry) -> Self {
        Self(entry.blocker() << 1 | u32::from(entry.full()))
    }
}

/// By node and light the state and the blocker that decides it: a row for each node, a column for each light.
#[derive(Clone, Debug, Default)]
pub(crate) struct StateMatrix {
    lights: usize,
    states: Vec<State>,
    deciders: Vec<Decider>,
}

impl StateMatrix {
    /// Without rows.
    pub fn new(lights: usize) -> Self {
        Self { lights, ..Self::default() }
    }

    /// A node's states.
    pub fn row(&self, node: usize) -> &[State] {
        &self.states[node * self.lights..(node + 1) * self.lights]
    }

    /// The blocker that decides a state, and whether it is full.
    pub fn decider(&self, node: usize, light: usize) -> Option<(u32, bool)> {
        let decider = self.deciders[node * self.lights + light];
        (decider != Decider::NONE).then_some((decider.0 >> 1, decider.0 & 1 == 1))
    }

    /// How many deciding blockers it has.
    pub fn blockers(&self) -> usize {
        self.deciders.iter().filter(|d| **d != Decider::NONE).count()
    }

    /// Becomes a matrix of the same states as another one, without blockers that decide them.
    pub fn set_undecided(&mut self, states: &Self) {
        self.lights = states.lights;
        self.states.clone_from(&states.states);
        self.deciders.clear();
        self.deciders.resize(self.states.len(), Decider::NONE);
    }

    /// Makes a pair partial because of a blocker.
    pub fn set_partial(&mut self, node: usize, light: usize, blocker: u32) {
        let at = node * self.lights + light;
        (self.states[at], self.deciders[at]) = (State::Partial, Decider(blocker << 1));
    }

    /// Makes all pairs of a node partial that are unoccluded, because of a blocker.
    pub fn set_all_partial(&mut self, node: usize, blocker: u32) {
        let row = node * self.lights..(node + 1) * self.lights;
        for (state, decider) in self.states[row.clone()].iter_mut().zip(&mut self.deciders[row]) {
            if *state == State::Unoccluded {
                (*state, *decider) = (State::Partial, Decider(blocker << 1));
            }
        }
    }

    /// Appends a node; of a light's entries the first one decides.
    pub fn push(&mut self, node: &NodeVisibility) {
        self.push_states(&node.states, node.entries.iter().filter(|e| !e.is_partly_facing()));
    }

    /// Appends a node of these states and entries.
    pub fn push_states<'a>(&mut self, states: &[State], entries: impl DoubleEndedIterator<Item = &'a Entry>) {
        let first = self.states.len();
        self.states.extend_from_slice(states);
        self.deciders.resize(self.states.len(), Decider::NONE);
        for entry in entries.rev() {
            self.deciders[first + entry.light as usize] = Decider::of(entry);
        }
    }

    /// Drops all but the first nodes.
    pub fn truncate(&mut self, nodes: usize) {
        self.states.truncate(nodes * self.lights);
        self.deciders.truncate(nodes * self.lights);
    }

    /// Appends the rows of another matrix of as many lights.
    pub fn append(&mut self, other: Self) {
        if self.states.is_empty() && self.lights == other.lights {
            *self = other;
            return;
        }
        self.states.extend(other.states);
        self.deciders.extend(other.deciders);
    }

    /// Takes off all but the first nodes.
    pub fn split_off(&mut self, nodes: usize) -> Self {
        let first = nodes * self.lights;
        Self {
            lights: self.lights,
            states: self.states.split_off(first),
            deciders: self.deciders.split_off(first),
        }
    }

    /// Appends some rows of another matrix of as many lights.
    pub fn append_rows(&mut self, other: &Self, nodes: Range<usize>) {
        let range = nodes.start * self.lights..nodes.end * self.lights;
        self.states.extend_from_slice(&other.states[range.clone()]);
        self.deciders.extend_from_slice(&other.deciders[range]);
    }

    /// The columns of some lights.
    pub fn columns(&self, lights: &[u32]) -> Self {
        let mut result = Self::new(lights.len());
        for first in (0..self.states.len()).step_by(self.lights.max(1)) {
            let at = |light: &u32| first + *light as usize;
            result.states.extend(lights.iter().map(|light| self.states[at(light)]));
            result.deciders.extend(lights.iter().map(|light| self.deciders[at(light)]));
        }
        result
    }

    /// Replaces the columns of some lights, from a node on, by those of a matrix.
    pub fn set_columns(&mut self, node: usize, lights: &[u32], columns: &Self) {
        let width = columns.lights.max(1);
        let rows = columns.states.chunks(width).zip(columns.deciders.chunks(width));
        let first = (node * self.lights..).step_by(self.lights.max(1));
        for (first, (states, deciders)) in first.zip(rows) {
            for (light, (state, decider)) in lights.iter().zip(states.iter().zip(deciders)) {
                let at = first + *light as usize;
                (self.states[at], self.deciders[at]) = (*state, *decider);
            }
        }
    }
}
