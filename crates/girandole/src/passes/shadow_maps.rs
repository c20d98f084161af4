//! Shadow maps: those parts of them that are stale, ray cast at their texels' centres.
//!
//! Parts are drawn in batches, as many as have room beside the maps; larger parts, by bands of rows. For opaque occluders, then
//! for alpha-masked ones: 1. A lane a triangle: which clusters may cover a texel of the part, and of those the triangles that are
//! small there, the nearest of each texel by an atomic maximum beside the maps; large ones are listed. 2. What had no room in a
//! list: workgroups by the cluster, as many as the first pass found. 3. A workgroup for 64 x 64 texels: the listed triangles that
//! touch its blocks, merged by lanes that have two rows of a block each. Last, copies to the atlas. A maximum does not depend on the
//! order, nor on how parts are cut or batched: all is the same to the bit.

use crate::Result;
use crate::device::buffers::{storage, uniform};
use crate::device::kernel::{Groups, Kernel, Shared, buffer, order_all};
use crate::device::recorder::Recorder;
use crate::layout::{Frame, Light, MapOccluders, MapPart};
use crate::maps::atlas::{Atlas, MapsView};
use crate::maps::cache::{MapCache, MapUpdate};
use crate::maps::map_view::TexelRect;
use crate::maps::occluders::CLUSTER;
use crate::resident::Resident;
use crate::settings::RendererOptions;
use crate::shader_constants::{
    LISTED_WORDS, MAP_ACROSS, MAP_BLOCK, MAP_CLUSTERS, MAP_LISTED, MAP_LISTS_HEAD, MAP_SLICE, WORKGROUP,
};
use crate::shaders::{self, Source};
use crate::tier::Tier;

/// The unit of stored depth: a map holds this over the distance. Nothing nearer to a light blocks it.
pub(crate) const NEAR: f64 = 1e-6;

/// Texels of a part at most, but for eight rows: 512 × 512.
const MOST_PART_TEXELS: u64 = 1 << 18;

/// What `are_hidden` of `lib/map_set_up.wgsl` looks at are two words.
const _: () = assert!(MAP_CLUSTERS == 64);

const PART_WORDS: u32 = (size_of::<MapPart>() / 4) as u32;

/// Words that tell which clusters are hidden from a batch's lights: 16 MiB.
const MOST_HIDDEN_WORDS: usize = 1 << 22;

pub(crate) struct ShadowMaps {
    /// Of opaque and of masked occluders.
    sets: [Kernels; 2],
    /// Large triangles of a part that are listed, of each.
    most_listed: [u32; 2],
}

struct Kernels {
    small: Kernel,
    large: Kernel,
    merge: Kernel,
}

/// What bounds the work of workgroups: some devices end an invocation after 65 535 steps of loops.
#[derive(Clone, Copy)]
struct Bounds {
    /// Large triangles of a part that are listed. For each 128 that touch all blocks of a workgroup, lanes that merge them take 1500 steps at
    /// most (eight lanes 9600: two blocks at a time, of which one may be covered where the other is cut), for masked ones 9500.
    most_listed: u32,
    /// Lanes of a workgroup that looks for small triangles among 2048, each of which takes 400 steps at most, and of one that merges
    /// large ones.
    lanes: [u32; 2],
}

impl Bounds {
    /// For opaque occluders and for masked ones. At each barrier software devices switch from one vector of lanes to the next, which
    /// takes longer than most of what is between: there, opaque ones have one or two vectors.
    fn of(tier: Tier) -> [Self; 2] {
        let gpu = |most_listed| Self { most_listed, lanes: [WORKGROUP; 2] };
        [tier.choose(gpu(4096), Self { most_listed: 640, lanes: [16, 8] }), gpu(512)]
    }
}

/// Parts of maps that are drawn at once, and the lights that they are of.
#[derive(Default)]
struct Batch {
    parts: Vec<MapPart>,
    lights: Vec<u32>,
    /// Taken beside the maps.
    texels: u32,
    /// Of a part and a cluster, that triangles without room in a list may need.
    pairs: u64,
}

impl ShadowMaps {
    pub fn new(device: &wgpu::Device, shared: &Shared, options: &RendererOptions) -> Self {
        let bounds = Bounds::of(shared.kernels.tier);
        let kernels = |set: usize, [small, large, merge]: [&'static Source; 3]| {
            let Bounds { most_listed, lanes } = bounds[set];
            let kernel = |source, entry, lanes| {
                let constants = [
                    ("PARAMETERISATION", f64::from(options.shadow_map as u32)),
                    ("NEAR", NEAR),
                    ("CLUSTER", f64::from(CLUSTER)),
                    ("MOST_LISTED", f64::from(most_listed)),
                    ("MAP_LANES", f64::from(lanes)),
                ];
                Kernel::new(device, shared, source, entry, &constants)
            };
            Kernels {
                small: kernel(small, "small_triangles", lanes[0]),
                large: kernel(large, "large_triangles", WORKGROUP),
                merge: kernel(merge, "merge_large_triangles", lanes[1]),
            }
        };
        let opaque =
            [&shaders::SMALL_MAP_TRIANGLES, &shaders::LARGE_MAP_TRIANGLES, &shaders::MERGE_LARGE_TRIANGLES];
        let masked = [
            &shaders::SMALL_MAP_TRIANGLES_MASKED,
            &shaders::LARGE_MAP_TRIANGLES_MASKED,
            &shaders::MERGE_LARGE_TRIANGLES_MASKED,
        ];
        Self {
            sets: [kernels(0, opaque), kernels(1, masked)],
            most_listed: bounds.map(|bounds| bounds.most_listed),
        }
    }

