//! Shadow maps: one draw and one pass an atlas page.

use crate::device::buffers::storage;
use crate::device::kernel::{Draw, RenderKernel, Shared, buffer};
use crate::device::recorder::Recorder;
use crate::layout::Item;
use crate::maps::atlas::{DEPTH, MapsView};
use crate::maps::occluders::{self, CLUSTER, CullCounts};
use crate::resident::Resident;
use crate::settings::RendererOptions;
use crate::{Result, shaders};

/// The unit of stored depth: a map holds this over the distance. Nothing nearer to a light blocks it.
pub(crate) const NEAR: f64 = 1e-6;
/// Items in one draw at the most: 32 MiB of them.
const MAX_ITEMS: usize = 4 << 20;

pub(crate) struct ShadowMaps {
    opaque: RenderKernel,
    masked: RenderKernel,
    faces: u32,
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
