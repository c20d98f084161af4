//! Shadow maps: those parts of them that are stale, ray cast at their texels' centres.
//!
//! Parts are drawn in batches, as many as have room beside the maps. 1. A lane a triangle: which clusters may cover a texel of the
//! part, and of those the triangles that are small there, the nearest of each texel by an atomic maximum beside the maps; large
//! ones are listed, 128 a part. 2. What has no room in a list, and alpha-masked large triangles: workgroups by the cluster, as many as
//! the first pass found. 3. Lanes have eight texels each: the nearest of what is beside the maps and of the listed triangles goes
//! to the atlas. A maximum does not depend on the order, nor on how parts are cut or batched: all is the same to the bit.

use crate::Result;
use crate::device::buffers::{storage, uniform};
use crate::device::kernel::{Groups, Kernel, Shared, buffer, order_all};
use crate::device::recorder::Recorder;
use crate::layout::{Frame, Light, MapOccluders, MapPart};
use crate::maps::atlas::MapsView;
use crate::maps::layout::MapSlot;
use crate::maps::map_view::TexelRect;
use crate::maps::occluders::CLUSTER;
use crate::maps::states::MapUpdate;
use crate::resident::Resident;
use crate::settings::{RendererOptions, ShadowMap};
use crate::shader_constants::{
    MAP_ACROSS, MAP_BLOCK, MAP_CLUSTERS, MAP_LISTED, MAP_LISTS_HEAD, MAP_SLICE, OWNER_VECTORS,
};
use crate::shaders;

/// The unit of stored depth: a map holds this over the distance. Nothing nearer to a light blocks it.
pub(crate) const NEAR: f64 = 1e-6;

pub(crate) struct ShadowMaps {
    /// Of opaque and of masked occluders.
    small: [Kernel; 2],
    large: [Kernel; 2],
    merge: Kernel,
    /// Whether straight lines are straight in maps.
    is_straight: bool,
}

impl ShadowMaps {
    pub fn new(device: &wgpu::Device, shared: &Shared, options: &RendererOptions) -> Self {
        let constants = [
            ("PARAMETERISATION", f64::from(options.shadow_map as u32)),
            ("NEAR", NEAR),
            ("CLUSTER", f64::from(CLUSTER)),
        ];
        let kernel = |source, entry| Kernel::new(device, shared, source, entry, &constants);
        Self {
            small: [&shaders::SMALL_MAP_TRIANGLES, &shaders::SMALL_MAP_TRIANGLES_MASKED]
                .map(|source| kernel(source, "small_triangles")),
            large: [&shaders::LARGE_MAP_TRIANGLES, &shaders::LARGE_MAP_TRIANGLES_MASKED]
                .map(|source| kernel(source, "large_triangles")),
            merge: kernel(&shaders::MERGE_LARGE_TRIANGLES, "merge_large_triangles"),
            is_straight: options.shadow_map != ShadowMap::Parabolic,
        }
    }

    /// Orders what every scene needs, see [`Kernel::order`].
    pub fn order(&self, shared: &Shared) -> bool {
        order_all([&self.small[0], &self.large[0], &self.merge], shared)
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
        let used = |set: &usize| *set == 0 || !atlas.occluders.sets()[*set].bounds.is_empty();
        let most = (0..2).filter(used).map(|set| atlas.sets[set].parts).min().unwrap_or(1);
        let owners = (0..2).map(|set| atlas.owner_vectors(set)).max().unwrap_or(0).max(1);
        let most = (most.min(atlas.layout.drawn_parts) as usize).min(OWNER_VECTORS as usize / owners);
        let (mut batch, mut texels) = (Vec::new(), 0);
        for update in updates {
            let light = update.light as usize;
            let new = MapPart { texels, ..part(&lights.samples[light], &atlas.layout.slots[light], update) };
            if !batch.is_empty()
                && (batch.len() == most || u64::from(texels + texel_count(&new)) > atlas.layout.drawn_texels)
            {
                self.draw(recorder, scene, &batch)?;
                recorder.split();
                (batch, texels) = (Vec::new(), 0);
            }
            batch.push((
                update.light,
                MapPart { texels, first_set_up: batch.len() as u32 * MAP_LISTED * 4, ..new },
            ));
            texels += texel_count(&new);
        }
        if !batch.is_empty() {
            self.draw(recorder, scene, &batch)?;
        }
        Ok(atlas.view())
    }

