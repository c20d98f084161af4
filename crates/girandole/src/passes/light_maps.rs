//! Light maps (Barczak §4.3.2): for each leaf patch the sum of the lights that its map holds, without visibility.

use super::{Compiler, LightMapsView, batches};
use crate::device::kernel::{Groups, Kernel, buffer};
use crate::device::recorder::Recorder;
use crate::layout::{self, Frame};
use crate::resident::Resident;
use crate::scene::receivers::Receivers;
use crate::shader_constants::{BATCH, GROUPS_PER_ROW};
use crate::shaders;
use girandole_core::lights::Clamp;

pub(crate) struct LightMaps {
    kernel: Kernel,
}

impl LightMaps {
    pub fn new(compiler: &Compiler) -> Self {
        Self { kernel: compiler.kernel(&shaders::LIGHT_MAPS, "bake_light_maps") }
    }

    /// Sums all lights anew, batch by batch, with this bound of the geometric factor.
    pub fn record<'a>(
        &self,
        recorder: &mut Recorder,
        scene: &Resident,
        receivers: &'a Receivers,
        clamp: Clamp,
    ) -> LightMapsView<'a> {
        let lights = &scene.lights;
        let offsets = receivers.offsets_buffer(recorder.device);
        for batch in batches(lights.count(), BATCH) {
            let frame = Frame { batch: batch.first / BATCH, clamp: layout::clamp(clamp), ..Frame::default() };
            let resources = [
                ("lights", wgpu::BindingResource::Buffer(lights.batch(batch.first))),
                buffer("light_lists", &receivers.light_lists),
                buffer("light_maps", &receivers.light_maps),
                buffer("offsets", &offsets),
            ];
            let leaves = receivers.leaves;
            let groups = [leaves.min(GROUPS_PER_ROW), leaves.div_ceil(GROUPS_PER_ROW)];
            let groups = Groups::Count(groups);
            self.kernel.record(
                recorder,
                (&frame, Some(&scene.geometry.group)),
                "light_maps_gpu_ms",
                &resources,
                groups,
            );
        }
        LightMapsView { receivers, used: true }
    }
}
