//! Lists all points of a grid for shading: of the coarsest grid, or with a step of 1 every pixel.

use super::sort_points::ListedPoints;
use super::visibility_buffer::Seen;
use super::{BandSample, Compiler, GridView, LightMapsView};
use crate::device::kernel::{Groups, Kernel, Shared, buffer, texture};
use crate::device::recorder::Recorder;
use crate::points::lists::PointLists;
use crate::shaders;

pub(crate) struct AppendAllPoints {
    kernel: Kernel,
}

impl AppendAllPoints {
    pub fn new(compiler: &Compiler) -> Self {
        Self { kernel: compiler.kernel(&shaders::APPEND_ALL_POINTS, "append_all_points") }
    }

    /// See [`Kernel::order`].
    pub fn order(&self, shared: &Shared) -> bool {
        self.kernel.order(shared)
    }

    /// Lists the points of the band's grid; where nothing is seen, `grid` is cleared.
    pub fn record<'a>(
        &self,
        recorder: &mut Recorder,
        band: &BandSample,
        seen: Seen,
        light_maps: LightMapsView,
        lists: &'a PointLists,
        grid: GridView,
    ) -> ListedPoints<'a> {
        let resources = [
            texture("triangle_ids", seen.triangle_ids),
            texture("surface_ids", seen.surface_ids),
            texture("mirror_hits", seen.ends()),
            texture("fine_irradiance", grid.irradiance),
            buffer("receivers", light_maps.receivers.receivers()),
            buffer("shade_list", &lists.shade_list),
            buffer("offsets", lists.offsets(light_maps.used)),
        ];
        let groups = Groups::tiles(band.grid_size(band.frame.step));
        self.kernel.record(recorder, band.groups(), "select_gpu_ms", &resources, groups);
        ListedPoints::new(lists)
    }
}
