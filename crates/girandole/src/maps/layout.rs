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
const WANTED_PAGES: u32 = 32;
/// Texels that are drawn at once at most, but for larger maps: 16 MiB of them.
const MOST_TEXELS: u64 = 4 << 20;
/// Texels that are drawn at once where there are so many and memory suffices, as any regular map is: fewer do not keep devices busy.
const FEW_TEXELS: u64 = 1 << 20;
/// Texels beside the maps for each pair of a part and a cluster that is listed at most.
const TEXELS_PER_PAIR: u64 = 4;
/// A large map shows all that is seen, of a sun or of a part of a sky: its regular size is one of so many times that of others, where a page
/// holds that.
const LARGE_TILES: [u32; 3] = [1, 2, 4];
/// Large maps are so much smaller at most than they could be, where others are finer then.
const LARGE_ENOUGH: f32 = 0.875;
/// Units across a map of the regular size, unless all maps are to have that.
const REGULAR_UNITS: u32 = 4;

/// How many times as coarse as those of other lights the maps of samples of surfaces may be: edges of their shadows average out, the
/// more of them there are. At 300, maps of 256 and of 448 texels differ by less than a thousandth of FLIP to the path tracer; at 1024,
/// those of 160 and of 240 by a ten-thousandth, and those of 96 by five; at 4096, those of 80 and of 176 by ten.
pub(crate) fn coarseness(lights: &[Light]) -> f32 {
    let samples = lights.iter().filter(|light| light.is_sample()).count();
    (samples as f32 / MANY as f32).sqrt().clamp(1.0, 2.0)
}

/// Texels across the largest map that is chosen for these lights, but for large ones. A sun's, those of a sky of many samples, and those of
/// few lights beside a sky are not made smaller where there are many.
pub(crate) fn largest_chosen(lights: &[Light]) -> u32 {
    let [of_few, of_many] = MAX_CHOSEN;
    let others = lights.iter().filter(|light| !light.has_large_map()).count();
    if lights.len() <= FEW
        || (1..=FEW).contains(&others)
        || lights.iter().any(|light| light.shows_square() || light.is_parallel() && !light.has_large_map())
    {
        return of_few;
    }
    (of_many as f32 / coarseness(lights)) as u32
}

/// A map's place in the atlas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct MapSlot {
    /// First unit in x and y.
    pub at: [u32; 2],
    /// Page (array layer).
    pub page: u32,
    /// Units across.
    pub span: u32,
}

