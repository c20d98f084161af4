//! What is counted of a frame, and read back.

use super::Renderer;
use crate::Result;
use crate::device::readback;
use crate::device::recorder::Recorder;
use crate::device::timers::Timers;
use crate::frame::first_samples;
use crate::gpu_scene::previous_transforms::PreviousTransforms;
use crate::gpu_scene::receivers::Receivers;
use crate::gpu_scene::transfer::GpuTransfer;
use crate::passes::LightMapsView;
use crate::passes::stale_error::PixelErrors;
use crate::passes::visibility_buffer::DepthUse;
use crate::points::lists::PointLists;
use crate::settings::{Mode, RenderSettings, Shading};
use crate::shader_constants::{
    JOINTED, MAPPED_SHADOWED, MAPPED_UNSHADOWED, NEAR_SHADOWED, NEAR_UNSHADOWED, NO_PART, SHADOWED,
    UNSHADOWED,
};
use crate::stats::FrameStats;
use crate::viewport::{LastFrame, Viewport};
use std::future::Future;

impl Renderer {
    /// What a viewport's last frame did; shadow maps that were drawn or left stale, and milliseconds, are those of the renderer's last frame,
    /// whichever viewport it was for. The future completes while the device is polled; it owns what it needs. What was recorded
    /// into an encoder of the caller's has to be submitted before.
    ///
    /// # Errors
    /// [`Error::Device`](crate::Error::Device) where the device was lost.
    pub fn stats(&self, viewport: &Viewport) -> impl Future<Output = Result<FrameStats>> + use<> {
        let (context, scene) = (&self.context, self.scene.as_ref());
        let Viewport { targets, lists, multipass, .. } = viewport;
        let mut stats = FrameStats::default();
        if let Some(scene) = scene {
            stats.lights = scene.lights.count();
            stats.map_size = scene.atlas.cache.layout().map_size;
            stats.map_size_wanted = scene.atlas.cache.layout().wanted_size;
            stats.atlas_pages = scene.atlas.cache.layout().pages;
            stats.atlas_bytes = scene.atlas.bytes();
            stats.non_blockers = scene.atlas.left_out();
            stats.maps_drawn = scene.maps_drawn;
            stats.texels_drawn = scene.texels_drawn;
            stats.light_map_changes = scene.light_map_changes;
            stats.transfer = scene.transfer.as_ref().map(GpuTransfer::counts).unwrap_or_default();
            stats.stale = scene.stale();
        }
        let mut encoder = context.device.create_command_encoder(&Default::default());
        let mut tally = None;
        let settings = viewport.last.as_ref().map(|last| &last.settings);
        match (settings, targets, scene.and_then(|s| s.receivers.as_ref()), lists) {
            (Some(settings), Some(targets), ..) if settings.mode == Mode::Naive => {
                let samples = u64::from(settings.samples_per_axis).pow(2);
                stats.points[0] = samples * targets.size.map(u64::from).iter().product::<u64>();
                stats.pairs.looked_up = stats.points[0] * u64::from(stats.lights);
            }
            (Some(settings), _, Some(receivers), Some(lists)) => {
                stats.leaves = [receivers.leaf_count(), receivers.mapped()];
                if let (Shading::Multipass { .. }, Some(plan)) = (settings.shading, multipass) {
                    stats.passes = [plan.count, plan.unmerged];
                }
                tally = Some(Tally::record(&context.device, &mut encoder, receivers, lists, settings));
            }
            _ => {}
        }
        let timestamps = context.timers.resolve(&context.device, &mut encoder);
        context.queue.submit([encoder.finish()]);
        async move {
            if let Some(tally) = tally {
                tally.count(&mut stats).await?;
            }
            if let Some(timestamps) = timestamps {
                stats.gpu_ms = timestamps.sums().await?;
            }
            Ok(stats)
        }
    }

    /// An estimate of the error that [stale](FrameStats::stale) shadow maps make in a viewport's last frame: the mean over the picture's
    /// pixels of |L − L′|, over the mean of L, where L is the luminance of the frame's linear radiance and L′ what it would be with
    /// all shadow maps up to date. 0 where none is stale. It looks at 1024 fixed pixels, spread evenly, whatever the picture's size,
    /// which takes as long as a small frame. Interpolation and filters of shadow maps are not part of it. `None` where
    /// scene or shadow maps were changed since, by a frame in another viewport even, for debug views, and where the picture is black. The future is like that of
    /// [`Renderer::stats`].
    ///
    /// # Errors
    /// [`Error::Device`](crate::Error::Device) where the device was lost, [`Error::TooLarge`](crate::Error::TooLarge) where a
    /// scene exceeds its limits.
    pub fn stale_error(&self, viewport: &Viewport) -> impl Future<Output = Result<Option<f64>>> + use<> {
        let context = &self.context;
        let mut encoder = context.device.create_command_encoder(&Default::default());
        let errors = self.record_stale_error(viewport, &mut encoder);
        context.queue.submit([encoder.finish()]);
        async move {
            match errors? {
                StaleError::Unknown => Ok(None),
                StaleError::Nothing => Ok(Some(0.0)),
                StaleError::OfPixels(errors) => errors.relative().await,
            }
        }
    }
}

