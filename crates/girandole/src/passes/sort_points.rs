//! Sorts the points to shade by their leaf receivers, in chunks of one leaf each, so that neighbours walk the same list of
//! lights (a counting sort).

use super::{BandSample, Compiler, LightMapsView};
use crate::device::kernel::{Groups, Kernel, Shared, buffer, order_all};
use crate::device::recorder::Recorder;
use crate::points::lists::{PointLists, SCATTER_AT};
use crate::shaders;

pub(crate) struct SortPoints {
    prefix_sum: Kernel,
    scatter_points: Kernel,
}

/// Points to shade, as they were found.
pub(crate) struct ListedPoints<'a> {
    lists: &'a PointLists,
}

impl<'a> ListedPoints<'a> {
    pub fn new(lists: &'a PointLists) -> Self {
        Self { lists }
    }
}

/// Points to shade in order of leaves.
#[derive(Clone, Copy)]
pub(crate) struct SortedPoints<'a> {
    pub lists: &'a PointLists,
}

impl SortPoints {
    pub fn new(compiler: &Compiler) -> Self {
        Self {
            prefix_sum: compiler.kernel(&shaders::PREFIX_SUM, "prefix_sum"),
            scatter_points: compiler.kernel(&shaders::SCATTER_POINTS, "scatter_points"),
        }
    }

    /// See [`Kernel::order`].
    pub fn order(&self, shared: &Shared) -> bool {
        order_all([&self.prefix_sum, &self.scatter_points], shared)
    }

    /// Sorts the points, empties the list and adds to the tally.
    pub fn record<'a>(
        &self,
        recorder: &mut Recorder,
        band: &BandSample,
        light_maps: LightMapsView,
        points: ListedPoints<'a>,
    ) -> SortedPoints<'a> {
        let lists = points.lists;
        let resources = [
            buffer("shade_list", &lists.shade_list),
            buffer("point_queue", &lists.point_queue),
            buffer("dispatch_arguments", &lists.dispatch_arguments),
            buffer("tally", &lists.tally),
            buffer("candidates", &lists.candidates),
            buffer("shading_order", light_maps.receivers.shading_order()),
            buffer("offsets", lists.offsets(light_maps.used)),
        ];
        let one = Groups::Count([1, 1]);
        self.prefix_sum.record(recorder, band.groups(), "sort_gpu_ms", &resources, one);
        let groups = Groups::Indirect(&lists.dispatch_arguments, SCATTER_AT);
        self.scatter_points.record(recorder, band.groups(), "sort_gpu_ms", &resources, groups);
        SortedPoints { lists }
    }
}
