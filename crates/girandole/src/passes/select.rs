//! What the picture needs, and no more: the surfaces that pixels show, the points among them to shade, sorted by
//! receiver, and their shading (Barczak §4.3).

use super::shade::{BATCH, SceneFeatures, ShadeInputs, constants};
use super::{Band, Groups, Kernel, Layouts, shadow_maps};
use crate::bind::Slot;
use crate::receivers::Receivers;
use crate::selection::{COOPERATIVE_AT, CURVED_AT, FLAT_AT, PointLists, SCATTER_AT, SHADE_AT};
use crate::settings::RendererOptions;
use crate::shader_constants::{EDGE_RUN, GROUPS_PER_ROW};
use crate::targets::Targets;
use crate::{shaders, timers::Timers};

/// The kernels, compiled for a scene.
pub(crate) struct Select {
    every: Kernel,
    points: PointKernels,
    /// For the last grid, whose points are the picture's pixels: they store radiance. Without textures only.
    pixels: Option<PixelKernels>,
    allot: Kernel,
    scatter: Kernel,
    light_maps: Kernel,
    /// Pixels of an invocation at edges.
    edge_run: u32,
    /// What they were compiled for.
    pub needs: SceneFeatures,
}

/// The kernels that store points of a grid.
struct PointKernels {
    refine: Kernel,
    check: Kernel,
    /// The same on curved surfaces, if there are any.
    check_bent: Option<Kernel>,
    edges: Kernel,
    behind: Kernel,
    gather: Kernel,
    /// For few points, where lanes share them.
    wide: Option<Kernel>,
}

/// The kernels that store radiance.
struct PixelKernels {
    points: PointKernels,
    /// For first samples, where further ones follow.
    first: Kernel,
}

/// Which points of a grid to shade.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Choice {
    /// All of them.
    Every,
    /// Those that cannot be interpolated from the coarser grid.
    Refine,
    /// Further samples that neither their pixel's first one nor its neighbours' stand for.
    Edges,
}

impl Select {
    pub fn new(
        device: &wgpu::Device,
        layouts: &Layouts,
        options: &RendererOptions,
        needs: SceneFeatures,
    ) -> Self {
        use Slot::{Float, Grid, Ids, Picture, Read, Uniform, Write};
        let flag = |name, value: bool| (name, f64::from(u8::from(value)));
        let [curved, specular, textures] = [
            flag("HAS_CURVED", needs.curved),
            flag("HAS_SPECULAR", needs.specular),
            flag("HAS_TEXTURES", needs.textures),
        ];
        let kernel = |source, entry, slots: &[Slot], constants: &[(&str, f64)]| {
            Kernel::new(device, layouts, source, entry, slots, constants)
        };
        let tuning = layouts.tuning;
        // With a work queue, the next chunk is in its header.
        let queued = if tuning.persistent_threads { Write } else { Read };
        let check = [Ids, Read, Write, Uniform, Ids, Float, Float, Grid, Grid, Read, Picture];
        let lights = if tuning.lights_in_storage { Read } else { Uniform };
        let maps = shadow_maps::slot(&tuning);
        let shade =
            |queue| [Ids, maps, lights, Write, Uniform, queue, Read, Read, Uniform, Grid, Grid, Ids, Picture];
        let edge_run = if tuning.edge_runs { EDGE_RUN } else { 1 };
        let edges = [Ids, Float, Float, Grid, Grid, Write, Write, Picture];
        let points = |is_final: bool| {
            let is_final = flag("WRITES_RADIANCE", is_final);
            let mut gather = constants(options, needs).to_vec();
            gather.extend([curved, is_final]);
            let behind = [Ids, Read, Write, Uniform, Ids, Float, Float, Grid, Grid, Write, Read, Picture];
            let refine = [Ids, Float, Float, Grid, Grid, Write, Picture];
            let test = |entry| {
                let constants = [curved, specular, textures, is_final];
                kernel(shaders::test_candidates(&tuning), entry, &check, &constants)
            };
            PointKernels {
                refine: kernel(&shaders::REFINE, "refine", &refine, &[curved, specular, is_final]),
                check: test("test_flat_candidates"),
                check_bent: needs.curved.then(|| test("test_curved_candidates")),
                edges: kernel(shaders::edges(&tuning), "interpolate_edges", &edges, &[specular, is_final]),
                behind: kernel(
                    &shaders::EDGE_FALLBACK,
                    "edge_fallback",
                    &behind,
                    &[specular, textures, is_final],
                ),
                gather: kernel(shaders::shade_points(&tuning), "shade_points", &shade(queued), &gather),
                wide: tuning.cooperative_points.then(|| {
                    kernel(&shaders::SHADE_POINTS, "shade_points_cooperative", &shade(Read), &gather)
                }),
            }
        };
        Self {
            every: kernel(
                &shaders::APPEND_ALL_POINTS,
                "append_all_points",
                &[Ids, Read, Write, Uniform, Ids, Grid],
                &[textures],
            ),
            points: points(false),
            pixels: (!needs.textures).then(|| PixelKernels {
                points: points(true),
                first: kernel(
                    shaders::edges(&tuning),
                    "resolve_first_samples",
                    &edges,
                    &[specular, flag("WRITES_RADIANCE", true)],
                ),
            }),
            allot: kernel(
                &shaders::PREFIX_SUM,
                "prefix_sum",
                &[Write, Write, Write, Write, Uniform, Write, Read],
                &[],
            ),
            scatter: kernel(&shaders::SCATTER_POINTS, "scatter_points", &[Write, Write, Uniform], &[]),
            light_maps: kernel(
                &shaders::LIGHT_MAPS,
                "bake_light_maps",
                &[Uniform, Read, Write, Uniform],
                &[flag("ONLY_COSINE_LIGHTS", needs.plain_lights)],
            ),
            edge_run,
            needs,
        }
    }

