//! What the picture needs, and no more: the surfaces that pixels show, the points among them to shade, sorted by
//! receiver, and their shading (Barczak §4.3).

use super::shade::{BATCH, Needs, ShadeInputs, constants};
use super::{Band, Groups, Kernel, Layouts};
use crate::bind::Slot;
use crate::receivers::{LIGHT_MAP_GROUPS, Receivers};
use crate::selection::Selection;
use crate::settings::RendererOptions;
use crate::{shaders, timers::Timers};

/// The kernels, compiled for a scene.
pub(crate) struct Select {
    surfaces: Kernel,
    every: Kernel,
    refine: Kernel,
    allot: Kernel,
    scatter: Kernel,
    gather: Kernel,
    light_maps: Kernel,
    /// What they were compiled for.
    pub needs: Needs,
}

/// Which points of a grid to shade.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Choice {
    /// All of them.
    Every,
    /// Those that cannot be interpolated from the coarser grid.
    Refine,
}

impl Select {
    pub fn new(device: &wgpu::Device, layouts: &Layouts, options: &RendererOptions, needs: Needs) -> Self {
        use Slot::{DepthArray, Ids, Read, Uniform, Write};
        let flag = |name, value: bool| (name, f64::from(u8::from(value)));
        let [curved, specular] = [flag("CURVED", needs.curved), flag("SPECULAR", needs.specular)];
        let kernel = |source, entry, slots: &[Slot], constants: &[(&str, f64)]| {
            Kernel::new(device, layouts, source, entry, slots, constants)
        };
        let points = [Read, Write, Write, Write];
        let mut gather = constants(options, needs).to_vec();
        gather.push(curved);
        Self {
            surfaces: kernel(
                &shaders::SURFACES,
                "main",
                &[Ids, Read, Write, Uniform],
                &[flag("TEXTURES", needs.textures)],
            ),
            every: kernel(&shaders::SELECT, "every", &points, &[]),
            refine: kernel(&shaders::SELECT, "refine", &points, &[curved, specular]),
            allot: kernel(&shaders::SORT, "allot", &[Write, Write, Write, Write, Uniform], &[]),
            scatter: kernel(&shaders::SCATTER, "main", &[Read, Write, Uniform], &[]),
            gather: kernel(
                &shaders::GATHER,
                "main",
                &[Ids, DepthArray, Uniform, Write, Uniform, Read, Read, Read, Uniform],
                &gather,
            ),
            light_maps: kernel(
                &shaders::LIGHT_MAPS,
                "main",
                &[Uniform, Read, Write, Uniform],
                &[flag("PLAIN", needs.plain_lights)],
            ),
            needs,
        }
    }

    /// Which surface each pixel shows, from triangle ids.
    pub fn record_surfaces(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        timers: &Timers,
        band: Band,
        ids: &wgpu::TextureView,
        (receivers, selection): (&Receivers, &Selection),
    ) {
        let resources = [
            wgpu::BindingResource::TextureView(ids),
            receivers.receivers.as_entire_binding(),
            selection.surfaces.as_entire_binding(),
            selection.plan.as_entire_binding(),
        ];
        let groups = Groups::tiles([band.size[0], band.size[1] + 1]);
        self.surfaces.record(device, encoder, timers.compute("surfaces_gpu_ms"), band, &resources, groups);
    }

    /// Chooses points of the frame's grid and sorts them by leaf.
    pub fn record_points(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        timers: &Timers,
        band: Band,
        (choice, step): (Choice, u32),
        (selection, sums): (&Selection, &wgpu::Buffer),
    ) {
        let resources =
            [&selection.surfaces, sums, &selection.counts, &selection.points].map(|b| b.as_entire_binding());
        let kernel = match choice {
            Choice::Every => &self.every,
            Choice::Refine => &self.refine,
        };
        let points = [band.size[0], band.size[1] + 1].map(|n| (n - 1).div_ceil(step) + 1);
        let time = timers.compute("select_gpu_ms");
        kernel.record(device, encoder, time, band, &resources, Groups::tiles(points));

        let resources =
            [&selection.counts, &selection.queue, &selection.arguments, &selection.tally, &selection.plan]
                .map(|b| b.as_entire_binding());
        let time = timers.compute("sort_gpu_ms");
        self.allot.record(device, encoder, time, band, &resources, Groups::Count([1, 1]));

        let resources = [&selection.points, &selection.queue, &selection.plan].map(|b| b.as_entire_binding());
        let groups = Groups::Indirect(&selection.arguments, 0);
        self.scatter.record(device, encoder, timers.compute("sort_gpu_ms"), band, &resources, groups);
    }

    /// Shades the points that were chosen last with the frame's batch of lights.
    pub fn record_gather(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        timers: &Timers,
        band: Band,
        inputs: ShadeInputs,
        (receivers, selection): (&Receivers, &Selection),
    ) {
        let resources = [
            wgpu::BindingResource::TextureView(inputs.ids),
            wgpu::BindingResource::TextureView(inputs.atlas),
            wgpu::BindingResource::Buffer(inputs.lights),
            inputs.sums.as_entire_binding(),
            inputs.maps.as_entire_binding(),
            selection.queue.as_entire_binding(),
            receivers.lists.as_entire_binding(),
            receivers.light_maps.as_entire_binding(),
            selection.plan.as_entire_binding(),
        ];
        let groups = Groups::Indirect(&selection.arguments, 16);
        self.gather.record(device, encoder, timers.compute("shade_gpu_ms"), band, &resources, groups);
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
        let groups = [leaves.min(LIGHT_MAP_GROUPS), leaves.div_ceil(LIGHT_MAP_GROUPS)];
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
