//! Parts of shadow maps as the device draws them, in one pass an atlas page.

use crate::device::buffers::storage;
use crate::device::kernel::{Draw, Groups, Kernel, RenderKernel, Shared, buffer, texture};
use crate::device::recorder::Recorder;
use crate::layout::{Frame, MapPart};
use crate::maps::atlas::{Atlas, DEPTH, PageCopy};
use crate::maps::culling::{CullCounts, DrawnMaps, Items};
use crate::maps::footprint::TexelRect;
use crate::maps::occluders::{CLUSTER, PIECE};
use crate::maps::states::MapUpdate;
use crate::parallel::in_order;
use crate::passes::shadow_maps::NEAR;
use crate::resident::Resident;
use crate::settings::RendererOptions;
use crate::{Result, shaders};
use std::ops::Range;

/// Items in one list at the most: 32 MiB of them.
const MAX_ITEMS: u32 = 4 << 20;
/// Maps whose items are found on all cores before they are drawn, at least.
const CULLED_AT_ONCE: usize = 64;
/// In how many parts a frame's maps are drawn for that, whatever their number, at most; but for pages, and lists that are full.
const MOST_PARTS: usize = 4;
/// Workgroups that copy a part of a map: a multiple of the threads of most software devices.
const COPY_GROUPS: u32 = 16;

pub(crate) struct MapPages {
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
}

/// What is drawn into the maps.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Drawing {
    /// All.
    Atlas,
    /// What does not move, to be kept apart.
    Still,
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

/// Kinds of items: opaque and masked clusters of what does not move; opaque clusters of what does, pieces of such, masked ones, and
/// texels.
const KINDS: usize = 6;
/// How many of them are of what does not move.
const STILL: usize = 2;

/// Triangles of an item of each kind but texels.
const TRIANGLES: [u32; KINDS - 1] = [CLUSTER, CLUSTER, CLUSTER, PIECE, CLUSTER];

impl MapPages {
    pub fn new(device: &wgpu::Device, shared: &Shared, options: &RendererOptions) -> Self {
        let clips = device.features().contains(wgpu::Features::CLIP_DISTANCES);
        let source = if clips { &shaders::SHADOW_MAPS_CLIP } else { &shaders::SHADOW_MAPS_DISCARD };
        let pipeline = |source, vertex, fragment, (topology, compare), cluster: u32| {
            let constants = [
                ("PARAMETERISATION", f64::from(options.shadow_map as u32)),
                ("NEAR", NEAR),
                ("CLUSTER", f64::from(cluster)),
            ];
            let draw = Draw { vertex, fragment, topology, depth: Some((DEPTH, compare)), targets: vec![] };
            RenderKernel::new(device, shared, source, draw, &constants)
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
        }
    }

    /// Orders what every scene needs, see [`RenderKernel::order`].
    pub fn order(&self, shared: &Shared) -> bool {
        self.opaque.order(shared)
    }

