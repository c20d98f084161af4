//! How each leaf receiver and light lie to each other, two bytes a pair.

use crate::shader_constants::{
    BATCH, JOINTED, MAPPED_SHADOWED, MAPPED_UNSHADOWED, NEAR_SHADOWED, NEAR_UNSHADOWED, NO_PART, SHADOWED,
    UNSHADOWED,
};
use girandole_core::visibility::State;

/// How a light lies to a leaf; the default where it is dark.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Relation {
    /// Whether the leaf's light map has room for it.
    pub in_map: bool,
    /// Whether some point of the leaf may be near to what it stands for.
    pub is_near: bool,
    /// Whether a [`Joint`](girandole_core::visibility::Joint) of the leaf is between them.
    pub is_jointed: bool,
    /// Whether the light's place may lie behind the leaf while part of what it stands for lies before it.
    pub is_cut: IsCut,
}

/// Whether a light's place lies behind a leaf and part of what it stands for before it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum IsCut {
    #[default]
    No,
    /// At points of the leaf that only shading knows.
    Somewhere,
    Everywhere,
}

impl Relation {
    /// Whether the light map holds the light where anything of it arrives.
    pub fn is_summed(self) -> bool {
        self.in_map && !self.is_near && !self.is_jointed
    }

    /// The part of the leaf's list that the light is in.
    pub fn part(self, state: State) -> u32 {
        match (state, self.in_map, self.is_near) {
            (State::Full, ..) => match self.is_cut {
                IsCut::No => NO_PART,
                IsCut::Somewhere => NEAR_SHADOWED,
                IsCut::Everywhere => NEAR_UNSHADOWED,
            },
            (State::Unoccluded, _, true) => NEAR_UNSHADOWED,
            (State::Partial, ..) if self.is_jointed => JOINTED,
            (State::Partial, _, true) => NEAR_SHADOWED,
            (State::Unoccluded, true, false) => MAPPED_UNSHADOWED,
            (State::Unoccluded, false, false) => UNSHADOWED,
            (State::Partial, false, false) => SHADOWED,
            (State::Partial, true, false) => MAPPED_SHADOWED,
        }
    }
}

/// A leaf and a light. From the lowest bit: the [`State`], the same whatever dynamic objects do, the [`Relation`], the part of the leaf's
/// list, and whether the leaf's light map holds the light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Pair(u16);

const STATE: Bits = Bits::after(None, 2);
const STANDING: Bits = Bits::after(Some(STATE), 2);
const IN_MAP: Bits = Bits::after(Some(STANDING), 1);
const IS_NEAR: Bits = Bits::after(Some(IN_MAP), 1);
const IS_JOINTED: Bits = Bits::after(Some(IS_NEAR), 1);
const IS_CUT: Bits = Bits::after(Some(IS_JOINTED), 2);
const PART: Bits = Bits::after(Some(IS_CUT), 3);
const IS_HELD: Bits = Bits::after(Some(PART), 1);
const _: () = assert!(NO_PART < 1 << PART.count && IS_HELD.first < u16::BITS);

/// Some bits of a word.
#[derive(Clone, Copy)]
struct Bits {
    first: u32,
    count: u32,
}

impl Bits {
    const fn after(before: Option<Self>, count: u32) -> Self {
        let first = match before {
            Some(Self { first, count }) => first + count,
            None => 0,
        };
        Self { first, count }
    }

    const fn mask(self) -> u16 {
        ((1 << self.count) - 1) << self.first
    }
}

impl Default for Pair {
    /// Dark, and in no list.
    fn default() -> Self {
        let mut pair = Self(0);
        pair.set_states(State::Full, State::Full);
        pair.set(PART, NO_PART as u16);
        pair
    }
}

impl Pair {
    fn get(self, bits: Bits) -> u16 {
        (self.0 & bits.mask()) >> bits.first
    }

    fn set(&mut self, bits: Bits, value: u16) {
        self.0 = self.0 & !bits.mask() | value << bits.first;
    }

    fn state_in(self, bits: Bits) -> State {
        [State::Unoccluded, State::Partial, State::Full][usize::from(self.get(bits).min(2))]
    }

    pub fn state(self) -> State {
        self.state_in(STATE)
    }

    /// The state, whatever dynamic objects do.
    pub fn standing(self) -> State {
        self.state_in(STANDING)
    }

    pub fn set_states(&mut self, state: State, standing: State) {
        self.set(STATE, state as u16);
        self.set(STANDING, standing as u16);
    }

    pub fn relation(self) -> Relation {
        Relation {
            in_map: self.get(IN_MAP) != 0,
            is_near: self.get(IS_NEAR) != 0,
            is_jointed: self.get(IS_JOINTED) != 0,
            is_cut: [IsCut::No, IsCut::Somewhere, IsCut::Everywhere][usize::from(self.get(IS_CUT).min(2))],
        }
    }

