//! Pipelines and their bind groups. Bindings are declared once, in the WGSL: layouts are reflected from there, and a pass
//! binds its resources by the names that they have in the shader.
//!
//! Group 0 is the frame (one uniform with a dynamic offset), group 1 the scene, group 2 belongs to the pass.

use super::compiled::{Compiled, Lazy, Recipe};
#[cfg(feature = "parallel")]
use super::crew::Crew;
use super::module::{LazyModule, Module};
use super::recorder::Recorder;
use super::reflection::Reflection;
use crate::layout::Frame;
use crate::shader_constants::{TILE, WORKGROUP};
use crate::shaders::{self, Source};
use crate::tier::Kernels;
use std::sync::Arc;

/// A resource under its name in the shader.
pub(crate) type Binding<'a> = (&'static str, wgpu::BindingResource<'a>);

/// Binds a texture.
pub(crate) fn texture<'a>(name: &'static str, view: &'a wgpu::TextureView) -> Binding<'a> {
    (name, wgpu::BindingResource::TextureView(view))
}

/// Binds a whole buffer.
pub(crate) fn buffer<'a>(name: &'static str, buffer: &'a wgpu::Buffer) -> Binding<'a> {
    (name, buffer.as_entire_binding())
}

/// The layout of a group, with the names of its bindings.
pub(crate) struct GroupLayout {
    layout: wgpu::BindGroupLayout,
    names: Vec<(String, u32)>,
}

impl GroupLayout {
    fn new(device: &wgpu::Device, label: &str, bindings: Vec<(String, wgpu::BindGroupLayoutEntry)>) -> Self {
        let entries: Vec<_> = bindings.iter().map(|(_, entry)| *entry).collect();
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(label),
            entries: &entries,
        });
        Self { layout, names: bindings.into_iter().map(|(name, entry)| (name, entry.binding)).collect() }
    }

    /// A group of these resources. Those that the shader does not use may be among them; one that is missing is a
    /// validation error.
    pub fn group(&self, device: &wgpu::Device, resources: &[Binding]) -> wgpu::BindGroup {
        let entries: Vec<_> = self
            .names
            .iter()
            .filter_map(|(name, binding)| {
                let (_, resource) = resources.iter().find(|(n, _)| n == name)?;
                Some(wgpu::BindGroupEntry { binding: *binding, resource: resource.clone() })
            })
            .collect();
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.layout,
            entries: &entries,
        })
    }
}

/// What pipelines share: the groups 0, the frame, and 1, the scene; how the device is tuned; and what was compiled for it.
pub(crate) struct Shared {
    pub kernels: Kernels,
    pub frame: wgpu::BindGroupLayout,
    pub scene: Arc<GroupLayout>,
    pub compiled: Compiled,
}

impl Shared {
    pub fn new(device: &wgpu::Device, kernels: Kernels, compiled: Compiled) -> Self {
        let all = wgpu::ShaderStages::VERTEX_FRAGMENT | wgpu::ShaderStages::COMPUTE;
        let frame = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("frame"),
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: all,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: true,
                    min_binding_size: wgpu::BufferSize::new(size_of::<Frame>() as u64),
                },
                count: None,
            }],
        });
        // Whatever an entry point uses of it, all passes share one group of the whole scene.
        let bindings = Reflection::of(&shaders::SCENE.concatenated(&kernels)).group(1, all);
        Self { kernels, frame, scene: GroupLayout::new(device, "scene", bindings).into(), compiled }
    }
}

/// What every recipe has: a device, the groups that all share, a module, and its overrides.
struct Ingredients {
    device: wgpu::Device,
    frame: wgpu::BindGroupLayout,
    scene: Arc<GroupLayout>,
    module: Arc<LazyModule>,
    constants: Vec<(String, f64)>,
}

impl Ingredients {
    fn new(
        device: &wgpu::Device,
        shared: &Shared,
        module: &Arc<LazyModule>,
        constants: &[(&str, f64)],
    ) -> Self {
        let constants = constants.iter().map(|(name, value)| (name.to_string(), *value)).collect();
        let (frame, scene) = (shared.frame.clone(), shared.scene.clone());
        Self { device: device.clone(), frame, scene, module: module.clone(), constants }
    }

    fn constants(&self) -> Vec<(&str, f64)> {
        self.constants.iter().map(|(name, value)| (name.as_str(), *value)).collect()
    }
}

/// The layouts of a pipeline's groups: those that its entry points use.
struct PipelineGroups {
    pass: GroupLayout,
    pipeline_layout: wgpu::PipelineLayout,
    uses_frame: bool,
    uses_scene: bool,
}

