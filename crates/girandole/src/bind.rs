//! Bind groups: layout and group come from one list of slots.

use crate::targets;

/// What a binding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Slot {
    /// Uniform buffer; with a dynamic offset.
    UniformAt,
    /// Uniform buffer.
    Uniform,
    /// Storage buffer that is only read.
    Read,
    /// Storage buffer that is written.
    Write,
    /// Texture of whole numbers.
    Ids,
    /// Array of textures of whole numbers.
    IdsArray,
    /// Float texture that is not filtered.
    Float,
    /// Array of depth textures.
    DepthArray,
    /// Array of storage textures, r32float, read.
    ImageArray,
    /// Grid of points: storage texture, rgba32float, written.
    Grid,
    /// The picture: storage texture, rg32uint, written (see `packed`).
    Picture,
}

/// The layout of these slots, bound from 0 up.
pub(crate) fn layout(
    device: &wgpu::Device,
    label: &str,
    visibility: wgpu::ShaderStages,
    slots: &[Slot],
) -> wgpu::BindGroupLayout {
    let buffer =
        |ty, has_dynamic_offset| wgpu::BindingType::Buffer { ty, has_dynamic_offset, min_binding_size: None };
    let texture = |sample_type, view_dimension| wgpu::BindingType::Texture {
        sample_type,
        view_dimension,
        multisampled: false,
    };
    let entries: Vec<_> = slots
        .iter()
        .enumerate()
        .map(|(binding, slot)| wgpu::BindGroupLayoutEntry {
            binding: binding as u32,
            visibility,
            ty: match slot {
                Slot::UniformAt => buffer(wgpu::BufferBindingType::Uniform, true),
                Slot::Uniform => buffer(wgpu::BufferBindingType::Uniform, false),
                Slot::Read => buffer(wgpu::BufferBindingType::Storage { read_only: true }, false),
                Slot::Write => buffer(wgpu::BufferBindingType::Storage { read_only: false }, false),
                Slot::Ids => texture(wgpu::TextureSampleType::Uint, wgpu::TextureViewDimension::D2),
                Slot::IdsArray => texture(wgpu::TextureSampleType::Uint, wgpu::TextureViewDimension::D2Array),
                Slot::Float => texture(
                    wgpu::TextureSampleType::Float { filterable: false },
                    wgpu::TextureViewDimension::D2,
                ),
                Slot::DepthArray => {
                    texture(wgpu::TextureSampleType::Depth, wgpu::TextureViewDimension::D2Array)
                }
                Slot::ImageArray => wgpu::BindingType::StorageTexture {
                    access: wgpu::StorageTextureAccess::ReadOnly,
                    format: wgpu::TextureFormat::R32Float,
                    view_dimension: wgpu::TextureViewDimension::D2Array,
                },
                Slot::Grid | Slot::Picture => wgpu::BindingType::StorageTexture {
                    access: wgpu::StorageTextureAccess::WriteOnly,
                    format: if *slot == Slot::Grid { targets::GRID } else { targets::PICTURE },
                    view_dimension: wgpu::TextureViewDimension::D2,
                },
            },
            count: None,
        })
        .collect();
    device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
}

/// A group of these resources, bound from 0 up.
pub(crate) fn group(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    resources: &[wgpu::BindingResource],
) -> wgpu::BindGroup {
    let entries: Vec<_> = resources
        .iter()
        .enumerate()
        .map(|(binding, resource)| wgpu::BindGroupEntry {
            binding: binding as u32,
            resource: resource.clone(),
        })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

/// A pipeline layout of three groups: the frame, the scene, the pass.
pub(crate) fn pipeline_layout(
    device: &wgpu::Device,
    groups: &[Option<&wgpu::BindGroupLayout>],
) -> wgpu::PipelineLayout {
    device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: groups,
        immediate_size: 0,
    })
}

/// A compute pipeline with entry point `entry`.
pub(crate) fn compute_pipeline(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    entry: &str,
    groups: &[Option<&wgpu::BindGroupLayout>],
    constants: &[(&str, f64)],
) -> wgpu::ComputePipeline {
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(entry),
        layout: Some(&pipeline_layout(device, groups)),
        module,
        entry_point: Some(entry),
        compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
        cache: None,
    })
}
