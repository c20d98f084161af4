//! Which shadow maps show what was there before, and which of them are drawn next (Barczak §4.5.3).
//!
//! A map is stale where what it shows has moved since: in the rectangle of texels that the mover covers, before and after. Each
//! frame draws as many stale maps as its budget says, by priority: the brightest channel of the light times the frames that the
//! map has been stale (and the extent of what is stale), so that bright ones come first and none starves. Maps that show nothing of use (those of lights
//! that moved themselves, and before the first frame) are drawn in any case, lest light leak.

use super::footprint::TexelRect;
use crate::layout::Light;
use crate::settings::{MapPriority, MapUpdates};

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

    /// A light moved: its map, of this size, shows nothing of use.
    pub fn invalidate(&mut self, light: usize, size: u32) {
        self.maps[light] = MapState { stale: TexelRect::whole(size), frames: 0, is_valid: false };
    }

    /// What the next frame draws, in the order of lights.
    pub fn choose(&self, updates: &MapUpdates, lights: &[Light]) -> Vec<MapUpdate> {
        let stale = (0..self.maps.len()).filter(|&light| !self.maps[light].stale.is_empty());
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
            self.maps[update.light as usize] =
                MapState { stale: TexelRect::default(), frames: 0, is_valid: true };
        }
    }

    /// Counts a frame for those that remain stale.
    pub fn advance(&mut self) {
        for map in self.maps.iter_mut().filter(|map| !map.stale.is_empty()) {
            map.frames += 1;
        }
    }

    /// What is stale now.
    pub fn counts(&self) -> StaleCounts {
        let stale = self.maps.iter().filter(|map| !map.stale.is_empty());
        stale.fold(StaleCounts::default(), |counts, map| StaleCounts {
            maps: counts.maps + 1,
            oldest: counts.oldest.max(map.frames),
        })
    }
}
