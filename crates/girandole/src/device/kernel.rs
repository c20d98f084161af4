//! Pipelines and their bind groups. Bindings are declared once, in the WGSL: layouts are reflected from there, and a pass
//! binds its resources by the names that they have in the shader.
//!
//! Group 0 is the frame (one uniform with a dynamic offset), group 1 the scene, group 2 belongs to the pass.

use super::recorder::Recorder;
use crate::device::tuning::DeviceTuning;
use crate::layout::Frame;
use crate::shader_constants::{TILE, WORKGROUP};
use crate::shaders::{self, Source};
use std::sync::{Arc, Mutex, PoisonError};

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

/// A shader module with what reflection says of it.
struct Module {
    shader: wgpu::ShaderModule,
    ir: naga::Module,
    info: naga::valid::ModuleInfo,
    name: &'static str,
}

impl Module {
    /// Compiles a source. What is wrong with it is reported by the device as a validation error.
    fn new(device: &wgpu::Device, source: &Source, tuning: &DeviceTuning) -> Self {
        let text = source.concatenated(tuning);
        let ir = naga::front::wgsl::parse_str(&text).unwrap_or_default();
        let flags = naga::valid::ValidationFlags::empty();
        let info = naga::valid::Validator::new(flags, naga::valid::Capabilities::all())
            .validate(&ir)
            .unwrap_or_else(|_| empty_info());
        let shader = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(source.name),
            source: wgpu::ShaderSource::Wgsl(text.into()),
        });
        Self { shader, ir, info, name: source.name }
    }

    /// Of these constants, those that the module declares as overrides.
    fn constants<'c>(&self, constants: &[(&'c str, f64)]) -> Vec<(&'c str, f64)> {
        let declares = |name: &str| self.ir.overrides.iter().any(|(_, o)| o.name.as_deref() == Some(name));
        constants.iter().copied().filter(|(name, _)| declares(name)).collect()
    }

    /// The bindings of a group that any of these entry points uses.
    fn bindings(&self, group: u32, entries: &[&str]) -> Vec<(String, wgpu::BindGroupLayoutEntry)> {
        let mut found = Vec::new();
        for (handle, global) in self.ir.global_variables.iter() {
            let Some(binding) = global.binding.filter(|b| b.group == group) else { continue };
            let mut visibility = wgpu::ShaderStages::empty();
            for (index, entry) in self.ir.entry_points.iter().enumerate() {
                let uses = !self.info.get_entry_point(index)[handle].is_empty();
                if uses && entries.contains(&entry.name.as_str()) {
                    visibility |= stage(entry.stage);
                }
            }
            if !visibility.is_empty()
                && let Some(ty) = binding_type(&self.ir, global)
            {
                let entry =
                    wgpu::BindGroupLayoutEntry { binding: binding.binding, visibility, ty, count: None };
                found.push((global.name.clone().unwrap_or_default(), entry));
            }
        }
        found
    }
}

fn empty_info() -> naga::valid::ModuleInfo {
    let flags = naga::valid::ValidationFlags::empty();
    naga::valid::Validator::new(flags, naga::valid::Capabilities::empty())
        .validate(&naga::Module::default())
        .unwrap_or_else(|_| unreachable!("an empty module is valid"))
}

fn stage(stage: naga::ShaderStage) -> wgpu::ShaderStages {
    match stage {
        naga::ShaderStage::Vertex => wgpu::ShaderStages::VERTEX,
        naga::ShaderStage::Fragment => wgpu::ShaderStages::FRAGMENT,
        _ => wgpu::ShaderStages::COMPUTE,
    }
}

/// What the layout says of a global variable; nothing for what no shader of ours binds.
fn binding_type(ir: &naga::Module, global: &naga::GlobalVariable) -> Option<wgpu::BindingType> {
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    match global.space {
        naga::AddressSpace::Uniform => Some(buffer(wgpu::BufferBindingType::Uniform)),
        naga::AddressSpace::Storage { access } => Some(buffer(wgpu::BufferBindingType::Storage {
            read_only: !access.contains(naga::StorageAccess::STORE),
        })),
        naga::AddressSpace::Handle => match ir.types[global.ty].inner {
            naga::TypeInner::Image { dim: naga::ImageDimension::D2, arrayed, class } => {
                let view_dimension = if arrayed {
                    wgpu::TextureViewDimension::D2Array
                } else {
                    wgpu::TextureViewDimension::D2
                };
                image_type(class, view_dimension)
            }
            _ => None,
        },
        _ => None,
    }
}

