//! The shadow atlas on the GPU, and what is drawn into it.

use super::footprint::MapView;
use super::hidden::HiddenMovers;
use super::layout::AtlasLayout;
use super::moved::MovedBoxes;
use super::occluders::{CLUSTER, Clusters, Occluders};
use super::states::MapStates;
use super::still::StillMaps;
use crate::Result;
use crate::device::buffers::storage;
use crate::device::tuning::DeviceTuning;
use crate::layout::Light;
use crate::parallel::in_order;
use crate::settings::RendererOptions;
use girandole_core::scene::{Geometry, ObjectId, Scene};
use wgpu::util::DeviceExt;

/// Format of what is drawn.
pub(crate) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

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
    /// Where each page is drawn.
    pub pages: Vec<wgpu::TextureView>,
    /// The way from there to the atlas, if that is another texture.
    pub copy: Option<PageCopy>,
    /// The maps without what moves, if kernels refresh them and anything does.
    pub still: Option<StillMaps>,
    /// `Maps` for the shaders.
    pub maps: wgpu::Buffer,
    pub occluders: Occluders,
    pub states: MapStates,
    /// Corners of each kind of occluders.
    pub positions: [wgpu::Buffer; 2],
    pub coordinates: wgpu::Buffer,
}

impl Atlas {
    pub fn new(
        device: &wgpu::Device,
        (tuning, options): (&DeviceTuning, &RendererOptions),
        layout: AtlasLayout,
        scene: &Scene,
        geometry: &Geometry,
        occluders: Occluders,
    ) -> Result<Self> {
        use wgpu::TextureUsages as U;
        let copy = tuning.copy_maps.then(|| PageCopy::new(device, layout.page_size));
        let is_refreshed = StillMaps::are_wanted(tuning, options) && occluders.move_at_all();
        let (format, usage) = match &copy {
            None => (DEPTH, U::RENDER_ATTACHMENT | U::TEXTURE_BINDING),
            Some(_) => (wgpu::TextureFormat::R32Float, U::STORAGE_BINDING | U::COPY_DST),
        };
        let texture = pages(device, layout.page_size, layout.pages, format, usage | U::COPY_SRC);
        let page = |i: u32| match &copy {
            None => texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2),
                base_array_layer: i,
                array_layer_count: Some(1),
                ..Default::default()
            }),
            Some(copy) => copy.depth.create_view(&Default::default()),
        };
        let positions = |clusters: &Clusters| clusters.positions(geometry, 0..clusters.bounds.len());
        Ok(Self {
            states: MapStates::new(layout.slots.iter().map(|slot| slot.size)),
            view: texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..Default::default()
            }),
            pages: (0..layout.pages).map(page).collect(),
            copy,
            still: is_refreshed.then(|| StillMaps::new(device, &layout)).transpose()?,
            maps: device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("maps"),
                contents: bytemuck::bytes_of(&layout.maps()),
                usage: wgpu::BufferUsages::UNIFORM,
            }),
            positions: [
                storage(device, "occluders", &positions(&occluders.opaque))?,
                storage(device, "masked occluders", &positions(&occluders.masked))?,
            ],
            coordinates: storage(
                device,
                "mask coordinates",
                &mask_coordinates(scene, geometry, &occluders.masked),
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
        hidden: [&HiddenMovers; 2],
        faces: u32,
    ) {
        let Self { occluders, states, layout, positions, .. } = self;
        let boxes = |occluders: &Occluders| {
            let of = |&object: &ObjectId| occluders.of_object(object).map(move |bounds| (object, bounds));
            MovedBoxes::new(moved.iter().flat_map(of).collect())
        };
        let covered_before = boxes(occluders);
        for (clusters, buffer) in [&mut occluders.opaque, &mut occluders.masked].into_iter().zip(positions) {
            clusters.follow(geometry, moved);
            for (cluster, corners) in clusters.moved_positions(moved) {
                let at = size_of::<[f32; 3]>() * 3 * CLUSTER as usize * cluster;
                queue.write_buffer(buffer, at as u64, bytemuck::cast_slice(&corners));
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

    /// Whether kernels refresh maps.
    pub fn is_refreshed(&self) -> bool {
        self.still.is_some()
    }

    /// Bytes of the pages, and of what they are copied through.
    pub fn bytes(&self) -> u64 {
        let of = |t: &wgpu::Texture| {
            u64::from(t.width()) * u64::from(t.height()) * u64::from(t.depth_or_array_layers()) * 4
        };
        of(&self.texture) + self.copy.as_ref().map_or(0, |c| of(&c.depth) + c.buffer.size())
    }

    /// Triangles left out because they cannot block anything.
    pub fn left_out(&self) -> usize {
        self.occluders.left_out
    }
}

/// Texels of a texture.
pub(super) fn texels(texture: &wgpu::Texture) -> u64 {
    u64::from(texture.width()) * u64::from(texture.height()) * u64::from(texture.depth_or_array_layers())
}

/// Pages of texels.
pub(super) fn pages(
    device: &wgpu::Device,
    [width, height]: [u32; 2],
    count: u32,
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("shadow atlas"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: count },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

/// One page of depth for all to be drawn in, and a buffer on the way from there: textures of different formats are not
/// copied directly.
pub(crate) struct PageCopy {
    pub depth: wgpu::Texture,
    buffer: wgpu::Buffer,
    bytes_per_row: u32,
}

impl PageCopy {
    fn new(device: &wgpu::Device, page_size: [u32; 2]) -> Self {
        use wgpu::TextureUsages as U;
        let usage = U::RENDER_ATTACHMENT | U::COPY_SRC | U::TEXTURE_BINDING;
        let bytes_per_row = (page_size[0] * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        Self {
            depth: pages(device, page_size, 1, DEPTH, usage),
            buffer: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("page of the shadow atlas"),
                size: u64::from(bytes_per_row) * u64::from(page_size[1]),
                usage: wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            bytes_per_row,
        }
    }

    /// Copies what is drawn to a page of the atlas, and others like it.
    pub fn record(&self, encoder: &mut wgpu::CommandEncoder, atlases: &[&wgpu::Texture], page: u32) {
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(self.bytes_per_row),
            rows_per_image: None,
        };
        let buffer = wgpu::TexelCopyBufferInfo { buffer: &self.buffer, layout };
        encoder.copy_texture_to_buffer(self.depth.as_image_copy(), buffer, self.depth.size());
        for atlas in atlases {
            let mut target = atlas.as_image_copy();
            target.origin.z = page;
            encoder.copy_buffer_to_texture(buffer, target, self.depth.size());
        }
    }
}

/// Texture coordinates of each corner of masked triangles, with the material's index as bits.
fn mask_coordinates(scene: &Scene, geometry: &Geometry, clusters: &Clusters) -> Vec<[f32; 4]> {
    clusters.corners(0..clusters.bounds.len(), |t| {
        let triangle = &geometry.triangles[t as usize];
        let set = scene.materials[triangle.material as usize]
            .base_color_texture
            .map_or(0, |t| t.uv_set as usize & 1);
        triangle.vertices.map(|v| {
            let uv = geometry.uvs.get(v as usize).map_or([0.0; 2], |uv| uv[set].to_array());
            [uv[0], uv[1], f32::from_bits(triangle.material), 0.0]
        })
    })
}
