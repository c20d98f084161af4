//! What examples share that draw into a texture of their own.

mod png;
pub use png::write_png;

use girandole::glam::Vec3;
use girandole::image::Image;
use girandole::{Gpu, wgpu};

/// Reads an `Rgba32Float` texture back, whose width is a multiple of 16.
pub fn read_back(gpu: &Gpu, texture: &wgpu::Texture) -> Result<Image, Box<dyn std::error::Error>> {
    let (width, height) = (texture.width(), texture.height());
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(width * height * 16),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let layout = wgpu::TexelCopyBufferLayout { bytes_per_row: Some(width * 16), ..Default::default() };
    let copy = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.copy_texture_to_buffer(texture.as_image_copy(), copy, texture.size());
    gpu.queue.submit([encoder.finish()]);
    buffer.map_async(wgpu::MapMode::Read, .., |_| ());
    gpu.wait()?;
    let channel = |p: &[u8], i: usize| f32::from_le_bytes([p[i], p[i + 1], p[i + 2], p[i + 3]]);
    let texels = buffer.get_mapped_range(..)?;
    let pixels = texels.chunks_exact(16).map(|p| Vec3::new(channel(p, 0), channel(p, 4), channel(p, 8)));
    Ok(Image { width, height, pixels: pixels.collect() })
}
