//! The cache of shadow maps: one record a light says where its map lies, what it shows, and what of that is stale (Barczak §4.5.3).
//!
//! Each frame says which maps it looks up, and how large it wants them: that depends on scene, lights and view alone. What it lacks is
//! drawn, as far as its budget allows, by priority: the brightest channel of the light times the frames that it has waited (and the
//! extent of what is to be drawn), so that bright ones come first and none starves. Maps lack something that are missing, of another
//! size than wanted, or stale: what they show has moved since, within the rectangle of texels that the mover covered before and after.
//! A light whose map is missing lights nothing that it might be hidden from. Lest lights go out in between, maps of those that moved
//! themselves are drawn in any case, and so are all that the first frame looks up.
//!
//! Views look a light's map up in several sizes, and parallel light's for several parts of the scene: what one view has no use for stays for
//! the others, as maps do that no frame looks up any longer, until others need their place: those that were looked up longest ago go first.

use super::layout::{AtlasLayout, MapSlot};
use super::map_view::{ShownSquare, TexelRect};
use super::snapshot::Snapshot;
use crate::layout::Light;
use crate::settings::{MapPriority, MapUpdates};
use crate::shader_constants::NO_MAP;
use girandole_core::glam::Vec3;
use std::cmp::Reverse;
use std::collections::BTreeSet;

/// The shadow maps of all lights.
#[derive(Debug)]
pub(crate) struct MapCache {
    /// Those that frames look up.
    maps: Vec<MapRecord>,
    /// For each light those that other frames looked up, of other sizes or of other parts of the scene: all have a place and show something.
    others: Vec<Vec<MapRecord>>,
    layout: AtlasLayout,
}

/// Which of the maps: of a light, the one that frames look up or one of the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct MapIndex {
    pub light: usize,
    other: Option<usize>,
}

/// One light's map.
#[derive(Clone, Debug, Default)]
struct MapRecord {
    /// Its place in the atlas, if it has one.
    slot: Option<MapSlot>,
    /// What of it has to be drawn for it to be up to date; [`EVERYWHERE`] where it does not show the scene from where its light is.
    stale: TexelRect,
    /// Whether the next frame that looks it up draws it, whatever the budget.
    is_due: bool,
    /// Frames that were shaded while it lacked something.
    waited: u32,
    /// Units across that the last frame wanted; 0 where that does not look it up.
    wanted: u32,
    /// Frames since one looked it up.
    idle: u32,
    shows: ShownSquare,
    /// Where dynamic objects were when it was drawn.
    transforms: Snapshot,
}

/// A part of a light's map to be drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct MapUpdate {
    pub light: u32,
    pub part: TexelRect,
}

/// What a frame leaves to be drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StaleCounts {
    /// Maps that it looks up.
    pub maps: u32,
    /// Frames that the oldest of them has waited.
    pub oldest: u32,
}

/// All texels, however many there are.
const EVERYWHERE: TexelRect = TexelRect { first: [0; 2], end: [u32::MAX; 2] };

fn is_lit(light: &Light) -> bool {
    light.intensity != Vec3::ZERO
}

impl MapIndex {
    /// The map of a light that frames look up.
    pub fn of_frames(light: usize) -> Self {
        Self { light, other: None }
    }
}

impl MapRecord {
    fn is_drawn(&self) -> bool {
        self.stale != EVERYWHERE
    }

    fn is_of(&self, shows: ShownSquare, span: u32) -> bool {
        self.shows == shows && self.slot.is_some_and(|slot| slot.span == span)
    }

    /// One for the same light, that is not drawn yet.
    fn anew(&self) -> Self {
        let Self { is_due, waited, wanted, shows, .. } = *self;
        Self { stale: EVERYWHERE, is_due, waited, wanted, shows, ..Self::default() }
    }

    fn lose_place(&mut self) {
        (self.slot, self.stale) = (None, EVERYWHERE);
    }
}

impl MapCache {
    /// For so many lights, none of whose maps was drawn yet.
    pub fn new(layout: &AtlasLayout, lights: usize) -> Self {
        let undrawn = MapRecord { stale: EVERYWHERE, is_due: true, ..MapRecord::default() };
        Self { maps: vec![undrawn; lights], others: vec![Vec::new(); lights], layout: layout.clone() }
    }

    pub fn layout(&self) -> &AtlasLayout {
        &self.layout
    }

