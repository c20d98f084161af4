//! The cache of shadow maps: one record a light says where its map lies, what it shows, and what of that is stale (Barczak §4.5.3).
//!
//! Each frame says which maps it looks up, and how large it wants them: that depends on scene, lights and view alone. What it lacks is
//! drawn, as far as its budget allows, by priority: the brightest channel of the light times the frames that it has waited (and the
//! extent of what is to be drawn), so that bright ones come first and none starves. Maps lack something that are missing, of another
//! size than wanted, or stale: what they show has moved since, within the rectangle of texels that the mover covered before and after.
//! A light whose map is missing lights nothing that it might be hidden from. Lest lights go out in between, maps of those that moved
//! themselves are drawn in any case, and so are all that the first frame looks up.
//!
//! Maps that no frame looks up any longer stay until others need their place: those that were wanted longest ago go first.

use super::grid::AtlasGrid;
use super::layout::{AtlasLayout, MapSlot};
use super::map_view::TexelRect;
use super::snapshot::Snapshot;
use crate::layout::Light;
use crate::settings::{MapPriority, MapUpdates};
use crate::shader_constants::NO_MAP;
use girandole_core::glam::Vec3;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// The shadow maps of all lights.
#[derive(Debug)]
pub(crate) struct MapCache {
    maps: Vec<MapRecord>,
    layout: AtlasLayout,
    grid: AtlasGrid,
    /// Frames so far.
    frame: u64,
}

/// One light's map.
#[derive(Clone, Debug)]
pub(crate) struct MapRecord {
    /// Its place in the atlas, if it has one.
    slot: Option<MapSlot>,
    /// Whether it shows the scene from where its light is, at some moment.
    is_drawn: bool,
    /// Whether the next frame that looks it up draws it, whatever the budget.
    is_due: bool,
    /// What of it has to be drawn for it to be up to date, while it is drawn at all.
    stale: TexelRect,
    /// Frames that were shaded while it lacked something.
    frames: u32,
    /// Units across that the last frame wanted; 0 where that does not look it up.
    wanted: u32,
    /// The last frame that looked it up.
    last_wanted: u64,
    /// Where dynamic objects were when it was drawn.
    pub transforms: Snapshot,
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

/// What a frame's map lacks.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Lack {
    Nothing,
    /// All of it, in this many units across.
    All(u32),
    Part(TexelRect),
}

impl MapRecord {
    /// What it lacks to be as it is wanted.
    fn lack(&self) -> Lack {
        match self.slot {
            _ if self.wanted == 0 => Lack::Nothing,
            Some(slot) if self.is_drawn && slot.span == self.wanted => match self.stale.is_empty() {
                true => Lack::Nothing,
                false => Lack::Part(self.stale),
            },
            _ => Lack::All(self.wanted),
        }
    }
}

impl MapCache {
    /// For so many lights, none of whose maps was drawn yet.
    pub fn new(layout: &AtlasLayout, lights: usize, transforms: &Snapshot) -> Self {
        let undrawn = MapRecord {
            slot: None,
            is_drawn: false,
            is_due: true,
            stale: TexelRect::default(),
            frames: 0,
            wanted: 0,
            last_wanted: 0,
            transforms: transforms.clone(),
        };
        Self { maps: vec![undrawn; lights], grid: AtlasGrid::new(layout), layout: layout.clone(), frame: 0 }
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
        let layout = &self.layout;
        let of = |most: [u32; 2]| {
            let span = |(&texels, light): (&f32, &Light)| {
                let is_large = light.has_large_map();
                if texels > 0.0 { layout.span(texels, is_large, most[usize::from(is_large)]) } else { 0 }
            };
            texels.iter().zip(lights).map(span).collect::<Vec<u32>>()
        };
        let spans = of(layout.largest);
        if layout.largest == layout.regular || AtlasGrid::holds(layout, &spans) {
            spans
        } else {
            of(layout.regular)
        }
    }

    /// The units across of regular maps of these lights.
    pub fn regular_spans(&self, lights: &[Light]) -> Vec<u32> {
        lights.iter().map(|light| self.layout.regular[usize::from(light.has_large_map())]).collect()
    }

    /// Takes note of what a frame looks up: for each light, units across that it wants, or 0.
    pub fn want(&mut self, spans: &[u32]) {
        for (map, &span) in self.maps.iter_mut().zip(spans) {
            map.wanted = span;
            if span > 0 {
                map.last_wanted = self.frame;
            }
        }
    }

