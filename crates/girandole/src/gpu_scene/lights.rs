//! Light samples on the GPU.

use crate::Result;
use crate::device::buffers::check_size;
use crate::layout::Light;
use crate::shader_constants::{BATCH, DISTANT};
use girandole_core::glam::Vec3;
use girandole_core::lights::SPREAD;
use wgpu::util::DeviceExt;

/// Light samples with their places in the atlas.
pub(crate) struct GpuLights {
    pub samples: Vec<Light>,
    /// Of samples of the environment, sr, as [`girandole_core::lights::mean_solid_angle`].
    pub mean_solid_angle: f32,
    /// Of what samples on surfaces stand for, m²: the mean over all that they cover; 0 without any.
    pub mean_area: f32,
    /// Whether some are punctual, which no ray meets.
    pub has_punctual: bool,
    /// For shadow maps as a whole, for shading in batches: it goes on for a batch behind the last one.
    pub buffer: wgpu::Buffer,
    /// The same without those that are dark, if there are any, and how many are left.
    lit: Option<(wgpu::Buffer, u32)>,
    /// What both are to hold from the next frame on.
    next: Vec<wgpu::Buffer>,
    /// Whether maps show other parts of the scene than those on the device say.
    shows_others: bool,
}

impl GpuLights {
    /// # Errors
    /// [`crate::Error::TooLarge`] beyond the device's limit.
    pub fn new(device: &wgpu::Device, samples: Vec<Light>) -> Result<Self> {
        let padded = padded(&samples);
        check_size(device, "lights", bytemuck::cast_slice::<_, u8>(&padded))?;
        Ok(Self {
            lit: lit(device, &samples),
            buffer: buffer(device, &padded),
            mean_solid_angle: mean_solid_angle(&samples),
            mean_area: mean_area(&samples),
            has_punctual: has_punctual(&samples),
            samples,
            next: Vec::new(),
            shows_others: false,
        })
    }

    /// Takes as many others, of which these differ, ascending.
    pub fn follow(
        &mut self,
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        samples: Vec<Light>,
        changed: &[usize],
    ) {
        // All of them where places were not put there yet.
        let all = (0, samples.len().saturating_sub(1));
        let ends = changed.first().copied().zip(changed.last().copied());
        if let Some((first, last)) = ends.map(|ends| if self.next.is_empty() { ends } else { all }) {
            let at = first * size_of::<Light>();
            queue.write_buffer(&self.buffer, at as u64, bytemuck::cast_slice(&samples[first..=last]));
            self.lit = lit(device, &samples);
            self.next.clear();
        }
        self.mean_solid_angle = mean_solid_angle(&samples);
        self.mean_area = mean_area(&samples);
        self.has_punctual = has_punctual(&samples);
        self.samples = samples;
    }

    /// Has the map of parallel light show what another one's does.
    pub fn show(&mut self, index: usize, as_of: &Light) {
        let light = &mut self.samples[index];
        let is_other = (light.position, light.scale) != (as_of.position, as_of.scale);
        (light.position, light.scale) = (as_of.position, as_of.scale);
        self.shows_others |= is_other;
    }

    /// Gives each its place in the atlas, which the next frame puts on the device: others that are recorded have their own.
    pub fn place(&mut self, device: &wgpu::Device, words: &[u32]) {
        let is_placed = self.samples.iter().map(|light| light.atlas_slot).eq(words.iter().copied());
        if is_placed && !std::mem::take(&mut self.shows_others) {
            return;
        }
        self.shows_others = false;
        for (light, &word) in self.samples.iter_mut().zip(words) {
            light.atlas_slot = word;
        }
        self.next = vec![buffer(device, &padded(&self.samples))];
        self.next.extend(self.lit.is_some().then(|| buffer(device, &padded(&lit_ones(&self.samples)))));
    }

    /// Puts places on the device.
    pub fn record(&self, encoder: &mut wgpu::CommandEncoder) {
        let held = [Some(&self.buffer), self.lit.as_ref().map(|(buffer, _)| buffer)];
        for (next, held) in self.next.iter().zip(held.into_iter().flatten()) {
            encoder.copy_buffer_to_buffer(next, 0, held, 0, next.size());
        }
    }

    /// Takes note that they are there.
    pub fn advance(&mut self) {
        self.next.clear();
    }

    /// How many.
    pub fn count(&self) -> u32 {
        self.samples.len() as u32
    }

    /// How many are not dark.
    pub fn lit_count(&self) -> u32 {
        self.lit.as_ref().map_or(self.count(), |(_, count)| *count)
    }

    /// Lights from `first` on: [`BATCH`] of them, used or not.
    pub fn batch(&self, first: u32) -> wgpu::BufferBinding<'_> {
        batch(&self.buffer, first)
    }

    /// The same of those that are not dark.
    pub fn lit_batch(&self, first: u32) -> wgpu::BufferBinding<'_> {
        batch(self.lit.as_ref().map_or(&self.buffer, |(buffer, _)| buffer), first)
    }
}

fn batch(buffer: &wgpu::Buffer, first: u32) -> wgpu::BufferBinding<'_> {
    let size = size_of::<Light>() as u64;
    wgpu::BufferBinding {
        buffer,
        offset: u64::from(first) * size,
        size: wgpu::BufferSize::new(u64::from(BATCH) * size),
    }
}

fn mean_solid_angle(samples: &[Light]) -> f32 {
    let of = |light: &Light| {
        (light.profile == DISTANT && light.rectangle.y == 0.0 && light.intensity != Vec3::ZERO)
            .then(|| f64::from(light.rectangle.x))
    };
    let count = samples.iter().filter_map(of).count();
    (samples.iter().filter_map(of).sum::<f64>() / count.max(1) as f64) as f32
}

fn mean_area(samples: &[Light]) -> f32 {
    // As in `shaders/lib/light.wgsl`.
    let area = |light: &Light| {
        let side = if light.offset < 0.0 { 2.0 / SPREAD } else { 2.0 };
        let [z, w] = [light.rectangle.z, light.rectangle.w];
        side * side * (z * z + w * w) * light.scale.abs()
    };
    let areas = samples.iter().filter(|light| light.is_sample()).map(area);
    let [sum, squares] = areas.fold([0.0; 2], |[sum, squares], area| [sum + area, squares + area * area]);
    if sum > 0.0 { squares / sum } else { 0.0 }
}

fn has_punctual(samples: &[Light]) -> bool {
    !samples.iter().all(|light| light.is_sample() || light.profile == DISTANT)
}

fn padded(samples: &[Light]) -> Vec<Light> {
    let mut padded = samples.to_vec();
    padded.resize(samples.len() + BATCH as usize, Light::default());
    padded
}

fn buffer(device: &wgpu::Device, padded: &[Light]) -> wgpu::Buffer {
    device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("lights"),
        contents: bytemuck::cast_slice(padded),
        usage: wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::UNIFORM
            | wgpu::BufferUsages::COPY_SRC
            | wgpu::BufferUsages::COPY_DST,
    })
}

fn lit(device: &wgpu::Device, samples: &[Light]) -> Option<(wgpu::Buffer, u32)> {
    let lit = lit_ones(samples);
    (lit.len() < samples.len()).then(|| (buffer(device, &padded(&lit)), lit.len() as u32))
}

fn lit_ones(samples: &[Light]) -> Vec<Light> {
    samples.iter().filter(|light| light.intensity != Vec3::ZERO).copied().collect()
}
