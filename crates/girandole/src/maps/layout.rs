//! Where each light's shadow map lies: a grid of square tiles in the pages (array layers) of one depth texture, sized
//! to need under a memory budget.
//!
//! Worked example: 1024 lights under 256 MiB (64 Mi texels) get ⌊√(2²⁶ / 1024)⌋ = 256 texels across at most; as what is beside the maps
//! while they are drawn counts too, they get 240: in 32 pages of 240 × 7680 texels, 32 one above the other.

use crate::layout::Maps;
use crate::settings::{RendererOptions, ShadowMap};
use crate::shader_constants::{LISTED_WORDS, MAP_BLOCK, MAP_LISTED, MAP_LISTS_HEAD};
use crate::{Error, Remedy, Result};

/// Smallest map that is worth drawing.
const MIN_SIZE: u32 = 16;
/// Largest map that is chosen unless asked for: of few lights and of many, whose shadows' edges average out. At 300 lights, maps of
/// 256 and of 448 texels differ by less than a thousandth of FLIP to the path tracer.
const MAX_CHOSEN: [u32; 2] = [512, 256];
/// Lights that are few.
const FEW: usize = 64;
/// Largest page: what every WebGPU device can hold.
const MAX_PAGE: u32 = 8192;
/// Most pages: what a light's place has room for.
const MAX_PAGES: u32 = 256;
/// Pages are kept narrow as long as there are no more than this.
const WANTED_PAGES: u64 = 32;
/// Texels that are drawn at once at most, but for larger maps: 16 MiB of them.
const MOST_TEXELS: u64 = 4 << 20;
/// Texels beside the maps for each pair of a part and a cluster that is listed at most.
const TEXELS_PER_PAIR: u64 = 4;
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
    /// Texels that are drawn at once, beside the maps.
    pub drawn_texels: u64,
    /// One a light.
    pub slots: Vec<MapSlot>,
}

impl AtlasLayout {
    /// Bytes of the pages, and of what is beside them while maps are drawn.
    pub fn bytes(&self) -> u64 {
        let [width, height] = self.page_size.map(u64::from);
        let texels = u64::from(self.pages) * width * height;
        4 * (texels + self.drawn_texels + list_words(self.drawn_texels, self.pairs()))
    }

    /// Pairs of a part and a cluster that are listed.
    pub(crate) fn pairs(&self) -> u64 {
        self.drawn_texels / TEXELS_PER_PAIR
    }

    /// A slot in the words of the shaders, see `Light.atlas_slot`.
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

    /// Lays out the maps of lights, of which `directional[i]` tells whether light i is a directional one. `shows_all` tells whether any map
    /// shows all that is seen, as those of parallel light do: they are not made smaller where there are many.
    ///
    /// # Errors
    /// [`Error::TooLarge`] where the budget or the device's limits do not suffice.
    pub fn new(
        directional: &[bool],
        shows_all: bool,
        options: &RendererOptions,
        limits: &wgpu::Limits,
    ) -> Result<Self> {
        let lights = directional.len();
        let suns = directional.iter().filter(|&&d| d).count();
        let budget = u64::from(options.memory_mib) << 20;
        let max_page = limits.max_texture_dimension_2d.min(MAX_PAGE);
        let max_pages = limits.max_texture_array_layers.min(MAX_PAGES);
        let shapes = |size| shapes([lights as u64, suns as u64], size, max_page, max_pages);
        let fits = |shape: &Shape| shape.bytes() <= budget;
        let granule = granule(options.shadow_map);
        let least_mib = |size: u32| shapes(size).map(|s| s.bytes().div_ceil(1 << 20)).min();
        let shape = match options.map_size {
            Some(size) if size < MIN_SIZE || size > max_page => {
                let what = format!("shadow maps of {size}² texels are not possible here");
                return Err(Error::too_large(what, Remedy::MapSize { from: MIN_SIZE, to: max_page }));
            }
            Some(size) => {
                let size = size.next_multiple_of(granule).min(max_page);
                shapes(size).find(fits).ok_or_else(|| {
                    let (needs, remedy) = match least_mib(size) {
                        Some(mib) => (format!("{mib} MiB"), Remedy::MemoryOrSmallerMaps { mib }),
                        None => {
                            (format!("more than the {max_pages} pages of this device"), Remedy::SmallerMaps)
                        }
                    };
                    Error::too_large(format!("{lights} shadow maps of {size}² texels need {needs}"), remedy)
                })?
            }
            None => {
                let largest = (budget / 4 / tiles([lights as u64, suns as u64], DIRECTIONAL_TILES)).isqrt();
                let most = MAX_CHOSEN[usize::from(lights > FEW && !shows_all)];
                let largest = (largest as u32).clamp(MIN_SIZE, most).min(max_page) / granule;
                let sizes = (1..=largest).rev().map(|i| i * granule);
                sizes.filter_map(|size| shapes(size).find(fits)).next().ok_or_else(|| {
                    let what = format!("{lights} shadow maps do not fit into {} MiB", options.memory_mib);
                    let remedy = least_mib(granule)
                        .map_or(Remedy::FewerLights, |mib| Remedy::MemoryOrFewerLights { mib });
                    Error::too_large(what, remedy)
                })?
            }
        };
        Ok(shape.place(directional))
    }
}

