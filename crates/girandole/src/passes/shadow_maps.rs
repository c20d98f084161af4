//! Shadow maps: those parts of them that are stale, in one pass an atlas page.

use crate::device::buffers::storage;
use crate::device::kernel::{Draw, Groups, Kernel, RenderKernel, Shared, buffer, texture};
use crate::device::recorder::Recorder;
use crate::layout::{Frame, MapPart};
use crate::maps::atlas::{Atlas, DEPTH, MapsView, PageCopy};
use crate::maps::footprint::{MapView, TexelRect};
use crate::maps::occluders::{CLUSTER, CullCounts, Items, PIECE};
use crate::maps::states::MapUpdate;
use crate::parallel::in_order;
use crate::resident::Resident;
use crate::settings::RendererOptions;
use crate::{Result, shaders};
use std::borrow::Cow;
use std::ops::Range;

/// The unit of stored depth: a map holds this over the distance. Nothing nearer to a light blocks it.
pub(crate) const NEAR: f64 = 1e-6;
/// Items in one list at the most: 32 MiB of them.
const MAX_ITEMS: u32 = 4 << 20;
/// Share of a page that is drawn in parts, from which on it is drawn and copied as a whole.
const WHOLE_PAGE: f32 = 0.5;
/// Maps whose items are found on all cores before they are drawn, at least.
const CULLED_AT_ONCE: usize = 64;
/// In how many parts a frame's maps are drawn for that, whatever their number, at most; but for pages, and lists that are full.
const MOST_PARTS: usize = 4;
/// Workgroups that copy a part of a map: a multiple of the threads of most software devices.
const COPY_GROUPS: u32 = 16;

pub(crate) struct ShadowMaps {
    /// Empties rectangles.
    clear: RenderKernel,
    opaque: RenderKernel,
    /// For pieces of clusters.
    pieces: RenderKernel,
    masked: RenderKernel,
    /// For texels of what is small.
    texels: RenderKernel,
    /// Copies rectangles to the atlas, where maps are not drawn there.
    copy: Option<Kernel>,
    faces: u32,
}

/// Maps that are drawn in one page at once.
struct Round {
    page: usize,
    updates: Vec<MapUpdate>,
    /// The page of the atlas that it makes up as a whole, if it does.
    whole_page: Option<u32>,
}

/// A render pass over a page: all of a round's items, or as many as one list holds.
struct Pass<'a> {
    round: &'a Round,
    is_first: bool,
    is_last: bool,
    /// Items of each kind.
    items: [Range<u32>; KINDS],
}

/// Kinds of items: opaque clusters, pieces of such, masked clusters, and texels.
const KINDS: usize = 4;

/// Triangles of an item of each kind but texels.
const TRIANGLES: [u32; KINDS - 1] = [CLUSTER, PIECE, CLUSTER];

impl ShadowMaps {
    pub fn new(device: &wgpu::Device, shared: &Shared, options: &RendererOptions) -> Self {
        let clips = device.features().contains(wgpu::Features::CLIP_DISTANCES);
        let source = if clips { &shaders::SHADOW_MAPS_CLIP } else { &shaders::SHADOW_MAPS_DISCARD };
        let pipeline = |source, vertex, fragment, (topology, compare), cluster: u32| {
            let constants = [
                ("PARAMETERISATION", f64::from(options.shadow_map as u32)),
                ("NEAR", NEAR),
                ("CLUSTER", f64::from(cluster)),
            ];
            let draw = Draw { vertex, fragment, topology, depth: Some((DEPTH, compare)), targets: &[] };
            RenderKernel::new(device, shared, source, &draw, &constants)
        };
        let occluders = (wgpu::PrimitiveTopology::TriangleList, wgpu::CompareFunction::Greater);
        let emptied = (wgpu::PrimitiveTopology::TriangleStrip, wgpu::CompareFunction::Always);
        let points = (wgpu::PrimitiveTopology::PointList, wgpu::CompareFunction::Greater);
        let copy = || Kernel::new(device, shared, &shaders::COPY_MAPS, "copy_maps", &[]);
        let opaque = |cluster| pipeline(source, "opaque", (!clips).then_some("confine"), occluders, cluster);
        Self {
            clear: pipeline(&shaders::CLEAR_MAPS, "clear_maps", None, emptied, CLUSTER),
            opaque: opaque(CLUSTER),
            pieces: opaque(PIECE),
            masked: pipeline(&shaders::SHADOW_MAPS_MASKED, "masked", Some("cut_out"), occluders, CLUSTER),
            texels: pipeline(&shaders::SHADOW_MAPS_TEXELS, "texel", None, points, CLUSTER),
            copy: shared.tuning.copy_maps.then(copy),
            faces: options.shadow_map.faces(),
        }
    }