/// The atlas: its pages, and the sizes of maps.
#[derive(Clone, Debug)]
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
    /// Units across the regular map of a light, and a large one.
    pub regular: [u32; 2],
    /// The same of the largest maps that are chosen where there is room.
    pub largest: [u32; 2],
    /// The smallest size, of which others are multiples.
    least: u32,
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

    /// How many maps of so many units across a page holds in x and y.
    pub fn per_page(&self, span: u32) -> [u32; 2] {
        self.page_size.map(|texels| texels / self.unit / span)
    }

    /// Whether maps of so many units across all have room at once. The larger ones come first: what they leave is whole places for smaller
    /// ones.
    pub fn holds(&self, spans: &[u32]) -> bool {
        let mut spans: Vec<u32> = spans.iter().copied().filter(|span| *span > 0).collect();
        spans.sort_unstable_by(|a, b| b.cmp(a));
        let mut units = 0;
        spans.into_iter().all(|span| {
            let [columns, rows] = self.per_page(span).map(u64::from);
            let area = u64::from(span).pow(2);
            units += area;
            units <= u64::from(self.pages) * columns * rows * area
        })
    }

    /// Texels across a map of so many units.
    pub fn size(&self, span: u32) -> u32 {
        span * self.unit / self.least * self.least
    }

    /// Texels across a large map of the regular size.
    fn large_size(&self) -> u32 {
        self.size(self.regular[1])
    }

    /// A slot in the words of the shaders, see `Light.atlas_slot`.
    pub fn word(slot: &MapSlot) -> u32 {
        (slot.page << 24) | (slot.span.ilog2() << 20) | (slot.at[1] << 10) | slot.at[0]
    }

    /// What shaders need to know about the whole atlas.
    pub fn maps(&self) -> Maps {
        let sizes = std::array::from_fn(|class| {
            // The last one is that of NO_MAP.
            let size = self.size(if class as u32 <= MAX_PAGE.ilog2() { 1 << class } else { 1 }) as f32;
            [size, 1.0 / size, 0.0, 0.0]
        });
        Maps { page: self.page_size.map(|s| s as f32), unit: self.unit, padding: 0, sizes }
    }

    /// Units across a map with at least so many texels across, if it may have that many: from the smallest map up to so many units. 0 for
    /// no texels.
    pub fn span(&self, texels: f32, is_large: bool, most: [u32; 2]) -> u32 {
        if texels <= 0.0 {
            return 0;
        }
        let kind = usize::from(is_large);
        let mut span = self.regular[kind] / self.regular[0];
        while span < most[kind] && (self.size(span) as f32) < texels {
            span *= 2;
        }
        span
    }

    /// Lays out the maps of lights, of which `large[i]` tells whether light i has a large one, at most so many texels across.
    ///
    /// # Errors
    /// [`Error::TooLarge`] where the budget or the device's limits do not suffice.
    pub fn new(large: &[bool], most: u32, options: &RendererOptions, limits: &wgpu::Limits) -> Result<Self> {
        let max_page = limits.max_texture_dimension_2d.min(MAX_PAGE);
        let max_pages = limits.max_texture_array_layers.min(MAX_PAGES);
        // Parts are drawn in whole blocks, in each of which maps are linear.
        let granule = MAP_BLOCK * if options.shadow_map == ShadowMap::Cube { 4 } else { 2 };
        let [least, most] = match options.map_size {
            Some(size) if size < MIN_SIZE || size > max_page => {
                let what = format!("shadow maps of {size}² texels are not possible here");
                return Err(Error::too_large(what, Remedy::MapSize { from: MIN_SIZE, to: max_page }));
            }
            Some(size) => [size.next_multiple_of(granule).min(max_page); 2],
            None => [granule, most.min(max_page)],
        };
        let suns = large.iter().filter(|&&d| d).count();
        let counts = [large.len() - suns, suns].map(|count| count as u32);
        let with_suns =
            |suns, size, tiles| layouts([counts[0], suns], [least, size, most], [max_page, max_pages], tiles);
        // Where there is memory, each sun has room for two maps: two views in turn see other parts of the scene.
        let of_size =
            |size, tiles| with_suns(2 * counts[1], size, tiles).chain(with_suns(counts[1], size, tiles));
        let budget = u64::from(options.memory_mib) << 20;
        let of_tiles = |tiles| {
            (least..most + 1).step_by(least as usize).rev().flat_map(move |size| of_size(size, tiles))
        };
        let fitting: Vec<Self> = LARGE_TILES
            .into_iter()
            .filter_map(|tiles| of_tiles(tiles).find(|layout| layout.bytes() <= budget))
            .collect();
        let widest = fitting.iter().map(Self::large_size).max().unwrap_or(0) as f32;
        let least_wide = if counts[0] > 0 { LARGE_ENOUGH * widest } else { widest };
        let large_enough = fitting.into_iter().filter(|layout| layout.large_size() as f32 >= least_wide);
        large_enough.max_by_key(|layout| layout.map_size).ok_or_else(|| {
            let mib = of_size(least, 1).map(|layout| layout.bytes().div_ceil(1 << 20)).min();
            let remedy = match (mib, options.map_size) {
                (Some(mib), Some(_)) => Remedy::MemoryOrSmallerMaps { mib },
                (Some(mib), None) => Remedy::MemoryOrFewerLights { mib },
                (None, Some(_)) => Remedy::SmallerMaps,
                (None, None) => Remedy::FewerLights,
            };
            let needs = mib.map_or(format!("more than {max_pages} pages"), |mib| format!("{mib} MiB"));
            let lights = large.len();
            Error::too_large(format!("{lights} shadow maps of {least}² texels need {needs}"), remedy)
        })
    }
}