    /// Whether the last grid can store the picture's radiance.
    pub fn stores_radiance(&self) -> bool {
        self.pixels.is_some()
    }

    fn kernels(&self, is_final: bool) -> &PointKernels {
        if is_final && let Some(pixels) = &self.pixels { &pixels.points } else { &self.points }
    }

    /// Chooses points of the frame's grid and sorts them by leaf; `is_final`: their radiance is stored.
    pub fn record_points(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        timers: &Timers,
        band: Band,
        (choice, step, is_final): (Choice, u32, bool),
        (receivers, selection, targets): (&Receivers, &PointLists, &Targets),
    ) {
        let level = step.ilog2() as usize;
        // The coarsest grid of all reads none; it is given another one, which it does not touch.
        let (fine, coarse) = match choice {
            Choice::Edges => (&targets.sample, &targets.grids[0]),
            _ => (&targets.grids[level], targets.grids.get(level + 1).unwrap_or(&targets.grids[0])),
        };
        let fine = fine.each_ref().map(wgpu::BindingResource::TextureView);
        let picture = wgpu::BindingResource::TextureView(&targets.picture_view);
        let coarse = coarse.each_ref().map(wgpu::BindingResource::TextureView);
        let keys = wgpu::BindingResource::TextureView(&targets.keys);
        let spacing = if choice == Choice::Refine { 2 * step } else { step };
        let points = [band.size[0], band.size[1] + 1].map(|n| (n - 1).div_ceil(spacing) + 1);
        let look = [
            wgpu::BindingResource::TextureView(&targets.ids),
            receivers.receivers.as_entire_binding(),
            selection.shade_list.as_entire_binding(),
            selection.offsets_buffer().as_entire_binding(),
            keys.clone(),
            coarse[0].clone(),
            coarse[1].clone(),
            fine[0].clone(),
            fine[1].clone(),
            selection.candidates.as_entire_binding(),
            picture.clone(),
        ];
        match choice {
            Choice::Every => {
                let time = timers.compute("select_gpu_ms");
                let [ids, receivers, wanted, plan, keys, _, _, light, ..] = look;
                let resources = [ids, receivers, wanted, plan, keys, light];
                self.every.record(device, encoder, time, band, &resources, Groups::tiles(points));
            }
            Choice::Edges => {
                let [ids, receivers, wanted, plan, keys, first, second, light, other, open, picture] = look;
                let sums = targets.sums.as_entire_binding();
                let [edges, behind] = [&self.kernels(is_final).edges, &self.kernels(is_final).behind];
                let resources =
                    [&keys, &first, &second, &light, &other, &sums, &open, &picture].map(Clone::clone);
                let time = timers.compute("edges_gpu_ms");
                let runs = [points[0].div_ceil(self.edge_run), points[1]];
                edges.record(device, encoder, time, band, &resources, Groups::rows(runs));
                let resources =
                    [ids, receivers, wanted, plan, keys, first, second, light, other, sums, open, picture];
                let groups = Groups::Indirect(&selection.candidates, FLAT_AT);
                behind.record(device, encoder, timers.compute("edges_gpu_ms"), band, &resources, groups);
            }
            Choice::Refine => {
                let [coarse_light, coarse_second] = coarse;
                let [fine_light, fine_second] = fine;
                let open = selection.candidates.as_entire_binding();
                let resources = [keys, coarse_light, coarse_second, fine_light, fine_second, open, picture];
                let time = timers.compute("select_gpu_ms");
                let kernels = self.kernels(is_final);
                kernels.refine.record(device, encoder, time, band, &resources, Groups::rows(points));
                let groups = Groups::Indirect(&selection.candidates, FLAT_AT);
                let time = timers.compute("select_gpu_ms");
                kernels.check.record(device, encoder, time, band, &look, groups);
                if let Some(check) = &kernels.check_bent {
                    let groups = Groups::Indirect(&selection.candidates, CURVED_AT);
                    check.record(device, encoder, timers.compute("select_gpu_ms"), band, &look, groups);
                }
            }
        }

        let resources = [
            &selection.shade_list,
            &selection.point_queue,
            &selection.dispatch_arguments,
            &selection.tally,
            selection.offsets_buffer(),
            &selection.candidates,
            &receivers.shading_order_buffer,
        ]
        .map(|b| b.as_entire_binding());
        let time = timers.compute("sort_gpu_ms");
        self.allot.record(device, encoder, time, band, &resources, Groups::Count([1, 1]));
        let resources = [&selection.shade_list, &selection.point_queue, selection.offsets_buffer()]
            .map(|b| b.as_entire_binding());
        let groups = Groups::Indirect(&selection.dispatch_arguments, SCATTER_AT);
        self.scatter.record(device, encoder, timers.compute("sort_gpu_ms"), band, &resources, groups);
    }