    /// Draws parts of maps. Nothing else changes: what else is in these maps is as it would be drawn again.
    ///
    /// # Errors
    /// [`crate::Error::TooLarge`] where a list of what to draw exceeds the device's limits.
    pub fn record<'a>(
        &self,
        recorder: &mut Recorder,
        scene: &'a Resident,
        updates: &[MapUpdate],
    ) -> Result<(MapsView<'a>, CullCounts)> {
        let atlas = &scene.atlas;
        let mut counts = CullCounts::default();
        if updates.is_empty() {
            return Ok((atlas.view(), counts));
        }
        let updates = &with_pages(scene, updates)[..];
        let at_once = updates.len().div_ceil(MOST_PARTS).max(CULLED_AT_ONCE);
        let rounds = rounds(atlas, updates);
        let (mut items, mut passes, mut undrawn) = (<[Items; 2]>::default(), Vec::new(), 0);
        for round in &rounds {
            let mut is_first = true;
            let mut first = counts_of(&items);
            for (block, updates) in round.updates.chunks(at_once).enumerate() {
                let culled = in_order(updates, |update| self.cull(scene, update));
                undrawn += culled.len();
                for (index, (new, count)) in culled.into_iter().enumerate() {
                    counts += count;
                    items.iter_mut().zip(new).for_each(|(items, new)| items.append(new));
                    let is_last = block * at_once + index + 1 == round.updates.len();
                    let ends = counts_of(&items);
                    // The device draws while the next ones are found.
                    let is_enough = undrawn >= at_once && index + 1 == updates.len();
                    let is_full = is_enough || ends.iter().sum::<u32>() >= MAX_ITEMS;
                    if is_last || is_full {
                        let ranges = std::array::from_fn(|kind| first[kind]..ends[kind]);
                        passes.push(Pass { round, is_first, is_last, items: ranges });
                        is_first = false;
                    }
                    if is_full {
                        self.draw(recorder, scene, &items, &passes)?;
                        recorder.split();
                        (items, undrawn) = Default::default();
                        passes.clear();
                        first = [0; KINDS];
                    }
                }
            }
        }
        if !passes.is_empty() {
            self.draw(recorder, scene, &items, &passes)?;
        }
        Ok((atlas.view(), counts))
    }

    /// What is drawn of each kind of occluders for a part of a map.
    fn cull(&self, scene: &Resident, update: &MapUpdate) -> ([Items; 2], CullCounts) {
        let Resident { lights, atlas, hidden, .. } = scene;
        let &MapUpdate { light, part } = update;
        let slot = atlas.layout.slots[light as usize];
        let map = MapView::new(&lights.samples[light as usize], slot.size, self.faces);
        let is_hidden = |object| hidden.is_hidden(object, light as usize);
        let (mut items, mut counts) = (<[Items; 2]>::default(), CullCounts::default());
        for (clusters, items) in atlas.occluders.sets().into_iter().zip(&mut items) {
            if !clusters.bounds.is_empty() || std::ptr::eq(clusters, &atlas.occluders.opaque) {
                counts += clusters.cull((light, map), part, is_hidden, items);
            }
            items.texels.iter_mut().for_each(|texel| *texel = texel.in_page(slot.origin));
        }
        (items, counts)
    }

    fn draw(
        &self,
        recorder: &mut Recorder,
        scene: &Resident,
        items: &[Items; 2],
        passes: &[Pass],
    ) -> Result<()> {
        let Resident { lights, atlas, .. } = scene;
        let device = recorder.device;
        let kernels = [&self.opaque, &self.pieces, &self.masked];
        let [opaque, masked] = &atlas.positions;
        let lists = [&items[0].clusters, &items[0].pieces, &items[1].clusters];
        let mut groups = Vec::with_capacity(kernels.len());
        for ((kernel, items), positions) in kernels.iter().zip(lists).zip([opaque, opaque, masked]) {
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
        let texels = storage(device, "texels", &items[0].texels)?;
        let resources = [buffer("texels", &texels), buffer("maps", &atlas.maps)];
        let texel_group = self.texels.group(device, &resources);
        for Pass { round, is_first, is_last, items: [of_triangles @ .., texels] } in passes {
            let parts: Vec<MapPart> = match round.whole_page {
                None => round.updates.iter().map(|update| map_part(atlas, update)).collect(),
                Some(_) => Vec::new(),
            };
            let parts = storage(device, "parts of maps", &parts)?;
            let clears = *is_first && round.whole_page.is_some();
            let timestamps = recorder.timers.render("shadow_maps_gpu_ms");
            let mut pass = recorder.encoder().begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("shadow maps"),
                color_attachments: &[],
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &atlas.pages[round.page],
                    depth_ops: Some(wgpu::Operations {
                        load: if clears { wgpu::LoadOp::Clear(0.0) } else { wgpu::LoadOp::Load },
                        store: wgpu::StoreOp::Store,
                    }),
                    stencil_ops: None,
                }),
                timestamp_writes: timestamps,
                occlusion_query_set: None,
                multiview_mask: None,
            });
            if *is_first && !clears {
                let group = self.clear.group(device, &[buffer("parts", &parts), buffer("maps", &atlas.maps)]);
                self.clear.set(&mut pass, (None, None), &group);
                pass.draw(0..4, 0..round.updates.len() as u32);
            }
            for (((kernel, items), group), triangles) in
                kernels.iter().zip(of_triangles).zip(&groups).zip(TRIANGLES)
            {
                if !items.is_empty() {
                    kernel.set(&mut pass, (None, Some(&scene.geometry.group)), group);
                    pass.draw(0..3 * triangles, items.clone());
                }
            }
            if !texels.is_empty() {
                self.texels.set(&mut pass, (None, None), &texel_group);
                pass.draw(texels.clone(), 0..1);
            }
            drop(pass);
            if let (true, Some(copy)) = (*is_last, &atlas.copy) {
                self.copy(recorder, atlas, round, copy, &parts);
            }
        }
        Ok(())
    }

    /// Copies what was drawn to the atlas.
    fn copy(
        &self,
        recorder: &mut Recorder,
        atlas: &Atlas,
        round: &Round,
        page: &PageCopy,
        parts: &wgpu::Buffer,
    ) {
        match (round.whole_page, &self.copy) {
            (None, Some(kernel)) => {
                let resources = [
                    texture("drawn", &atlas.pages[0]),
                    texture("atlas", atlas.view().atlas),
                    buffer("parts", parts),
                ];
                let groups = Groups::Count([round.updates.len() as u32, COPY_GROUPS]);
                let nothing = Frame::default();
                kernel.record(recorder, (&nothing, None), "copy_maps_gpu_ms", &resources, groups);
            }
            (whole, _) => page.record(recorder.encoder(), &atlas.texture, whole.unwrap_or(0)),
        }
    }
}

