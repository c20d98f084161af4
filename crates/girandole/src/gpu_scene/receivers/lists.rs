//! Lists of lights by leaf and batch, and where they lie: records of all leaves, where each list begins, the lists of static
//! leaves, and those of leaves on dynamic objects.

use super::Receivers;
use crate::Result;
use crate::device::mirror::Mirror;
use crate::gpu_scene::pairs::Pair;
use crate::records::{LeafRange, LeafRecord};
use crate::shader_constants::{BATCH, NO_PART, SIDE};
use girandole_core::visibility::State;

/// Room that the lists of leaves on dynamic objects have, where they do not need more: 16 MiB.
const MOVING_ENTRIES: usize = 8 << 20;
/// Entries of a word: indices of lights in their batch.
const PER_WORD: usize = 2;
const _: () = assert!(BATCH <= 1 << 16, "an entry has 16 bits");
/// Lights more than now that the list of a static leaf and batch has room for; and a share of those that it has.
const SPARE_ENTRIES: usize = 8;
const SPARE_SHARE: usize = 8;

impl Receivers {
    /// Makes room for the lists as they are, and writes them.
    ///
    /// # Errors
    /// [`crate::Error::TooLarge`] beyond the device's limits.
    pub(super) fn lay_out(&mut self, device: &wgpu::Device) -> Result<()> {
        let (still, room) = (self.still as usize, self.offsets.leaves as usize);
        let ranges = room * self.offsets.batches as usize * LeafRange::WORDS;
        let mut at = (self.offsets.ranges_at as usize + ranges) * PER_WORD;
        self.lists.at.clear();
        for leaf in 0..still {
            for pairs in self.pairs.batches(leaf) {
                self.lists.at.push(at as u32);
                at += room_for(pairs);
            }
        }
        self.lists.moving_at = at as u32;
        let pairs = (room - still) * self.pairs.lights;
        let end = at + self.moving_entries().max(pairs.min(MOVING_ENTRIES));
        self.light_lists = Mirror::new(device, "lists of lights", Vec::new(), end.div_ceil(PER_WORD))?;
        let mut light_map = 0;
        for leaf in 0..still {
            self.write_record(leaf, light_map);
            light_map += u32::from(self.leaves[leaf].place.has_map);
            self.list(leaf);
        }
        self.list_moving();
        Ok(())
    }

    /// Writes records and lists of leaves on dynamic objects.
    pub(super) fn list_moving(&mut self) {
        let (still, count) = (self.still as usize, self.leaves.len());
        self.lists.at.truncate(still * self.offsets.batches as usize);
        self.lists.parts[still..].fill([0; NO_PART as usize]);
        self.lists.skipped[still..].fill(0);
        let (mut at, static_maps) = (self.lists.moving_at, self.static_maps());
        for leaf in still..count {
            for pairs in self.pairs.batches(leaf) {
                self.lists.at.push(at);
                at += whole_words(entries(pairs)) as u32;
            }
            self.write_record(leaf, static_maps + (leaf - still) as u32);
            self.list(leaf);
        }
    }

    /// Whether there is room for the lists of leaves on dynamic objects.
    pub(super) fn moving_lists_fit(&self) -> bool {
        self.lists.moving_at as usize + self.moving_entries() <= self.light_lists.room() * PER_WORD
    }

    fn moving_entries(&self) -> usize {
        let rows = self.still as usize..self.leaves.len();
        let lists = rows.flat_map(|leaf| self.pairs.batches(leaf));
        lists.map(|pairs| whole_words(entries(pairs))).sum()
    }

    /// Whether there is room for the lists of a static leaf.
    pub(super) fn lists_fit(&self, leaf: usize) -> bool {
        let batches = self.offsets.batches as usize;
        let mut lists = self.pairs.batches(leaf).zip(leaf * batches..);
        lists.all(|(pairs, list)| {
            let end = self.lists.at.get(list + 1).filter(|_| list + 1 < self.still as usize * batches);
            self.lists.at[list] as usize + entries(pairs) <= *end.unwrap_or(&self.lists.moving_at) as usize
        })
    }

