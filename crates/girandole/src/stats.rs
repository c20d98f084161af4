//! What a frame did: counts and times.

use crate::Result;
use crate::occluders::CullCounts;
use crate::readback;
use crate::renderer::Renderer;
use crate::settings::{Mode, Shading};
use std::collections::BTreeMap;

/// What a frame did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameStats {
    /// Light samples.
    pub lights: u32,
    /// Texels across each shadow map.
    pub map_size: u32,
    /// Pages of the atlas.
    pub atlas_pages: u32,
    /// Bytes of the atlas, and of what it is copied through.
    pub atlas_bytes: u64,
    /// Triangles left out of the shadow maps because they cannot block.
    pub non_blockers: usize,
    /// Faces and clusters drawn and culled when the maps were last drawn.
    pub culling: CullCounts,
    /// Points shaded, by pixels from point to point: 1, 2, 4, 8; and further samples of pixels at edges. All other
    /// pixels were interpolated.
    pub points: [u64; 5],
    /// Pairs of point and light.
    pub pairs: PairCounts,
    /// Multipass shading: passes for each set of points, and how many it would take without optimisation.
    pub passes: [u32; 2],
    /// Leaf receivers, and how many of them have a light map.
    pub leaves: [u32; 2],
    /// Milliseconds on the device by pass, where it has timestamps and [`Renderer::time_passes`] asked for them; names
    /// end in `_gpu_ms`.
    pub gpu_ms: BTreeMap<&'static str, f64>,
}

/// What became of the pairs of shaded point and light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PairCounts {
    /// Summed by what a shadow map says.
    pub looked_up: u64,
    /// Summed without a look, because nothing can block.
    pub unshadowed: u64,
    /// Taken from a light map.
    pub mapped: u64,
    /// Left out, because the light cannot arrive.
    pub skipped: u64,
}

impl PairCounts {
    /// Pairs that were evaluated one by one.
    pub fn evaluated(&self) -> u64 {
        self.looked_up + self.unshadowed
    }
}

impl Renderer {
    /// What the last frame did. The future completes while the device is polled.
    ///
    /// # Errors
    /// [`Error::Device`](crate::Error::Device) where the device was lost.
    pub async fn stats(&self) -> Result<FrameStats> {
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let timestamps = self.timers.resolve(&self.device, &mut encoder);
        let tally = self.copy_tally(&mut encoder);
        self.queue.submit([encoder.finish()]);
        let mut stats = FrameStats::default();
        if let Some(tally) = tally {
            let bytes = readback::bytes(&tally).await?;
            self.count(&bytemuck::pod_collect_to_vec::<u8, u32>(&bytes), &mut stats);
        }
        if let (Some(l), Some(drawn)) = (&self.loaded, &self.drawn)
            && drawn.settings.mode == Mode::Naive
        {
            let samples = u64::from(drawn.settings.samples_per_axis).pow(2);
            stats.points[0] = samples * u64::from(drawn.size[0]) * u64::from(drawn.size[1]);
            stats.pairs.looked_up = stats.points[0] * l.lights.len() as u64;
        }
        if let Some(l) = &self.loaded {
            stats.lights = l.lights.len() as u32;
            stats.map_size = l.atlas.layout.map_size;
            stats.atlas_pages = l.atlas.layout.pages;
            stats.atlas_bytes = l.atlas.bytes();
            stats.non_blockers = l.atlas.left_out();
            stats.culling = l.counts;
        }
        if let Some(buffer) = timestamps {
            let bytes = readback::bytes(&buffer).await?;
            stats.gpu_ms = self.timers.sums(&bytemuck::pod_collect_to_vec::<u8, u64>(&bytes));
        }
        Ok(stats)
    }

    /// Records the read-back of how many points of each leaf were shaded.
    fn copy_tally(&self, encoder: &mut wgpu::CommandEncoder) -> Option<wgpu::Buffer> {
        let selection = self.selection.as_ref()?;
        self.drawn.as_ref().filter(|d| d.settings.mode != Mode::Naive)?;
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("tally"),
            size: selection.tally.size(),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        encoder.copy_buffer_to_buffer(&selection.tally, 0, &buffer, 0, selection.tally.size());
        Some(buffer)
    }

    /// Points and pairs from the tally.
    fn count(&self, tally: &[u32], stats: &mut FrameStats) {
        let (Some(loaded), Some(drawn)) = (&self.loaded, &self.drawn) else { return };
        let Some(receivers) = &loaded.receivers else { return };
        stats.leaves = [receivers.leaves, receivers.mapped];
        if let (Shading::Multipass { .. }, Some(draws)) = (drawn.settings.shading, &loaded.draws) {
            stats.passes = [draws.count, draws.unmerged];
        }
        let maps = drawn.settings.uses_light_maps();
        for (row, points) in tally.chunks_exact(receivers.leaves.max(1) as usize).zip(&mut stats.points) {
            for ((&count, parts), &skipped) in row.iter().zip(&receivers.parts).zip(&receivers.skipped) {
                let count = u64::from(count);
                *points += count;
                let [mapped, unshadowed, added, subtracted] = parts.map(|n| count * u64::from(n));
                stats.pairs.looked_up += added + subtracted;
                stats.pairs.unshadowed += unshadowed + if maps { 0 } else { mapped };
                stats.pairs.mapped += if maps { mapped } else { 0 };
                stats.pairs.skipped += count * u64::from(skipped);
            }
        }
    }
}
