//! Where each light's shadow map lies: a grid of square tiles in the pages (array layers) of one depth texture, sized
//! to need under a memory budget.
//!
//! Worked example: 300 lights under 256 MiB (64 Mi texels) get ⌊√(2²⁶ / 300)⌋ = 472 → 464 texels across (a multiple
//! of 16), 17 tiles fit a page of 8192 one above the other, so 18 pages of 464 × 7888 texels are made.

use crate::layout::Maps;
use crate::settings::RendererOptions;
use crate::{Error, Result};

/// Smallest map that is worth drawing.
const MIN_SIZE: u32 = 16;
/// Largest map that is chosen unless asked for.
const MAX_CHOSEN: u32 = 512;
/// Largest page: what every WebGPU device can hold.
const MAX_PAGE: u32 = 8192;
/// Most pages: what a light's place has room for.
const MAX_PAGES: u32 = 256;
/// Pages are kept narrow as long as there are no more than this.
const WANTED_PAGES: u64 = 32;
/// A directional light's map covers the whole scene: it gets this many tiles along each axis.
const DIRECTIONAL_TILES: u32 = 4;

/// A light's place in the atlas.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MapSlot {
    /// First texel in x and y.
    pub origin: [u32; 2],
    /// Page (array layer).
    pub page: u32,
    /// Texels across.
    pub size: u32,
}

/// The atlas: its pages, and one slot a light.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AtlasLayout {
    /// Texels of a page in x and y.
    pub page_size: [u32; 2],
    /// How many pages.
    pub pages: u32,
    /// Texels across a map.
    pub map_size: u32,
    /// Texels across the map of a directional light: four times as many where a page holds them.
    pub parallel_size: u32,
    /// One a light.
    pub slots: Vec<MapSlot>,
}

impl AtlasLayout {
    /// Bytes of the pages.
    pub fn bytes(&self) -> u64 {
        u64::from(self.page_size[0]) * u64::from(self.page_size[1]) * u64::from(self.pages) * 4
    }

    /// A slot in the words of the shaders, see `Light.place`.
    pub(crate) fn place(&self, slot: &MapSlot) -> u32 {
        let [column, row] = slot.origin.map(|o| o / self.map_size);
        (slot.page << 24) | (row << 12) | column
    }

    /// What shaders need to know about the whole atlas.
    pub(crate) fn maps(&self) -> Maps {
        Maps {
            page: self.page_size.map(|s| s as f32),
            size: self.map_size as f32,
            parallel_size: self.parallel_size as f32,
            texel: 1.0 / self.map_size as f32,
            parallel_texel: 1.0 / self.parallel_size as f32,
        }
    }

    /// Lays out the maps of lights, of which `directional[i]` tells whether light i is a directional one.
    ///
    /// # Errors
    /// A sentence, where the budget or the device's limits do not suffice.
    pub fn new(directional: &[bool], options: &RendererOptions, limits: &wgpu::Limits) -> Result<Self> {
        let lights = directional.len() as u64;
        let suns = directional.iter().filter(|&&d| d).count() as u64;
        let budget = u64::from(options.memory_mib) << 18;
        let max_page = limits.max_texture_dimension_2d.min(MAX_PAGE);
        let tiles_of = |block: u32| (lights - suns) + suns * u64::from(block) * u64::from(block);
        let size = match options.map_size {
            Some(size) if size < MIN_SIZE || size > max_page => {
                return Err(Error::TooLarge(format!(
                    "a shadow map of {size} texels is not possible here; --map-size takes {MIN_SIZE} to {max_page}"
                )));
            }
            Some(size) => size,
            None => {
                let fitting = ((budget / tiles_of(DIRECTIONAL_TILES).max(1)) as f64).sqrt() as u32;
                (fitting / 16 * 16).min(MAX_CHOSEN)
            }
        };
        if size < MIN_SIZE {
            let needed = (tiles_of(DIRECTIONAL_TILES) * u64::from(MIN_SIZE).pow(2)).div_ceil(1 << 18);
            return Err(Error::TooLarge(format!(
                "{lights} shadow maps do not fit into {} MiB; give at least --memory {}, or fewer --lights",
                options.memory_mib,
                needed + needed / 8 + 1
            )));
        }
        let block = DIRECTIONAL_TILES.min(max_page / size);
        let per_side = max_page / size;
        let tiles = tiles_of(block);
        // Few columns: where textures are stored row by row, the rows of a map then lie close together.
        let least = if suns > 0 { block } else { 1 };
        let columns = (tiles.div_ceil(u64::from(per_side) * WANTED_PAGES) as u32).clamp(least, per_side);
        let pages = tiles.div_ceil(u64::from(columns) * u64::from(per_side)).max(1);
        let share = tiles.div_ceil(pages).max(1);
        let rows = (share.div_ceil(u64::from(columns)) as u32).clamp(least, per_side);
        let mut result = Self {
            page_size: [columns * size, rows * size],
            pages: 0,
            map_size: size,
            parallel_size: size * block,
            slots: vec![MapSlot::default(); directional.len()],
        };
        let mut grid = Grid { columns, rows, taken: Vec::new() };
        for wanted in [true, false] {
            let span = if wanted { block } else { 1 };
            let mut from = 0;
            for (slot, _) in result.slots.iter_mut().zip(directional).filter(|(_, d)| **d == wanted) {
                let (cell, page, column, row) = grid.place(span, from);
                from = cell;
                *slot = MapSlot { origin: [column * size, row * size], page, size: size * span };
            }
        }
        result.pages = grid.pages().max(1);
        let budget_bytes = u64::from(options.memory_mib) << 20;
        // A page's last row may stay partly empty: allow an eighth.
        if result.bytes() > budget_bytes + budget_bytes / 8 {
            return Err(Error::TooLarge(format!(
                "{lights} shadow maps of {size}² texels need {} MiB; give --memory that much, or a smaller --map-size",
                result.bytes().div_ceil(1 << 20)
            )));
        }
        if result.pages > limits.max_texture_array_layers.min(MAX_PAGES) {
            return Err(Error::TooLarge(format!(
                "{lights} shadow maps of {size}² texels need {} pages and this device holds {}; use a smaller --map-size",
                result.pages,
                limits.max_texture_array_layers.min(MAX_PAGES)
            )));
        }
        Ok(result)
    }
}

