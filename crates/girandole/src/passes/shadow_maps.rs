//! Shadow maps: one draw and one pass an atlas page.

use super::MapsView;
use crate::atlas::AtlasLayout;
use crate::device::kernel::{Draw, RenderKernel, Shared, buffer};
use crate::device::recorder::Recorder;
use crate::gpu_scene::storage;
use crate::layout::Item;
use crate::occluders::{self, CLUSTER, Clusters, CullCounts, Occluders};
use crate::resident::Resident;
use crate::settings::RendererOptions;
use crate::{Result, shaders};
use girandole_core::scene::{Geometry, Scene};
use wgpu::util::DeviceExt;

/// The unit of stored depth: a map holds this over the distance. Nothing nearer to a light blocks it.
pub(crate) const NEAR: f64 = 1e-6;
/// Format of the atlas.
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// Items in one draw at the most: 32 MiB of them.
const MAX_ITEMS: usize = 4 << 20;

pub(crate) struct ShadowMaps {
    opaque: RenderKernel,
    masked: RenderKernel,
    faces: u32,
}

/// The atlas and what is drawn into it.
pub(crate) struct Atlas {
    pub layout: AtlasLayout,
    pub texture: wgpu::Texture,
    /// All pages as an array.
    view: wgpu::TextureView,
    /// Where each page is drawn.
    pages: Vec<wgpu::TextureView>,
    /// The way from there to the atlas, if that is another texture.
    copy: Option<PageCopy>,
    /// `Maps` for the shaders.
    maps: wgpu::Buffer,
    occluders: Occluders,
    positions: [wgpu::Buffer; 2],
    coordinates: wgpu::Buffer,
}