    /// A light's map, if it shows something: its place and what of it is stale.
    pub fn shown(&self, light: usize) -> Option<(MapSlot, TexelRect)> {
        let MapRecord { slot, is_drawn, stale, .. } = self.maps.get(light)?;
        slot.filter(|_| *is_drawn).map(|slot| (slot, *stale))
    }

    /// Texels across a map, its first texel in its page, and the page.
    pub fn texels(&self, slot: &MapSlot) -> (u32, [u32; 2], u32) {
        (self.layout.size(slot.span), self.layout.origin(slot), slot.page)
    }

    /// The place that a light has, whether anything was drawn there or not.
    pub fn slot(&self, light: usize) -> Option<MapSlot> {
        self.maps.get(light)?.slot
    }

    /// Something moved: this of a light's map is stale now.
    pub fn mark(&mut self, light: usize, stale: TexelRect) {
        self.maps[light].stale = stale;
    }

    /// A light moved: its map shows nothing of use.
    pub fn invalidate(&mut self, light: usize) {
        let map = &mut self.maps[light];
        map.is_due |= map.is_drawn && map.wanted > 0;
        map.is_drawn = false;
    }

    /// All lights are others: their maps show nothing of use.
    pub fn invalidate_all(&mut self) {
        for map in &mut self.maps {
            (map.is_drawn, map.is_due) = (false, true);
        }
    }

    /// What the next frame draws, in the order of lights, in places that are found for it. Maps of lights that are dark are left until
    /// those shine.
    pub fn plan(&mut self, updates: &MapUpdates, lights: &[Light]) -> Vec<MapUpdate> {
        let mut is_chosen = vec![false; self.maps.len()];
        self.choose(updates, lights).into_iter().for_each(|light| is_chosen[light] = true);
        let mut to_place = BinaryHeap::new();
        for (light, map) in self.maps.iter_mut().enumerate().filter(|(light, _)| is_chosen[*light]) {
            if let Lack::All(span) = map.lack() {
                map.is_drawn = false;
                if let Some(slot) = map.slot.take_if(|slot| slot.span != span) {
                    self.grid.free(&slot);
                }
                if map.slot.is_none() {
                    to_place.push((span, Reverse(light)));
                }
            }
        }
        // Large ones first: what gives way to them is smaller, or not as it is wanted.
        while let Some((span, Reverse(light))) = to_place.pop() {
            let mut slot = self.grid.place(light as u32, span);
            if slot.is_none() {
                for lost in self.cheapest(span).into_iter().flatten() {
                    let (lost, map) = (lost as usize, &mut self.maps[lost as usize]);
                    map.slot.take().iter().for_each(|slot| self.grid.free(slot));
                    map.is_drawn = false;
                    let is_lit = lights[lost].intensity != Vec3::ZERO;
                    is_chosen[lost] |= map.wanted > 0 && is_lit && updates.most.is_none();
                    if is_chosen[lost] {
                        to_place.push((map.wanted, Reverse(lost)));
                    }
                }
                slot = self.grid.place(light as u32, span);
            }
            self.maps[light].slot = slot;
        }
        let placed =
            (0..self.maps.len()).filter(|light| is_chosen[*light] && self.maps[*light].slot.is_some());
        placed.map(|light| MapUpdate { light: light as u32, part: self.part(light) }).collect()
    }

    /// The lights whose maps are nearest at hand to lose for one of so many units across.
    fn cheapest(&self, span: u32) -> Option<Vec<u32>> {
        self.grid.cheapest(span, |light| {
            let map = &self.maps[light as usize];
            let slot = map.slot?;
            if map.wanted == slot.span && slot.span >= span {
                return None;
            }
            // What is wanted least, then what was wanted longest ago.
            let unused = self.frame - map.last_wanted;
            let area = u64::from(slot.span * slot.span);
            Some(if map.wanted > 0 { area << 32 } else { 1 + (area << 20) / (1 + unused) })
        })
    }

    /// What is to be drawn of a light's map, which has a place.
    fn part(&self, light: usize) -> TexelRect {
        match self.maps[light].lack() {
            Lack::All(span) => TexelRect::whole(self.layout.size(span)),
            Lack::Part(part) => part,
            Lack::Nothing => TexelRect::default(),
        }
    }

