//! Parts of shadow maps that kernels refresh: what moves is rasterised beside the maps, the nearest of each texel, and merged with
//! what else they show.

use super::shadow_maps::NEAR;
use crate::Result;
use crate::device::buffers::storage;
use crate::device::kernel::{Groups, Kernel, Shared, buffer, order_all, texture};
use crate::device::recorder::Recorder;
use crate::layout::{Frame, RefreshedPart};
use crate::maps::culling::Items;
use crate::maps::occluders::PIECE;
use crate::maps::still::StillMaps;
use crate::resident::Resident;
use crate::settings::RendererOptions;
use crate::shaders;

/// Workgroups a part: a multiple of the threads of most software devices.
const PART_GROUPS: u32 = 8;
/// Pieces in one list, and texels, but for a single map: 16 MiB of the former, 32 MiB of the latter.
const MAX_LISTED: u32 = 4 << 20;

pub(crate) struct RefreshedMaps {
    rasterize: Kernel,
    /// With what does not move, and with what was drawn.
    merge: [Kernel; 2],
}

/// What parts of maps show beside what is rasterised.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Beside {
    /// What does not move, from where it is kept.
    Still,
    /// What was drawn into them just now.
    Drawn,
}

impl RefreshedMaps {
    pub fn new(device: &wgpu::Device, shared: &Shared, options: &RendererOptions) -> Self {
        let constants = [
            ("PARAMETERISATION", f64::from(options.shadow_map as u32)),
            ("NEAR", NEAR),
            ("CLUSTER", f64::from(PIECE)),
        ];
        let merge = |is_drawn| {
            Kernel::new(device, shared, &shaders::MERGE_MAPS, "merge_maps", &[("IS_DRAWN", is_drawn)])
        };
        Self {
            rasterize: Kernel::new(
                device,
                shared,
                &shaders::RASTERIZE_PIECES,
                "rasterize_pieces",
                &constants,
            ),
            merge: [0.0, 1.0].map(merge),
        }
    }

    /// Orders what first pictures need, see [`Kernel::order`].
    pub fn order(&self, shared: &Shared) -> bool {
        order_all([&self.rasterize, &self.merge[usize::from(true)]], shared)
    }

    /// Refreshes parts of maps, with pieces and texels of these items.
    ///
    /// # Errors
    /// [`crate::Error::TooLarge`] where those of a single map exceed the device's limits.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &Resident,
        still: &StillMaps,
        items: &Items,
        (parts, beside): (&[RefreshedPart], Beside),
    ) -> Result<()> {
        let Resident { lights, atlas, .. } = scene;
        for batch in batches(parts, still.texels(), MAX_LISTED) {
            let (mut texels, mut list) = (0, Vec::with_capacity(batch.len()));
            for part in batch {
                list.push(RefreshedPart { nearest: texels as u32, ..part.behind(&batch[0]) });
                texels += part.texels();
            }
            let of = |first: u32, end: u32| first as usize..end as usize;
            let (first, last) = (&batch[0], &batch[batch.len() - 1]);
            let pieces = &items.rasterized[of(first.first_piece, last.end_piece)];
            let listed = &items.texels[of(first.first_texel, last.end_texel)];
            let device = recorder.device;
            let list = storage(device, "parts of maps", &list)?;
            let pieces = storage(device, "pieces", pieces)?;
            let listed = storage(device, "texels", listed)?;
            recorder.encoder().clear_buffer(&still.nearest, 0, Some(texels * size_of::<u32>() as u64));
            let resources = [
                buffer("lights", &lights.buffer),
                buffer("parts", &list),
                buffer("maps", &atlas.maps),
                buffer("positions", &atlas.positions[0]),
                buffer("pieces", &pieces),
                buffer("texels", &listed),
                buffer("nearest", &still.nearest),
                texture("still", &still.view),
                texture("atlas", atlas.view().atlas),
            ];
            let groups = Groups::Count([batch.len() as u32, PART_GROUPS]);
            let nothing = Frame::default();
            self.rasterize.record(recorder, (&nothing, None), "rasterize_maps_gpu_ms", &resources, groups);
            let merge = &self.merge[usize::from(beside == Beside::Drawn)];
            merge.record(recorder, (&nothing, None), "merge_maps_gpu_ms", &resources, groups);
        }
        Ok(())
    }
}

/// Which parts are refreshed at once: neighbours in the list, as many as have so many texels beside the maps and list so many pieces and
/// texels, or one.
fn batches(parts: &[RefreshedPart], texels: u64, listed: u32) -> impl Iterator<Item = &[RefreshedPart]> {
    let mut rest = parts;
    std::iter::from_fn(move || {
        let first = rest.first()?;
        let mut sum = 0;
        let fits = |part: &&RefreshedPart| {
            sum += part.texels();
            let part = part.behind(first);
            sum <= texels && part.end_piece <= listed && part.end_texel <= listed
        };
        let count = rest.iter().take_while(fits).count().max(1);
        let (batch, others) = rest.split_at(count);
        rest = others;
        Some(batch)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn batches_hold_what_has_room_and_every_part_once() {
        // Columns, pieces and texels of each.
        let sizes = [[8, 3, 0], [8, 3, 2], [1, 9, 0], [90, 0, 0], [0, 0, 0], [2, 1, 9], [2, 1, 1], [7, 8, 0]];
        let mut listed = [0, 0];
        let parts = sizes.map(|[columns, pieces, texels]| {
            let part = RefreshedPart {
                end: [columns, 1],
                end_piece: pieces,
                end_texel: texels,
                ..Default::default()
            };
            let part = part.after(listed);
            listed = [part.end_piece, part.end_texel];
            part
        });
        let lengths = |texels, listed| batches(&parts, texels, listed).map(<[_]>::len).collect::<Vec<_>>();
        // The first two fill the room beside the maps; the third, the fourth and the sixth exceed some bound each by itself.
        assert_eq!(lengths(16, 8), [2, 1, 1, 1, 1, 1, 1]);
        assert_eq!(lengths(16, 9), [2, 1, 1, 2, 2]);
        assert_eq!(lengths(16, 10), [2, 1, 1, 4]);
        assert_eq!(lengths(1000, 1000), [parts.len()]);
        assert!(batches(&[], 16, 8).next().is_none());
    }
}
