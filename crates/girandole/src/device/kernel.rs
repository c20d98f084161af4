//! Pipelines and their bind groups. Bindings are declared once, in the WGSL: layouts are reflected from there, and a pass
//! binds its resources by the names that they have in the shader.
//!
//! Group 0 is the frame (one uniform with a dynamic offset), group 1 the scene, group 2 belongs to the pass.

use super::compiled::{Compiled, Module, binding_type};
use super::recorder::Recorder;
use crate::device::tuning::DeviceTuning;
use crate::layout::Frame;
use crate::shader_constants::{TILE, WORKGROUP};
use crate::shaders::{self, Source};
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
    pub tuning: DeviceTuning,
    pub frame: wgpu::BindGroupLayout,
    pub scene: GroupLayout,
    pub compiled: Compiled,
}

impl Shared {
    pub fn new(device: &wgpu::Device, tuning: DeviceTuning, compiled: Compiled) -> Self {
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
        let ir = naga::front::wgsl::parse_str(&shaders::SCENE.concatenated(&tuning)).unwrap_or_default();
        let bindings = ir
            .global_variables
            .iter()
            .filter_map(|(_, global)| {
                let binding = global.binding.filter(|b| b.group == 1)?.binding;
                let ty = binding_type(&ir, global)?;
                let entry = wgpu::BindGroupLayoutEntry { binding, visibility: all, ty, count: None };
                Some((global.name.clone()?, entry))
            })
            .collect();
        Self { tuning, frame, scene: GroupLayout::new(device, "scene", bindings), compiled }
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
    fn new(device: &wgpu::Device, shared: &Shared, module: &Module, entries: &[&str]) -> Self {
        let uses_frame = !module.bindings(0, entries).is_empty();
        let uses_scene = !module.bindings(1, entries).is_empty();
        let pass = GroupLayout::new(device, module.name, module.bindings(2, entries));
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(module.name),
            bind_group_layouts: &[
                uses_frame.then_some(&shared.frame),
                uses_scene.then_some(&shared.scene.layout),
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

/// A compute pipeline.
#[derive(Clone)]
pub(crate) struct Kernel {
    groups: Arc<PipelineGroups>,
    pipeline: wgpu::ComputePipeline,
    label: &'static str,
}

impl Kernel {
    /// Compiles an entry point; of `constants`, the module's overrides are set.
    pub fn new(
        device: &wgpu::Device,
        shared: &Shared,
        source: &Source,
        entry: &'static str,
        constants: &[(&str, f64)],
    ) -> Self {
        let (key, module) = shared.compiled.module(device, source, &shared.tuning);
        let constants = module.constants(constants);
        let make = || {
            let groups = PipelineGroups::new(device, shared, &module, &[entry]);
            let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry),
                layout: Some(&groups.pipeline_layout),
                module: &module.shader,
                entry_point: Some(entry),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants: &constants,
                    ..Default::default()
                },
                cache: None,
            });
            Self { groups: groups.into(), pipeline, label: source.name }
        };
        shared.compiled.get((key, entry.into(), &constants), |memory| &mut memory.kernels, make)
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
        let group = self.groups.pass.group(recorder.device, resources);
        let uniform = self.groups.uses_frame.then(|| recorder.uniform(frame));
        let timestamps = recorder.timers.compute(time);
        let mut pass = recorder.encoder().begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(self.label),
            timestamp_writes: timestamps,
        });
        pass.set_pipeline(&self.pipeline);
        if let Some((uniform, offset)) = &uniform {
            pass.set_bind_group(0, uniform, &[*offset]);
        }
        if let Some(scene) = scene.filter(|_| self.groups.uses_scene) {
            pass.set_bind_group(1, scene, &[]);
        }
        pass.set_bind_group(2, &group, &[]);
        match groups {
            Groups::Count([x, y]) => pass.dispatch_workgroups(x, y, 1),
            Groups::Indirect(buffer, offset) => pass.dispatch_workgroups_indirect(buffer, offset),
        }
    }
}

/// What a render pipeline is made of beside its shader.
#[derive(Debug)]
pub(crate) struct Draw<'a> {
    pub vertex: &'a str,
    pub fragment: Option<&'a str>,
    pub topology: wgpu::PrimitiveTopology,
    pub depth: Option<(wgpu::TextureFormat, wgpu::CompareFunction)>,
    pub targets: &'a [Option<wgpu::ColorTargetState>],
}

/// A render pipeline.
#[derive(Clone)]
pub(crate) struct RenderKernel {
    groups: Arc<PipelineGroups>,
    pipeline: wgpu::RenderPipeline,
}

impl RenderKernel {
    /// Compiles the entry points of `draw`; of `constants`, the module's overrides are set.
    pub fn new(
        device: &wgpu::Device,
        shared: &Shared,
        source: &Source,
        draw: &Draw,
        constants: &[(&str, f64)],
    ) -> Self {
        let (key, module) = shared.compiled.module(device, source, &shared.tuning);
        let constants = module.constants(constants);
        let make = || Self::compile(device, shared, (source, &module), draw, &constants);
        shared.compiled.get((key, format!("{draw:?}"), &constants), |memory| &mut memory.render_kernels, make)
    }

    fn compile(
        device: &wgpu::Device,
        shared: &Shared,
        (source, module): (&Source, &Module),
        draw: &Draw,
        constants: &[(&str, f64)],
    ) -> Self {
        let entries: Vec<&str> = std::iter::once(draw.vertex).chain(draw.fragment).collect();
        let groups = PipelineGroups::new(device, shared, module, &entries);
        let compilation_options = wgpu::PipelineCompilationOptions { constants, ..Default::default() };
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(source.name),
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
                targets: draw.targets,
            }),
            multiview_mask: None,
            cache: None,
        });
        Self { groups: groups.into(), pipeline }
    }

    /// The group of these resources.
    pub fn group(&self, device: &wgpu::Device, resources: &[Binding]) -> wgpu::BindGroup {
        self.groups.pass.group(device, resources)
    }

    /// Sets pipeline and groups in a render pass; `uniform` and `scene` as far as they are used.
    pub fn set(
        &self,
        pass: &mut wgpu::RenderPass,
        (uniform, scene): (Option<&(wgpu::BindGroup, u32)>, Option<&wgpu::BindGroup>),
        group: &wgpu::BindGroup,
    ) {
        pass.set_pipeline(&self.pipeline);
        if let Some((uniform, offset)) = uniform.filter(|_| self.groups.uses_frame) {
            pass.set_bind_group(0, uniform, &[*offset]);
        }
        if let Some(scene) = scene.filter(|_| self.groups.uses_scene) {
            pass.set_bind_group(1, scene, &[]);
        }
        pass.set_bind_group(2, group, &[]);
    }
}
