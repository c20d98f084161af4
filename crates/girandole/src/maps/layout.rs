//! How the shadow atlas is laid out: equal pages (array layers) of one texture, and the sizes of the maps in it.
//!
//! Every light has room for a map of the regular size, which need and a memory budget decide. Maps may be smaller by halves, or larger
//! by doubles where there is room: all are squares of a power of two of units, at multiples of their own size in a page.
//!
//! Worked example: 1024 lamps under 256 MiB (64 Mi texels) get ⌊√(2²⁶ / 1024)⌋ = 256 texels across at most; as what is beside the maps
//! while they are drawn counts too, they get 240, in 32 pages of 240 × 7680 texels; or 112 or 48, in squares of 120 and 60.

use crate::layout::{Light, Maps};
use crate::settings::{RendererOptions, ShadowMap};
use crate::shader_constants::{LISTED_WORDS, MAP_BLOCK, MAP_LISTED, MAP_LISTS_HEAD};
use crate::{Error, Remedy, Result};

/// Smallest map that is worth drawing.
const MIN_SIZE: u32 = 16;
/// Largest map that is chosen unless asked for: of few lights and of many.
const MAX_CHOSEN: [u32; 2] = [512, 256];
/// Lights that are few.
const FEW: usize = 64;
/// Samples of surfaces that have maps of that size; those of more are smaller, see [`coarseness`].
const MANY: usize = 400;
/// Largest page: what every WebGPU device can hold.
const MAX_PAGE: u32 = 8192;
/// Most pages: what a light's place has room for.
const MAX_PAGES: u32 = 256;
/// Pages are kept narrow as long as there are no more than this.
const WANTED_PAGES: u64 = 32;
/// Texels that are drawn at once at most, but for larger maps: 16 MiB of them.
const MOST_TEXELS: u64 = 4 << 20;
/// Texels that are drawn at once where there are no more and memory suffices: fewer do not keep devices busy.
const FEW_TEXELS: u64 = 1 << 20;
/// Texels beside the maps for each pair of a part and a cluster that is listed at most.
const TEXELS_PER_PAIR: u64 = 4;
/// A directional light's map covers the whole scene: its regular size is so many times that of others, where a page holds that.
const DIRECTIONAL_TILES: u32 = 4;
/// Units across a map of the regular size, unless all maps are to have that.
const REGULAR_UNITS: u32 = 4;

/// How many times as coarse as those of other lights the maps of samples of surfaces may be: edges of their shadows average out, the
/// more of them there are. At 300, maps of 256 and of 448 texels differ by less than a thousandth of FLIP to the path tracer; at 1024,
/// those of 160 and of 240 by a ten-thousandth, and those of 96 by five; at 4096, those of 80 and of 176 by ten.
pub(crate) fn coarseness(lights: &[Light]) -> f32 {
    let samples = lights.iter().filter(|light| light.is_sample()).count();
    (samples as f32 / MANY as f32).sqrt().clamp(1.0, 2.0)
}

/// Texels across the largest map that is chosen for these lights. Those of parallel light show all that is seen: they are not made
/// smaller where there are many.
pub(crate) fn largest_chosen(lights: &[Light]) -> u32 {
    let [of_few, of_many] = MAX_CHOSEN;
    if lights.len() <= FEW || lights.iter().any(Light::is_parallel) {
        return of_few;
    }
    (of_many as f32 / coarseness(lights)) as u32
}

/// A map's place in the atlas.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct MapSlot {
    /// First unit in x and y.
    pub at: [u32; 2],
    /// Page (array layer).
    pub page: u32,
    /// Units across.
    pub span: u32,
}

