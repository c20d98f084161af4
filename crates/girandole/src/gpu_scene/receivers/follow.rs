//! Receivers after dynamic objects and lights changed: lights that stay, and leaves that none of this concerns, cost nothing.

use super::leaf::{LeafLight, LightsThenNow};
use super::{Receivers, Sources, receiver_words};
use crate::Result;
use crate::gpu_scene::geometry::gpu_lights;
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
            && sources.lights.len() == self.samples.len()
            && (0..still).all(|leaf| self.places[leaf].stays(geometry, database, leaf));
        let has_room = count <= self.room as usize && receiver_words.len() <= self.receivers.room();
        if !(is_same && has_room) {
            return Ok(false);
        }
        self.database = Some(database.clone());
        self.receivers.set(0, &receiver_words);
        self.gpu_lights = gpu_lights(sources.lights, geometry.radius());
        let before = std::mem::replace(&mut self.samples, sources.lights.samples().to_vec());
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
        let held = count.min(self.leaves as usize);
        self.resize(count);
        for leaf in still..count {
            if leaf < held && self.places[leaf].stays(geometry, database, leaf) {
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
        self.order();
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
        let row = self.row(leaf);
        let states_stay = self.states[row.clone()] == *states;
        let standing_stay = self.standing[row.clone()] == *standing;
        if changed.is_empty() && states_stay && standing_stay {
            return false;
        }
        let all = 0..self.samples.len();
        // Lights that moved may change how others are tested.
        let mut with_states = Vec::new();
        let concerned = if standing_stay {
            changed
        } else {
            let then = &self.standing[row.clone()];
            let is_full = |state: State| state == State::Full;
            let differs = |light: &usize| {
                is_full(then[*light]) != is_full(standing[*light]) || before[*light] != self.samples[*light]
            };
            with_states.extend(all.clone().filter(differs));
            &with_states
        };
        let (place, light) = (&self.places[leaf], &mut self.leaf_lights[leaf]);
        let relations = &mut self.relations[row.clone()];
        let mut others_differ = false;
        if concerned.len() * 2 > self.samples.len() {
            *light = LeafLight::new(place, &self.samples, standing, relations);
            others_differ = true;
        } else if !concerned.is_empty() {
            let lights = LightsThenNow { then: before, now: &self.samples };
            let states = [&self.standing[row.clone()], standing];
            others_differ = light.follow(place, lights, states, concerned, relations);
        }
        let units = if place.has_map { light.units() } else { 0.0 };
        if self.units[leaf] != units {
            self.units[leaf] = units;
            self.light_maps.mark(leaf, true);
        }
        self.states[row.clone()].copy_from_slice(states);
        self.standing[row].copy_from_slice(standing);
        if others_differ || !states_stay {
            return self.choose_parts(leaf, all);
        }
        self.choose_parts(leaf, concerned.iter().copied())
    }
}