    /// Draws parts of lights' maps that have room beside the maps.
    fn draw(&self, recorder: &mut Recorder, scene: &Resident, batch: &[(u32, MapPart)]) -> Result<()> {
        let Resident { lights, atlas, hidden, .. } = scene;
        let device = recorder.device;
        let (nothing, time) = (Frame::default(), "shadow_maps_gpu_ms");
        let mut parts: Vec<MapPart> = batch.iter().map(|(_, part)| *part).collect();
        let texels: u32 = parts.iter().map(texel_count).sum();
        recorder.encoder().clear_buffer(&atlas.nearest, 0, Some(u64::from(texels) * 4));
        let most = |of: &dyn Fn(&MapPart) -> u32| parts.iter().map(of).max().unwrap_or(0);
        let blocks = most(&|part| size(part).map(|n| n / MAP_BLOCK).iter().product());
        let merged = most(&|part| size(part).map(|n| n.div_ceil(MAP_ACROSS * MAP_BLOCK)).iter().product());
        let count = parts.len() as u32;
        let mut of_opaque = None;
        for (set, occluders) in atlas.occluders.sets().into_iter().enumerate() {
            if set > 0 && occluders.bounds.is_empty() {
                continue;
            }
            let mut states = Vec::new();
            for (part, (index, _)) in parts.iter_mut().zip(batch) {
                part.owners = states.len() as u32 / 4;
                let light = &lights.samples[*index as usize];
                let is_straight = self.is_straight || light.is_parallel();
                states.extend(atlas.owner_states(set, (*index, light), hidden, is_straight));
            }
            let list = storage(device, "parts of maps", &parts)?;
            states.resize(4 * OWNER_VECTORS as usize, 0);
            let states = uniform(device, "objects", bytemuck::cast_slice(&states));
            let batch = MapOccluders {
                clusters: occluders.bounds.len() as u32,
                first_moving: occluders.first_dynamic() as u32,
                parts: count,
                slices: blocks.div_ceil(MAP_SLICE),
            };
            let batch = uniform(device, "batch of maps", bytemuck::bytes_of(&batch));
            let gpu = &atlas.sets[set];
            recorder.encoder().clear_buffer(&gpu.lists, 0, Some(u64::from(MAP_LISTS_HEAD + count) * 4));
            let resources = [
                buffer("parts", &list),
                buffer("occluders", &gpu.words),
                buffer("batch", &batch),
                buffer("owners", &states),
                buffer("nearest", &atlas.nearest),
                buffer("lists", &gpu.lists),
                buffer("set_ups", &atlas.set_ups),
            ];
            let bound = (&nothing, Some(&scene.geometry.group));
            let workgroups = (occluders.bounds.len() as u32).div_ceil(MAP_CLUSTERS);
            self.small[set].record(recorder, bound, time, &resources, Groups::Count([workgroups, count]));
            self.large[set].record(recorder, bound, time, &resources, Groups::Indirect(&gpu.lists, 0));
            if set == 0 {
                of_opaque = Some(list);
            }
        }
        let Some(list) = of_opaque else { return Ok(()) };
        let resources = [
            buffer("parts", &list),
            buffer("nearest", &atlas.nearest),
            buffer("lists", &atlas.sets[0].lists),
            buffer("set_ups", &atlas.set_ups),
        ];
        self.merge.record(recorder, (&nothing, None), time, &resources, Groups::Count([merged, count]));
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
        Ok(())
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

/// A part of a light's map, in whole blocks, without its places beside the maps.
fn part(light: &Light, slot: &MapSlot, update: &MapUpdate) -> MapPart {
    let TexelRect { first, end } = update.part.in_blocks(MAP_BLOCK);
    let is_parallel = light.is_parallel();
    let (across, deep) = if is_parallel { (light.scale, 0.5 * light.offset) } else { (1.0, 1.0) };
    MapPart {
        position: light.position,
        is_parallel: u32::from(is_parallel),
        x: light.tangent * across,
        y: light.normal.cross(light.tangent) * across,
        z: light.normal * deep,
        size: slot.size,
        first,
        end,
        origin: slot.origin,
        page: slot.page,
        ..MapPart::default()
    }
}
