//! Which shadow maps show what was there before, and which of them are drawn next (Barczak §4.5.3).
//!
//! A map is stale where what it shows has moved since: in the rectangle of texels that the mover covers, before and after. Each
//! frame draws as many stale maps as its budget says, by priority: the brightest channel of the light times the frames that the
//! map has been stale (and the extent of what is stale), so that bright ones come first and none starves. Maps that show nothing of use (those of lights
//! that moved themselves, and before the first frame) are drawn in any case, lest light leak.

use super::map_view::TexelRect;
use crate::layout::Light;
use crate::settings::{MapPriority, MapUpdates};
use girandole_core::glam::Vec3;

/// How each light's shadow map stands.
#[derive(Clone, Debug, Default)]
pub(crate) struct MapStates {
    maps: Vec<MapState>,
}

#[derive(Clone, Copy, Debug)]
struct MapState {
    /// What has to be drawn for it to be up to date.
    stale: TexelRect,
    /// Frames that were shaded with it so.
    frames: u32,
    /// Whether it shows the scene from where its light is, at some moment.
    is_valid: bool,
}

/// A part of a light's map to be drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct MapUpdate {
    pub light: u32,
    pub part: TexelRect,
}

/// What a frame leaves stale.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StaleCounts {
    /// Maps.
    pub maps: u32,
    /// Frames that the oldest of them has been stale.
    pub oldest: u32,
}

impl MapStates {
    /// Maps of these sizes, none drawn yet.
    pub fn new(sizes: impl Iterator<Item = u32>) -> Self {
        let undrawn = |size| MapState { stale: TexelRect::whole(size), frames: 0, is_valid: false };
        Self { maps: sizes.map(undrawn).collect() }
    }

    /// Something moved in a part of a light's map.
    pub fn mark(&mut self, light: usize, part: TexelRect) {
        let map = &mut self.maps[light];
        map.stale = map.stale.union(&part);
    }

    /// The part of a light's map that has to be drawn.
    pub fn stale(&self, light: usize) -> TexelRect {
        self.maps[light].stale
    }

    /// A light moved: its map, of this size, shows nothing of use.
    pub fn invalidate(&mut self, light: usize, size: u32) {
        self.maps[light] = MapState { stale: TexelRect::whole(size), frames: 0, is_valid: false };
    }

    /// What the next frame draws, in the order of lights. Maps of lights that are dark are left until those shine.
    pub fn choose(&self, updates: &MapUpdates, lights: &[Light]) -> Vec<MapUpdate> {
        let stale = (0..self.maps.len()).filter(|&light| self.is_stale(light, lights));
        let must = |&light: &usize| {
            let MapState { is_valid, frames, .. } = self.maps[light];
            !is_valid || updates.oldest.is_some_and(|oldest| frames >= oldest)
        };
        let (mut chosen, mut others): (Vec<usize>, Vec<usize>) = stale.partition(must);
        let room = updates.most.map_or(usize::MAX, |most| (most as usize).saturating_sub(chosen.len()));
        let extent = |part: TexelRect| match updates.priority {
            MapPriority::Brightness => 1.0,
            MapPriority::BrightnessAndExtent => part.texels().sqrt(),
        };
        let priority = |light: usize| {
            let MapState { stale, frames, .. } = self.maps[light];
            lights[light].intensity.max_element() * (frames as f32 + 1.0) * extent(stale)
        };
        others.sort_by(|&a, &b| priority(b).total_cmp(&priority(a)).then(a.cmp(&b)));
        chosen.extend(others.into_iter().take(room));
        chosen.sort_unstable();
        chosen.iter().map(|&light| MapUpdate { light: light as u32, part: self.maps[light].stale }).collect()
    }

    /// Takes note that these were drawn.
    pub fn note(&mut self, drawn: &[MapUpdate]) {
        for update in drawn {
            let map = &mut self.maps[update.light as usize];
            let stale = TexelRect::default();
            *map = MapState { stale, frames: 0, is_valid: true };
        }
    }

    /// Counts a frame for those that remain stale.
    pub fn advance(&mut self) {
        for map in self.maps.iter_mut().filter(|map| !map.stale.is_empty()) {
            map.frames += 1;
        }
    }

    /// Whether a map shows what is no longer there, and it matters.
    fn is_stale(&self, light: usize, lights: &[Light]) -> bool {
        !self.maps[light].stale.is_empty() && lights[light].intensity != Vec3::ZERO
    }

    /// What of each light's map is stale, and matters.
    pub fn stale_parts<'a>(&'a self, lights: &'a [Light]) -> impl Iterator<Item = TexelRect> + 'a {
        let part = |light: usize| {
            if self.is_stale(light, lights) { self.maps[light].stale } else { TexelRect::default() }
        };
        (0..self.maps.len()).map(part)
    }