/// How many items there are of each kind.
fn counts_of([opaque, masked]: &[Items; 2]) -> [u32; KINDS] {
    [opaque.clusters.len(), opaque.pieces.len(), masked.clusters.len(), opaque.texels.len()].map(|n| n as u32)
}

/// Which maps are drawn together. Those of a page are, or where maps are copied, those that lie in different places of their
/// pages: a map is always drawn in the same place, as rasterisation rounds differently elsewhere.
fn rounds(atlas: &Atlas, updates: &[MapUpdate]) -> Vec<Round> {
    let slots = &atlas.layout.slots;
    let mut rounds: Vec<Round> = Vec::new();
    for &update in updates {
        let slot = slots[update.light as usize];
        let is_free = |round: &Round| match atlas.copy {
            None => round.page == slot.page as usize,
            Some(_) => round.updates.iter().all(|other| !slots[other.light as usize].covers_like(&slot)),
        };
        match rounds.iter_mut().find(|round| is_free(round)) {
            Some(round) => round.updates.push(update),
            None => {
                let page = if atlas.copy.is_some() { 0 } else { slot.page as usize };
                rounds.push(Round { page, updates: vec![update], whole_page: None });
            }
        }
    }
    let mut in_page = vec![0; atlas.layout.pages as usize];
    slots.iter().for_each(|slot| in_page[slot.page as usize] += 1);
    for round in &mut rounds {
        let page = slots[round.updates[0].light as usize].page;
        let is_whole = |update: &MapUpdate| {
            let slot = slots[update.light as usize];
            slot.page == page && update.part == TexelRect::whole(slot.size)
        };
        let all = round.updates.len() == in_page[page as usize] && round.updates.iter().all(is_whole);
        round.whole_page = all.then_some(page);
    }
    rounds
}