impl Atlas {
    pub fn new(
        device: &wgpu::Device,
        copies_maps: bool,
        layout: AtlasLayout,
        scene: &Scene,
        geometry: &Geometry,
        occluders: Occluders,
    ) -> Result<Self> {
        use wgpu::TextureUsages as U;
        let copy = copies_maps.then(|| PageCopy::new(device, layout.page_size));
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
        Ok(Self {
            view: texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..Default::default()
            }),
            pages: (0..layout.pages).map(page).collect(),
            copy,
            maps: device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("maps"),
                contents: bytemuck::bytes_of(&layout.maps()),
                usage: wgpu::BufferUsages::UNIFORM,
            }),
            positions: [
                storage(device, "occluders", &occluders.opaque.positions(geometry))?,
                storage(device, "masked occluders", &occluders.masked.positions(geometry))?,
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

    /// What shaders read maps from.
    pub fn view(&self) -> MapsView<'_> {
        MapsView { atlas: &self.view, maps: &self.maps }
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

/// Pages of texels.
fn pages(
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
struct PageCopy {
    depth: wgpu::Texture,
    buffer: wgpu::Buffer,
    bytes_per_row: u32,
}

impl PageCopy {
    fn new(device: &wgpu::Device, page_size: [u32; 2]) -> Self {
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
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

    /// Copies what is drawn to a page of the atlas.
    fn record(&self, encoder: &mut wgpu::CommandEncoder, atlas: &wgpu::Texture, page: u32) {
        let mut target = atlas.as_image_copy();
        target.origin.z = page;
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(self.bytes_per_row),
            rows_per_image: None,
        };
        let buffer = wgpu::TexelCopyBufferInfo { buffer: &self.buffer, layout };
        encoder.copy_texture_to_buffer(self.depth.as_image_copy(), buffer, self.depth.size());
        encoder.copy_buffer_to_texture(buffer, target, self.depth.size());
    }
}

/// Texture coordinates of each corner of masked triangles, with the material's index as bits.
fn mask_coordinates(scene: &Scene, geometry: &Geometry, clusters: &Clusters) -> Vec<[f32; 4]> {
    clusters.corners(|t| {
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

impl ShadowMaps {
    pub fn new(device: &wgpu::Device, shared: &Shared, options: &RendererOptions) -> Self {
        let clips = device.features().contains(wgpu::Features::CLIP_DISTANCES);
        let source = if clips { &shaders::SHADOW_MAPS_CLIP } else { &shaders::SHADOW_MAPS_DISCARD };
        let constants = [
            ("PARAMETERISATION", f64::from(options.shadow_map as u32)),
            ("NEAR", NEAR),
            ("CLUSTER", f64::from(CLUSTER)),
        ];
        let pipeline = |source, vertex, fragment| {
            let draw = Draw {
                vertex,
                fragment,
                topology: wgpu::PrimitiveTopology::TriangleList,
                depth: Some((DEPTH, wgpu::CompareFunction::Greater)),
                targets: &[],
            };
            RenderKernel::new(device, shared, source, &draw, &constants)
        };
        Self {
            opaque: pipeline(source, "opaque", (!clips).then_some("confine")),
            masked: pipeline(&shaders::SHADOW_MAPS_MASKED, "masked", Some("cut_out")),
            faces: options.shadow_map.faces(),
        }
    }

    /// Draws the maps of all lights, page by page.
    ///
    /// # Errors
    /// [`crate::Error::TooLarge`] where a list of what to draw exceeds the device's limits.
    pub fn record<'a>(
        &self,
        recorder: &mut Recorder,
        scene: &'a Resident,
    ) -> Result<(MapsView<'a>, CullCounts)> {
        let Resident { lights, atlas, .. } = scene;
        let mut counts = CullCounts::default();
        let sets = [&atlas.occluders.opaque, &atlas.occluders.masked];
        for (page, view) in atlas.pages.iter().enumerate() {
            let mut of_page =
                (0..lights.samples.len()).filter(|&i| atlas.layout.slots[i].page as usize == page).peekable();
            let mut first = true;
            while first || of_page.peek().is_some() {
                // As many lights as fit into one list; as a rule, all of the page's.
                let mut items = [Vec::new(), Vec::new()];
                while items.iter().map(Vec::len).sum::<usize>() < MAX_ITEMS
                    && let Some(index) = of_page.next()
                {
                    for (clusters, items) in sets.iter().zip(&mut items) {
                        if !clusters.bounds.is_empty() || std::ptr::eq(*clusters, sets[0]) {
                            let light = (index as u32, &lights.samples[index]);
                            let map_size = atlas.layout.slots[index].size as f32;
                            counts += occluders::cull(light, map_size, self.faces, clusters, items);
                        }
                    }
                }
                self.draw(recorder, (view, first), scene, items)?;
                first = false;
            }
            if let Some(copy) = &atlas.copy {
                copy.record(recorder.encoder(), &atlas.texture, page as u32);
            }
        }
        Ok((atlas.view(), counts))
    }

    fn draw(
        &self,
        recorder: &mut Recorder,
        (view, clear): (&wgpu::TextureView, bool),
        scene: &Resident,
        items: [Vec<Item>; 2],
    ) -> Result<()> {
        let Resident { lights, atlas, .. } = scene;
        let device = recorder.device;
        let kernels = [&self.opaque, &self.masked];
        let mut groups = Vec::with_capacity(2);
        for ((kernel, items), positions) in kernels.iter().zip(&items).zip(&atlas.positions) {
            let list = storage(device, "items", items)?;
            let resources = [
                buffer("lights", &lights.buffer),
                buffer("positions", positions),
                buffer("items", &list),
                buffer("maps", &atlas.maps),
                buffer("coordinates", &atlas.coordinates),
            ];
            groups.push(kernel.group(device, &resources));
        }
        let timestamps = recorder.timers.render("shadow_maps_gpu_ms");
        let mut pass = recorder.encoder().begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("shadow maps"),
            color_attachments: &[],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view,
                depth_ops: Some(wgpu::Operations {
                    load: if clear { wgpu::LoadOp::Clear(0.0) } else { wgpu::LoadOp::Load },
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            timestamp_writes: timestamps,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        for ((kernel, items), group) in kernels.iter().zip(&items).zip(&groups) {
            if !items.is_empty() {
                kernel.set(&mut pass, (None, Some(&scene.geometry.group)), group);
                pass.draw(0..3 * CLUSTER, 0..items.len() as u32);
            }
        }
        Ok(())
    }
}
