//! Puts what surfaces that let light through send, and leave of what lies behind, before the picture; see
//! `shaders/layers.wgsl`.

use super::visibility_buffer::Seen;
use super::{BandSample, Compiler, GridView};
use crate::device::kernel::{Groups, Kernel, Shared, buffer, order_all, texture};
use crate::device::recorder::Recorder;
use crate::shaders;

pub(crate) struct Layers {
    add: Kernel,
    /// With what mirrored rays brought to a layer, if any may be smooth enough.
    add_mirrored: Option<Kernel>,
    put_before: Kernel,
}

impl Layers {
    pub fn new(compiler: &Compiler) -> Self {
        let add_mirrored = || compiler.kernel(&shaders::LAYERS_MIRRORING, "add_layer");
        Self {
            add: compiler.kernel(&shaders::LAYERS, "add_layer"),
            add_mirrored: compiler.features.mirrors_in_layers.then(add_mirrored),
            put_before: compiler.kernel(&shaders::LAYERS, "put_before"),
        }
    }

    /// See [`Kernel::order`].
    pub fn order(&self, shared: &Shared) -> bool {
        order_all([self.add_mirrored.as_ref().unwrap_or(&self.add), &self.put_before], shared)
    }

    /// Adds the layer of `band`, from the nearest; with mirror images, if there are any.
    pub fn add(
        &self,
        recorder: &mut Recorder,
        band: &BandSample,
        seen: Seen,
        lit: GridView,
        has_mirror_images: bool,
    ) {
        let mut resources = vec![
            texture("triangle_ids", seen.triangle_ids),
            texture("irradiance", lit.irradiance),
            texture("directional", lit.directional),
            buffer("layer_sums", &band.targets.layers(recorder.device).sums),
        ];
        resources.extend(band.reflected_environment());
        let mirrored = self.add_mirrored.as_ref().filter(|_| has_mirror_images);
        if mirrored.is_some() {
            resources.push(buffer("mirror_image", &band.targets.mirrors(recorder.device).image));
        }
        let groups = Groups::tiles(band.size());
        mirrored.unwrap_or(&self.add).record(recorder, band.groups(), "layers_gpu_ms", &resources, groups);
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