    /// How many lights there are.
    pub fn len(&self) -> usize {
        self.maps.len()
    }

    /// For each light, the units across of a map that has so many texels across, if there is room for so many; 0 for none.
    pub fn spans(&self, texels: &[f32], lights: &[Light]) -> Vec<u32> {
        let up_to = |most: [u32; 2]| -> Vec<u32> {
            let pairs = texels.iter().zip(lights);
            pairs.map(|(&texels, light)| self.layout.span(texels, light.has_large_map(), most)).collect()
        };
        let spans = up_to(self.layout.largest);
        if self.layout.holds(&spans) { spans } else { up_to(self.layout.regular) }
    }

    /// The units across of regular maps of these lights.
    pub fn regular_spans(&self, lights: &[Light]) -> Vec<u32> {
        lights.iter().map(|light| self.layout.regular[usize::from(light.has_large_map())]).collect()
    }

    /// Takes note of what a frame looks up: for each light, units across that it wants, or 0.
    pub fn want(&mut self, spans: &[u32]) {
        self.others.iter_mut().flatten().for_each(|map| map.idle = map.idle.saturating_add(1));
        for (light, &span) in spans.iter().enumerate() {
            let shows = self.maps[light].shows;
            if span > 0 && !self.maps[light].is_of(shows, span) {
                self.turn_to(light, |map| map.is_of(shows, span));
            }
            let map = &mut self.maps[light];
            map.wanted = span;
            map.idle = if span > 0 { 0 } else { map.idle.saturating_add(1) };
        }
    }

    /// A map of parallel light is to show another part of the scene.
    pub fn show(&mut self, light: usize, shows: ShownSquare) {
        if self.maps[light].shows == shows || self.turn_to(light, |map| map.shows == shows) {
            return;
        }
        let map = &self.maps[light];
        let anew = MapRecord { is_due: map.is_due || map.is_drawn() && map.wanted > 0, shows, ..map.anew() };
        self.replace(light, anew);
    }

    /// Has frames look up another of a light's maps, if there is such a one.
    fn turn_to(&mut self, light: usize, is_it: impl FnMut(&MapRecord) -> bool) -> bool {
        let Some(at) = self.others[light].iter().position(is_it) else { return false };
        let other = self.others[light].swap_remove(at);
        let MapRecord { waited, wanted, .. } = self.maps[light];
        self.replace(light, MapRecord { waited, wanted, ..other });
        true
    }

    /// Has frames look another map of a light up; the one before stays, if it shows something.
    fn replace(&mut self, light: usize, map: MapRecord) {
        let before = std::mem::replace(&mut self.maps[light], map);
        if before.slot.is_some() && before.is_drawn() {
            self.others[light].push(MapRecord { is_due: false, waited: 0, wanted: 0, ..before });
        }
    }

    /// A light's map, if it shows something: its place and what of it is stale.
    pub fn shown(&self, light: usize) -> Option<(MapSlot, TexelRect)> {
        let map = self.maps.get(light).filter(|map| map.is_drawn())?;
        Some((map.slot?, map.stale))
    }

    /// All maps that show something.
    pub fn all_shown(&self) -> Vec<MapIndex> {
        let lights = 0..self.len();
        let of = |light: usize| {
            let others = (0..self.others[light].len()).map(Some);
            let looked_up = self.maps[light].is_drawn().then_some(None);
            looked_up.into_iter().chain(others).map(move |other| MapIndex { light, other })
        };
        lights.flat_map(of).collect()
    }

    fn record(&self, index: MapIndex) -> &MapRecord {
        index.other.map_or(&self.maps[index.light], |other| &self.others[index.light][other])
    }

    /// What a map shows, its place and what of it is stale.
    pub fn holds(&self, index: MapIndex) -> Option<(ShownSquare, MapSlot, TexelRect)> {
        let map = self.record(index);
        Some((map.shows, map.slot?, map.stale))
    }

    /// Texels across a map, its first texel in its page, and the page.
    pub fn texels(&self, slot: &MapSlot) -> (u32, [u32; 2], u32) {
        (self.layout.size(slot.span), slot.at.map(|unit| unit * self.layout.unit), slot.page)
    }

    /// The place that a light has, whether anything was drawn there or not.
    pub fn slot(&self, light: usize) -> Option<MapSlot> {
        self.maps.get(light)?.slot
    }

