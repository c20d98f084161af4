//! The mean of the pictures of several light sets, and how much they differ.

use super::targets::Targets;

/// Bytes of a pixel: its mean, and the sum of squared differences from it, four floats each.
const PIXEL_BYTES: u64 = 32;

/// Sums of a picture's size, by bands of rows; of no set as long as none was added.
pub(crate) struct Average {
    pub size: [u32; 2],
    /// One a band, see `average.wgsl`.
    pub bands: Vec<wgpu::Buffer>,
    /// Sets that were added.
    pub sets: u32,
}

impl Average {
    pub fn new(device: &wgpu::Device, targets: &Targets) -> Self {
        let size = targets.size;
        let band = |[first, end]: [u32; 2]| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("average"),
                size: u64::from(size[0]) * u64::from(end - first) * PIXEL_BYTES,
                usage: wgpu::BufferUsages::STORAGE,
                mapped_at_creation: false,
            })
        };
        Self { size, bands: targets.bands().map(band).collect(), sets: 0 }
    }
}