    /// Orders what every scene needs, see [`Kernel::order`].
    pub fn order(&self, shared: &Shared) -> bool {
        order_all([&self.sets[0].small, &self.sets[0].merge], shared)
    }

    /// Draws parts of maps. Nothing else changes: what else is in these maps is as it would be drawn again.
    ///
    /// # Errors
    /// [`crate::Error::TooLarge`] where a list exceeds the device's limits.
    pub fn record<'a>(
        &self,
        recorder: &mut Recorder,
        scene: &'a Resident,
        updates: &[MapUpdate],
    ) -> Result<MapsView<'a>> {
        let Resident { lights, atlas, .. } = scene;
        lights.record(recorder.encoder());
        let mut batch = Batch::default();
        let drawn_texels = atlas.cache.layout().drawn_texels;
        let parts = updates.iter().flat_map(|update| {
            let whole = part(&lights.samples[update.light as usize], &atlas.cache, update);
            whole.into_iter().flat_map(|part| bands(part, drawn_texels)).map(|part| (update.light, part))
        });
        for (light, part) in parts {
            let texels = texel_count(&part);
            let pairs = (0..2).map(|set| atlas.pairs(set, self.listed_room(&part, set))).max().unwrap_or(0);
            let hidden = (batch.parts.len() + 1) * atlas.hidden_words(0).max(atlas.hidden_words(1));
            let has_room = hidden <= MOST_HIDDEN_WORDS
                && u64::from(batch.texels + texels) <= drawn_texels
                && batch.pairs + pairs <= atlas.pairs;
            if !batch.parts.is_empty() && !has_room {
                self.draw(recorder, scene, std::mem::take(&mut batch))?;
                recorder.split();
            }
            batch.parts.push(MapPart { texels: batch.texels, ..part });
            batch.lights.push(light);
            batch.texels += texels;
            batch.pairs += pairs;
        }
        if !batch.parts.is_empty() {
            self.draw(recorder, scene, batch)?;
        }
        Ok(atlas.view())
    }

    /// Large triangles that a part has room for in a list, see `lib/map_lists.wgsl`.
    fn listed_room(&self, part: &MapPart, set: usize) -> u32 {
        (size(part).iter().product::<u32>() / MAP_LISTED).min(self.most_listed[set])
    }

    fn draw(&self, recorder: &mut Recorder, scene: &Resident, mut batch: Batch) -> Result<()> {
        let nearest = &scene.atlas.nearest;
        recorder.encoder().clear_buffer(nearest, 0, Some(u64::from(batch.texels) * 4));
        let first = MAP_LISTS_HEAD + batch.parts.len() as u32;
        for part in &mut batch.parts {
            part.first_listed = first + part.texels / MAP_LISTED * LISTED_WORDS;
        }
        for set in 0..2 {
            self.draw_set(recorder, scene, &mut batch, set)?;
        }
        copy(recorder, &scene.atlas, &batch.parts);
        Ok(())
    }

    /// Draws opaque or masked occluders.
    fn draw_set(
        &self,
        recorder: &mut Recorder,
        scene: &Resident,
        batch: &mut Batch,
        set: usize,
    ) -> Result<()> {
        let Resident { atlas, hidden, .. } = scene;
        let clusters = atlas.occluders.sets()[set];
        if clusters.bounds.is_empty() {
            return Ok(());
        }
        let device = recorder.device;
        let count = batch.parts.len() as u32;
        let (mut words, mut bits) = (Vec::new(), Vec::new());
        for (part, &light) in batch.parts.iter_mut().zip(&batch.lights) {
            part.hidden = count * PART_WORDS + bits.len() as u32;
            bits.extend(atlas.hidden(set, light, hidden));
            words.extend_from_slice(bytemuck::cast_slice(&[*part]));
        }
        words.extend(bits);
        words.resize(words.len().next_multiple_of(4), 0);
        let most = |of: &dyn Fn(&MapPart) -> u32| batch.parts.iter().map(of).max().unwrap_or(0);
        let blocks = most(&|part| size(part).map(|n| n / MAP_BLOCK).iter().product());
        let merged = most(&|part| size(part).map(|n| n.div_ceil(MAP_ACROSS * MAP_BLOCK)).iter().product());
        let head = MapOccluders {
            clusters: clusters.bounds.len() as u32,
            first_pair: MAP_LISTS_HEAD + count + batch.texels / MAP_LISTED * LISTED_WORDS,
            slices: blocks.div_ceil(MAP_SLICE),
        };
        let parts = storage::<u32>(device, "parts of maps", &words)?;
        let head = uniform(device, "batch of maps", bytemuck::bytes_of(&head));
        let resources = [
            buffer("parts", &parts),
            buffer("occluders", &atlas.sets[set]),
            buffer("batch", &head),
            buffer("nearest", &atlas.nearest),
            buffer("lists", &atlas.lists),
        ];
        recorder.encoder().clear_buffer(&atlas.lists, 0, Some(u64::from(MAP_LISTS_HEAD + count) * 4));
        let Kernels { small, large, merge } = &self.sets[set];
        let nothing = Frame::default();
        let mut record = |kernel: &Kernel, groups| {
            let bound = (&nothing, Some(&scene.geometry.group));
            kernel.record(recorder, bound, "shadow_maps_gpu_ms", &resources, groups);
        };
        record(small, Groups::Count([(clusters.bounds.len() as u32).div_ceil(MAP_CLUSTERS), count]));
        if batch.pairs > 0 {
            record(large, Groups::Indirect(&atlas.lists, 0));
        }
        record(merge, Groups::Count([merged, count]));
        Ok(())
    }
}