/// What sizes of maps are multiples of: their parts are drawn in whole blocks, in each of which they are linear.
fn granule(shape: ShadowMap) -> u32 {
    if shape == ShadowMap::Cube { 4 * MAP_BLOCK } else { 2 * MAP_BLOCK }
}

/// Tiles of lights and of the suns among them, each of those `block` tiles along an axis; 1 where there are none.
fn tiles([lights, suns]: [u64; 2], block: u32) -> u64 {
    (lights - suns + suns * u64::from(block).pow(2)).max(1)
}

/// Equal pages for tiles of one size.
struct Shape {
    /// Texels across a tile.
    size: u32,
    /// Tiles across a directional light's map.
    block: u32,
    /// Tiles across a page.
    columns: u32,
    /// Tiles down a page.
    rows: u32,
    pages: u32,
    has_suns: bool,
}

/// Shapes that hold the maps of so many lights and suns, the fewest and largest pages first.
fn shapes(counts: [u64; 2], size: u32, max_page: u32, max_pages: u32) -> impl Iterator<Item = Shape> {
    let suns = counts[1];
    let per_side = max_page / size;
    let block = DIRECTIONAL_TILES.min(per_side);
    let tiles = tiles(counts, block);
    // Few columns: where textures are stored row by row, the rows of a map then lie close together.
    let least = if suns > 0 { block } else { 1 };
    let columns = (tiles.div_ceil(u64::from(per_side) * WANTED_PAGES) as u32).clamp(least, per_side);
    let fewest = tiles.div_ceil(u64::from(columns) * u64::from(per_side));
    (fewest..=u64::from(max_pages)).filter_map(move |wanted| {
        let share = tiles.div_ceil(wanted);
        let columns = (share.div_ceil(u64::from(per_side)) as u32).max(least);
        let rows = (share.div_ceil(u64::from(columns)) as u32).max(least);
        let blocks = u64::from(columns / block) * u64::from(rows / block);
        let of_suns = if suns > 0 { suns.div_ceil(blocks) } else { 0 };
        let pages = tiles.div_ceil(u64::from(columns) * u64::from(rows)).max(of_suns);
        let pages = u32::try_from(pages).ok().filter(|pages| *pages <= max_pages)?;
        Some(Shape { size, block, columns, rows, pages, has_suns: suns > 0 })
    })
}

impl Shape {
    fn page_size(&self) -> [u32; 2] {
        [self.columns * self.size, self.rows * self.size]
    }

    /// Texels of all pages.
    fn texels(&self) -> u64 {
        self.page_size().map(u64::from).iter().product::<u64>() * u64::from(self.pages)
    }

    /// Texels that are drawn at once.
    fn drawn_texels(&self) -> u64 {
        let largest = u64::from(self.size) * if self.has_suns { u64::from(self.block) } else { 1 };
        // Rows are whole numbers of 256 bytes then.
        let row = largest.next_multiple_of(64);
        (self.texels() / 4).max(largest * row).min(MOST_TEXELS)
    }