/// Maps to be drawn as a whole where that makes up a page of which much is drawn in any case: copying it then costs less than copying
/// parts, and what is drawn is the same. Only pages of which nothing is left stale are.
fn with_pages<'a>(scene: &Resident, updates: &'a [MapUpdate]) -> Cow<'a, [MapUpdate]> {
    let Resident { atlas, lights, .. } = scene;
    let slots = &atlas.layout.slots;
    if atlas.copy.is_none() {
        return Cow::Borrowed(updates);
    }
    let pages = atlas.layout.pages as usize;
    let (mut drawn, mut all, mut is_left) = (vec![0.0; pages], vec![0.0; pages], vec![false; pages]);
    let mut is_drawn = vec![false; slots.len()];
    for &MapUpdate { light, part } in updates {
        drawn[slots[light as usize].page as usize] += part.texels();
        is_drawn[light as usize] = true;
    }
    let stale = atlas.states.stale_parts(&lights.samples);
    for ((slot, is_drawn), part) in slots.iter().zip(&is_drawn).zip(stale) {
        all[slot.page as usize] += TexelRect::whole(slot.size).texels();
        is_left[slot.page as usize] |= !is_drawn && !part.is_empty();
    }
    let is_whole = |page: usize| !is_left[page] && drawn[page] >= WHOLE_PAGE * all[page];
    if !(0..pages).any(is_whole) {
        return Cow::Borrowed(updates);
    }
    let parts = updates.iter().filter(|update| !is_whole(slots[update.light as usize].page as usize));
    let whole = (0..).zip(slots).filter(|(_, slot)| is_whole(slot.page as usize));
    let whole = whole.map(|(light, slot)| MapUpdate { light, part: TexelRect::whole(slot.size) });
    let mut result: Vec<MapUpdate> = parts.copied().chain(whole).collect();
    result.sort_unstable_by_key(|update| update.light);
    Cow::Owned(result)
}

/// A part of a map as a part of its page.
fn map_part(atlas: &Atlas, update: &MapUpdate) -> MapPart {
    let slot = atlas.layout.slots[update.light as usize];
    let in_page = |texel: [u32; 2]| [0, 1].map(|i| slot.origin[i] + texel[i]);
    MapPart {
        first: in_page(update.part.first),
        end: in_page(update.part.end),
        page: slot.page,
        ..MapPart::default()
    }
}
