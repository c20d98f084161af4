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
//! but the input.
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

use rustc_hash::FxHashMap;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

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
    /// No pairs yet, but room for so many objects and lights.
    pub fn new(objects: usize, lights: usize) -> Self {
        let words_per_object = lights.div_ceil(WORD).max(1);
        Self { words_per_object, bits: vec![0; objects * words_per_object] }
    }

    /// Says that an object needs a light.
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

    /// Takes all pairs away and keeps the room.
    pub fn clear(&mut self) {
        self.bits.fill(0);
    }

    /// How many objects there is room for.
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

/// [`optimise`] for frame after frame: as long as nothing changes, it gives the last result again.
#[derive(Clone, Debug, Default)]
pub struct Optimiser {
    sets: LightSets,
    lights_per_pass: u32,
    elements: Vec<Element>,
}

impl Optimiser {
    /// The elements as [`optimise`] makes them, and whether they may differ from the last call's.
    pub fn update(&mut self, sets: &LightSets, lights_per_pass: u32) -> (&[Element], bool) {
        let changed = self.lights_per_pass != lights_per_pass || self.sets != *sets;
        if changed {
            self.elements = optimise(sets, lights_per_pass);
            self.lights_per_pass = lights_per_pass;
            self.sets.clone_from(sets);
        }
        (&self.elements, changed)
    }
}

/// The numbers of the bits that are set.
fn ones(set: &[u64]) -> Vec<u32> {
    let mut list = Vec::new();
    for (word, first) in set.iter().zip((0..).step_by(WORD)) {
        let mut rest = *word;
        while rest != 0 {
            list.push(first + rest.trailing_zeros());
            rest &= rest - 1;
        }
    }
    list
}

/// An element, later than all those it is compared with: no merge of it with an earlier one saves more than `bound`.
/// The greatest is looked at first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Row {
    bound: u32,
    later: Reverse<usize>,
    /// With which earlier element it saves just that, as long as that one is not removed.
    partner: Option<usize>,
}

/// Two objects with the same lights.
struct Twins {
    saving: u32,
    kept: usize,
    removed: usize,
}

/// The state of the greedy merging.
///
/// Each pair belongs to its later element's [`Row`]. As an element's lights never change (what is left of an element
/// after a merge is a new one, later than all), a row only ever loses pairs, so that what it was found to save stays an
/// upper bound. Rows wait in a heap by their bounds and are only scanned when they come to the top.
struct Greedy {
    words: usize,
    /// The lights of each element, `words` each.
    bits: Vec<u64>,
    /// How many lights each element has; 0 if it is removed.
    sizes: Vec<u32>,
    /// The root of each element's objects in `joined`.
    objects: Vec<usize>,
    /// What is at a node: an object's own number, or the nodes of two disjoint sets of objects.
    joined: Vec<(usize, usize)>,
    /// Passes for so many lights.
    cost: Vec<u32>,
    per_pass: u32,
    rows: BinaryHeap<Row>,
    /// Elements that pairs are looked for among, in ascending order, with some that are removed.
    listed: Vec<usize>,
    /// Objects to be merged for having the same lights, in reversed order.
    twins: Vec<Twins>,
}

impl Greedy {
    fn new(sets: &LightSets, lights_per_pass: u32) -> Self {
        let words = sets.words_per_object.max(1);
        let per_pass = lights_per_pass.max(1);
        let sizes: Vec<u32> = sets.sets().map(|set| set.iter().map(|w| w.count_ones()).sum()).collect();
        let most = sizes.iter().copied().max().unwrap_or(0);
        let mut greedy = Self {
            words,
            bits: sets.bits.clone(),
            objects: (0..sizes.len()).collect(),
            joined: (0..sizes.len()).map(|object| (object, object)).collect(),
            cost: (0..=most).map(|n| n.div_ceil(per_pass)).collect(),
            per_pass,
            rows: BinaryHeap::new(),
            listed: Vec::new(),
            twins: Vec::new(),
            sizes,
        };
        // Objects with the same lights are found here, and only the first of them is compared with others.
        let mut first_with: FxHashMap<&[u64], usize> = FxHashMap::default();
        for (object, set) in sets.sets().enumerate().filter(|(_, set)| set.iter().any(|&w| w != 0)) {
            let kept = *first_with.entry(set).or_insert(object);
            let saving = greedy.cost[greedy.sizes[object] as usize];
            if kept == object {
                greedy.listed.push(object);
                greedy.rows.push(Row { bound: saving, later: Reverse(object), partner: None });
            } else {
                greedy.twins.push(Twins { saving, kept, removed: object });
            }
        }
        greedy.twins.sort_by_key(|t| (t.saving, Reverse((t.removed, t.kept))));
        greedy
    }

