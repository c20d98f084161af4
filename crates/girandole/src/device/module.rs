//! Shader modules, made when a pipeline first needs them, with what reflection says of them.

use crate::shaders::Source;
use crate::tier::Kernels;
use std::sync::OnceLock;

/// The text of a module, which is cheap, and what a device makes of it.
pub(super) struct LazyModule {
    pub name: &'static str,
    text: String,
    module: OnceLock<Module>,
}

impl LazyModule {
    pub fn new(source: &Source, kernels: &Kernels) -> Self {
        Self { name: source.name, text: source.concatenated(kernels), module: OnceLock::new() }
    }

    /// Of these constants, those that the module declares as overrides.
    pub fn constants<'c>(&self, constants: &[(&'c str, f64)]) -> Vec<(&'c str, f64)> {
        let declares = |name: &str| self.text.contains(&format!("\noverride {name}:"));
        constants.iter().copied().filter(|(name, _)| declares(name)).collect()
    }

    /// The module, made now unless it is there.
    pub fn get(&self, device: &wgpu::Device) -> &Module {
        self.module.get_or_init(|| Module::new(device, self.name, &self.text))
    }
}

/// A shader module with what reflection says of it.
pub(super) struct Module {
    pub shader: wgpu::ShaderModule,
    ir: naga::Module,
    info: naga::valid::ModuleInfo,
}

impl Module {
    /// Compiles a source. What is wrong with it is reported by the device as a validation error.
    fn new(device: &wgpu::Device, name: &'static str, text: &str) -> Self {
        let ir = naga::front::wgsl::parse_str(text).unwrap_or_default();
        let flags = naga::valid::ValidationFlags::empty();
        let info = naga::valid::Validator::new(flags, naga::valid::Capabilities::all())
            .validate(&ir)
            .unwrap_or_else(|_| empty_info());
        let shader = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(name),
            source: wgpu::ShaderSource::Wgsl(text.into()),
        });
        Self { shader, ir, info }
    }

    /// The bindings of a group that any of these entry points uses.
    pub fn bindings(&self, group: u32, entries: &[&str]) -> Vec<(String, wgpu::BindGroupLayoutEntry)> {
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
pub(super) fn binding_type(ir: &naga::Module, global: &naga::GlobalVariable) -> Option<wgpu::BindingType> {
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
            access: if access.contains(naga::StorageAccess::LOAD | naga::StorageAccess::STORE) {
                wgpu::StorageTextureAccess::ReadWrite
            } else if access.contains(naga::StorageAccess::STORE) {
                wgpu::StorageTextureAccess::WriteOnly
            } else {
                wgpu::StorageTextureAccess::ReadOnly
            },
            format: match format {
                naga::StorageFormat::Rgba32Float => wgpu::TextureFormat::Rgba32Float,
                naga::StorageFormat::R32Uint => wgpu::TextureFormat::R32Uint,
                naga::StorageFormat::Rg32Uint => wgpu::TextureFormat::Rg32Uint,
                naga::StorageFormat::Rgba32Uint => wgpu::TextureFormat::Rgba32Uint,
                naga::StorageFormat::R32Float => wgpu::TextureFormat::R32Float,
                _ => return None,
            },
            view_dimension,
        }),
        _ => None,
    }
}
