//! Storage buffers within the device's limits.

use crate::{Error, Remedy, Result};
use wgpu::util::DeviceExt;

/// Creates a storage buffer with these contents, which may be overwritten (never empty: WebGPU has no empty bindings).
///
/// # Errors
/// [`Error::TooLarge`] beyond the device's limit.
pub(crate) fn storage<T: bytemuck::Pod>(
    device: &wgpu::Device,
    label: &str,
    contents: &[T],
) -> Result<wgpu::Buffer> {
    let bytes: &[u8] = bytemuck::cast_slice(contents);
    check_size(device, label, bytes)?;
    let contents = if bytes.is_empty() { &[0; 256] } else { bytes };
    Ok(device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some(label),
        contents,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
    }))
}

pub(crate) fn check_size(device: &wgpu::Device, label: &str, bytes: &[u8]) -> Result<()> {
    check_bytes(device, label, bytes.len() as u64)
}

/// Whether a storage buffer of so many bytes is possible.
///
/// # Errors
/// [`Error::TooLarge`] beyond the device's limit.
pub(crate) fn check_bytes(device: &wgpu::Device, label: &str, bytes: u64) -> Result<()> {
    let limit = device.limits().max_storage_buffer_binding_size;
    if bytes > limit {
        let what = format!(
            "the scene's {label} take {} MiB and this device binds {} MiB at most",
            bytes >> 20,
            limit >> 20
        );
        return Err(Error::too_large(what, Remedy::SmallerScene));
    }
    Ok(())
}

/// A uniform buffer with these contents.
pub(crate) fn uniform(device: &wgpu::Device, label: &str, contents: &[u8]) -> wgpu::Buffer {
    device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some(label),
        contents,
        usage: wgpu::BufferUsages::UNIFORM,
    })
}
