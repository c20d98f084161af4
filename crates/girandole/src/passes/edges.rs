//! Further samples of a pixel: interpolated between the first samples of this pixel and its neighbours, where those lie on
//! the same surface; the others are listed for shading.

use super::sort_points::ListedPoints;
use super::visibility_buffer::Seen;
use super::{BandSample, Compiler, GridView, LightMapsView};
use crate::device::kernel::{Binding, Groups, Kernel, Shared, buffer, order_all, texture};
use crate::device::recorder::Recorder;
use crate::points::lists::{FLAT_AT, PointLists};
use crate::shader_constants::EDGE_RUN;
use crate::shaders;

pub(crate) struct Edges {
    edges: Kernel,
    edge_fallback: Kernel,
    run: u32,
}

impl Edges {
    pub fn new(compiler: &Compiler) -> Self {
        let edges = shaders::edges(&compiler.shared.kernels);
        Self {
            edges: compiler.kernel(edges, "interpolate_edges"),
            edge_fallback: compiler.kernel(&shaders::EDGE_FALLBACK, "edge_fallback"),
            run: compiler.shared.kernels.tier.choose(1, EDGE_RUN),
        }
    }

    /// See [`Kernel::order`].
    pub fn order(&self, shared: &Shared) -> bool {
        order_all([&self.edges, &self.edge_fallback], shared)
    }

    /// Fills `fine`, or the picture, from the `first` samples, as far as that can be done by interpolation.
    pub fn record<'a>(
        &self,
        recorder: &mut Recorder,
        band: &BandSample,
        seen: Seen,
        light_maps: LightMapsView,
        lists: &'a PointLists,
        [first, fine]: [GridView; 2],
    ) -> ListedPoints<'a> {
        let mut resources = samples(band, seen, first, fine).to_vec();
        resources.extend([
            texture("triangle_ids", seen.triangle_ids),
            buffer("receivers", light_maps.receivers.receivers()),
            buffer("shade_list", &lists.shade_list),
            buffer("candidates", &lists.candidates),
            buffer("offsets", lists.offsets(light_maps.used)),
        ]);
        let [width, rows] = band.grid_size(1);
        let groups = Groups::rows([width.div_ceil(self.run), rows]);
        self.edges.record(recorder, band.groups(), "edges_gpu_ms", &resources, groups);
        let groups = Groups::Indirect(&lists.candidates, FLAT_AT);
        self.edge_fallback.record(recorder, band.groups(), "edges_gpu_ms", &resources, groups);
        ListedPoints::new(lists)
    }
}

/// What passes over the samples of pixels bind.
pub(super) fn samples<'a>(
    band: &BandSample<'a>,
    seen: Seen<'a>,
    first: GridView<'a>,
    fine: GridView<'a>,
) -> [Binding<'a>; 7] {
    [
        texture("surface_ids", seen.surface_ids),
        texture("first_irradiance", first.irradiance),
        texture("first_directional", first.directional),
        texture("fine_irradiance", fine.irradiance),
        texture("fine_directional", fine.directional),
        texture("picture", &band.targets.picture_view),
        buffer("partial_sums", &band.targets.partial_sums),
    ]
}
