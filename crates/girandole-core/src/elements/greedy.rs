//! The greedy merging of figure 4-10, with less work than scoring all pairs again and again.

use super::columns::{BLOCK, Columns, Counts};
use super::{Element, LightSets, WORD, count, ones};
use rustc_hash::FxHashMap;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// An element, later than all those it is compared with: no merge of it with an earlier one saves more than `bound`.
/// The heap's top has the greatest bound.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Row {
    bound: u32,
    later: Reverse<usize>,
    /// The earlier element with which it saves exactly `bound`, unless that one has been removed.
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
/// upper bound. Rows are in a heap by their bounds and are only scanned when they reach the top.
pub(super) struct Greedy {
    words: usize,
    /// The lights of each element, `words` each.
    bits: Vec<u64>,
    /// How many lights each element has; 0 if it is removed.
    sizes: Vec<u32>,
    /// The root of each element's objects in `joined`.
    objects: Vec<usize>,
    /// What is at a node: an object's own number, or the nodes of two disjoint sets of objects.
    joined: Vec<(usize, usize)>,
    per_pass: u32,
    rows: BinaryHeap<Row>,
    /// Elements that are searched for pairs, in ascending order, including some that are removed.
    listed: Vec<usize>,
    /// The number of removed elements in `listed`.
    unlisted: usize,
    /// The lights of the elements in `listed`.
    columns: Columns,
    /// Objects to be merged for having the same lights, in reversed order.
    twins: Vec<Twins>,
}

impl Greedy {
    pub(super) fn new(sets: &LightSets, lights_per_pass: u32) -> Self {
        let words = sets.words_per_object.max(1);
        let sizes: Vec<u32> = sets.sets().map(count).collect();
        let most = sizes.iter().copied().max().unwrap_or(0);
        // All lights in one pass is the best there is.
        let per_pass = lights_per_pass.clamp(1, most.max(1));
        let mut greedy = Self {
            words,
            bits: sets.bits.clone(),
            objects: (0..sizes.len()).collect(),
            joined: (0..sizes.len()).map(|object| (object, object)).collect(),
            per_pass,
            rows: BinaryHeap::new(),
            listed: Vec::new(),
            unlisted: 0,
            columns: Columns::new(words * WORD, per_pass),
            twins: Vec::new(),
            sizes,
        };
        // Objects with the same lights are found here, and only the first of them is compared with others.
        let mut first_with: FxHashMap<&[u64], usize> = FxHashMap::default();
        for (object, set) in sets.sets().enumerate().filter(|(_, set)| set.iter().any(|&w| w != 0)) {
            let kept = *first_with.entry(set).or_insert(object);
            let saving = greedy.sizes[object].div_ceil(per_pass);
            if kept == object {
                greedy.list(object);
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
    pub(super) fn run(&mut self, observe: &mut impl FnMut(&Self, usize, usize, u32)) {
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
    ///
    /// With r = 1 … k lights in an element's last pass, taking m lights away from it saves ⌊(m − r) / k⌋ + 1 passes if
    /// m ≥ r, else none, and no more than ⌈m / k⌉. So a pair that saves more than `best` passes has at least
    /// r + k · `best` lights in common, for both of its elements.
    fn scan(&self, later: usize, bound: u32) -> Option<Row> {
        let lights = ones(self.set(later));
        let rest = self.last_pass(later);
        let mut best = 0;
        let mut partner = None;
        let mut counts = Counts::default();
        let end = self.listed.partition_point(|&other| other < later);
        'found: for (block, others) in self.listed[..end].chunks(BLOCK).enumerate() {
            self.columns.count(block, &lights, &mut counts);
            let mut from = 0;
            // Better pairs need more common lights, so candidates are searched again after each.
            'again: loop {
                let extra = best * self.per_pass;
                for at in self.columns.candidates(block, &counts, rest + extra, extra, from..others.len()) {
                    let saving = self.saving(later, others[at], counts.get(at));
                    if saving > best {
                        (best, partner) = (saving, Some(others[at]));
                        if best == bound {
                            break 'found;
                        }
                        from = at + 1;
                        continue 'again;
                    }
                }
                break;
            }
        }
        partner.map(|_| Row { bound: best, later: Reverse(later), partner })
    }

    /// How many lights an element's last pass has.
    fn last_pass(&self, element: usize) -> u32 {
        (self.sizes[element] - 1) % self.per_pass + 1
    }

    /// Passes that merging two elements with so many common lights saves; 0 if it costs.
    fn saving(&self, a: usize, b: usize, common: u32) -> u32 {
        let cost = |lights: u32| lights.div_ceil(self.per_pass);
        let (a, b) = (self.sizes[a], self.sizes[b]);
        (cost(a) + cost(b)).saturating_sub(cost(a - common) + cost(b - common) + cost(common))
    }

    /// Merges two elements and lists the new ones.
    fn merge(&mut self, a: usize, b: usize) {
        let pairs = || self.set(a).iter().zip(self.set(b));
        let common: Vec<u64> = pairs().map(|(a, b)| a & b).collect();
        let only_a: Vec<u64> = pairs().map(|(a, b)| a & !b).collect();
        let only_b: Vec<u64> = pairs().map(|(a, b)| b & !a).collect();
        let (objects_a, objects_b) = (self.objects[a], self.objects[b]);
        let all = self.joined.len();
        self.joined.push((objects_a, objects_b));
        if only_a.iter().all(|&w| w == 0) {
            // All of its lights are common, so it keeps its index.
            self.objects[a] = all;
            self.remove(b);
        } else if only_b.iter().all(|&w| w == 0) {
            self.objects[b] = all;
            self.remove(a);
        } else {
            self.remove(a);
            self.remove(b);
            self.add(&common, all);
        }
        self.add(&only_a, objects_a);
        self.add(&only_b, objects_b);
        // Rebuild the list once half of it is removed.
        if self.listed.len() < 2 * self.unlisted {
            self.columns = self.columns.emptied();
            self.unlisted = 0;
            for element in std::mem::take(&mut self.listed) {
                if self.sizes[element] != 0 {
                    self.list(element);
                }
            }
        }
    }

    /// A new element, if it has lights.
    fn add(&mut self, set: &[u64], objects: usize) {
        let size = count(set);
        if size == 0 {
            return;
        }
        let element = self.sizes.len();
        self.bits.extend_from_slice(set);
        self.sizes.push(size);
        self.objects.push(objects);
        self.list(element);
        let bound = size.div_ceil(self.per_pass);
        self.rows.push(Row { bound, later: Reverse(element), partner: None });
    }

    /// From now on, later elements are compared with this one.
    fn list(&mut self, element: usize) {
        let lights = ones(self.set(element));
        self.columns.push(&lights, self.last_pass(element));
        self.listed.push(element);
    }

    fn remove(&mut self, element: usize) {
        self.sizes[element] = 0;
        if let Ok(at) = self.listed.binary_search(&element) {
            self.columns.remove(at);
            self.unlisted += 1;
        }
    }

    /// The number of indices of elements, removed ones included.
    #[cfg(test)]
    pub(super) fn places(&self) -> usize {
        self.sizes.len()
    }

    /// An element's lights; none if it is removed.
    #[cfg(test)]
    pub(super) fn lights(&self, element: usize) -> Option<&[u64]> {
        (self.sizes[element] != 0).then(|| self.set(element))
    }

    fn set(&self, element: usize) -> &[u64] {
        &self.bits[element * self.words..(element + 1) * self.words]
    }

    /// The elements there are, sorted.
    pub(super) fn elements(&self) -> Vec<Element> {
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
