//! Shadow maps of what does not move, from which parts of the atlas are refreshed where software devices draw maps
//! ([`DeviceTuning::refresh_maps`](crate::DeviceTuning::refresh_maps)).

use super::atlas::{pages, texels};
use super::layout::AtlasLayout;
use crate::Result;
use crate::device::buffers::check_bytes;
use crate::device::tuning::DeviceTuning;
use crate::settings::{RendererOptions, ShadowMap};

/// Texels for which there is room beside the maps at most, but for larger maps: 16 MiB of them.
const TEXELS: u64 = 4 << 20;

pub(crate) struct StillMaps {
    pub texture: wgpu::Texture,
    /// All pages as an array.
    pub view: wgpu::TextureView,
    /// Depths' bits of the nearest occluder that moves, for the texels of parts that are refreshed.
    pub nearest: wgpu::Buffer,
}

impl StillMaps {
    /// Whether kernels refresh maps, as far as anything moves: where they are copied, and shown by ratios of linear functions.
    pub fn are_wanted(tuning: &DeviceTuning, options: &RendererOptions) -> bool {
        tuning.copy_maps && tuning.refresh_maps && options.shadow_map == ShadowMap::Octahedral
    }

    /// # Errors
    /// [`crate::Error::TooLarge`] where a map exceeds the device's limits.
    pub fn new(device: &wgpu::Device, layout: &AtlasLayout) -> Result<Self> {
        use wgpu::TextureUsages as U;
        let usage = U::STORAGE_BINDING | U::TEXTURE_BINDING | U::COPY_DST;
        let format = wgpu::TextureFormat::R32Float;
        let texture = pages(device, layout.page_size, layout.pages, format, usage);
        let largest = layout.slots.iter().map(|slot| u64::from(slot.size).pow(2)).max();
        let room = TEXELS.min(texels(&texture)).max(largest.unwrap_or(0));
        let bytes = room * size_of::<u32>() as u64;
        check_bytes(device, "shadow maps' texels", bytes)?;
        let nearest = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("nearest of what moves"),
            size: bytes,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let dimension = Some(wgpu::TextureViewDimension::D2Array);
        let view = texture.create_view(&wgpu::TextureViewDescriptor { dimension, ..Default::default() });
        Ok(Self { texture, view, nearest })
    }

    /// Bytes of the maps and of what is beside them.
    pub fn bytes(&self) -> u64 {
        texels(&self.texture) * 4 + self.nearest.size()
    }

    /// For how many texels there is room at once.
    pub fn texels(&self) -> u64 {
        self.nearest.size() / size_of::<u32>() as u64
    }
}
