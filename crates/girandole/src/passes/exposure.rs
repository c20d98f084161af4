//! Automatic exposure: a histogram of luminance, and the stops that follow from it.

use crate::device::kernel::{Groups, Kernel, Shared, buffer, texture};
use crate::device::recorder::Recorder;
use crate::layout::Frame;
use crate::points::targets::Targets;
use crate::shader_constants::HISTOGRAM_BINS;
use crate::shaders;

pub(crate) struct Exposure {
    clear: Kernel,
    count: Kernel,
    choose: Kernel,
    histogram: wgpu::Buffer,
    stops: wgpu::Buffer,
}

/// One float on the device: the scale before tone mapping, stops.
#[derive(Clone, Copy)]
pub(crate) struct Stops<'a>(pub &'a wgpu::Buffer);

impl Exposure {
    pub fn new(device: &wgpu::Device, shared: &Shared) -> Self {
        let kernel = |entry| Kernel::new(device, shared, &shaders::EXPOSURE, entry, &[]);
        let buffer = |label, size| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: wgpu::BufferUsages::STORAGE,
                mapped_at_creation: false,
            })
        };
        Self {
            clear: kernel("clear"),
            count: kernel("count"),
            choose: kernel("choose"),
            histogram: buffer("histogram", u64::from(HISTOGRAM_BINS) * 4),
            stops: buffer("exposure", 4),
        }
    }

    /// What was found last.
    pub fn stops(&self) -> Stops<'_> {
        Stops(&self.stops)
    }

    /// Finds the stops of a picture.
    pub fn record(&self, recorder: &mut Recorder, targets: &Targets) -> Stops<'_> {
        let resources = [
            texture("picture", &targets.picture_view),
            buffer("histogram", &self.histogram),
            buffer("exposure", &self.stops),
        ];
        let one = Groups::Count([1, 1]);
        for (kernel, groups) in
            [(&self.clear, one), (&self.count, Groups::tiles(targets.size)), (&self.choose, one)]
        {
            let nothing = (&Frame::default(), None);
            kernel.record(recorder, nothing, "exposure_gpu_ms", &resources, groups);
        }
        self.stops()
    }
}
