//! Light samples on the GPU.

use crate::Result;
use crate::device::buffers::check_size;
use crate::layout::Light;
use crate::shader_constants::BATCH;
use wgpu::util::DeviceExt;

/// Light samples with their places in the atlas.
pub(crate) struct GpuLights {
    pub samples: Vec<Light>,
    /// For shadow maps as a whole, for shading in batches: it goes on for a batch behind the last one.
    pub buffer: wgpu::Buffer,
}

impl GpuLights {
    /// # Errors
    /// [`crate::Error::TooLarge`] beyond the device's limit.
    pub fn new(device: &wgpu::Device, samples: Vec<Light>) -> Result<Self> {
        let mut padded = samples.clone();
        padded.resize(samples.len() + BATCH as usize, Light::default());
        check_size(device, "lights", bytemuck::cast_slice::<_, u8>(&padded))?;
        let buffer = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("lights"),
            contents: bytemuck::cast_slice(&padded),
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        });
        Ok(Self { samples, buffer })
    }

    /// Takes as many others.
    pub fn follow(&mut self, queue: &wgpu::Queue, samples: Vec<Light>) {
        let differ = |(a, b): (&Light, &Light)| a != b;
        let pairs = || self.samples.iter().zip(&samples);
        if let (Some(first), Some(last)) = (pairs().position(differ), pairs().rposition(differ)) {
            let at = first * size_of::<Light>();
            queue.write_buffer(&self.buffer, at as u64, bytemuck::cast_slice(&samples[first..=last]));
        }
        self.samples = samples;
    }

    /// How many.
    pub fn count(&self) -> u32 {
        self.samples.len() as u32
    }

    /// Lights from `first` on: [`BATCH`] of them, used or not.
    pub fn batch(&self, first: u32) -> wgpu::BufferBinding<'_> {
        let size = size_of::<Light>() as u64;
        wgpu::BufferBinding {
            buffer: &self.buffer,
            offset: u64::from(first) * size,
            size: wgpu::BufferSize::new(u64::from(BATCH) * size),
        }
    }
}