    /// Something moved: this of a map, which shows something, is stale now.
    pub fn mark(&mut self, index: MapIndex, stale: TexelRect) {
        let of_light = &mut self.others[index.light];
        index.other.map_or(&mut self.maps[index.light], |other| &mut of_light[other]).stale = stale;
    }

    /// A light moved: its maps show nothing of use.
    pub fn invalidate(&mut self, light: usize) {
        let map = &mut self.maps[light];
        map.is_due |= map.is_drawn() && map.wanted > 0;
        map.stale = EVERYWHERE;
        self.others[light].clear();
    }

    /// All lights are others: their maps show nothing of use.
    pub fn invalidate_all(&mut self) {
        for map in &mut self.maps {
            (map.stale, map.is_due) = (EVERYWHERE, true);
        }
        self.others.iter_mut().for_each(Vec::clear);
    }

    /// What the next frame draws, in the order of lights, in places that are found for it. Maps of lights that are dark are left until
    /// those shine.
    pub fn plan(&mut self, updates: &MapUpdates, lights: &[Light]) -> Vec<MapUpdate> {
        let mut chosen = self.choose(updates, lights);
        for &light in &chosen {
            let map = &self.maps[light];
            if map.slot.is_some_and(|slot| slot.span != map.wanted) {
                self.replace(light, map.anew());
            }
        }
        // Large ones first: what gives way to them is smaller, or not as it is wanted.
        for span in (0..=self.layout.largest[1].ilog2()).rev().map(|class| 1 << class) {
            let waits = |map: &MapRecord| map.slot.is_none() && map.wanted == span;
            let waiting: Vec<usize> =
                chosen.iter().copied().filter(|light| waits(&self.maps[*light])).collect();
            if waiting.is_empty() {
                continue;
            }
            for (light, (slot, held)) in waiting.into_iter().zip(self.places(span)) {
                for lost in held {
                    match lost.other {
                        Some(other) => self.others[lost.light][other].lose_place(),
                        None => self.maps[lost.light].lose_place(),
                    }
                    let is_looked_up = lost.other.is_none() && self.maps[lost.light].wanted > 0;
                    if updates.most.is_none() && is_looked_up && is_lit(&lights[lost.light]) {
                        chosen.insert(lost.light);
                    }
                }
                self.maps[light].slot = Some(slot);
            }
            self.others.iter_mut().for_each(|maps| maps.retain(|map| map.slot.is_some()));
        }
        let placed = chosen.into_iter().filter(|light| self.maps[*light].slot.is_some());
        placed.map(|light| MapUpdate { light: light as u32, part: self.lack(light) }).collect()
    }

    /// Places for maps of so many units across, each with the maps that are there. Those come first whose maps were looked up
    /// longest ago, after those that are free; what is as it is wanted, and no smaller, stays.
    fn places(&self, span: u32) -> impl Iterator<Item = (MapSlot, Vec<MapIndex>)> + use<> {
        let [columns, rows] = self.layout.per_page(span);
        let mut held = vec![Vec::new(); (self.layout.pages * rows * columns) as usize];
        let of_frames = (0..self.len()).map(MapIndex::of_frames);
        let others = (0..self.len()).flat_map(|light| {
            (0..self.others[light].len()).map(move |other| MapIndex { light, other: Some(other) })
        });
        for index in of_frames.chain(others) {
            let Some(slot) = self.record(index).slot else { continue };
            let [across, down] = slot.at.map(|at| at / span..(at + slot.span).div_ceil(span));
            for row in down.start..down.end.min(rows) {
                let first = (slot.page * rows + row) * columns;
                for column in across.start..across.end.min(columns) {
                    held[(first + column) as usize].push(index);
                }
            }
        }
        let idle = |index: &MapIndex| {
            let MapRecord { slot, wanted, idle, .. } = self.record(*index);
            slot.filter(|slot| slot.span != *wanted || slot.span < span).map(|_| *idle)
        };
        let all = (0..).zip(held).filter_map(|(index, maps)| {
            let at = [index % columns, index / columns % rows].map(|place| place * span);
            let idle = maps.iter().map(idle).fold(Some(u32::MAX), Option::min)?;
            Some((idle, MapSlot { at, page: index / columns / rows, span }, maps))
        });
        let mut places: Vec<_> = all.collect();
        // From the other end, lest small ones take the room of large ones that other views look up.
        if span < self.layout.regular[1] {
            places.reverse();
        }
        places.sort_by_key(|(idle, ..)| Reverse(*idle));
        places.into_iter().map(|(_, slot, maps)| (slot, maps))
    }

