//! The shadow atlas on the GPU, and what is drawn into it.

use super::cache::MapCache;
use super::layout::{AtlasLayout, list_words};
use super::map_view::MapView;
use super::moved::MovedBoxes;
use super::occluders::{CLUSTER, Clusters, Occluders};
use super::occlusion_culling::OccludedObjects;
use crate::Result;
use crate::device::buffers::{check_bytes, storage, uniform};
use crate::layout::Light;
use crate::parallel::in_order;
use girandole_core::scene::{Geometry, ObjectId};

/// Shadow maps that are up to date.
#[derive(Clone, Copy)]
pub(crate) struct MapsView<'a> {
    pub atlas: &'a wgpu::TextureView,
    /// `Maps` for the shaders.
    pub maps: &'a wgpu::Buffer,
}

/// The atlas and what is drawn into it.
pub(crate) struct Atlas {
    pub texture: wgpu::Texture,
    /// All pages as an array.
    view: wgpu::TextureView,
    /// `Maps` for the shaders.
    pub maps: wgpu::Buffer,
    pub occluders: Occluders,
    pub cache: MapCache,
    /// Each kind of occluders, see `lib/map_set_up.wgsl`.
    pub sets: [wgpu::Buffer; 2],
    /// The texels of parts that are drawn at once.
    pub nearest: wgpu::Buffer,
    /// See `lib/map_lists.wgsl`.
    pub lists: wgpu::Buffer,
    /// Pairs of a part and a cluster for which there is room in it.
    pub pairs: u64,
}

impl Atlas {
    /// # Errors
    /// [`crate::Error::TooLarge`] beyond the device's limits.
    pub fn new(
        device: &wgpu::Device,
        layout: &AtlasLayout,
        geometry: &Geometry,
        occluders: Occluders,
        cache: MapCache,
    ) -> Result<Self> {
        use wgpu::TextureUsages as U;
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("shadow atlas"),
            size: wgpu::Extent3d {
                width: layout.page_size[0],
                height: layout.page_size[1],
                depth_or_array_layers: layout.pages,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::R32Float,
            usage: U::STORAGE_BINDING | U::TEXTURE_BINDING | U::COPY_SRC | U::COPY_DST,
            view_formats: &[],
        });
        let texels = layout.drawn_texels;
        let of = |clusters: &Clusters| storage(device, "occluders", &clusters.words(geometry));
        let [opaque, masked] = occluders.sets();
        // Any part has room for all of its pairs.
        let pairs =
            [opaque, masked].map(|set| set.bounds.len() as u64).into_iter().fold(layout.pairs(), u64::max);
        let list_bytes = list_words(texels, pairs) * 4;
        Ok(Self {
            view: texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..Default::default()
            }),
            maps: uniform(device, "maps", bytemuck::bytes_of(&layout.maps())),
            sets: [of(opaque)?, of(masked)?],
            nearest: empty(device, "shadow maps' texels", texels * 4, wgpu::BufferUsages::COPY_SRC)?,
            lists: empty(device, "lists of large triangles", list_bytes, wgpu::BufferUsages::INDIRECT)?,
            pairs,
            texture,
            occluders,
            cache,
        })
    }

    /// Follows dynamic objects that moved, and marks what is stale for it. Lights that moved themselves see everything from elsewhere.
    pub fn follow(
        &mut self,
        queue: &wgpu::Queue,
        geometry: &Geometry,
        moved: &[ObjectId],
        (lights, moved_lights): (&[Light], &[u32]),
        hidden: [&OccludedObjects; 2],
        is_octahedral: bool,
    ) {
        let Self { occluders, cache, sets, .. } = self;
        let boxes = |occluders: &Occluders| {
            let of = |&object: &ObjectId| occluders.of_object(object).map(move |bounds| (object, bounds));
            MovedBoxes::new(&moved.iter().flat_map(of).collect::<Vec<_>>())
        };
        let covered_before = boxes(occluders);
        for (clusters, set) in [&mut occluders.opaque, &mut occluders.masked].into_iter().zip(sets) {
            let moved = clusters.follow(geometry, moved);
            for (at, words) in clusters.moved_words(geometry, &moved) {
                queue.write_buffer(set, 16 * at as u64, bytemuck::cast_slice(&words));
            }
        }
        let covered_after = boxes(occluders);
        moved_lights.iter().for_each(|&light| cache.invalidate(light as usize));
        let shown = cache.all_shown();
        let stale = in_order(&shown, |&index| {
            let (shows, slot, stale) = cache.holds(index)?;
            let light = shows.shown_by(&lights[index.light]);
            let map = MapView { light: &light, size: cache.layout().size(slot.span), is_octahedral };
            let covered = [&covered_before, &covered_after].into_iter().zip(hidden);
            Some(covered.fold(stale, |stale, (covered, hidden)| {
                covered.stale(&map, stale, |object| hidden.is_hidden(object, index.light))
            }))
        });
        for (index, stale) in shown.into_iter().zip(stale) {
            stale.into_iter().for_each(|stale| cache.mark(index, stale));
        }
    }

    /// What shaders read maps from.
    pub fn view(&self) -> MapsView<'_> {
        MapsView { atlas: &self.view, maps: &self.maps }
    }

    /// Bytes of the pages, and of what is beside them while maps are drawn.
    pub fn bytes(&self) -> u64 {
        let layout = self.cache.layout();
        layout.bytes() + 4 * (self.pairs - layout.pairs())
    }

    /// Pairs that a part needs at most whose list has room for so many large triangles.
    pub fn pairs(&self, set: usize, room: u32) -> u64 {
        let clusters = self.occluders.sets()[set].bounds.len() as u64;
        if clusters * u64::from(CLUSTER) > u64::from(room) { clusters } else { 0 }
    }

    /// A bit for each of a set's clusters: whether it is hidden from a light, as far as that was found.
    pub fn hidden(&self, set: usize, light: u32, objects: &OccludedObjects) -> Vec<u32> {
        let clusters = self.occluders.sets()[set];
        let mut words = vec![0; self.hidden_words(set)];
        let dynamic = clusters.dynamic.iter().filter(|object| objects.is_hidden(object.id, light as usize));
        let still = self.occluders.culling.of_light(light, set).iter().cloned();
        for cluster in still.chain(dynamic.map(|object| object.clusters.clone())).flatten() {
            words[cluster / 32] |= 1 << (cluster % 32);
        }
        words
    }

    /// How many words those are.
    pub fn hidden_words(&self, set: usize) -> usize {
        self.occluders.sets()[set].bounds.len().div_ceil(32)
    }

    /// Triangles left out because they cannot block anything.
    pub fn left_out(&self) -> usize {
        self.occluders.left_out
    }
}

/// A storage buffer of so many bytes that is filled on the device.
fn empty(device: &wgpu::Device, label: &str, bytes: u64, usage: wgpu::BufferUsages) -> Result<wgpu::Buffer> {
    check_bytes(device, label, bytes)?;
    Ok(device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: bytes,
        usage: usage | wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    }))
}