    pub fn set_relation(&mut self, relation: Relation) {
        let Relation { in_map, is_near, is_jointed, is_cut } = relation;
        self.set(IN_MAP, in_map.into());
        self.set(IS_NEAR, is_near.into());
        self.set(IS_JOINTED, is_jointed.into());
        self.set(IS_CUT, is_cut as u16);
    }

    /// The part of the leaf's list that the light is in, or [`NO_PART`].
    pub fn part(self) -> u32 {
        self.get(PART).into()
    }

    pub fn set_part(&mut self, part: u32) {
        self.set(PART, part as u16);
    }

    /// Whether the leaf's light map is to hold the light.
    pub fn is_mapped(self) -> bool {
        matches!(self.part(), MAPPED_UNSHADOWED | MAPPED_SHADOWED)
    }

    /// Whether the light's shadow map is looked up.
    pub fn is_looked_up(self) -> bool {
        matches!(self.part(), NEAR_SHADOWED | JOINTED | SHADOWED | MAPPED_SHADOWED)
    }

    /// Whether the leaf's light map holds the light.
    pub fn is_held(self) -> bool {
        self.get(IS_HELD) != 0
    }

    /// The leaf's light map is as it is to be.
    pub fn hold(&mut self) {
        self.set(IS_HELD, self.is_mapped().into());
    }
}

/// Of all leaves and lights, leaf by leaf.
pub(crate) struct Pairs {
    /// How many lights there are.
    pub lights: usize,
    all: Vec<Pair>,
}

impl Pairs {
    /// Of no leaves.
    pub fn new(lights: usize) -> Self {
        Self { lights, all: Vec::new() }
    }

    pub fn all(&self) -> &[Pair] {
        &self.all
    }

    /// Those of a leaf.
    pub fn row(&self, leaf: usize) -> &[Pair] {
        &self.all[leaf * self.lights..(leaf + 1) * self.lights]
    }

    pub fn row_mut(&mut self, leaf: usize) -> &mut [Pair] {
        &mut self.all[leaf * self.lights..(leaf + 1) * self.lights]
    }

    /// Those of a leaf, by batches of lights.
    pub fn batches(&self, leaf: usize) -> impl Iterator<Item = &[Pair]> {
        self.row(leaf).chunks(BATCH as usize)
    }

    /// Makes room for so many leaves, and forgets others.
    pub fn resize(&mut self, leaves: usize) {
        self.all.resize(leaves * self.lights, Pair::default());
    }
}

/// Takes the states of a leaf's pairs, and those whatever dynamic objects do.
pub(crate) fn set_states(pairs: &mut [Pair], states: &[State], standing: &[State]) {
    let with_states = pairs.iter_mut().zip(states).zip(standing);
    with_states.for_each(|((pair, state), standing)| pair.set_states(*state, *standing));
}

/// Whether the states of a leaf's pairs are these, and those whatever dynamic objects do.
pub(crate) fn have_states(pairs: &[Pair], states: &[State], standing: &[State]) -> [bool; 2] {
    let with_states = pairs.iter().zip(states).zip(standing);
    // Without an early end many are compared at once.
    let differ = with_states.fold(0, |differ, ((pair, state), standing)| {
        let word = (*state as u16) << STATE.first | (*standing as u16) << STANDING.first;
        differ | pair.0 ^ word
    });
    [STATE, STANDING].map(|bits| differ & bits.mask() == 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_set_is_what_is_read_and_nothing_else_changes() {
        let states = [State::Unoccluded, State::Partial, State::Full];
        let cuts = [IsCut::No, IsCut::Somewhere, IsCut::Everywhere];
        let mut pair = Pair::default();
        assert_eq!((pair.part(), pair.relation(), pair.is_held()), (NO_PART, Relation::default(), false));
        for case in 0..3000_usize {
            let bit = |bit: usize| case.wrapping_mul(0x9e37_79b9) >> (8 + bit) & 1 != 0;
            let (state, standing) = (states[case % 3], states[case / 3 % 3]);
            let is_cut = cuts[case / 9 % 3];
            let relation = Relation { in_map: bit(0), is_near: bit(1), is_jointed: bit(2), is_cut };
            let part = case as u32 % 8;
            pair.set_states(state, standing);
            pair.set_relation(relation);
            pair.set_part(part);
            pair.hold();
            assert_eq!((pair.state(), pair.standing()), (state, standing));
            assert_eq!((pair.relation(), pair.part()), (relation, part));
            assert_eq!(pair.is_held(), part == MAPPED_UNSHADOWED || part == MAPPED_SHADOWED);
            assert_eq!(have_states(&[pair; 3], &[state; 3], &[standing; 3]), [true; 2]);
            let other = states[(case + 1) % 3];
            assert_eq!(have_states(&[pair; 2], &[state, other], &[standing; 2]), [false, true]);
            let other = states[(case / 3 + 1) % 3];
            assert_eq!(have_states(&[pair; 2], &[state; 2], &[other, standing]), [true, false]);
        }
        assert_eq!(size_of::<Pair>(), 2);
    }
}
