//! Adds a picture to the mean of several, and shows the mean in its place; see `shaders/average.wgsl`.

use crate::device::kernel::{Groups, Kernel, Shared, buffer, texture};
use crate::device::readback;
use crate::device::recorder::Recorder;
use crate::layout::Frame;
use crate::points::average::Average;
use crate::points::targets::Targets;
use crate::shader_constants::TILE;
use crate::{Result, shaders};

pub(crate) struct Averaging {
    add: Kernel,
    show: Kernel,
    estimate: Kernel,
}

impl Averaging {
    pub fn new(device: &wgpu::Device, shared: &Shared) -> Self {
        let kernel = |entry| Kernel::new(device, shared, &shaders::AVERAGE, entry, &[]);
        Self { add: kernel("add"), show: kernel("show"), estimate: kernel("estimate") }
    }

    /// Adds the picture to the average.
    pub fn add(&self, recorder: &mut Recorder, targets: &Targets, average: &mut Average) {
        for (band, averages) in targets.bands().zip(&average.bands) {
            let frame = Frame { size: targets.size, band, sample: average.sets, ..Frame::default() };
            let resources = [texture("picture", &targets.picture_view), buffer("averages", averages)];
            let groups = tiles(&frame);
            self.add.record(recorder, (&frame, None), "average_gpu_ms", &resources, Groups::Count(groups));
        }
        average.sets += 1;
    }

    /// Writes the average in the picture's place.
    pub fn show(&self, recorder: &mut Recorder, targets: &Targets, average: &Average) {
        for (band, averages) in targets.bands().zip(&average.bands) {
            let frame = Frame { size: targets.size, band, ..Frame::default() };
            let resources = [texture("mean_picture", &targets.picture_view), buffer("averages", averages)];
            let groups = tiles(&frame);
            self.show.record(recorder, (&frame, None), "average_gpu_ms", &resources, Groups::Count(groups));
        }
    }

    /// Estimates the error of the average of two sets or more.
    pub fn estimate(&self, recorder: &mut Recorder, targets: &Targets, average: &Average) -> Estimate {
        let device = recorder.device;
        let mut sums = Vec::new();
        for (band, averages) in targets.bands().zip(&average.bands) {
            let frame = Frame { size: targets.size, band, samples: average.sets, ..Frame::default() };
            let groups = tiles(&frame);
            let [errors, sum] = [
                wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
                wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            ]
            .map(|usage| {
                device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("errors of tiles"),
                    size: groups.map(u64::from).iter().product::<u64>() * 4,
                    usage,
                    mapped_at_creation: false,
                })
            });
            let resources = [buffer("averages", averages), buffer("tile_errors", &errors)];
            let groups = Groups::Count(groups);
            self.estimate.record(recorder, (&frame, None), "average_gpu_ms", &resources, groups);
            recorder.encoder().copy_buffer_to_buffer(&errors, 0, &sum, 0, sum.size());
            sums.push(sum);
        }
        Estimate { sums, pixels: targets.size.map(f64::from).iter().product() }
    }
}

fn tiles(frame: &Frame) -> [u32; 2] {
    [frame.size[0], frame.band[1] - frame.band[0]].map(|n| n.div_ceil(TILE))
}

/// Errors of tiles on their way back.
pub(crate) struct Estimate {
    sums: Vec<wgpu::Buffer>,
    pixels: f64,
}

impl Estimate {
    /// The mean over all pixels.
    pub async fn mean(self) -> Result<f64> {
        let mut sum = 0.0;
        for buffer in &self.sums {
            let bytes = readback::bytes(buffer).await?;
            sum += bytemuck::pod_collect_to_vec::<u8, f32>(&bytes).into_iter().map(f64::from).sum::<f64>();
        }
        Ok(sum / self.pixels)
    }
}
