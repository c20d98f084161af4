//! From a grid of points to one with half the step: points between neighbours that receive nearly the same light are
//! interpolated, the others are listed for shading (Barczak §4.3.3).

use super::sort_points::ListedPoints;
use super::visibility_buffer::Seen;
use super::{BandSample, Compiler, GridView, LightMapsView};
use crate::device::kernel::{Groups, Kernel, Shared, buffer, order_all, texture};
use crate::device::recorder::Recorder;
use crate::points::lists::{CURVED_AT, FLAT_AT, PointLists};
use crate::shaders;

pub(crate) struct Refine {
    refine: Kernel,
    test_flat: Kernel,
    /// The same for candidates on curved surfaces, if there are any.
    test_curved: Option<Kernel>,
}

impl Refine {
    pub fn new(compiler: &Compiler) -> Self {
        let tests = shaders::test_candidates(&compiler.shared.kernels);
        Self {
            refine: compiler.kernel(&shaders::REFINE, "refine"),
            test_flat: compiler.kernel(tests, "test_flat_candidates"),
            test_curved: compiler.features.curved.then(|| compiler.kernel(tests, "test_curved_candidates")),
        }
    }

    /// See [`Kernel::order`]; what takes long to compile comes first.
    pub fn order(&self, shared: &Shared) -> bool {
        order_all(self.test_curved.iter().chain([&self.test_flat, &self.refine]), shared)
    }

    /// Fills `fine`, the grid of the band's step, from `coarse`, that of twice the step, as far as that can be done by
    /// interpolation; with radiance as the output, the picture.
    pub fn record<'a>(
        &self,
        recorder: &mut Recorder,
        band: &BandSample,
        seen: Seen,
        light_maps: LightMapsView,
        lists: &'a PointLists,
        [coarse, fine]: [GridView; 2],
    ) -> ListedPoints<'a> {
        let resources = [
            texture("triangle_ids", seen.triangle_ids),
            texture("surface_ids", seen.surface_ids),
            texture("mirror_hits", seen.ends()),
            texture("coarse_irradiance", coarse.irradiance),
            texture("coarse_directional", coarse.directional),
            texture("fine_irradiance", fine.irradiance),
            texture("fine_directional", fine.directional),
            texture("picture", &band.targets.picture_view),
            buffer("receivers", light_maps.receivers.receivers()),
            buffer("shade_list", &lists.shade_list),
            buffer("candidates", &lists.candidates),
            buffer("offsets", lists.offsets(light_maps.used)),
        ];
        let cells = Groups::rows(band.grid_size(2 * band.frame.step));
        self.refine.record(recorder, band.groups(), "select_gpu_ms", &resources, cells);
        for (kernel, at) in [(Some(&self.test_flat), FLAT_AT), (self.test_curved.as_ref(), CURVED_AT)] {
            if let Some(kernel) = kernel {
                let groups = Groups::Indirect(&lists.candidates, at);
                kernel.record(recorder, band.groups(), "select_gpu_ms", &resources, groups);
            }
        }
        ListedPoints::new(lists)
    }
}