    /// Bytes of the pages, and of what is beside them while maps are drawn.
    fn bytes(&self) -> u64 {
        let drawn = self.drawn_texels();
        4 * (self.texels() + drawn + list_words(drawn, drawn / TEXELS_PER_PAIR))
    }

    fn place(&self, directional: &[bool]) -> AtlasLayout {
        let &Self { size, block, columns, rows, pages, .. } = self;
        let mut slots = vec![MapSlot::default(); directional.len()];
        let mut grid = Grid { columns, rows, taken: Vec::new() };
        for wanted in [true, false] {
            let span = if wanted { block } else { 1 };
            let mut from = 0;
            for (slot, _) in slots.iter_mut().zip(directional).filter(|(_, d)| **d == wanted) {
                let (cell, page, column, row) = grid.place(span, from);
                from = cell;
                *slot = MapSlot { origin: [column * size, row * size], page, size: size * span };
            }
        }
        let parallel_size = size * block;
        let drawn_texels = self.drawn_texels();
        let page_size = self.page_size();
        AtlasLayout { page_size, pages, map_size: size, parallel_size, drawn_texels, slots }
    }
}

/// Words of `lists` (lib/map_lists.wgsl), the parts as small as they can be.
pub(crate) fn list_words(texels: u64, pairs: u64) -> u64 {
    let least = u64::from(MAP_BLOCK * wgpu::COPY_BYTES_PER_ROW_ALIGNMENT / 4);
    u64::from(MAP_LISTS_HEAD)
        + texels / least
        + texels / u64::from(MAP_LISTED) * u64::from(LISTED_WORDS)
        + pairs
}

struct Grid {
    columns: u32,
    rows: u32,
    taken: Vec<bool>,
}