struct Grid {
    columns: u32,
    rows: u32,
    taken: Vec<bool>,
}

impl Grid {
    fn pages(&self) -> u32 {
        (self.taken.len() as u32).div_ceil(self.columns * self.rows)
    }

    /// The first free square of `span` cells at or after cell `from`: (cell, page, column, row).
    fn place(&mut self, span: u32, from: usize) -> (usize, u32, u32, u32) {
        let cells = (self.columns * self.rows) as usize;
        let mut cell = from;
        loop {
            let page = cell / cells;
            if self.taken.len() < (page + 1) * cells {
                self.taken.resize((page + 1) * cells, false);
            }
            let (column, row) = ((cell % cells) as u32 % self.columns, (cell % cells) as u32 / self.columns);
            if column + span <= self.columns && row + span <= self.rows {
                let square: Vec<usize> =
                    (0..span * span).map(|i| cell + (i / span * self.columns + i % span) as usize).collect();
                if square.iter().all(|&c| !self.taken[c]) {
                    for c in square {
                        self.taken[c] = true;
                    }
                    return (cell, page as u32, column, row);
                }
            }
            cell += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(directional: &[bool], options: RendererOptions) -> Result<AtlasLayout> {
        AtlasLayout::new(directional, &options, &wgpu::Limits::default())
    }

    fn overlaps(a: &MapSlot, b: &MapSlot) -> bool {
        a.page == b.page
            && (0..2).all(|i| a.origin[i] < b.origin[i] + b.size && b.origin[i] < a.origin[i] + a.size)
    }

    #[test]
    fn slots_lie_in_their_page_and_do_not_overlap() {
        for (points, suns) in [(1, 0), (0, 1), (300, 0), (297, 3), (4096, 1), (5, 2)] {
            let mut kinds = vec![false; points];
            for i in 0..suns {
                kinds.insert(i * points / 3, true);
            }
            let l = layout(&kinds, RendererOptions::default()).unwrap();
            assert!(l.bytes() <= (256 << 20) * 9 / 8, "{} bytes", l.bytes());
            for (i, a) in l.slots.iter().enumerate() {
                assert!((0..2).all(|k| a.origin[k] + a.size <= l.page_size[k]) && a.page < l.pages);
                assert!(a.size == if kinds[i] { l.map_size * 4 } else { l.map_size });
                assert!(l.slots[i + 1..].iter().all(|b| !overlaps(a, b)));
            }
        }
        // The control: slots that do overlap are seen to.
        let a = MapSlot { origin: [0, 0], page: 0, size: 16 };
        assert!(overlaps(&a, &MapSlot { origin: [15, 15], ..a }));
    }

    #[test]
    fn the_worked_example_holds() {
        let l = layout(&[false; 300], RendererOptions::default()).unwrap();
        assert_eq!((l.map_size, l.pages, l.page_size), (464, 18, [464, 7888]));
    }

    #[test]
    fn what_does_not_fit_is_refused_with_advice() {
        let few = RendererOptions { memory_mib: 1, ..Default::default() };
        let message = layout(&[false; 4096], few).unwrap_err().to_string();
        assert!(message.contains("--memory"), "{message}");
        let large = RendererOptions { map_size: Some(1024), ..Default::default() };
        assert!(layout(&[false; 300], large).unwrap_err().to_string().contains("--map-size"));
        let absurd = RendererOptions { map_size: Some(1 << 20), ..Default::default() };
        assert!(layout(&[false], absurd).is_err());
        assert!(layout(&[false; 4], RendererOptions { map_size: Some(1024), ..Default::default() }).is_ok());
    }
}