    /// Draws parts of maps. `cull` finds what is drawn there; what kernels rasterise is left to `merge` where a round is drawn. Adds to
    /// what was drawn.
    ///
    /// # Errors
    /// [`crate::Error::TooLarge`] where a list of what to draw exceeds the device's limits.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &Resident,
        (updates, drawing): (&[MapUpdate], Drawing),
        cull: impl Fn(&MapUpdate) -> ([Items; 2], CullCounts) + Sync,
        merge: impl Fn(&mut Recorder, &Items) -> Result<()>,
        drawn: &mut DrawnMaps,
    ) -> Result<()> {
        let at_once = at_once(updates);
        let (mut items, mut passes, mut undrawn) = (<[Items; 2]>::default(), Vec::new(), 0);
        let rounds = rounds(&scene.atlas, updates);
        for round in &rounds {
            let mut is_first = true;
            let mut first = counts_of(&items);
            for (block, updates) in round.updates.chunks(at_once).enumerate() {
                let culled = in_order(updates, &cull);
                undrawn += culled.len();
                for (index, (new, counts)) in culled.into_iter().enumerate() {
                    drawn.culling += counts;
                    items.iter_mut().zip(new).for_each(|(items, new)| items.append(new));
                    let is_last = block * at_once + index + 1 == round.updates.len();
                    let ends = counts_of(&items);
                    // The device draws while the next ones are found.
                    let is_enough = undrawn >= at_once && index + 1 == updates.len();
                    let is_full = is_enough || ends.iter().sum::<u32>() >= MAX_ITEMS;
                    if is_last || is_full {
                        let ranges = std::array::from_fn(|kind| first[kind]..ends[kind]);
                        let pass = Pass { round, is_first, is_last, items: ranges };
                        if pass.keeps(scene, drawing) {
                            drawn.kept.extend(round.updates.iter().map(|update| update.light));
                        }
                        passes.push(pass);
                        is_first = false;
                    }
                    if is_full {
                        self.draw(recorder, scene, &items, &passes, drawing)?;
                        if is_last {
                            merge(recorder, &items[0])?;
                            items = Default::default();
                        }
                        items.iter_mut().for_each(Items::forget_drawn);
                        recorder.split();
                        undrawn = 0;
                        passes.clear();
                        first = counts_of(&items);
                    }
                }
            }
        }
        if !passes.is_empty() {
            self.draw(recorder, scene, &items, &passes, drawing)?;
            merge(recorder, &items[0])?;
        }
        Ok(())
    }

    fn draw(
        &self,
        recorder: &mut Recorder,
        scene: &Resident,
        items: &[Items; 2],
        passes: &[Pass],
        drawing: Drawing,
    ) -> Result<()> {
        let Resident { lights, atlas, .. } = scene;
        let device = recorder.device;
        let kernels = [&self.opaque, &self.masked, &self.opaque, &self.pieces, &self.masked];
        let [opaque, masked] = &atlas.positions;
        let [of_opaque, of_masked] = items;
        let lists =
            [&of_opaque.still, &of_masked.still, &of_opaque.clusters, &of_opaque.pieces, &of_masked.clusters];
        let positions = [opaque, masked, opaque, opaque, masked];
        let mut groups = Vec::with_capacity(kernels.len());
        for ((kernel, items), positions) in kernels.iter().zip(lists).zip(positions) {
            // What is not drawn is not compiled.
            if items.is_empty() {
                groups.push(None);
                continue;
            }
            let list = storage(device, "items", items)?;
            let resources = [
                buffer("lights", &lights.buffer),
                buffer("positions", positions),
                buffer("items", &list),
                buffer("maps", &atlas.maps),
                buffer("coordinates", &atlas.coordinates),
            ];
            groups.push(Some(kernel.group(device, &resources)));
        }
        let texels = match &of_opaque.texels[..] {
            [] => None,
            _ if atlas.is_refreshed() => None,
            texels => Some(storage(device, "texels", texels)?),
        };
        let texel_group = texels.map(|texels| {
            self.texels.group(device, &[buffer("texels", &texels), buffer("maps", &atlas.maps)])
        });
        for pass in passes {
            let Pass { round, is_first, is_last, items: ranges } = pass;
            let parts: Vec<MapPart> = match round.whole_page {
                None => round.updates.iter().map(|update| map_part(atlas, update)).collect(),
                Some(_) => Vec::new(),
            };
            let parts = storage(device, "parts of maps", &parts)?;
            let (all, still) = (0..KINDS, 0..STILL);
            let draws = match pass.keeps(scene, drawing) {
                false if drawing == Drawing::Still => vec![(all, vec![Drawing::Still])],
                false => vec![(all, vec![Drawing::Atlas])],
                true if pass.draws_moving() => {
                    vec![(still, vec![Drawing::Still]), (STILL..KINDS, vec![Drawing::Atlas])]
                }
                true => vec![(all, vec![Drawing::Still, Drawing::Atlas])],
            };
            for (kinds, targets) in draws {
                let is_first = *is_first && kinds.start == 0;
                let clears = is_first && round.whole_page.is_some();
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
                if is_first && !clears {
                    let resources = [buffer("parts", &parts), buffer("maps", &atlas.maps)];
                    self.clear.set(&mut pass, (None, None), &self.clear.group(device, &resources));
                    pass.draw(0..4, 0..round.updates.len() as u32);
                }
                for kind in kinds.clone().filter(|&kind| !ranges[kind].is_empty()) {
                    if let (Some(triangles), Some(group)) =
                        (TRIANGLES.get(kind), groups.get(kind).and_then(Option::as_ref))
                    {
                        kernels[kind].set(&mut pass, (None, Some(&scene.geometry.group)), group);
                        pass.draw(0..3 * triangles, ranges[kind].clone());
                    } else if let Some(group) = &texel_group {
                        self.texels.set(&mut pass, (None, None), group);
                        pass.draw(ranges[kind].clone(), 0..1);
                    }
                }
                drop(pass);
                if let (true, Some(copy)) = (*is_last, &atlas.copy) {
                    self.copy(recorder, atlas, round, (copy, &targets), &parts);
                }
            }
        }
        Ok(())
    }

    /// Copies what was drawn to the atlas, and to where what does not move is kept.
    fn copy(
        &self,
        recorder: &mut Recorder,
        atlas: &Atlas,
        round: &Round,
        (page, targets): (&PageCopy, &[Drawing]),
        parts: &wgpu::Buffer,
    ) {
        let (textures, views): (Vec<_>, Vec<_>) = targets
            .iter()
            .map(|target| match (target, &atlas.still) {
                (Drawing::Still, Some(still)) => (&still.texture, &still.view),
                _ => (&atlas.texture, atlas.view().atlas),
            })
            .unzip();
        match (round.whole_page, &self.copy) {
            (None, Some(kernel)) => {
                for view in views {
                    let resources =
                        [texture("drawn", &atlas.pages[0]), texture("atlas", view), buffer("parts", parts)];
                    let groups = Groups::Count([round.updates.len() as u32, COPY_GROUPS]);
                    let nothing = Frame::default();
                    kernel.record(recorder, (&nothing, None), "copy_maps_gpu_ms", &resources, groups);
                }
            }
            (whole, _) => page.record(recorder.encoder(), &textures, whole.unwrap_or(0)),
        }
    }
}