    /// What of a light's map has to be drawn for it to be as it is wanted.
    fn lack(&self, light: usize) -> TexelRect {
        let map = &self.maps[light];
        let is_as_large = map.slot.is_some_and(|slot| slot.span == map.wanted);
        let lack = if is_as_large { map.stale } else { EVERYWHERE };
        let size = self.layout.size(map.wanted);
        TexelRect { end: lack.end.map(|end| end.min(size)), ..lack }
    }

    /// The lights whose maps the next frame draws.
    fn choose(&self, updates: &MapUpdates, lights: &[Light]) -> BTreeSet<usize> {
        let must = |light: usize| {
            let MapRecord { is_due, waited, .. } = self.maps[light];
            is_due || updates.oldest.is_some_and(|oldest| waited >= oldest)
        };
        let priority = |light: usize| {
            let extent = match updates.priority {
                MapPriority::Brightness => 1.0,
                MapPriority::BrightnessAndExtent => (self.lack(light).texels() as f32).sqrt(),
            };
            lights[light].intensity.max_element() * (self.maps[light].waited as f32 + 1.0) * extent
        };
        let mut lacking: Vec<usize> = self.lacking(lights).collect();
        // Those that are missing leave lights out. Numbers that are not negative have the order of their bits.
        lacking.sort_by_cached_key(|&light| {
            Reverse((must(light), !self.maps[light].is_drawn(), priority(light).to_bits()))
        });
        let has_room = |rank: usize| updates.most.is_none_or(|most| rank < most as usize);
        let ranks = lacking.into_iter().enumerate();
        ranks.filter(|(rank, light)| has_room(*rank) || must(*light)).map(|(_, light)| light).collect()
    }

    /// The lights that shine and whose maps lack something.
    fn lacking(&self, lights: &[Light]) -> impl Iterator<Item = usize> {
        (0..self.len()).filter(|&light| is_lit(&lights[light]) && !self.lack(light).is_empty())
    }

    /// For each light, the place of its map in the words of the shaders, once these are drawn.
    pub fn words(&self, drawn: &[MapUpdate]) -> Vec<u32> {
        let mut is_shown: Vec<bool> = self.maps.iter().map(MapRecord::is_drawn).collect();
        drawn.iter().for_each(|update| is_shown[update.light as usize] = true);
        let word = |(map, is_shown): (&MapRecord, bool)| match &map.slot {
            Some(slot) if is_shown && map.wanted > 0 => AtlasLayout::word(slot),
            _ => NO_MAP,
        };
        self.maps.iter().zip(is_shown).map(word).collect()
    }

    /// Takes note that these were drawn, with dynamic objects where they are.
    pub fn note(&mut self, drawn: &[MapUpdate], transforms: &Snapshot) {
        for update in drawn {
            let map = &mut self.maps[update.light as usize];
            (map.stale, map.is_due, map.waited) = (TexelRect::default(), false, 0);
            map.transforms = transforms.clone();
        }
    }

    /// Counts a frame. What shone and was not looked up is not due any longer.
    pub fn advance(&mut self, lights: &[Light]) {
        for (light, sample) in lights.iter().enumerate() {
            let is_complete = self.lack(light).is_empty();
            let map = &mut self.maps[light];
            map.waited += u32::from(!is_complete);
            map.is_due &= map.wanted > 0 || !is_lit(sample);
        }
    }

    /// Of each light's map what shows what is no longer there, and matters; all of it where it is missing.
    pub fn stale_parts(&self, lights: &[Light]) -> impl Iterator<Item = TexelRect> {
        self.maps.iter().zip(lights).map(|(map, light)| match map.wanted > 0 && is_lit(light) {
            true => map.stale,
            false => TexelRect::default(),
        })
    }

    /// Where objects were when each light's map was drawn, if it shows something.
    pub fn transforms(&self) -> impl Iterator<Item = Option<&Snapshot>> {
        self.maps.iter().map(|map| map.is_drawn().then_some(&map.transforms))
    }

    /// What is left to be drawn.
    pub fn counts(&self, lights: &[Light]) -> StaleCounts {
        let waited: Vec<u32> = self.lacking(lights).map(|light| self.maps[light].waited).collect();
        StaleCounts { maps: waited.len() as u32, oldest: waited.into_iter().max().unwrap_or_default() }
    }
}