impl PipelineGroups {
    fn new(of: &Ingredients, module: &Module, entries: &[&str]) -> Self {
        let (device, name) = (&of.device, of.module.name);
        let uses_frame = !module.reflection.bindings(0, entries).is_empty();
        let uses_scene = !module.reflection.bindings(1, entries).is_empty();
        let pass = GroupLayout::new(device, name, module.reflection.bindings(2, entries));
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(name),
            bind_group_layouts: &[
                uses_frame.then_some(&of.frame),
                uses_scene.then_some(&of.scene.layout),
                Some(&pass.layout),
            ],
            immediate_size: 0,
        });
        Self { pass, pipeline_layout, uses_frame, uses_scene }
    }
}

/// How many workgroups.
#[derive(Clone, Copy)]
pub(crate) enum Groups<'a> {
    /// These.
    Count([u32; 2]),
    /// What the device finds at an offset in a buffer, bytes.
    Indirect(&'a wgpu::Buffer, u64),
}

impl Groups<'_> {
    /// Groups of 8 × 8 over so many points.
    pub fn tiles(points: [u32; 2]) -> Self {
        Self::Count(points.map(|n| n.div_ceil(TILE)))
    }

    /// Groups of 64 × 1 over so many points, for kernels that store them all: rows fill whole pages of memory.
    pub fn rows([width, height]: [u32; 2]) -> Self {
        Self::Count([width.div_ceil(WORKGROUP), height])
    }
}

/// A compute pipeline, compiled when it is first recorded, or before that if it was [ordered](Kernel::order).
#[derive(Clone)]
pub(crate) struct Kernel(Arc<Lazy<ComputeRecipe>>);

pub(super) struct ComputeRecipe {
    of: Ingredients,
    entry: &'static str,
}

pub(super) struct ComputeKernel {
    groups: PipelineGroups,
    pipeline: wgpu::ComputePipeline,
}

impl Recipe for ComputeRecipe {
    type Made = ComputeKernel;

    #[cfg(feature = "parallel")]
    fn device(&self) -> &wgpu::Device {
        &self.of.device
    }

    fn names(&self) -> (&'static str, String) {
        (self.of.module.name, self.entry.into())
    }

    fn make(&self) -> ComputeKernel {
        let Self { of, entry } = self;
        let module = of.module.get(&of.device);
        let groups = PipelineGroups::new(of, module, &[entry]);
        let pipeline = of.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(entry),
            layout: Some(&groups.pipeline_layout),
            module: &module.shader,
            entry_point: Some(entry),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &of.constants(),
                ..Default::default()
            },
            cache: None,
        });
        ComputeKernel { groups, pipeline }
    }

    #[cfg(feature = "parallel")]
    fn send(lazy: Arc<Lazy<Self>>, crew: &Crew) {
        crew.send(move || lazy.make_ahead());
    }
}

/// Orders these, in this order. Whether there is nothing to wait for.
pub(crate) fn order_all<'k>(kernels: impl IntoIterator<Item = &'k Kernel>, shared: &Shared) -> bool {
    kernels.into_iter().fold(true, |are_there, kernel| kernel.order(shared) & are_there)
}

impl Kernel {
    /// An entry point; of `constants`, the module's overrides are set.
    pub fn new(
        device: &wgpu::Device,
        shared: &Shared,
        source: &Source,
        entry: &'static str,
        constants: &[(&str, f64)],
    ) -> Self {
        Self::of(device, shared, (source, &shared.kernels), entry, constants)
    }

    /// The same of certain variants of the library's files.
    pub fn of(
        device: &wgpu::Device,
        shared: &Shared,
        (source, kernels): (&Source, &Kernels),
        entry: &'static str,
        constants: &[(&str, f64)],
    ) -> Self {
        let (key, module) = shared.compiled.module(source, kernels);
        let constants = module.constants(constants);
        let recipe = || ComputeRecipe { of: Ingredients::new(device, shared, &module, &constants), entry };
        Self(shared.compiled.get((key, entry.into(), &constants), |memory| &mut memory.kernels, recipe))
    }

    /// Has it compiled soon, after those that were ordered before. Whether there is nothing to wait for.
    pub fn order(&self, shared: &Shared) -> bool {
        shared.compiled.order(&self.0)
    }

    /// Records one dispatch, timed under `time`.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        (frame, scene): (&Frame, Option<&wgpu::BindGroup>),
        time: &'static str,
        resources: &[Binding],
        groups: Groups,
    ) {
        let ComputeKernel { groups: layouts, pipeline } = self.0.get();
        let group = layouts.pass.group(recorder.device, resources);
        let uniform = layouts.uses_frame.then(|| recorder.uniform(frame));
        let (timestamps, is_rehearsal) = (recorder.timers.compute(time), recorder.is_rehearsal);
        let mut pass = recorder.encoder().begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(self.0.recipe().of.module.name),
            timestamp_writes: timestamps,
        });
        pass.set_pipeline(pipeline);
        if let Some((uniform, offset)) = &uniform {
            pass.set_bind_group(0, uniform, &[*offset]);
        }
        if let Some(scene) = scene.filter(|_| layouts.uses_scene) {
            pass.set_bind_group(1, scene, &[]);
        }
        pass.set_bind_group(2, &group, &[]);
        match groups {
            _ if is_rehearsal => pass.dispatch_workgroups(0, 0, 1),
            Groups::Count([x, y]) => pass.dispatch_workgroups(x, y, 1),
            Groups::Indirect(buffer, offset) => pass.dispatch_workgroups_indirect(buffer, offset),
        }
        drop(pass);
        if is_rehearsal {
            // The device begins with this one while others are compiled.
            recorder.split();
        }
    }
}

