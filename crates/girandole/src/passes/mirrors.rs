//! Mirror images: what rays meet that smooth surfaces reflect, see `shaders/trace_mirrors.wgsl`.

use super::visibility_buffer::Seen;
use super::{BandSample, Compiler, GridView};
use crate::device::kernel::{Groups, Kernel, Shared, buffer, order_all, texture};
use crate::device::recorder::Recorder;
use crate::rays::RayHierarchies;
use crate::shaders;

pub(crate) struct Mirrors {
    /// From what the camera sees.
    trace: Kernel,
    /// From where rays end.
    trace_further: Kernel,
    add: Kernel,
    blur: Kernel,
    put: Kernel,
}

impl Mirrors {
    pub fn new(compiler: &Compiler) -> Self {
        let further = compiler.mirrored();
        Self {
            trace: compiler.kernel(&shaders::TRACE_MIRRORS, "trace_mirrors"),
            trace_further: further.kernel(&shaders::TRACE_MIRRORS, "trace_mirrors"),
            add: further.kernel(&shaders::ADD_MIRRORED, "add_mirrored"),
            blur: compiler.kernel(&shaders::PUT_MIRRORS, "blur_mirrors"),
            put: compiler.kernel(&shaders::PUT_MIRRORS, "put_mirrors"),
        }
    }

    /// See [`Kernel::order`].
    pub fn order(&self, shared: &Shared) -> bool {
        order_all([&self.trace, &self.trace_further, &self.add, &self.blur, &self.put], shared)
    }

    /// Sends ray `index` of the band's sample from what is seen: where it ends is seen next.
    pub fn trace<'a>(
        &self,
        recorder: &mut Recorder,
        band: &BandSample<'a>,
        hierarchies: &RayHierarchies,
        seen: Seen,
        index: u32,
    ) -> Seen<'a> {
        let targets = band.targets.mirrors(recorder.device);
        let next = targets.ends(recorder.device, band.frame.sample, index);
        let mut resources = vec![
            texture("triangle_ids", seen.triangle_ids),
            texture("mirror_hits", seen.ends()),
            texture("ray_texels", &hierarchies.texels),
            buffer("triangle_surfaces", &band.scene.triangle_surfaces),
            buffer("mirror_image", &targets.image),
            texture("next_triangle_ids", &next.triangle_ids),
            texture("next_surface_ids", &next.surface_ids),
            texture("next_hits", &next.hits),
        ];
        resources.extend(band.reflected_environment());
        let kernel = if index == 0 { &self.trace } else { &self.trace_further };
        let band = band.with_layer(index, false);
        kernel.record(recorder, band.groups(), "mirrors_gpu_ms", &resources, Groups::tiles(band.size()));
        Seen {
            triangle_ids: &next.triangle_ids,
            surface_ids: &next.surface_ids,
            depth: &band.targets.depth,
            mirror_hits: Some(&next.hits),
        }
    }

    /// Adds what is sent from where rays end.
    pub fn add(&self, recorder: &mut Recorder, band: &BandSample, ends: Seen, lit: GridView) {
        let mut resources = vec![
            texture("triangle_ids", ends.triangle_ids),
            texture("mirror_hits", ends.ends()),
            texture("irradiance", lit.irradiance),
            texture("directional", lit.directional),
            buffer("mirror_image", &band.targets.mirrors(recorder.device).image),
        ];
        resources.extend(band.reflected_environment());
        self.add.record(recorder, band.groups(), "mirrors_gpu_ms", &resources, Groups::tiles(band.size()));
    }

    /// Adds what a sample's surfaces make of that to the samples before.
    pub fn blur(&self, recorder: &mut Recorder, band: &BandSample, seen: Seen) {
        let targets = band.targets.mirrors(recorder.device);
        let resources = [
            texture("triangle_ids", seen.triangle_ids),
            texture("surface_ids", seen.surface_ids),
            texture("first_hits", &targets.ends(recorder.device, 0, 0).hits),
            buffer("mirror_image", &targets.image),
        ];
        self.blur.record(recorder, band.groups(), "mirrors_gpu_ms", &resources, Groups::tiles(band.size()));
    }

    /// Adds all samples' to a band of the picture.
    pub fn put(&self, recorder: &mut Recorder, band: &BandSample) {
        let (_, view) = band.targets.composite(recorder.device);
        let resources = [
            buffer("mirror_image", &band.targets.mirrors(recorder.device).image),
            texture("picture", &band.targets.picture_view),
            texture("with_mirrors", view),
        ];
        self.put.record(recorder, band.groups(), "mirrors_gpu_ms", &resources, Groups::tiles(band.size()));
        band.take_composite(recorder);
    }
}
