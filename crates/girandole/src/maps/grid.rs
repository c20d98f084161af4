//! Who has which units of the atlas.

use super::layout::{AtlasLayout, MapSlot};
use std::collections::BTreeMap;

/// Nobody.
const FREE: u32 = u32::MAX;

/// The units of all pages, each with the light whose map covers it.
#[derive(Debug)]
pub(crate) struct AtlasGrid {
    /// Units of a page in x and y.
    page: [u32; 2],
    pages: u32,
    owners: Vec<u32>,
    /// For maps of so many units across, a block before which none is free.
    first_free: BTreeMap<u32, u32>,
}

impl AtlasGrid {
    /// All of it free.
    pub fn new(layout: &AtlasLayout) -> Self {
        let page = layout.page_units();
        let units = page[0] as usize * page[1] as usize * layout.pages as usize;
        Self { page, pages: layout.pages, owners: vec![FREE; units], first_free: BTreeMap::new() }
    }

    /// Whether maps of so many units across all have room at once.
    pub fn holds(layout: &AtlasLayout, spans: &[u32]) -> bool {
        let mut grid = Self::new(layout);
        let mut spans: Vec<u32> = spans.iter().copied().filter(|span| *span > 0).collect();
        spans.sort_unstable_by(|a, b| b.cmp(a));
        spans.into_iter().all(|span| grid.place(0, span).is_some())
    }

    /// A free place of so many units across, which a light has from now on.
    pub fn place(&mut self, light: u32, span: u32) -> Option<MapSlot> {
        let first = self.first_free.get(&span).copied().unwrap_or(0);
        let found = (first..self.blocks(span))
            .map(|block| self.slot(span, block))
            .zip(first..)
            .find(|(slot, _)| self.units(slot).all(|unit| self.owners[unit] == FREE));
        self.first_free.insert(span, found.map_or(self.blocks(span), |(_, block)| block + 1));
        let (slot, _) = found?;
        self.give(&slot, light);
        Some(slot)
    }

    /// Takes a place back.
    pub fn free(&mut self, slot: &MapSlot) {
        self.give(slot, FREE);
        for (&span, first) in &mut self.first_free {
            let [columns, rows] = self.page.map(|units| units / span);
            let [column, row] = slot.at.map(|unit| unit / span);
            if column < columns && row < rows {
                *first = (*first).min((slot.page * rows + row) * columns + column);
            }
        }
    }

    /// The place of so many units across that is cheapest to free, by what losing the map of a light costs, which may be out of the
    /// question; and the lights that have maps there.
    pub fn cheapest(&self, span: u32, cost: impl Fn(u32) -> Option<u64>) -> Option<Vec<u32>> {
        let all = (0..self.blocks(span)).filter_map(|block| {
            let slot = self.slot(span, block);
            let mut lights: Vec<u32> =
                self.units(&slot).map(|unit| self.owners[unit]).filter(|light| *light != FREE).collect();
            lights.sort_unstable();
            lights.dedup();
            let total = lights.iter().try_fold(0, |sum, light| Some(sum + cost(*light)?))?;
            Some((total, lights))
        });
        all.min_by_key(|(total, _)| *total).map(|(_, lights)| lights)
    }

    fn give(&mut self, slot: &MapSlot, light: u32) {
        for unit in self.units(slot) {
            self.owners[unit] = light;
        }
    }

    /// How many places there are for maps of so many units across.
    fn blocks(&self, span: u32) -> u32 {
        self.pages * self.page.map(|units| units / span).iter().product::<u32>()
    }

    fn slot(&self, span: u32, block: u32) -> MapSlot {
        let [columns, rows] = self.page.map(|units| units / span);
        let (page, block) = (block / (columns * rows), block % (columns * rows));
        MapSlot { at: [block % columns * span, block / columns * span], page, span }
    }

    /// Indices of the units of a place.
    fn units(&self, slot: &MapSlot) -> impl Iterator<Item = usize> + use<> {
        let (MapSlot { at: [x, y], page, span }, [width, height]) = (*slot, self.page);
        let row = move |row: u32| ((page * height + y + row) * width + x) as usize;
        (0..span).flat_map(move |at| row(at)..row(at) + span as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::RendererOptions;

    /// A layout for so many lights, some of them directional.
    fn layout(points: usize, suns: usize) -> AtlasLayout {
        let kinds: Vec<bool> = (0..points + suns).map(|i| i < suns).collect();
        AtlasLayout::new(&kinds, 256, &RendererOptions::default(), &wgpu::Limits::default()).unwrap()
    }

    #[test]
    fn every_light_has_room_for_its_regular_map() {
        for (points, suns) in [(1, 0), (0, 1), (300, 0), (297, 3), (1024, 0), (5, 2), (100, 30)] {
            let layout = layout(points, suns);
            let mut spans = vec![layout.regular[1]; suns];
            spans.resize(points + suns, layout.regular[0]);
            assert!(AtlasGrid::holds(&layout, &spans), "{points} {suns}");
            // The control: many more have not.
            assert!(!AtlasGrid::holds(&layout, &[&spans[..]; 9].concat()), "{points} {suns}");
        }
    }

    #[test]
    fn places_lie_in_their_page_and_do_not_overlap_whatever_comes_and_goes() {
        let layout = layout(40, 1);
        let mut grid = AtlasGrid::new(&layout);
        let mut held: Vec<(u32, MapSlot)> = Vec::new();
        let number = |index: u32| girandole_core::math::sequence::sample(index, 0, 3);
        let (mut refused, mut freed) = (0, 0);
        for light in 1..4000 {
            let span = 1 << (number(light) * 5.0) as u32;
            match grid.place(light, span) {
                Some(slot) => held.push((light, slot)),
                None => {
                    refused += 1;
                    let Some(lights) = grid.cheapest(span, |light| Some(u64::from(light))) else { continue };
                    let place: u64 = lights.iter().map(|light| u64::from(*light)).sum();
                    let others = grid.cheapest(span, |light| lights.contains(&light).then_some(0));
                    assert!(others.is_none_or(|others| others.iter().all(|light| lights.contains(light))));
                    assert!(place > 0, "something was in the way");
                    freed += lights.len();
                    held.retain(|(light, slot)| {
                        let goes = lights.contains(light);
                        if goes {
                            grid.free(slot);
                        }
                        !goes
                    });
                    held.push((light, grid.place(light, span).expect("what was freed")));
                }
            }
            let taken: usize = held.iter().map(|(_, slot)| (slot.span * slot.span) as usize).sum();
            assert_eq!(taken, grid.owners.iter().filter(|owner| **owner != FREE).count());
            for (light, slot) in &held {
                assert!(slot.page < layout.pages && slot.at.iter().all(|at| at.is_multiple_of(slot.span)));
                assert!((0..2).all(|i| slot.at[i] + slot.span <= layout.page_units()[i]));
                assert!(grid.units(slot).all(|unit| grid.owners[unit] == *light));
            }
        }
        assert!(refused > 100 && freed > 100, "{refused} {freed}");
    }
}
