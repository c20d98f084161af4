//! Shadow maps: those parts of them that are stale.

use crate::Result;
use crate::device::kernel::Shared;
use crate::device::recorder::Recorder;
use crate::layout::RefreshedPart;
use crate::maps::atlas::MapsView;
use crate::maps::culling::{CullCounts, DrawnMaps, Items, Wanted};
use crate::maps::footprint::{MapView, TexelRect};
use crate::maps::states::MapUpdate;
use crate::maps::still::StillMaps;
use crate::parallel::in_order;
use crate::passes::map_pages::{Drawing, MapPages, at_once};
use crate::passes::refreshed_maps::{Beside, RefreshedMaps};
use crate::resident::Resident;
use crate::settings::RendererOptions;

/// The unit of stored depth: a map holds this over the distance. Nothing nearer to a light blocks it.
pub(crate) const NEAR: f64 = 1e-6;

pub(crate) struct ShadowMaps {
    pages: MapPages,
    /// Refreshes maps, where software devices copy them.
    refreshed: Option<RefreshedMaps>,
    faces: u32,
}

impl ShadowMaps {
    pub fn new(device: &wgpu::Device, shared: &Shared, options: &RendererOptions) -> Self {
        let is_refreshed = StillMaps::are_wanted(&shared.tuning, options);
        Self {
            pages: MapPages::new(device, shared, options),
            refreshed: is_refreshed.then(|| RefreshedMaps::new(device, shared, options)),
            faces: options.shadow_map.faces(),
        }
    }

    /// Orders what every scene needs; `may_move`: also what refreshes maps.
    pub fn order(&self, shared: &Shared, may_move: bool) -> bool {
        let are_there = self.pages.order(shared);
        self.refreshed.as_ref().filter(|_| may_move).is_none_or(|refreshed| refreshed.order(shared))
            & are_there
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
    ) -> Result<(MapsView<'a>, DrawnMaps)> {
        let atlas = &scene.atlas;
        let mut drawn = DrawnMaps::default();
        let kernels = self.refreshed.as_ref().zip(atlas.still.as_ref());
        let mut rest = updates.to_vec();
        if let Some((kernels, still)) = kernels {
            rest = self.refresh(recorder, scene, (kernels, still), updates, &mut drawn)?;
        }
        let wanted = Wanted { still: true, moving: true, by_kernel: kernels.is_some() };
        let merge = |recorder: &mut Recorder, items: &Items| match kernels {
            Some((kernels, still)) => {
                kernels.record(recorder, scene, still, items, (&items.covered, Beside::Drawn))
            }
            None => Ok(()),
        };
        self.draw(recorder, scene, (&rest, Drawing::Atlas), wanted, merge, &mut drawn)?;
        Ok((atlas.view(), drawn))
    }

    /// Draws parts of maps by the device.
    fn draw(
        &self,
        recorder: &mut Recorder,
        scene: &Resident,
        maps: (&[MapUpdate], Drawing),
        wanted: Wanted,
        merge: impl Fn(&mut Recorder, &Items) -> Result<()>,
        drawn: &mut DrawnMaps,
    ) -> Result<()> {
        let cull = |update: &MapUpdate| self.cull(scene, update, wanted);
        self.pages.record(recorder, scene, maps, cull, merge, drawn)
    }

    /// Refreshes parts of maps from what does not move there and is kept apart. Returns those that are to be drawn instead.
    fn refresh(
        &self,
        recorder: &mut Recorder,
        scene: &Resident,
        (kernels, still): (&RefreshedMaps, &StillMaps),
        updates: &[MapUpdate],
        drawn: &mut DrawnMaps,
    ) -> Result<Vec<MapUpdate>> {
        let Resident { lights, atlas, .. } = scene;
        // What became stale by what moved is likely to do so again; what did by its light's own motion may never be drawn from there again.
        let is_refreshed = |update: &MapUpdate| {
            !lights.samples[update.light as usize].is_parallel() && atlas.states.is_valid(update.light)
        };
        let (refreshed, mut rest): (Vec<MapUpdate>, Vec<MapUpdate>) =
            updates.iter().partition(|update| is_refreshed(update));
        let only_still = Wanted { still: true, moving: false, by_kernel: false };
        let only_moving = Wanted { still: false, moving: true, by_kernel: true };
        for updates in refreshed.chunks(at_once(&refreshed)) {
            let culled = in_order(updates, |update| self.cull(scene, update, only_moving));
            let (mut items, mut parts, mut new) = (Items::default(), Vec::new(), Vec::new());
            for (&update, ([opaque, masked], count)) in updates.iter().zip(culled) {
                if opaque.are_drawn() || masked.are_drawn() {
                    rest.push(update);
                    continue;
                }
                drawn.culling += count;
                let MapUpdate { light, part: TexelRect { first, end } } = update;
                let found = opaque.covered.first().copied().unwrap_or_default();
                let found = found.after([items.rasterized.len(), items.texels.len()].map(|n| n as u32));
                parts.push(RefreshedPart { first, end, light, ..found });
                items.append(opaque);
                if !atlas.states.is_kept(light) {
                    let part = TexelRect::whole(atlas.layout.slots[light as usize].size);
                    new.push(MapUpdate { light, part });
                }
            }
            self.draw(recorder, scene, (&new, Drawing::Still), only_still, |_, _| Ok(()), drawn)?;
            drawn.kept.extend(new.iter().map(|update| update.light));
            kernels.record(recorder, scene, still, &items, (&parts, Beside::Still))?;
            recorder.split();
        }
        rest.sort_unstable_by_key(|update| update.light);
        Ok(rest)
    }

    /// What is drawn of each kind of occluders for a part of a map.
    fn cull(&self, scene: &Resident, update: &MapUpdate, wanted: Wanted) -> ([Items; 2], CullCounts) {
        let Resident { lights, atlas, hidden, .. } = scene;
        let &MapUpdate { light, part } = update;
        let slot = atlas.layout.slots[light as usize];
        let map = MapView::new(&lights.samples[light as usize], slot.size, self.faces);
        let is_hidden = |object| hidden.is_hidden(object, light as usize);
        let (mut items, mut counts) = (<[Items; 2]>::default(), CullCounts::default());
        for (clusters, items) in atlas.occluders.sets().into_iter().zip(&mut items) {
            if !clusters.bounds.is_empty() || std::ptr::eq(clusters, &atlas.occluders.opaque) {
                counts += clusters.cull((light, map), part, is_hidden, wanted, items);
            }
            if !wanted.by_kernel {
                items.texels.iter_mut().for_each(|texel| *texel = texel.in_page(slot.origin));
            }
        }
        (items, counts)
    }
}
