//! What a database stores: a state by node and light.

use super::State;
use std::ops::Range;

/// By node and light the state: a row for each node, a column for each light.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct StateMatrix {
    lights: usize,
    states: Vec<State>,
}

impl StateMatrix {
    /// Without rows.
    pub fn new(lights: usize) -> Self {
        Self { lights, states: Vec::new() }
    }

    /// Of so many lights, row by row.
    pub fn of(lights: usize, states: Vec<State>) -> Self {
        Self { lights, states }
    }

    /// Without rows, with room for so many.
    pub fn with_room(nodes: usize, lights: usize) -> Self {
        Self { lights, states: Vec::with_capacity(nodes * lights) }
    }

    /// A node's states.
    pub fn row(&self, node: usize) -> &[State] {
        &self.states[node * self.lights..(node + 1) * self.lights]
    }

    /// Becomes the same as another one.
    pub fn copy_from(&mut self, other: &Self) {
        self.lights = other.lights;
        self.states.clone_from(&other.states);
    }

    /// Makes a pair partial.
    pub fn set_partial(&mut self, node: usize, light: usize) {
        self.states[node * self.lights + light] = State::Partial;
    }

    /// Makes all pairs of a node partial that are unoccluded.
    pub fn set_all_partial(&mut self, node: usize) {
        let row = &mut self.states[node * self.lights..(node + 1) * self.lights];
        row.iter_mut().filter(|state| **state == State::Unoccluded).for_each(|state| *state = State::Partial);
    }

    /// Appends a node.
    pub fn push(&mut self, states: &[State]) {
        self.states.extend_from_slice(states);
    }

    /// Drops all but the first nodes.
    pub fn truncate(&mut self, nodes: usize) {
        self.states.truncate(nodes * self.lights);
    }

    /// Appends the rows of another matrix of as many lights.
    pub fn append(&mut self, other: Self) {
        if self.states.is_empty() && self.lights == other.lights {
            *self = other;
            return;
        }
        self.states.extend(other.states);
    }

    /// Takes off all but the first nodes.
    pub fn split_off(&mut self, nodes: usize) -> Self {
        Self { lights: self.lights, states: self.states.split_off(nodes * self.lights) }
    }

    /// Appends some rows of another matrix of as many lights.
    pub fn append_rows(&mut self, other: &Self, nodes: Range<usize>) {
        self.states.extend_from_slice(&other.states[nodes.start * self.lights..nodes.end * self.lights]);
    }

    /// The columns of some lights.
    pub fn columns(&self, lights: &[u32]) -> Self {
        let rows = self.states.chunks(self.lights.max(1));
        let states = rows.flat_map(|row| lights.iter().map(|light| row[*light as usize])).collect();
        Self { lights: lights.len(), states }
    }

    /// Replaces the columns of some lights, from a node on, by those of a matrix.
    pub fn set_columns(&mut self, node: usize, lights: &[u32], columns: &Self) {
        let rows = self.states[node * self.lights..].chunks_mut(self.lights.max(1));
        for (row, columns) in rows.zip(columns.states.chunks(columns.lights.max(1))) {
            lights.iter().zip(columns).for_each(|(light, state)| row[*light as usize] = *state);
        }
    }
}
