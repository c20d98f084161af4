//! Puts what surfaces that let light through send, and leave of what lies behind, before the picture; see
//! `shaders/layers.wgsl`.

use super::visibility_buffer::Seen;
use super::{BandSample, Compiler, GridView};
use crate::device::kernel::{Groups, Kernel, Shared, buffer, order_all, texture};
use crate::device::recorder::Recorder;
use crate::shaders;

pub(crate) struct Layers {
    add: Kernel,
    put_before: Kernel,
}

impl Layers {
    pub fn new(compiler: &Compiler) -> Self {
        let source = if compiler.features.reflects_environment {
            &shaders::LAYERS_REFLECTING
        } else {
            &shaders::LAYERS
        };
        let kernel = |entry| compiler.kernel(source, entry);
        Self { add: kernel("add_layer"), put_before: kernel("put_before") }
    }

    /// See [`Kernel::order`].
    pub fn order(&self, shared: &Shared) -> bool {
        order_all([&self.add, &self.put_before], shared)
    }

    /// Adds the layer of `band`, from the nearest.
    pub fn add(&self, recorder: &mut Recorder, band: &BandSample, seen: Seen, lit: GridView) {
        let mut resources = vec![
            texture("triangle_ids", seen.triangle_ids),
            texture("irradiance", lit.irradiance),
            texture("directional", lit.directional),
            buffer("layer_sums", &band.targets.layers(recorder.device).sums),
        ];
        resources.extend(band.reflected_environment());
        let groups = Groups::tiles(band.size());
        self.add.record(recorder, band.groups(), "layers_gpu_ms", &resources, groups);
    }

    /// Puts the layers of all samples of a band before its picture.
    pub fn put_before(&self, recorder: &mut Recorder, band: &BandSample) {
        let targets = band.targets;
        let (_, view) = targets.composite(recorder.device);
        let resources = [
            buffer("layer_sums", &targets.layers(recorder.device).sums),
            texture("picture", &targets.picture_view),
            texture("with_layers", view),
        ];
        let groups = Groups::tiles(band.size());
        self.put_before.record(recorder, band.groups(), "layers_gpu_ms", &resources, groups);
        band.take_composite(recorder);
    }
}