/// What stale maps make of a frame.
enum StaleError {
    /// Nobody knows.
    Unknown,
    /// None is stale.
    Nothing,
    OfPixels(PixelErrors),
}

impl Renderer {
    /// Compares the last frame with one whose shadow maps are all up to date.
    fn record_stale_error(
        &self,
        viewport: &Viewport,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Result<StaleError> {
        let Self { context, passes, .. } = self;
        let Viewport { targets, lists, last, .. } = viewport;
        let last = last.as_ref().filter(|last| self.last_frame == Some(last.id));
        let (Some(scene), Some(scene_passes), Some(targets), Some(LastFrame { settings, view, .. })) =
            (&self.scene, &self.scene_passes, targets, last)
        else {
            return Ok(StaleError::Unknown);
        };
        if settings.debug.is_some() {
            return Ok(StaleError::Unknown);
        }
        if scene.stale().maps == 0 {
            return Ok(StaleError::Nothing);
        }
        // The frame's own passes alone are timed.
        let timers = Timers::none();
        let mut recorder = Recorder::into_encoder(&context.device, &context.shared.frame, &timers, encoder);
        // What is left of the frame's visibility buffer is a band of its last samples.
        let whole = first_samples(view, (scene, targets), settings);
        let seen = passes.visibility_buffer.record(&mut recorder, &whole, DepthUse::Discard);
        let listed = scene.receivers.as_ref().zip(lists.as_ref()).filter(|_| settings.mode != Mode::Naive);
        let listed = listed
            .map(|(receivers, lists)| (LightMapsView { receivers, used: settings.uses_light_maps() }, lists));
        let pass = scene_passes.stale_error(context, settings.mode);
        let old = scene.previous_transforms(settings, &[]);
        let old = old.unwrap_or_else(|| PreviousTransforms::none(scene.lights.samples.len()));
        let errors = pass.record(&mut recorder, &whole, seen, (&scene.lights, &scene.atlas, &old), listed)?;
        recorder.finish();
        Ok(StaleError::OfPixels(errors))
    }
}

/// How many points of each leaf and grid were shaded, on its way back.
struct Tally {
    buffer: wgpu::Buffer,
    /// For each leaf, how many lights are in each part of its lists, and how many cannot light it.
    leaves: Vec<([u32; NO_PART as usize], u32)>,
    light_maps: bool,
}

impl Tally {
    fn record(
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        receivers: &Receivers,
        lists: &PointLists,
        settings: &RenderSettings,
    ) -> Self {
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("tally"),
            size: lists.tally.size(),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        encoder.copy_buffer_to_buffer(&lists.tally, 0, &buffer, 0, lists.tally.size());
        let leaves =
            receivers.lists.parts.iter().copied().zip(receivers.lists.skipped.iter().copied()).collect();
        Self { buffer, leaves, light_maps: settings.uses_light_maps() }
    }

    /// Points and pairs.
    async fn count(self, stats: &mut FrameStats) -> Result<()> {
        let bytes = readback::bytes(&self.buffer).await?;
        let words = bytemuck::pod_collect_to_vec::<u8, u32>(&bytes);
        for (row, points) in words.chunks_exact(self.leaves.len().max(1)).zip(&mut stats.points) {
            for (&count, &(parts, skipped)) in row.iter().zip(&self.leaves) {
                let count = u64::from(count);
                *points += count;
                let of = |part| count * u64::from(parts[part as usize]);
                let mapped = of(MAPPED_UNSHADOWED);
                stats.pairs.looked_up += of(NEAR_SHADOWED) + of(JOINTED) + of(SHADOWED) + of(MAPPED_SHADOWED);
                stats.pairs.unshadowed +=
                    of(UNSHADOWED) + of(NEAR_UNSHADOWED) + if self.light_maps { 0 } else { mapped };
                stats.pairs.mapped += if self.light_maps { mapped } else { 0 };
                stats.pairs.skipped += count * u64::from(skipped);
            }
        }
        Ok(())
    }
}