    /// Stores the radiance of first samples, where the last grid has what they receive.
    pub fn record_first(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        timers: &Timers,
        band: Band,
        (selection, targets): (&PointLists, &Targets),
    ) {
        let Some(PixelKernels { first, .. }) = &self.pixels else { return };
        let [[light, second], [other_light, other_second]] = [&targets.grids[0], &targets.sample]
            .map(|g| g.each_ref().map(wgpu::BindingResource::TextureView));
        let resources = [
            wgpu::BindingResource::TextureView(&targets.keys),
            light,
            second,
            other_light,
            other_second,
            targets.sums.as_entire_binding(),
            selection.candidates.as_entire_binding(),
            wgpu::BindingResource::TextureView(&targets.picture_view),
        ];
        let groups = Groups::rows([band.size[0].div_ceil(self.edge_run), band.size[1]]);
        first.record(device, encoder, timers.compute("resolve_gpu_ms"), band, &resources, groups);
    }

    /// Shades the points that were chosen last with the frame's batch of lights; `is_sparse`: they are few; `is_final`:
    /// their radiance is stored.
    pub fn record_gather(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        timers: &Timers,
        (band, is_sparse, is_final): (Band, bool, bool),
        inputs: ShadeInputs,
        (receivers, selection, targets): (&Receivers, &PointLists, &Targets),
    ) {
        let resources = [
            wgpu::BindingResource::TextureView(inputs.ids),
            wgpu::BindingResource::TextureView(inputs.atlas),
            wgpu::BindingResource::Buffer(inputs.lights),
            inputs.sums.as_entire_binding(),
            inputs.maps.as_entire_binding(),
            selection.point_queue.as_entire_binding(),
            receivers.lists.as_entire_binding(),
            receivers.light_maps.as_entire_binding(),
            selection.offsets_buffer().as_entire_binding(),
            wgpu::BindingResource::TextureView(inputs.grid[0]),
            wgpu::BindingResource::TextureView(inputs.grid[1]),
            wgpu::BindingResource::TextureView(&targets.keys),
            wgpu::BindingResource::TextureView(&targets.picture_view),
        ];
        let kernels = self.kernels(is_final);
        let (kernel, groups) = match &kernels.wide {
            Some(wide) if is_sparse => {
                (wide, Groups::Indirect(&selection.dispatch_arguments, COOPERATIVE_AT))
            }
            _ => (&kernels.gather, Groups::Indirect(&selection.dispatch_arguments, SHADE_AT)),
        };
        kernel.record(device, encoder, timers.compute("shade_gpu_ms"), band, &resources, groups);
    }

    /// Adds the frame's batch of lights to all light maps.
    pub fn record_light_maps(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        timers: &Timers,
        band: Band,
        lights: wgpu::BufferBinding,
        (receivers, plan): (&Receivers, &wgpu::Buffer),
    ) {
        let resources = [
            wgpu::BindingResource::Buffer(lights),
            receivers.lists.as_entire_binding(),
            receivers.light_maps.as_entire_binding(),
            plan.as_entire_binding(),
        ];
        let leaves = receivers.leaves;
        let groups = [leaves.min(GROUPS_PER_ROW), leaves.div_ceil(GROUPS_PER_ROW)];
        let time = timers.compute("light_maps_gpu_ms");
        self.light_maps.record(device, encoder, time, band, &resources, Groups::Count(groups));
    }
}

/// Lights from the first one of a batch on, as shading wants them.
pub(crate) fn batch_of(lights: &wgpu::Buffer, first: u32) -> wgpu::BufferBinding<'_> {
    let size = size_of::<crate::layout::Light>() as u64;
    wgpu::BufferBinding {
        buffer: lights,
        offset: u64::from(first) * size,
        size: wgpu::BufferSize::new(u64::from(BATCH) * size),
    }
}
