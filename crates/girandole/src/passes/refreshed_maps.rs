//! Parts of shadow maps that kernels refresh: what moves is rasterised beside the maps, the nearest of each texel, and merged with
//! what else they show.

use super::shadow_maps::NEAR;
use crate::Result;
use crate::device::buffers::storage;
use crate::device::kernel::{Groups, Kernel, Shared, buffer, texture};
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

pub(crate) struct RefreshedMaps {
    rasterize: Kernel,
    merge_still: Kernel,
    merge_drawn: Kernel,
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
        let kernel = |source, entry| Kernel::new(device, shared, source, entry, &constants);
        Self {
            rasterize: kernel(&shaders::RASTERIZE_PIECES, "rasterize_pieces"),
            merge_still: kernel(&shaders::MERGE_MAPS, "merge_still"),
            merge_drawn: kernel(&shaders::MERGE_MAPS, "merge_drawn"),
        }
    }

    /// Refreshes parts of maps, with pieces and texels of these items.
    ///
    /// # Errors
    /// [`crate::Error::TooLarge`] where lists exceed the device's limits.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &Resident,
        still: &StillMaps,
        items: &Items,
        (parts, beside): (&[RefreshedPart], Beside),
    ) -> Result<()> {
        if parts.is_empty() {
            return Ok(());
        }
        let pieces = storage(recorder.device, "pieces", &items.rasterized)?;
        let texels = storage(recorder.device, "texels", &items.texels)?;
        let lists = [buffer("pieces", &pieces), buffer("texels", &texels)];
        let (mut batch, mut texels) = (Vec::new(), 0);
        for part in parts {
            if texels > 0 && texels + part.texels() > still.texels() {
                self.batch(recorder, scene, still, &lists, (&batch, texels, beside))?;
                batch.clear();
                texels = 0;
            }
            batch.push(RefreshedPart { nearest: texels as u32, ..*part });
            texels += part.texels();
        }
        self.batch(recorder, scene, still, &lists, (&batch, texels, beside))
    }

    /// As many parts as have room beside the maps.
    fn batch(
        &self,
        recorder: &mut Recorder,
        scene: &Resident,
        still: &StillMaps,
        lists: &[crate::device::kernel::Binding; 2],
        (parts, texels, beside): (&[RefreshedPart], u64, Beside),
    ) -> Result<()> {
        let Resident { lights, atlas, .. } = scene;
        let list = storage(recorder.device, "parts of maps", parts)?;
        recorder.encoder().clear_buffer(&still.nearest, 0, Some(texels * size_of::<u32>() as u64));
        let [pieces, texels] = lists.clone();
        let resources = [
            buffer("lights", &lights.buffer),
            buffer("parts", &list),
            buffer("maps", &atlas.maps),
            buffer("positions", &atlas.positions[0]),
            pieces,
            texels,
            buffer("nearest", &still.nearest),
            texture("still", &still.view),
            texture("atlas", atlas.view().atlas),
        ];
        let groups = Groups::Count([parts.len() as u32, PART_GROUPS]);
        let nothing = Frame::default();
        self.rasterize.record(recorder, (&nothing, None), "rasterize_maps_gpu_ms", &resources, groups);
        let merge = if beside == Beside::Still { &self.merge_still } else { &self.merge_drawn };
        merge.record(recorder, (&nothing, None), "merge_maps_gpu_ms", &resources, groups);
        Ok(())
    }
}
