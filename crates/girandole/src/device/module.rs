//! Shader modules, made when a pipeline first needs them, with what reflection says of them.

use super::reflection::Reflection;
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
    pub reflection: Reflection,
}

impl Module {
    /// Compiles a source. What is wrong with it is reported by the device as a validation error.
    fn new(device: &wgpu::Device, name: &'static str, text: &str) -> Self {
        let shader = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(name),
            source: wgpu::ShaderSource::Wgsl(text.into()),
        });
        Self { shader, reflection: Reflection::of(text) }
    }
}
