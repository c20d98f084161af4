//! Receivers after dynamic objects and lights changed: lights that stay, and leaves that none of this concerns, cost nothing.

use super::leaf::{LeafLight, LightsThenNow};
use super::{LeafReceiver, Receivers, Sources, receiver_words};
use crate::Result;
use crate::gpu_scene::geometry::gpu_lights;
use crate::gpu_scene::pairs::{have_states, set_states};
use girandole_core::lights::{LightChanges, LightSample};
use girandole_core::visibility::State;

impl Receivers {
    /// Takes what visibility determination says after dynamic objects moved, and lights moved or shine otherwise, and nothing
    /// else. `false` where static receivers are others or there is no room for those that move: then all is to be made anew.
    ///
    /// # Errors
    /// [`crate::Error::TooLarge`] beyond the device's limits.
    pub fn follow(
        &mut self,
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        sources: Sources,
        changes: &LightChanges,
    ) -> Result<bool> {
        let Sources { geometry, database, .. } = sources;
        let (count, still) = (database.receivers().leaves.len(), self.still as usize);
        let receiver_words = receiver_words(&sources);
        let is_same = database.first_dynamic_leaf() as usize == still
            && sources.lights.len() == self.pairs.lights
            && (0..still).all(|leaf| self.leaves[leaf].place.stays(geometry, database, leaf));
        let has_room = count <= self.offsets.leaves as usize && receiver_words.len() <= self.receivers.room();
        if !(is_same && has_room) {
            return Ok(false);
        }
        self.database = Some(database.clone());
        self.receivers.set(0, &receiver_words);
        self.lights.on_gpu = gpu_lights(sources.lights, geometry.radius());
        let before = std::mem::replace(&mut self.lights.samples, sources.lights.samples().to_vec());
        let changed = changes.changed();
        self.light_maps.mark_lights(&changed);

        let mut all_fit = true;
        for leaf in 0..still {
            if self.follow_leaf(&sources, &before, &changed, leaf) {
                match self.lists_fit(leaf) {
                    true => self.list(leaf),
                    false => all_fit = false,
                }
            }
        }
        let held = count.min(self.leaves.len());
        self.resize(count);
        for leaf in still..count {
            if leaf < held && self.leaves[leaf].place.stays(geometry, database, leaf) {
                self.follow_leaf(&sources, &before, &changed, leaf);
            } else {
                self.place(&sources, leaf);
                self.light_maps.mark(leaf, true);
            }
        }
        if all_fit && self.moving_lists_fit() {
            self.list_moving();
        } else {
            self.lay_out(device)?;
        }
        self.sort();
        self.flush(queue);
        Ok(true)
    }

    /// Follows what changed for a leaf that stays. Whether its lists changed.
    fn follow_leaf(
        &mut self,
        sources: &Sources,
        before: &[LightSample],
        changed: &[usize],
        leaf: usize,
    ) -> bool {
        let (states, standing) =
            (sources.database.leaf_states(leaf as u32), sources.database.standing_states(leaf as u32));
        let Self { leaves, lights, pairs, units, light_maps, .. } = self;
        let (pairs, samples) = (pairs.row_mut(leaf), &lights.samples);
        let [states_stay, standing_stay] = have_states(pairs, states, standing);
        if changed.is_empty() && states_stay && standing_stay {
            return false;
        }
        let all = 0..samples.len();
        // Lights that moved may change how others are tested.
        let mut with_states = Vec::new();
        let concerned = if standing_stay {
            changed
        } else {
            let is_full = |state: State| state == State::Full;
            let differs = |light: &usize| {
                is_full(pairs[*light].standing()) != is_full(standing[*light])
                    || before[*light] != samples[*light]
            };
            with_states.extend(all.clone().filter(differs));
            &with_states
        };
        let LeafReceiver { place, light } = &mut leaves[leaf];
        let starts_anew = concerned.len() * 2 > samples.len();
        let mut others_differ = starts_anew;
        if !starts_anew && !concerned.is_empty() {
            let lights = LightsThenNow { then: before, now: samples };
            others_differ = light.follow(place, lights, standing, concerned, pairs);
        }
        if !(states_stay && standing_stay) {
            set_states(pairs, states, standing);
        }
        if starts_anew {
            *light = LeafLight::new(place, samples, pairs);
        }
        let wanted = if place.has_map { light.units() } else { 0.0 };
        if units[leaf] != wanted {
            units[leaf] = wanted;
            light_maps.mark(leaf, true);
        }
        if others_differ || !states_stay {
            return self.choose_parts(leaf, all);
        }
        self.choose_parts(leaf, concerned.iter().copied())
    }
}