    /// The lights whose maps the next frame draws.
    fn choose(&self, updates: &MapUpdates, lights: &[Light]) -> Vec<usize> {
        let must = |&light: &usize| {
            let MapRecord { is_due, frames, .. } = self.maps[light];
            is_due || updates.oldest.is_some_and(|oldest| frames >= oldest)
        };
        let (mut chosen, mut others): (Vec<usize>, Vec<usize>) = self.lacking(lights).partition(must);
        let room = updates.most.map_or(usize::MAX, |most| (most as usize).saturating_sub(chosen.len()));
        let extent = |part: TexelRect| match updates.priority {
            MapPriority::Brightness => 1.0,
            MapPriority::BrightnessAndExtent => (part.texels() as f32).sqrt(),
        };
        let priority = |light: usize| {
            let MapRecord { is_drawn, frames, .. } = self.maps[light];
            let brightness = lights[light].intensity.max_element();
            // Those that are missing leave lights out.
            (!is_drawn, brightness * (frames as f32 + 1.0) * extent(self.part(light)))
        };
        others.sort_by(|&a, &b| {
            let ((a_missing, of_a), (b_missing, of_b)) = (priority(a), priority(b));
            b_missing.cmp(&a_missing).then(of_b.total_cmp(&of_a)).then(a.cmp(&b))
        });
        chosen.extend(others.into_iter().take(room));
        chosen
    }

    /// The lights that shine and whose maps lack something.
    fn lacking<'a>(&'a self, lights: &'a [Light]) -> impl Iterator<Item = usize> + 'a {
        let lacks = |&light: &usize| {
            self.maps[light].lack() != Lack::Nothing && lights[light].intensity != Vec3::ZERO
        };
        (0..self.maps.len()).filter(lacks)
    }

    /// For each light, the place of its map in the words of the shaders, once these are drawn.
    pub fn words(&self, drawn: &[MapUpdate]) -> Vec<u32> {
        let word = |map: &MapRecord, is_drawn: bool| match map.slot {
            Some(slot) if is_drawn && map.wanted > 0 => AtlasLayout::word(&slot),
            _ => NO_MAP,
        };
        let mut words: Vec<u32> = self.maps.iter().map(|map| word(map, map.is_drawn)).collect();
        for update in drawn {
            words[update.light as usize] = word(&self.maps[update.light as usize], true);
        }
        words
    }

    /// Takes note that these were drawn, with dynamic objects where they are.
    pub fn note(&mut self, drawn: &[MapUpdate], transforms: &Snapshot) {
        for update in drawn {
            let map = &mut self.maps[update.light as usize];
            (map.is_drawn, map.is_due) = (true, false);
            (map.stale, map.frames) = (TexelRect::default(), 0);
            map.transforms = transforms.clone();
        }
    }

    /// Counts a frame. What shone and was not looked up is not due any longer.
    pub fn advance(&mut self, lights: &[Light]) {
        self.frame += 1;
        for (map, light) in self.maps.iter_mut().zip(lights) {
            map.frames += u32::from(map.lack() != Lack::Nothing);
            map.is_due &= map.wanted > 0 || light.intensity == Vec3::ZERO;
        }
    }

    /// Of each light's map what shows what is no longer there, and matters; all of it where it is missing.
    pub fn stale_parts<'a>(&'a self, lights: &'a [Light]) -> impl Iterator<Item = TexelRect> + 'a {
        self.maps.iter().zip(lights).map(|(map, light)| match map.lack() {
            _ if light.intensity == Vec3::ZERO => TexelRect::default(),
            Lack::Nothing => TexelRect::default(),
            _ if map.is_drawn => map.stale,
            _ => EVERYWHERE,
        })
    }

    /// Whether a light's map shows something, and where objects were when it was drawn.
    pub fn transforms(&self) -> impl Iterator<Item = Option<&Snapshot>> {
        self.maps.iter().map(|map| map.is_drawn.then_some(&map.transforms))
    }

    /// What is left to be drawn.
    pub fn counts(&self, lights: &[Light]) -> StaleCounts {
        self.lacking(lights).map(|light| &self.maps[light]).fold(StaleCounts::default(), |counts, map| {
            StaleCounts { maps: counts.maps + 1, oldest: counts.oldest.max(map.frames) }
        })
    }
}