    fn write_record(&mut self, leaf: usize, light_map: u32) {
        let record = self.leaves[leaf].place.record(light_map * SIDE * SIDE);
        self.light_lists.set(leaf * LeafRecord::WORDS, bytemuck::cast_slice(&[record]));
    }

    /// Writes the lists of a leaf.
    pub(super) fn list(&mut self, leaf: usize) {
        let batches = self.offsets.batches as usize;
        let mut counts = [0; NO_PART as usize + 1];
        for (batch, pairs) in self.pairs.batches(leaf).enumerate() {
            let at = self.lists.at[leaf * batches + batch];
            // The parts' first entries, in order, and the end.
            let mut bounds = [at; NO_PART as usize + 1];
            let mut entries = Vec::with_capacity(pairs.len());
            for part in 0..NO_PART as usize {
                let members = (0..).zip(pairs).filter(|(_, pair)| pair.part() == part as u32);
                entries.extend(members.map(|(light, _)| light));
                bounds[part + 1] = at + entries.len() as u32;
                counts[part] += bounds[part + 1] - bounds[part];
            }
            let range = self.offsets.ranges_at as usize + (leaf * batches + batch) * LeafRange::WORDS;
            self.light_lists.set(range, &bounds);
            let words = entries.chunks(PER_WORD).map(|pair| pair[0] | pair.get(1).unwrap_or(&0) << 16);
            self.light_lists.set(at as usize / PER_WORD, &words.collect::<Vec<u32>>());
        }
        self.lists.parts[leaf].copy_from_slice(&counts[..NO_PART as usize]);
        self.lists.skipped[leaf] = self.light_count() - counts.iter().sum::<u32>();
    }

    /// Sorts leaves.
    pub(super) fn sort(&mut self) {
        // Leaves with lists of equal length lie side by side: neighbours finish together.
        let mut order: Vec<u32> = (0..self.leaf_count()).collect();
        order.sort_by_cached_key(|&leaf| {
            self.pairs.row(leaf as usize).iter().filter(|pair| pair.state() == State::Partial).count()
        });
        self.order.leaves.clone_from(&order);
        order.extend(self.leaf_count()..self.offsets.leaves);
        self.order.words.set(0, &order);
    }
}

/// Room for the list of a static leaf and batch, whatever dynamic objects do: for what static ones leave of the lights, and for those
/// that it holds though their places lie behind the leaf.
fn room_for(pairs: &[Pair]) -> usize {
    let is_left = |pair: &&Pair| pair.standing() != State::Full || pair.part() != NO_PART;
    let entries = pairs.iter().filter(is_left).count();
    whole_words(pairs.len().min(entries + entries / SPARE_SHARE + SPARE_ENTRIES))
}

/// Room for so many entries: lists begin at words.
fn whole_words(entries: usize) -> usize {
    entries.next_multiple_of(PER_WORD)
}

/// How many lights are in a list.
fn entries(pairs: &[Pair]) -> usize {
    pairs.iter().filter(|pair| pair.part() != NO_PART).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader_constants::{NEAR_SHADOWED, UNSHADOWED};

    #[test]
    fn lists_have_room_for_lights_whose_places_lie_behind_the_leaf() {
        let pairs = |part: u32, parts: u32| -> Vec<Pair> {
            let pair = |i| {
                let mut pair = Pair::default();
                pair.set_states(State::Full, if i < 30 { State::Partial } else { State::Full });
                pair.set_part(if i < parts { part } else { NO_PART });
                pair
            };
            (0..100).map(pair).collect()
        };
        let all = pairs(NEAR_SHADOWED, 80);
        assert!(room_for(&all) >= entries(&all));
        // Dynamic objects may take lights from a list, and give them back.
        assert!(room_for(&pairs(UNSHADOWED, 10)) >= 30 + SPARE_ENTRIES);
    }
}