impl Grid {
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
        AtlasLayout::new(directional, directional.contains(&true), &options, &wgpu::Limits::default())
    }

    /// So many points, with suns among them.
    fn kinds(points: usize, suns: usize) -> Vec<bool> {
        let mut kinds = vec![false; points];
        for i in 0..suns {
            kinds.insert(i * points / suns, true);
        }
        kinds
    }

    fn overlaps(a: &MapSlot, b: &MapSlot) -> bool {
        a.page == b.page
            && (0..2).all(|i| a.origin[i] < b.origin[i] + b.size && b.origin[i] < a.origin[i] + a.size)
    }

    #[test]
    fn slots_lie_in_their_page_and_do_not_overlap() {
        for (points, suns) in [(1, 0), (0, 1), (300, 0), (297, 3), (4096, 1), (5, 2), (100, 30)] {
            for map_size in [None, Some(33)] {
                let kinds = kinds(points, suns);
                let l = layout(&kinds, RendererOptions { map_size, ..Default::default() }).unwrap();
                for (i, a) in l.slots.iter().enumerate() {
                    assert!((0..2).all(|k| a.origin[k] + a.size <= l.page_size[k]) && a.page < l.pages);
                    assert!(a.size == if kinds[i] { l.map_size * 4 } else { l.map_size });
                    assert!(l.slots[i + 1..].iter().all(|b| !overlaps(a, b)));
                }
            }
        }
        // The control: slots that do overlap are seen to.
        let a = MapSlot { origin: [0, 0], page: 0, size: 16 };
        assert!(overlaps(&a, &MapSlot { origin: [15, 15], ..a }));
    }

    #[test]
    fn everything_stays_within_the_budget() {
        let (mut sizes, mut refused) = (0, 0);
        for points in [0, 1, 2, 7, 59, 60, 100, 299, 300, 301, 311, 700, 1024, 4097, 70_000, 1 << 20] {
            for suns in [0, 1, 3, 40] {
                let kinds = kinds(points, suns);
                for memory_mib in [1, 3, 64, 256, 1000, 4096] {
                    for map_size in [None, Some(16), Some(100), Some(464), Some(1500)] {
                        let options = RendererOptions { memory_mib, map_size, ..Default::default() };
                        let budget = u64::from(memory_mib) << 20;
                        match layout(&kinds, options) {
                            Ok(l) => {
                                sizes += 1;
                                assert!(l.bytes() <= budget, "{points} + {suns} in {memory_mib} MiB");
                                assert!(l.pages <= MAX_PAGES && l.slots.iter().all(|s| s.page < l.pages));
                                let band = |s: &MapSlot| u64::from(s.size.next_multiple_of(64) * MAP_BLOCK);
                                assert!(l.slots.iter().all(|s| l.drawn_texels >= band(s)));
                            }
                            Err(_) => refused += 1,
                        }
                    }
                }
            }
        }
        assert!(sizes > 500 && refused > 500, "{sizes} {refused}");
        // What is beside them is bound in one piece, however large a map is.
        let largest = RendererOptions { memory_mib: 1024, map_size: Some(8192), ..Default::default() };
        let largest = layout(&[true], largest).unwrap();
        assert_eq!((largest.map_size, largest.drawn_texels), (8192, MOST_TEXELS));
        // The control: without a thought for what is beside them, larger maps fit.
        let drawn = layout(&[false; 1024], RendererOptions::default()).unwrap();
        let larger = u64::from(drawn.map_size + 16).pow(2) * 1024 * 4;
        assert!(larger <= 256 << 20, "{larger}");
    }

    #[test]
    fn the_worked_example_holds() {
        let l = layout(&[false; 1024], RendererOptions::default()).unwrap();
        assert_eq!((l.map_size, l.pages, l.page_size), (240, 32, [240, 7680]));
        let size = |lights| layout(&vec![false; lights], RendererOptions::default()).unwrap().map_size;
        assert_eq!([64, 65, 300].map(size), [512, 256, 256]);
        let shown =
            AtlasLayout::new(&[false; 300], true, &RendererOptions::default(), &wgpu::Limits::default());
        assert_eq!(shown.unwrap().map_size, 448);
    }

    #[test]
    fn maps_are_whole_blocks() {
        for (shape, granule) in [(ShadowMap::Octahedral, 16), (ShadowMap::Cube, 32)] {
            for map_size in [None, Some(17), Some(100), Some(464)] {
                let options = RendererOptions { map_size, shadow_map: shape, ..Default::default() };
                let l = layout(&[false, true, false], options).unwrap();
                let wanted = map_size.map_or(l.map_size, |size: u32| size.next_multiple_of(granule));
                assert!(l.map_size.is_multiple_of(granule) && l.map_size == wanted, "{map_size:?}");
            }
        }
    }

    #[test]
    fn what_does_not_fit_is_refused_with_advice_that_helps() {
        let default = RendererOptions::default();
        let remedy = |lights, options| match layout(&vec![false; lights], options) {
            Err(Error::TooLarge { remedy, .. }) => remedy,
            other => panic!("{other:?}"),
        };
        for (lights, map_size) in [(4096, None), (300, Some(1024)), (1000, Some(99))] {
            let few = RendererOptions { memory_mib: 1, map_size, ..default };
            let needed = match (remedy(lights, few), map_size) {
                (Remedy::MemoryOrFewerLights { mib }, None) => mib,
                (Remedy::MemoryOrSmallerMaps { mib }, Some(_)) => mib,
                other => panic!("{other:?}"),
            };
            let given = |memory_mib| layout(&vec![false; lights], RendererOptions { memory_mib, ..few });
            assert!(given(needed as u32).is_ok() && given(needed as u32 - 1).is_err(), "{lights}: {needed}");
        }
        let absurd = |map_size| remedy(1, RendererOptions { map_size: Some(map_size), ..default });
        assert_eq!(absurd(1 << 20), Remedy::MapSize { from: MIN_SIZE, to: MAX_PAGE });
        assert_eq!(absurd(1), Remedy::MapSize { from: MIN_SIZE, to: MAX_PAGE });
        // More pages than there can be, whatever the memory.
        assert_eq!(remedy(300, RendererOptions { map_size: Some(8000), ..default }), Remedy::SmallerMaps);
        assert!(layout(&[false; 4], RendererOptions { map_size: Some(1024), ..default }).is_ok());
    }
}