impl Pass<'_> {
    /// Whether anything that moves is drawn by it.
    fn draws_moving(&self) -> bool {
        self.items[STILL..TRIANGLES.len()].iter().any(|items| !items.is_empty())
    }

    /// Whether what does not move is kept apart as a part of drawing all of it: that costs little where pages are copied as a whole. It
    /// is when maps are first drawn; lights that went elsewhere since may go on.
    fn keeps(&self, scene: &Resident, drawing: Drawing) -> bool {
        let is_whole = self.round.whole_page.is_some() && self.is_first && self.is_last;
        let is_new = |update: &MapUpdate| scene.atlas.states.is_new(update.light);
        drawing == Drawing::Atlas
            && is_whole
            && scene.atlas.is_refreshed()
            && self.round.updates.iter().all(is_new)
    }
}

/// How many maps' items are found on all cores before they are drawn.
pub(super) fn at_once(updates: &[MapUpdate]) -> usize {
    updates.len().div_ceil(MOST_PARTS).max(CULLED_AT_ONCE)
}

/// How many items there are of each kind.
fn counts_of([opaque, masked]: &[Items; 2]) -> [u32; KINDS] {
    let still = [opaque.still.len(), masked.still.len()];
    let moving = [opaque.clusters.len(), opaque.pieces.len(), masked.clusters.len(), opaque.texels.len()];
    std::array::from_fn(|kind| still.iter().chain(&moving).nth(kind).map_or(0, |n| *n as u32))
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