/// What a render pipeline is made of beside its shader.
#[derive(Clone, Debug)]
pub(crate) struct Draw {
    pub vertex: &'static str,
    pub fragment: Option<&'static str>,
    pub topology: wgpu::PrimitiveTopology,
    pub depth: Option<(wgpu::TextureFormat, wgpu::CompareFunction)>,
    pub targets: Vec<Option<wgpu::ColorTargetState>>,
}

impl Draw {
    fn entries(&self) -> Vec<&'static str> {
        std::iter::once(self.vertex).chain(self.fragment).collect()
    }
}

/// A render pipeline, compiled when it is first used, or before that if it was [ordered](RenderKernel::order).
#[derive(Clone)]
pub(crate) struct RenderKernel(Arc<Lazy<RenderRecipe>>);

pub(super) struct RenderRecipe {
    of: Ingredients,
    draw: Draw,
}

pub(super) struct RenderKernelMade {
    groups: PipelineGroups,
    pipeline: wgpu::RenderPipeline,
}

impl Recipe for RenderRecipe {
    type Made = RenderKernelMade;

    #[cfg(feature = "parallel")]
    fn device(&self) -> &wgpu::Device {
        &self.of.device
    }

    fn names(&self) -> (&'static str, String) {
        (self.of.module.name, self.draw.entries().join(", "))
    }

    fn make(&self) -> RenderKernelMade {
        let Self { of, draw } = self;
        let module = of.module.get(&of.device);
        let groups = PipelineGroups::new(of, module, &draw.entries());
        let constants = of.constants();
        let compilation_options =
            wgpu::PipelineCompilationOptions { constants: &constants, ..Default::default() };
        let pipeline = of.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(of.module.name),
            layout: Some(&groups.pipeline_layout),
            vertex: wgpu::VertexState {
                module: &module.shader,
                entry_point: Some(draw.vertex),
                compilation_options: compilation_options.clone(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState { topology: draw.topology, ..Default::default() },
            depth_stencil: draw.depth.map(|(format, compare)| wgpu::DepthStencilState {
                format,
                depth_write_enabled: Some(true),
                depth_compare: Some(compare),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: draw.fragment.map(|entry| wgpu::FragmentState {
                module: &module.shader,
                entry_point: Some(entry),
                compilation_options,
                targets: &draw.targets,
            }),
            multiview_mask: None,
            cache: None,
        });
        RenderKernelMade { groups, pipeline }
    }

    #[cfg(feature = "parallel")]
    fn send(lazy: Arc<Lazy<Self>>, crew: &Crew) {
        crew.send(move || lazy.make_ahead());
    }
}

impl RenderKernel {
    /// The entry points of `draw`; of `constants`, the module's overrides are set.
    pub fn new(
        device: &wgpu::Device,
        shared: &Shared,
        (source, kernels): (&Source, &Kernels),
        draw: Draw,
        constants: &[(&str, f64)],
    ) -> Self {
        let (key, module) = shared.compiled.module(source, kernels);
        let constants = module.constants(constants);
        let name = format!("{draw:?}");
        let recipe = || RenderRecipe { of: Ingredients::new(device, shared, &module, &constants), draw };
        Self(shared.compiled.get((key, name, &constants), |memory| &mut memory.render_kernels, recipe))
    }

    /// Has it compiled soon, after those that were ordered before. Whether there is nothing to wait for.
    pub fn order(&self, shared: &Shared) -> bool {
        shared.compiled.order(&self.0)
    }

    /// The group of these resources.
    pub fn group(&self, device: &wgpu::Device, resources: &[Binding]) -> wgpu::BindGroup {
        self.0.get().groups.pass.group(device, resources)
    }

    /// Sets pipeline and groups in a render pass; `uniform` and `scene` as far as they are used.
    pub fn set(
        &self,
        pass: &mut wgpu::RenderPass,
        (uniform, scene): (Option<&(wgpu::BindGroup, u32)>, Option<&wgpu::BindGroup>),
        group: &wgpu::BindGroup,
    ) {
        let RenderKernelMade { groups, pipeline } = self.0.get();
        pass.set_pipeline(pipeline);
        if let Some((uniform, offset)) = uniform.filter(|_| groups.uses_frame) {
            pass.set_bind_group(0, uniform, &[*offset]);
        }
        if let Some(scene) = scene.filter(|_| groups.uses_scene) {
            pass.set_bind_group(1, scene, &[]);
        }
        pass.set_bind_group(2, group, &[]);
    }
}
