//! The shadow atlas on the GPU, and what is drawn into it.

use super::closed::is_outside;
use super::layout::AtlasLayout;
use super::map_view::MapView;
use super::moved::MovedBoxes;
use super::occluded::OccludedObjects;
use super::occluders::{Clusters, Occluders};
use super::states::MapStates;
use crate::Result;
use crate::device::buffers::{check_bytes, storage, uniform};
use crate::layout::Light;
use crate::parallel::in_order;
use crate::shader_constants::{MAP_LISTED, MAP_LISTS_HEAD, OWNER_VECTORS};
use girandole_core::scene::{Geometry, ObjectId};

/// Pairs of a part of a map and a cluster that are listed at once at most, but for what has more clusters: 1 MiB of them.
const MOST_PAIRS: u64 = 1 << 18;

/// Shadow maps that are up to date.
#[derive(Clone, Copy)]
pub(crate) struct MapsView<'a> {
    pub atlas: &'a wgpu::TextureView,
    /// `Maps` for the shaders.
    pub maps: &'a wgpu::Buffer,
}

/// The atlas and what is drawn into it.
pub(crate) struct Atlas {
    pub layout: AtlasLayout,
    pub texture: wgpu::Texture,
    /// All pages as an array.
    view: wgpu::TextureView,
    /// `Maps` for the shaders.
    pub maps: wgpu::Buffer,
    pub occluders: Occluders,
    pub states: MapStates,
    /// Of each kind of occluders.
    pub sets: [GpuOccluders; 2],
    /// The texels of parts that are drawn at once, the nearest of what small triangles show there.
    pub nearest: wgpu::Buffer,
    /// Their large triangles.
    pub set_ups: wgpu::Buffer,
}

/// One kind of occluders on the GPU.
pub(crate) struct GpuOccluders {
    /// See `lib/map_set_up.wgsl`.
    pub words: wgpu::Buffer,
    /// See `lib/map_lists.wgsl`.
    pub lists: wgpu::Buffer,
    /// Parts for which there is room in it.
    pub parts: u64,
}

impl GpuOccluders {
    fn new(device: &wgpu::Device, geometry: &Geometry, clusters: &Clusters, parts: u64) -> Result<Self> {
        let count = clusters.bounds.len() as u64;
        let parts = parts.min(MOST_PAIRS / count.max(1)).max(1);
        let words = u64::from(MAP_LISTS_HEAD) + parts * (1 + count);
        Ok(Self {
            words: storage(device, "occluders", &clusters.words(geometry))?,
            lists: empty(device, "lists of occluders", words * 4, wgpu::BufferUsages::INDIRECT)?,
            parts,
        })
    }
}

impl Atlas {
    /// # Errors
    /// [`crate::Error::TooLarge`] beyond the device's limits.
    pub fn new(
        device: &wgpu::Device,
        layout: AtlasLayout,
        geometry: &Geometry,
        occluders: Occluders,
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
        let AtlasLayout { drawn_texels, drawn_parts, .. } = layout;
        let of = |clusters| GpuOccluders::new(device, geometry, clusters, drawn_parts);
        let [opaque, masked] = occluders.sets();
        Ok(Self {
            states: MapStates::new(layout.slots.iter().map(|slot| slot.size)),
            view: texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..Default::default()
            }),
            maps: uniform(device, "maps", bytemuck::bytes_of(&layout.maps())),
            sets: [of(opaque)?, of(masked)?],
            nearest: empty(device, "shadow maps' texels", drawn_texels * 4, wgpu::BufferUsages::COPY_SRC)?,
            set_ups: empty(
                device,
                "shadow maps' triangles",
                drawn_parts * u64::from(MAP_LISTED) * 64,
                wgpu::BufferUsages::empty(),
            )?,
            texture,
            layout,
            occluders,
        })
    }

    /// Follows dynamic objects that moved, and marks what is stale for it. `lights` are as they were and as they are; those that
    /// moved themselves see everything from elsewhere.
    pub fn follow(
        &mut self,
        queue: &wgpu::Queue,
        geometry: &Geometry,
        moved: &[ObjectId],
        [before, after]: [&[Light]; 2],
        hidden: [&OccludedObjects; 2],
        faces: u32,
    ) {
        let Self { occluders, states, layout, sets, .. } = self;
        let boxes = |occluders: &Occluders| {
            let of = |&object: &ObjectId| occluders.of_object(object).map(move |bounds| (object, bounds));
            MovedBoxes::new(moved.iter().flat_map(of).collect())
        };
        let covered_before = boxes(occluders);
        for (clusters, set) in [&mut occluders.opaque, &mut occluders.masked].into_iter().zip(sets) {
            let moved = clusters.follow(geometry, moved);
            for (at, words) in clusters.moved_words(geometry, &moved) {
                queue.write_buffer(&set.words, 16 * at as u64, bytemuck::cast_slice(&words));
            }
        }
        let covered_after = boxes(occluders);
        let lights: Vec<usize> = (0..layout.slots.len()).collect();
        let stale = in_order(&lights, |&index| {
            let (light, slot) = (&after[index], &layout.slots[index]);
            let map = before[index].sees_like(light).then(|| MapView::new(light, slot.size, faces))?;
            let covered = [&covered_before, &covered_after].into_iter().zip(hidden);
            Some(covered.fold(states.stale(index), |stale, (covered, hidden)| {
                covered.stale(&map, stale, |object| hidden.is_hidden(object, index))
            }))
        });
        for (index, (stale, slot)) in stale.into_iter().zip(&layout.slots).enumerate() {
            match stale {
                Some(stale) => states.mark(index, stale),
                None => states.invalidate(index, slot.size),
            }
        }
    }

    /// What shaders read maps from.
    pub fn view(&self) -> MapsView<'_> {
        MapsView { atlas: &self.view, maps: &self.maps }
    }

    /// Bytes of the pages, and of what is beside them while maps are drawn.
    pub fn bytes(&self) -> u64 {
        let lists: u64 = self.sets.iter().map(|set| set.lists.size()).sum();
        self.layout.bytes() + lists
    }

    /// For each object of a set that moves or is closed, two bits in `owners` of `lib/map_set_up.wgsl`; more than it holds have none.
    pub fn owner_states(
        &self,
        set: usize,
        (index, light): (u32, &Light),
        hidden: &OccludedObjects,
        is_straight: bool,
    ) -> Vec<u32> {
        let Clusters { dynamic, closed, .. } = self.occluders.sets()[set];
        let sees_closed = |bounds| is_straight && is_outside(light, bounds);
        let of_dynamic = dynamic.iter().map(|object| {
            let is_closed = object.is_closed && sees_closed(&object.bounds);
            u32::from(hidden.is_hidden(object.id, index as usize)) | u32::from(is_closed) << 1
        });
        let of_closed = closed.iter().map(|(_, bounds)| u32::from(sees_closed(bounds)) << 1);
        let mut words = vec![0; 4 * self.owner_vectors(set)];
        let most = 16 * words.len();
        for (at, bits) in of_dynamic.chain(of_closed).enumerate().take(most) {
            words[at / 16] |= bits << (2 * (at % 16));
        }
        words
    }

    /// Vectors of a part in `owners`.
    pub fn owner_vectors(&self, set: usize) -> usize {
        let Clusters { dynamic, closed, .. } = self.occluders.sets()[set];
        (dynamic.len() + closed.len()).div_ceil(64).min(OWNER_VECTORS as usize)
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
