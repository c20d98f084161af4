//! Fewer render passes: objects that share lights are grouped into [`Element`]s and shaded together (Barczak, section
//! 4.3.5, figure 4-10).
//!
//! A pass shades at most k lights, on however many objects. An element with the lights L therefore takes ⌈|L| / k⌉
//! passes. At first each object that has lights is an element. Merging two elements makes a new one, with the objects
//! of both and the lights that both have, and takes these lights away from both; elements left without lights are
//! removed. [`optimise`] does the merge that saves the most passes, again and again, until none saves any.
//!
//! Which merge is next, exactly: the one that saves the most; among equals, first two objects that had the same lights
//! from the start, then the pair whose later element is the earliest, then the one whose earlier element is. An
//! element's place is that of its object, and new elements come after all others, except that an element all of whose
//! lights the other one has too takes over the other's objects and keeps its place. Hence the result depends on nothing
//! but the input. The first rule is free: no merge with one of two such objects saves more than merging these two.
//!
//! Worked example, k = 4: a floor lit by lights 0–7 and two pillars lit by 0–3 and 4–7 take 2 + 1 + 1 passes. The floor
//! and the first pillar merge and share lights 0–3, which leaves 4–7 to the floor; it merges with the second pillar.
//! Two passes are left.
//!
//! ```
//! use girandole_core::elements::{LightSets, optimise, passes, unmerged};
//! let floor = (0..8).map(|light| (0, light));
//! let pillars = (0..8).map(|light| (1 + light / 4, light));
//! let sets: LightSets = floor.chain(pillars).collect();
//! assert_eq!(passes(&unmerged(&sets), 4), 4);
//! let elements = optimise(&sets, 4);
//! assert_eq!(passes(&elements, 4), 2);
//! assert_eq!((&elements[0].objects[..], &elements[0].lights[..]), (&[0, 1][..], &[0, 1, 2, 3][..]));
//! ```

mod columns;
mod greedy;
#[cfg(test)]
mod tests;

use greedy::Greedy;

/// Bits in a word of a set.
const WORD: usize = u64::BITS as usize;

/// Objects that are shaded together, and the lights they are shaded with.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Element {
    /// Which objects, in ascending order.
    pub objects: Vec<u32>,
    /// Which lights, in ascending order.
    pub lights: Vec<u32>,
}

/// Which lights each object needs, a bit for each pair. Objects and lights are numbered from 0; it grows as needed, by
/// objects times lights, so the numbers should have few gaps.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LightSets {
    words_per_object: usize,
    bits: Vec<u64>,
}

impl LightSets {
    /// No pairs yet, with capacity for so many objects and lights.
    pub fn new(objects: usize, lights: usize) -> Self {
        let words_per_object = lights.div_ceil(WORD).max(1);
        Self { words_per_object, bits: vec![0; objects * words_per_object] }
    }

    /// Adds the pair of an object and a light that it needs.
    pub fn insert(&mut self, object: u32, light: u32) {
        let (object, light) = (object as usize, light as usize);
        let words = light / WORD + 1;
        if words > self.words_per_object {
            let mut wider = Self::new(self.objects(), words.next_power_of_two() * WORD);
            for (to, from) in wider.bits.chunks_mut(wider.words_per_object).zip(self.sets()) {
                to[..from.len()].copy_from_slice(from);
            }
            *self = wider;
        }
        if object >= self.objects() {
            self.bits.resize((object + 1) * self.words_per_object, 0);
        }
        self.bits[object * self.words_per_object + light / WORD] |= 1 << (light % WORD);
    }

    /// Removes all pairs and keeps the capacity.
    pub fn clear(&mut self) {
        self.bits.fill(0);
    }

    /// The number of objects that there is capacity for.
    pub fn objects(&self) -> usize {
        self.sets().len()
    }

    /// The lights of each object.
    fn sets(&self) -> std::slice::ChunksExact<'_, u64> {
        self.bits.chunks_exact(self.words_per_object.max(1))
    }
}

impl FromIterator<(u32, u32)> for LightSets {
    /// From pairs of an object and a light, in any order.
    fn from_iter<T: IntoIterator<Item = (u32, u32)>>(pairs: T) -> Self {
        let mut sets = Self::default();
        for (object, light) in pairs {
            sets.insert(object, light);
        }
        sets
    }
}

/// How many passes the elements take, when a pass shades `lights_per_pass` lights (0 counts as 1).
pub fn passes(elements: &[Element], lights_per_pass: u32) -> u32 {
    elements.iter().map(|e| (e.lights.len() as u32).div_ceil(lights_per_pass.max(1))).sum()
}

/// An element for each object that has lights: what [`optimise`] starts from.
pub fn unmerged(sets: &LightSets) -> Vec<Element> {
    let element = |(object, set)| Element { objects: vec![object], lights: ones(set) };
    (0..).zip(sets.sets()).map(element).filter(|e| !e.lights.is_empty()).collect()
}

/// Groups objects into elements so that they take fewer passes of `lights_per_pass` lights (more means fewer passes; 0
/// counts as 1). Each pair of an object and a light is in exactly one of the elements, which are sorted. Figure 4-10.
pub fn optimise(sets: &LightSets, lights_per_pass: u32) -> Vec<Element> {
    let mut greedy = Greedy::new(sets, lights_per_pass);
    greedy.run(&mut |_, _, _, _| {});
    greedy.elements()
}

/// How many bits are set.
fn count(set: &[u64]) -> u32 {
    set.iter().map(|word| word.count_ones()).sum()
}

/// The numbers of the bits that are set.
fn ones(set: &[u64]) -> Vec<u32> {
    let mut list = Vec::with_capacity(count(set) as usize);
    for (word, first) in set.iter().zip((0..).step_by(WORD)) {
        let mut rest = *word;
        while rest != 0 {
            list.push(first + rest.trailing_zeros());
            rest &= rest - 1;
        }
    }
    list
}