/// Layouts for so many points and suns (lights with large maps), in pages of whole tiles: regular maps of `size` texels across. Maps may have
/// from `least` texels, of which all sizes are multiples, up to `most`; large ones are so many tiles across where pages hold that. The fewest and largest pages come first.
fn layouts(
    [points, suns]: [u32; 2],
    [least, size, most]: [u32; 3],
    [max_page, max_pages]: [u32; 2],
    large_tiles: u32,
) -> impl Iterator<Item = AtlasLayout> {
    let per_side = max_page / size;
    // A sun's map is so many tiles across; the largest maps are so many times as wide as regular ones.
    let block = 1 << large_tiles.min(per_side).ilog2();
    let times = 1 << (most / size).min(per_side / block).ilog2();
    let widest = if suns > 0 { block } else { 1 };
    let regular = if size / REGULAR_UNITS >= least { REGULAR_UNITS } else { 1 };
    let tiles = (points + suns * block.pow(2)).max(1);
    // Few columns: where textures are stored row by row, the rows of a map then lie close together.
    let strips = tiles.div_ceil(per_side);
    let fewest = strips.div_ceil(strips.div_ceil(WANTED_PAGES).clamp(times * widest, per_side));
    let shapes = (fewest..=max_pages).map(move |pages| {
        let share = tiles.div_ceil(pages);
        let columns = share.div_ceil(per_side).max(times * widest);
        [columns, share.div_ceil(columns).max(times * widest), pages]
    });
    let holds_suns =
        move |[columns, rows, pages]: &[u32; 3]| columns / block * (rows / block) * pages >= suns;
    shapes.filter(holds_suns).flat_map(move |[columns, rows, pages]| {
        let page_size = [columns, rows].map(|tiles| tiles * size);
        let texels = page_size.map(u64::from).iter().product::<u64>() * u64::from(pages);
        // A whole regular map has room then, in rows of whole 256 bytes; a quarter of many has room for bands of rows.
        let across = widest * size;
        let at_once = FEW_TEXELS.min(texels).max(u64::from(across * across.next_multiple_of(64)));
        [at_once, texels / 4].map(|drawn_texels| AtlasLayout {
            page_size,
            pages,
            map_size: size,
            wanted_size: most,
            unit: size / regular,
            regular: [regular, regular * block],
            largest: [times * regular, times * regular * block],
            least,
            drawn_texels: drawn_texels.max(texels / 4).min(MOST_TEXELS),
        })
    })
}

