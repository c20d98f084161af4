//! Light maps (Barczak §4.3.2): for each leaf patch the sum of the lights that its map holds, without visibility.

use super::{Compiler, LightMapsView, batches};
use crate::Result;
use crate::device::buffers::storage;
use crate::device::kernel::{Groups, Kernel, Shared, buffer};
use crate::device::recorder::Recorder;
use crate::gpu_scene::light_maps::LightMapChanges;
use crate::gpu_scene::lights::GpuLights;
use crate::gpu_scene::receivers::Receivers;
use crate::layout::{self, Frame};
use crate::resident::Resident;
use crate::shader_constants::{BATCH, GROUPS_PER_ROW};
use crate::shaders;
use girandole_core::lights::Clamp;

pub(crate) struct LightMaps {
    kernel: Kernel,
}

impl LightMaps {
    pub fn new(compiler: &Compiler) -> Self {
        Self { kernel: compiler.kernel(&shaders::LIGHT_MAPS, "update_light_maps") }
    }

    /// See [`Kernel::order`].
    pub fn order(&self, shared: &Shared) -> bool {
        self.kernel.order(shared)
    }

    /// Adds lights to maps and takes others away, batch by batch, with this bound of the geometric factor.
    ///
    /// # Errors
    /// [`crate::Error::TooLarge`] where a list exceeds the device's limits.
    pub fn record<'a>(
        &self,
        recorder: &mut Recorder,
        scene: &Resident,
        receivers: &'a Receivers,
        changes: &LightMapChanges,
        clamp: Clamp,
    ) -> Result<LightMapsView<'a>> {
        let view = LightMapsView { receivers, used: true };
        if changes.is_empty() {
            return Ok(view);
        }
        let (device, lights) = (recorder.device, &scene.lights);
        let changed = storage(device, "changes of light maps", &changes.lights)?;
        let former = changes.former.clone().map(|former| GpuLights::new(device, former)).transpose()?;
        let former = former.as_ref().unwrap_or(lights);
        // What is taken away goes through the kernel that added it, with the lights of then: to the bit the same sum.
        let batches = batches(lights.count(), BATCH).zip(&changes.updates);
        let updates = batches.flat_map(|(batch, [taken_away, added])| {
            [(batch.first, taken_away, former), (batch.first, added, lights)]
        });
        for (first, updates, lights) in updates.filter(|(_, updates, _)| !updates.is_empty()) {
            let frame = Frame { batch: first / BATCH, clamp: layout::clamp(clamp), ..Frame::default() };
            let count = updates.len() as u32;
            let updates = storage(device, "updates of light maps", updates)?;
            let resources = [
                ("lights", wgpu::BindingResource::Buffer(lights.batch(first))),
                buffer("light_lists", receivers.light_lists()),
                buffer("light_maps", &receivers.light_maps.maps),
                buffer("sums", &receivers.light_maps.sums),
                buffer("updates", &updates),
                buffer("changes", &changed),
            ];
            let groups = [count.min(GROUPS_PER_ROW), count.div_ceil(GROUPS_PER_ROW)];
            self.kernel.record(
                recorder,
                (&frame, Some(&scene.geometry.group)),
                "light_maps_gpu_ms",
                &resources,
                Groups::Count(groups),
            );
        }
        Ok(view)
    }
}
