//! Fused shading: each point walks the lights of its leaf receiver (Barczak §4.3.1).

use super::sort_points::SortedPoints;
use super::visibility_buffer::Seen;
use super::{BandSample, Compiler, GridView, LightMapsView, MapsView};
use crate::device::kernel::{Groups, Kernel, Shared, buffer, texture};
use crate::device::recorder::Recorder;
use crate::gpu_scene::previous_transforms::PreviousTransformsBinding;
use crate::points::lists::{COOPERATIVE_AT, SHADE_AT};
use crate::shaders;
use crate::tier::Tier;

pub(crate) struct ShadePoints {
    shade_points: Kernel,
    /// For few points, where the device has lanes enough.
    cooperative: Option<Kernel>,
}

impl ShadePoints {
    /// `then`: for frames in which shadows on dynamic objects are looked up where these were when maps were drawn.
    pub fn new(compiler: &Compiler, then: bool) -> Self {
        let source = shaders::shade_points(&compiler.shared.kernels, then);
        Self {
            shade_points: compiler.kernel(source, "shade_points"),
            cooperative: (compiler.shared.kernels.tier == Tier::Gpu).then(|| {
                compiler.kernel(shaders::shade_points_cooperative(then), "shade_points_cooperative")
            }),
        }
    }

    /// See [`Kernel::order`].
    pub fn order(&self, shared: &Shared, are_few: bool) -> bool {
        self.cooperative.as_ref().filter(|_| are_few).unwrap_or(&self.shade_points).order(shared)
    }

    /// Sums the band's batch of lights at the points; the last one completes `grid`, or the picture.
    #[allow(clippy::too_many_arguments)]
    pub fn record<'a>(
        &self,
        recorder: &mut Recorder,
        band: &BandSample,
        seen: Seen,
        (maps, light_maps): (MapsView, LightMapsView),
        (lights, old): (wgpu::BufferBinding, Option<PreviousTransformsBinding>),
        (points, are_few): (SortedPoints, bool),
        grid: GridView<'a>,
    ) -> GridView<'a> {
        let lists = points.lists;
        let mut resources = vec![
            texture("triangle_ids", seen.triangle_ids),
            texture("surface_ids", seen.surface_ids),
            texture("mirror_hits", seen.ends()),
            texture("atlas", maps.atlas),
            buffer("maps", maps.maps),
            ("lights", wgpu::BindingResource::Buffer(lights)),
            buffer("partial_sums", &band.targets.partial_sums),
            buffer("point_queue", &lists.point_queue),
            buffer("light_lists", light_maps.receivers.light_lists()),
            buffer("light_maps", &light_maps.receivers.light_maps.maps),
            buffer("offsets", lists.offsets(light_maps.used)),
            texture("fine_irradiance", grid.irradiance),
            texture("fine_directional", grid.directional),
            texture("picture", &band.targets.picture_view),
        ];
        if let Some(PreviousTransformsBinding { places, rows }) = old {
            resources.push(buffer("previous_transforms", places));
            resources.push(("previous_rows", wgpu::BindingResource::Buffer(rows)));
        }
        let (kernel, at) = match &self.cooperative {
            Some(cooperative) if are_few => (cooperative, COOPERATIVE_AT),
            _ => (&self.shade_points, SHADE_AT),
        };
        let groups = Groups::Indirect(&lists.dispatch_arguments, at);
        kernel.record(recorder, band.groups(), "shade_gpu_ms", &resources, groups);
        grid
    }
}