/// Copies parts from beside the maps to them.
fn copy(recorder: &mut Recorder, atlas: &Atlas, parts: &[MapPart]) {
    // Neighbours in one: pages that are copied as a whole need not be emptied before.
    let is_below = |above: &MapPart, below: &MapPart| {
        above.page == below.page
            && corner(below) == [corner(above)[0], corner(above)[1] + size(above)[1]]
            && size(above)[0] == size(below)[0]
    };
    for run in parts.chunk_by(is_below) {
        let layout = wgpu::TexelCopyBufferLayout {
            offset: u64::from(run[0].texels) * 4,
            bytes_per_row: Some(stride(size(&run[0])) * 4),
            rows_per_image: None,
        };
        let [x, y] = corner(&run[0]);
        let target = wgpu::TexelCopyTextureInfo {
            origin: wgpu::Origin3d { x, y, z: run[0].page },
            ..atlas.texture.as_image_copy()
        };
        let height = run.iter().map(|part| size(part)[1]).sum();
        let copied = wgpu::Extent3d { width: size(&run[0])[0], height, depth_or_array_layers: 1 };
        let source = wgpu::TexelCopyBufferInfo { buffer: &atlas.nearest, layout };
        recorder.encoder().copy_buffer_to_texture(source, target, copied);
    }
}

/// Columns and rows.
fn size(part: &MapPart) -> [u32; 2] {
    [0, 1].map(|i| part.end[i] - part.first[i])
}

/// The first texel in its page.
fn corner(part: &MapPart) -> [u32; 2] {
    [0, 1].map(|i| part.origin[i] + part.first[i])
}

/// Texels of a row beside the maps, see `lib/map_parts.wgsl`.
fn stride([width, _]: [u32; 2]) -> u32 {
    width.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT / 4)
}

/// Texels beside the maps.
fn texel_count(part: &MapPart) -> u32 {
    stride(size(part)) * size(part)[1]
}

/// A part in pieces that have room beside the maps, and in lists for what is large there: bands of rows.
fn bands(part: MapPart, room: u64) -> impl Iterator<Item = MapPart> {
    let rows = room.min(MOST_PART_TEXELS) as u32 / stride(size(&part));
    let most_rows = (rows / MAP_BLOCK * MAP_BLOCK).max(MAP_BLOCK);
    (part.first[1]..part.end[1]).step_by(most_rows as usize).map(move |row| MapPart {
        first: [part.first[0], row],
        end: [part.end[0], part.end[1].min(row + most_rows)],
        ..part
    })
}

/// A part of a light's map, in whole blocks, without its places beside the maps; nothing where it has no place.
fn part(light: &Light, cache: &MapCache, update: &MapUpdate) -> Option<MapPart> {
    let (size, origin, page) = cache.texels(&cache.slot(update.light as usize)?);
    let TexelRect { first, end } = update.part.in_blocks(MAP_BLOCK);
    let is_parallel = light.is_parallel();
    let (across, deep) = if is_parallel { (light.scale, 0.5 * light.offset) } else { (1.0, 1.0) };
    Some(MapPart {
        position: light.position,
        parallel: if is_parallel { 1.0 + light.rectangle.z } else { 0.0 },
        x: light.tangent * across,
        y: light.normal.cross(light.tangent) * across,
        z: light.normal * deep,
        size,
        first,
        end,
        origin,
        page,
        ..MapPart::default()
    })
}