    /// What is stale now.
    pub fn counts(&self, lights: &[Light]) -> StaleCounts {
        let stale = (0..self.maps.len()).filter(|&light| self.is_stale(light, lights));
        stale.map(|light| self.maps[light]).fold(StaleCounts::default(), |counts, map| StaleCounts {
            maps: counts.maps + 1,
            oldest: counts.oldest.max(map.frames),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: u32 = 64;

    /// Lights of these intensities, with maps that are up to date.
    fn drawn(intensities: &[f32]) -> (MapStates, Vec<Light>) {
        let light = |&i: &f32| Light { intensity: Vec3::new(0.0, i, i / 2.0), ..Light::default() };
        let mut states = MapStates::new(intensities.iter().map(|_| SIZE));
        let lights: Vec<Light> = intensities.iter().map(light).collect();
        let all = states.choose(&MapUpdates { most: Some(0), ..MapUpdates::default() }, &lights);
        let lit = intensities.iter().filter(|i| **i > 0.0).count();
        assert_eq!(all.len(), lit, "what was never drawn is drawn whatever the budget is");
        states.note(&all);
        (states, lights)
    }

    fn square(side: u32) -> TexelRect {
        TexelRect { first: [3; 2], end: [3 + side; 2] }
    }

    /// A frame: which lights it draws.
    fn frame(states: &mut MapStates, lights: &[Light], updates: &MapUpdates) -> Vec<u32> {
        let chosen = states.choose(updates, lights);
        states.note(&chosen);
        states.advance();
        chosen.iter().map(|update| update.light).collect()
    }

    fn few(most: u32, priority: MapPriority) -> MapUpdates {
        MapUpdates { most: Some(most), oldest: None, priority }
    }

    #[test]
    fn bright_lights_come_first_and_those_with_much_that_is_stale() {
        for (priority, first) in
            [(MapPriority::Brightness, [1, 3]), (MapPriority::BrightnessAndExtent, [0, 3])]
        {
            let (mut states, lights) = drawn(&[2.0, 3.0, 1.0, 4.0, 9.0]);
            for (light, side) in [20, 5, 4, 18].into_iter().enumerate() {
                states.mark(light, square(side));
            }
            // The brightest one is up to date.
            assert_eq!(frame(&mut states, &lights, &few(2, priority)), first, "{priority:?}");
            assert_eq!(states.counts(&lights), StaleCounts { maps: 2, oldest: 1 });
        }
    }

    #[test]
    fn none_starves_and_each_gets_its_turn_by_its_brightness() {
        let (mut states, lights) = drawn(&[8.0, 4.0, 1.0, 0.5]);
        let mut turns = [0; 4];
        for _ in 0..300 {
            (0..4).for_each(|light| states.mark(light, square(7)));
            let chosen = frame(&mut states, &lights, &few(1, MapPriority::default()));
            assert_eq!(chosen.len(), 1, "the budget is kept and used");
            turns[chosen[0] as usize] += 1;
        }
        assert!(turns.is_sorted_by(|a, b| a > b) && turns[3] > 5, "{turns:?}");
    }

    #[test]
    fn maps_of_dark_lights_wait_until_those_shine() {
        let (mut states, mut lights) = drawn(&[2.0, 0.0]);
        states.mark(0, square(7));
        states.mark(1, square(7));
        assert_eq!(frame(&mut states, &lights, &MapUpdates::default()), [0]);
        assert_eq!(states.counts(&lights), StaleCounts::default());
        lights[1].intensity = Vec3::ONE;
        assert_eq!(states.counts(&lights).maps, 1);
        assert_eq!(frame(&mut states, &lights, &MapUpdates::default()), [1]);
    }

    #[test]
    fn no_map_is_older_than_allowed() {
        let (mut states, lights) = drawn(&[8.0, 4.0, 1.0, 0.5]);
        for oldest in [0, 1, 5] {
            for _ in 0..30 {
                (0..4).for_each(|light| states.mark(light, square(7)));
                let updates = MapUpdates { most: Some(0), oldest: Some(oldest), ..MapUpdates::default() };
                frame(&mut states, &lights, &updates);
                assert!(states.counts(&lights).oldest <= oldest, "{:?}", states.counts(&lights));
            }
        }
        // The control: without a bound they grow old.
        states.mark(2, square(7));
        (0..9).for_each(|_| drop(frame(&mut states, &lights, &few(0, MapPriority::default()))));
        assert!(states.counts(&lights).oldest >= 9);
    }

    #[test]
    fn what_is_drawn_covers_all_that_became_stale_and_lights_that_moved_are_drawn_as_a_whole() {
        let (mut states, lights) = drawn(&[1.0, 1.0]);
        states.mark(0, square(4));
        states.mark(0, TexelRect { first: [20, 1], end: [30, 2] });
        states.invalidate(1, SIZE);
        let chosen = states.choose(&few(1, MapPriority::default()), &lights);
        // The one that moved takes all of the budget.
        assert_eq!(chosen, [MapUpdate { light: 1, part: TexelRect::whole(SIZE) }]);
        states.note(&chosen);
        let part = TexelRect { first: [3, 1], end: [30, 7] };
        assert_eq!(states.choose(&MapUpdates::default(), &lights), [MapUpdate { light: 0, part }]);
    }
}