/// Words of `lists` (lib/map_lists.wgsl), the parts as small as they can be.
pub(crate) fn list_words(texels: u64, pairs: u64) -> u64 {
    let least = u64::from(MAP_BLOCK * wgpu::COPY_BYTES_PER_ROW_ALIGNMENT / 4);
    let listed = texels / u64::from(MAP_LISTED) * u64::from(LISTED_WORDS);
    u64::from(MAP_LISTS_HEAD) + texels / least + listed + pairs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader_constants::{COSINE, DISTANT, HEMISPHERE};
    use girandole_core::glam::Vec4;

    fn layout(large: &[bool], options: RendererOptions) -> Result<AtlasLayout> {
        let most = MAX_CHOSEN[usize::from(large.len() > FEW && !large.contains(&true))];
        AtlasLayout::new(large, most, &options, &wgpu::Limits::default())
    }

    #[test]
    fn everything_stays_within_the_budget_and_has_room() {
        let (mut laid_out, mut refused) = (0, 0);
        let points = [0, 1, 2, 7, 60, 100, 299, 300, 301, 700, 1024, 4097, 70_000, 1 << 20];
        let suns = [0, 1, 3, 40];
        for (points, suns) in points.into_iter().flat_map(|points| suns.map(|suns| (points, suns))) {
            let kinds: Vec<bool> = (0..points + suns).map(|i| i < suns).collect();
            for memory_mib in [1, 3, 64, 256, 1000, 4096] {
                for map_size in [None, Some(16), Some(100), Some(464), Some(1500), Some(8192)] {
                    let shadow_map = [ShadowMap::Octahedral, ShadowMap::Cube][points % 2];
                    let options = RendererOptions { memory_mib, map_size, shadow_map, ..Default::default() };
                    let Ok(l) = layout(&kinds, options) else {
                        refused += 1;
                        continue;
                    };
                    laid_out += 1;
                    let case = format!("{points} + {suns} in {memory_mib} MiB: {l:?}");
                    assert!(l.bytes() <= u64::from(memory_mib) << 20 && l.pages <= MAX_PAGES, "{case}");
                    let granule = [16, 32][points % 2];
                    let wanted = map_size.map_or(l.map_size, |size| size.next_multiple_of(granule));
                    assert!(l.map_size.is_multiple_of(granule) && l.map_size == wanted, "{case}");
                    // Beside them is room for a band of any map, and it is bound in one piece.
                    let largest = l.size(l.largest[usize::from(suns > 0)]);
                    let band = u64::from(largest.next_multiple_of(64) * MAP_BLOCK);
                    assert!((band..=MOST_TEXELS).contains(&l.drawn_texels), "{case}");
                    let regular: Vec<u32> = kinds.iter().map(|&sun| l.regular[usize::from(sun)]).collect();
                    assert!(l.holds(&regular) && l.page_size.iter().all(|side| *side >= largest), "{case}");
                }
            }
        }
        assert!(laid_out > 500 && refused > 500, "{laid_out} {refused}");
    }

    #[test]
    fn large_maps_are_only_as_much_larger_than_others_as_there_is_room_for() {
        let of = |memory_mib, map_size| {
            let options = RendererOptions { memory_mib, map_size, ..Default::default() };
            layout(&[true; 256], options).map(|l| (l.map_size, l.regular[1] / l.regular[0])).ok()
        };
        assert_eq!(
            [64, 128, 256].map(|size| of(256, Some(size))),
            [Some((64, 4)), Some((128, 2)), Some((256, 1))]
        );
        assert_eq!((of(2, None).map(|(_, times)| times), of(1, Some(256))), (Some(1), None));
        // Where nearly all are large, the others are as fine as costs these nothing.
        let mostly_large: Vec<bool> = (0..300).map(|light| light >= 7).collect();
        let l = layout(&mostly_large, RendererOptions::default()).unwrap();
        assert_eq!((l.large_size(), l.map_size), (448, 448));
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
        // Without a thought for what is beside them, larger maps fit.
        assert!(u64::from(l.map_size + 16).pow(2) * 1024 * 4 <= 256 << 20);
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
        // Of few samples of a sky, each has a large one.
        let of_sky = Light { profile: DISTANT, rectangle: Vec4::W, ..Light::default() };
        assert_eq!((largest_chosen(&[of_sky; 200]), of_sky.has_large_map()), (256, true));
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
                (Remedy::MemoryOrFewerLights { mib }, None)
                | (Remedy::MemoryOrSmallerMaps { mib }, Some(_)) => mib,
                other => panic!("{other:?}"),
            };
            let given = |memory_mib| layout(&vec![false; lights], RendererOptions { memory_mib, ..few });
            assert!(given(needed as u32).is_ok() && given(needed as u32 - 1).is_err(), "{lights}: {needed}");
        }
        let of_size = |lights, size| remedy(lights, RendererOptions { map_size: Some(size), ..default });
        let possible = Remedy::MapSize { from: MIN_SIZE, to: MAX_PAGE };
        assert_eq!([1 << 20, 1].map(|size| of_size(1, size)), [possible; 2]);
        // More pages than there can be, whatever the memory.
        assert_eq!(of_size(300, 8000), Remedy::SmallerMaps);
        assert!(layout(&[false; 4], RendererOptions { map_size: Some(1024), ..default }).is_ok());
    }
}