    /// Merges until nothing saves passes. `observe` sees each merge before it is done: the two elements, the earlier
    /// one first, and the passes it saves.
    fn run(&mut self, observe: &mut impl FnMut(&Self, usize, usize, u32)) {
        while let Some(row) = self.rows.pop() {
            let later = row.later.0;
            if self.sizes[later] == 0 {
                continue;
            }
            match row.partner {
                Some(partner) if self.sizes[partner] != 0 => {
                    self.merge_twins(row.bound, observe);
                    observe(self, partner, later, row.bound);
                    self.merge(partner, later);
                    if self.sizes[later] != 0 {
                        self.rows.push(Row { partner: None, ..row });
                    }
                }
                _ => self.rows.extend(self.scan(later, row.bound)),
            }
        }
        self.merge_twins(0, observe);
    }

    /// Merges the objects with the same lights that save at least so much.
    ///
    /// As ⌈(a + m) / k⌉ ≤ ⌈a / k⌉ + ⌈m / k⌉, no pair saves more than its common lights cost, which two with the same
    /// lights do save: no pair with one of them is better, and merging them leaves all other pairs as they are.
    fn merge_twins(&mut self, saving: u32, observe: &mut impl FnMut(&Self, usize, usize, u32)) {
        while let Some(twins) = self.twins.pop_if(|t| t.saving >= saving) {
            observe(self, twins.kept, twins.removed, twins.saving);
            self.merge(twins.kept, twins.removed);
        }
    }

    /// The best of an element's pairs with earlier ones, given that none saves more than `bound`.
    fn scan(&self, later: usize, bound: u32) -> Option<Row> {
        let set = self.set(later);
        let size = self.sizes[later];
        let mut best = 0;
        let mut partner = None;
        // A pair saves no more than its common lights cost, so more than this many have to be common.
        let mut enough = 0;
        for &other in self.listed.iter().take_while(|&&other| other < later) {
            let other_size = self.sizes[other];
            if other_size <= enough {
                continue;
            }
            let common = set.iter().zip(self.set(other)).map(|(a, b)| (a & b).count_ones()).sum();
            if common <= enough {
                continue;
            }
            let saving = self.saving(size, other_size, common);
            if saving > best {
                (best, partner) = (saving, Some(other));
                enough = best * self.per_pass;
                if best == bound {
                    break;
                }
            }
        }
        partner.map(|_| Row { bound: best, later: Reverse(later), partner })
    }

    /// Passes that merging two elements saves, from how many lights each has and how many are common; 0 if it costs.
    fn saving(&self, a: u32, b: u32, common: u32) -> u32 {
        let cost = |n: u32| self.cost[n as usize];
        (cost(a) + cost(b)).saturating_sub(cost(a - common) + cost(b - common) + cost(common))
    }

    /// Merges two elements; what is new gets in line.
    fn merge(&mut self, a: usize, b: usize) {
        let pairs = || self.set(a).iter().zip(self.set(b));
        let common: Vec<u64> = pairs().map(|(a, b)| a & b).collect();
        let only_a: Vec<u64> = pairs().map(|(a, b)| a & !b).collect();
        let only_b: Vec<u64> = pairs().map(|(a, b)| b & !a).collect();
        let (objects_a, objects_b) = (self.objects[a], self.objects[b]);
        let all = self.joined.len();
        self.joined.push((objects_a, objects_b));
        if only_a.iter().all(|&w| w == 0) {
            // All of its lights are common, so it may keep its place.
            self.objects[a] = all;
            self.sizes[b] = 0;
        } else if only_b.iter().all(|&w| w == 0) {
            self.objects[b] = all;
            self.sizes[a] = 0;
        } else {
            self.sizes[a] = 0;
            self.sizes[b] = 0;
            self.add(&common, all);
        }
        self.add(&only_a, objects_a);
        self.add(&only_b, objects_b);
        // Half of the list may be removed ones.
        if self.listed.len() > 2 * self.rows.len() + 64 {
            self.listed.retain(|&e| self.sizes[e] != 0);
        }
    }

    /// A new element, if it has lights.
    fn add(&mut self, set: &[u64], objects: usize) {
        let size: u32 = set.iter().map(|w| w.count_ones()).sum();
        if size == 0 {
            return;
        }
        let element = self.sizes.len();
        self.bits.extend_from_slice(set);
        self.sizes.push(size);
        self.objects.push(objects);
        self.listed.push(element);
        let bound = self.cost[size as usize];
        self.rows.push(Row { bound, later: Reverse(element), partner: None });
    }

    fn set(&self, element: usize) -> &[u64] {
        &self.bits[element * self.words..(element + 1) * self.words]
    }

    /// The elements there are, sorted.
    fn elements(&self) -> Vec<Element> {
        let present = (0..self.sizes.len()).filter(|&e| self.sizes[e] != 0);
        let mut elements: Vec<_> = present.map(|e| self.element(e)).collect();
        elements.sort();
        elements
    }

    fn element(&self, element: usize) -> Element {
        let mut objects = Vec::new();
        let mut nodes = vec![self.objects[element]];
        while let Some(node) = nodes.pop() {
            let (left, right) = self.joined[node];
            if left == node {
                objects.push(node as u32);
            } else {
                nodes.extend([left, right]);
            }
        }
        objects.sort_unstable();
        Element { objects, lights: ones(self.set(element)) }
    }
}