/// The atlas: its pages, and the sizes of maps.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct AtlasLayout {
    /// Texels of a page in x and y.
    pub page_size: [u32; 2],
    /// How many pages.
    pub pages: u32,
    /// Texels across a map of the regular size.
    pub map_size: u32,
    /// The same if memory did not matter.
    pub wanted_size: u32,
    /// Texels across a unit.
    pub unit: u32,
    /// Units across the regular map of a light, and of one that is directional.
    pub regular: [u32; 2],
    /// The same of the largest maps that are chosen where there is room.
    pub largest: [u32; 2],
    /// What sizes are multiples of.
    granule: u32,
    /// Texels that are drawn at once, beside the maps.
    pub drawn_texels: u64,
}

impl AtlasLayout {
    /// Bytes of the pages, and of what is beside them while maps are drawn.
    pub fn bytes(&self) -> u64 {
        let [width, height] = self.page_size.map(u64::from);
        let texels = u64::from(self.pages) * width * height;
        4 * (texels + self.drawn_texels + list_words(self.drawn_texels, self.pairs()))
    }

    /// Pairs of a part and a cluster that are listed.
    pub fn pairs(&self) -> u64 {
        self.drawn_texels / TEXELS_PER_PAIR
    }

    /// Units of a page in x and y.
    pub fn page_units(&self) -> [u32; 2] {
        self.page_size.map(|texels| texels / self.unit)
    }

    /// Texels across a map of so many units, whole granules.
    pub fn size(&self, span: u32) -> u32 {
        span * self.unit / self.granule * self.granule
    }

    /// The first texel of a map in its page.
    pub fn origin(&self, slot: &MapSlot) -> [u32; 2] {
        slot.at.map(|unit| unit * self.unit)
    }

    /// A slot in the words of the shaders, see `Light.atlas_slot`.
    pub fn word(slot: &MapSlot) -> u32 {
        (slot.page << 24) | (slot.span.ilog2() << 20) | (slot.at[1] << 10) | slot.at[0]
    }

    /// What shaders need to know about the whole atlas.
    pub fn maps(&self) -> Maps {
        // The last one is that of NO_MAP.
        let size = |class: u32| {
            let size = self.size(if class <= MAX_PAGE.ilog2() { 1 << class } else { 1 }) as f32;
            [size, 1.0 / size, 0.0, 0.0]
        };
        Maps {
            page: self.page_size.map(|s| s as f32),
            unit: self.unit,
            padding: 0,
            sizes: std::array::from_fn(|class| size(class as u32)),
        }
    }

    /// Units across a map with at least so many texels across, if it may have that many: from a quarter of the regular size up to so many
    /// units.
    pub fn span(&self, texels: f32, is_large: bool, most: u32) -> u32 {
        if self.regular[0] == 1 {
            return self.regular[usize::from(is_large)];
        }
        let mut span = self.regular[usize::from(is_large)] / REGULAR_UNITS;
        while span < most && (self.size(span) as f32) < texels {
            span *= 2;
        }
        span
    }