fn image_type(
    class: naga::ImageClass,
    view_dimension: wgpu::TextureViewDimension,
) -> Option<wgpu::BindingType> {
    let sampled = |sample_type, multisampled| {
        Some(wgpu::BindingType::Texture { sample_type, view_dimension, multisampled })
    };
    match class {
        naga::ImageClass::Sampled { kind: naga::ScalarKind::Uint, multi } => {
            sampled(wgpu::TextureSampleType::Uint, multi)
        }
        naga::ImageClass::Sampled { kind: naga::ScalarKind::Float, multi } => {
            sampled(wgpu::TextureSampleType::Float { filterable: false }, multi)
        }
        naga::ImageClass::Depth { multi } => sampled(wgpu::TextureSampleType::Depth, multi),
        naga::ImageClass::Storage { format, access } => Some(wgpu::BindingType::StorageTexture {
            access: if access.contains(naga::StorageAccess::STORE) {
                wgpu::StorageTextureAccess::WriteOnly
            } else {
                wgpu::StorageTextureAccess::ReadOnly
            },
            format: match format {
                naga::StorageFormat::Rgba32Float => wgpu::TextureFormat::Rgba32Float,
                naga::StorageFormat::Rg32Uint => wgpu::TextureFormat::Rg32Uint,
                naga::StorageFormat::R32Float => wgpu::TextureFormat::R32Float,
                _ => return None,
            },
            view_dimension,
        }),
        _ => None,
    }
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

/// What pipelines share: the groups 0, the frame, and 1, the scene; and how the device is tuned.
pub(crate) struct Shared {
    pub tuning: DeviceTuning,
    pub frame: wgpu::BindGroupLayout,
    pub scene: GroupLayout,
}

impl Shared {
    pub fn new(device: &wgpu::Device, tuning: DeviceTuning) -> Self {
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
        Self { tuning, frame, scene: GroupLayout::new(device, "scene", bindings) }
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
pub(crate) struct Kernel {
    groups: PipelineGroups,
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
        let module = Module::new(device, source, &shared.tuning);
        let groups = PipelineGroups::new(device, shared, &module, &[entry]);
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(entry),
            layout: Some(&groups.pipeline_layout),
            module: &module.shader,
            entry_point: Some(entry),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &module.constants(constants),
                ..Default::default()
            },
            cache: None,
        });
        Self { groups, pipeline, label: source.name }
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
pub(crate) struct Draw<'a> {
    pub vertex: &'a str,
    pub fragment: Option<&'a str>,
    pub topology: wgpu::PrimitiveTopology,
    pub depth: Option<(wgpu::TextureFormat, wgpu::CompareFunction)>,
    pub targets: &'a [Option<wgpu::ColorTargetState>],
}

/// A render pipeline.
pub(crate) struct RenderKernel {
    groups: PipelineGroups,
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
        let module = Module::new(device, source, &shared.tuning);
        let entries: Vec<&str> = std::iter::once(draw.vertex).chain(draw.fragment).collect();
        let groups = PipelineGroups::new(device, shared, &module, &entries);
        let constants = module.constants(constants);
        let compilation_options =
            wgpu::PipelineCompilationOptions { constants: &constants, ..Default::default() };
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
        Self { groups, pipeline }
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

/// Render pipelines that depend on what a caller asks for, made when they are first needed.
pub(crate) struct KernelCache<K>(Mutex<Vec<(K, Arc<RenderKernel>)>>);

impl<K: Copy + PartialEq> KernelCache<K> {
    pub fn new() -> Self {
        Self(Mutex::new(Vec::new()))
    }

    /// The pipeline under `key`.
    pub fn get(&self, key: K, make: impl FnOnce() -> RenderKernel) -> Arc<RenderKernel> {
        let mut made = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, kernel)) = made.iter().find(|(k, _)| *k == key) {
            return kernel.clone();
        }
        let kernel = Arc::new(make());
        made.push((key, kernel.clone()));
        kernel
    }
}
