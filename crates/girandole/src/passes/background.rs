//! The environment behind the picture, see `shaders/background.wgsl`.

use super::BandSample;
use crate::device::kernel::{Groups, Kernel, Shared, texture};
use crate::device::recorder::Recorder;
use crate::shader_constants::TILE;
use crate::shaders;

pub(crate) struct Background {
    kernel: Kernel,
}

impl Background {
    pub fn new(device: &wgpu::Device, shared: &Shared) -> Self {
        Self { kernel: Kernel::new(device, shared, &shaders::BACKGROUND, "background", &[]) }
    }

    /// Puts it behind a picture that is done, `whole`.
    pub fn record(&self, recorder: &mut Recorder, whole: &BandSample, environment: &wgpu::TextureView) {
        let targets = whole.targets;
        let (behind, view) = targets.composite(recorder.device);
        let resources = [
            texture("environment", environment),
            texture("picture", &targets.picture_view),
            texture("with_background", view),
        ];
        let groups = Groups::Count(targets.size.map(|n| n.div_ceil(TILE)));
        self.kernel.record(recorder, (&whole.frame, None), "background_gpu_ms", &resources, groups);
        let [from, to] = [behind, &targets.picture].map(wgpu::Texture::as_image_copy);
        recorder.encoder().copy_texture_to_texture(from, to, targets.picture.size());
    }
}