    /// Lays out the maps of lights, of which `directional[i]` tells whether light i is a directional one, at most so many texels across.
    ///
    /// # Errors
    /// [`Error::TooLarge`] where the budget or the device's limits do not suffice.
    pub fn new(
        directional: &[bool],
        most: u32,
        options: &RendererOptions,
        limits: &wgpu::Limits,
    ) -> Result<Self> {
        let lights = directional.len();
        let suns = directional.iter().filter(|&&d| d).count();
        let budget = u64::from(options.memory_mib) << 20;
        let max_page = limits.max_texture_dimension_2d.min(MAX_PAGE);
        let max_pages = limits.max_texture_array_layers.min(MAX_PAGES);
        let largest = if options.map_size.is_none() { most } else { 0 };
        let shapes = |size| shapes([lights as u64, suns as u64], [size, largest], max_page, max_pages);
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
        let wanted_size = if options.map_size.is_none() { most.min(max_page) } else { shape.size };
        let layout = AtlasLayout { wanted_size, ..shape.layout(granule, options.map_size.is_none()) };
        let at_once = layout.drawn_texels.max(shape.texels().min(FEW_TEXELS));
        let at_once = AtlasLayout { drawn_texels: at_once, ..layout.clone() };
        Ok(if at_once.bytes() <= budget { at_once } else { layout })
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
    /// How many times as wide the largest maps may be.
    times: u32,
    /// Tiles across a page.
    columns: u32,
    /// Tiles down a page.
    rows: u32,
    pages: u32,
    has_suns: bool,
}

/// Shapes that hold the maps of so many lights and suns, the fewest and largest pages first.
fn shapes(
    counts: [u64; 2],
    [size, largest]: [u32; 2],
    max_page: u32,
    max_pages: u32,
) -> impl Iterator<Item = Shape> {
    let suns = counts[1];
    let per_side = max_page / size;
    let block = 1 << DIRECTIONAL_TILES.min(per_side).ilog2();
    let tiles = tiles(counts, block);
    // Few columns: where textures are stored row by row, the rows of a map then lie close together.
    let times = (1 << (largest / size).max(1).ilog2()).min(1 << (per_side / block).ilog2());
    let least = times * if suns > 0 { block } else { 1 };
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
        Some(Shape { size, block, times, columns, rows, pages, has_suns: suns > 0 })
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

    /// The layout, with maps of several sizes or of the regular one alone.
    fn layout(&self, granule: u32, has_sizes: bool) -> AtlasLayout {
        let &Self { size, block, times, pages, .. } = self;
        let divides = has_sizes && size / REGULAR_UNITS >= granule;
        let regular = if divides { REGULAR_UNITS } else { 1 };
        AtlasLayout {
            page_size: self.page_size(),
            pages,
            map_size: size,
            wanted_size: size,
            unit: size / regular,
            regular: [regular, regular * block],
            largest: [times * regular, times * regular * block],
            granule,
            drawn_texels: self.drawn_texels(),
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader_constants::{COSINE, DISTANT, HEMISPHERE};

    fn layout(directional: &[bool], options: RendererOptions) -> Result<AtlasLayout> {
        let most = MAX_CHOSEN[usize::from(directional.len() > FEW && !directional.contains(&true))];
        AtlasLayout::new(directional, most, &options, &wgpu::Limits::default())
    }

    /// So many points, with suns among them.
    fn kinds(points: usize, suns: usize) -> Vec<bool> {
        let mut kinds = vec![false; points];
        for i in 0..suns {
            kinds.insert(i * points / suns, true);
        }
        kinds
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
                                assert!(l.pages <= MAX_PAGES);
                                let size = l.size(l.regular[usize::from(suns > 0)]);
                                let band = u64::from(size.next_multiple_of(64) * MAP_BLOCK);
                                assert!(l.drawn_texels >= band);
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
    fn small_atlases_are_drawn_at_once_where_memory_suffices() {
        let drawn = |memory_mib| {
            let options = RendererOptions { memory_mib, map_size: Some(64), ..Default::default() };
            layout(&[false; 256], options).unwrap().drawn_texels
        };
        let all = 256 * 64 * 64;
        assert_eq!([6, 12, 256].map(drawn), [all / 4, all, all]);
    }

    #[test]
    fn the_worked_example_holds() {
        let l = layout(&[false; 1024], RendererOptions::default()).unwrap();
        assert_eq!((l.map_size, l.pages, l.page_size), (240, 32, [240, 7680]));
        let size = |lights| layout(&vec![false; lights], RendererOptions::default()).unwrap().map_size;
        assert_eq!([64, 65, 300].map(size), [512, 256, 256]);
        let shown =
            AtlasLayout::new(&[false; 300], 512, &RendererOptions::default(), &wgpu::Limits::default());
        assert_eq!(shown.unwrap().map_size, 448);
    }

    #[test]
    fn maps_of_many_samples_are_smaller_and_those_of_lamps_and_skies_are_not() {
        let of = |profile, count| largest_chosen(&vec![Light { profile, ..Light::default() }; count]);
        let all = |count| [COSINE, HEMISPHERE, DISTANT].map(|profile| of(profile, count));
        assert_eq!([64, 400, 9999].map(all), [[512; 3], [256, 256, 512], [128, 256, 512]]);
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
