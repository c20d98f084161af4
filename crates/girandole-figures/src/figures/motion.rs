//! A room in which something moves along its path, frame by frame, timed part by part.

use crate::bench::{Bench, Stage, first_view};
use anyhow::Result;
use girandole::wgpu::{DeviceType, Features};
use girandole::{MapUpdates, RenderSettings, RendererOptions};
use girandole_core::illumination::{Illumination, IlluminationSettings, Rewalk};
use girandole_core::image::Image;
use girandole_core::lights::LightSettings;
use girandole_core::scene::{Scene, View};
use std::time::Instant;

/// Frames a second of the path.
pub const FPS: f64 = 25.0;

/// What a frame took in milliseconds, and what it did.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameCost {
    /// Determining who is hidden from whom, where it was timed by itself; else it is part of the rest.
    pub visibility: f64,
    /// Drawing shadow maps, where it was timed by itself; else it is part of the rest.
    pub maps: f64,
    /// All else: the rest of the update, and shading.
    pub rest: f64,
    /// Shadow maps that were drawn.
    pub drawn: f64,
    /// Texels of them that were drawn.
    pub texels: f64,
    /// Shadow maps that were left stale.
    pub stale: f64,
}

impl FrameCost {
    /// Milliseconds of all of it.
    pub fn total(&self) -> f64 {
        self.visibility + self.maps + self.rest
    }

    /// Of two times of one frame, part by part.
    fn quicker(self, other: Self) -> Self {
        Self {
            visibility: self.visibility.min(other.visibility),
            maps: self.maps.min(other.maps),
            rest: self.rest.min(other.rest),
            ..self
        }
    }

    /// Takes of each frame what was quicker when the same frames were timed again.
    pub fn take_quicker(costs: &mut Vec<Self>, again: Vec<Self>) {
        if costs.is_empty() {
            *costs = again;
        } else {
            costs.iter_mut().zip(again).for_each(|(cost, again)| *cost = cost.quicker(again));
        }
    }

    /// The mean of each part.
    pub fn mean(costs: &[Self]) -> Self {
        let mean = |part: fn(&Self) -> f64| costs.iter().map(part).sum::<f64>() / costs.len().max(1) as f64;
        Self {
            visibility: mean(|cost| cost.visibility),
            maps: mean(|cost| cost.maps),
            rest: mean(|cost| cost.rest),
            drawn: mean(|cost| cost.drawn),
            texels: mean(|cost| cost.texels),
            stale: mean(|cost| cost.stale),
        }
    }
}

/// A scene whose animations play, on the device.
pub struct Motion<'a> {
    bench: &'a Bench,
    scene: Scene,
    /// It is seen from here.
    pub stage: Stage<'a>,
    /// A second one, to time by itself what the renderer does within its update.
    beside: Option<Illumination>,
}

impl<'a> Motion<'a> {
    /// Opens a scene with so many light samples, which stay as they are whatever moves (as the thesis's do), in so
    /// many pixels. `in_parts`: each part of a frame is timed by itself, which slows frames down a little.
    pub fn new(bench: &'a Bench, scene: Scene, lights: u32, size: [u32; 2], in_parts: bool) -> Result<Self> {
        let view = first_view(&scene, size)?;
        Self::seen(bench, scene, lights, (view, size), in_parts)
    }

    /// The same from elsewhere.
    pub fn seen(
        bench: &'a Bench,
        mut scene: Scene,
        lights: u32,
        (view, size): (View, [u32; 2]),
        in_parts: bool,
    ) -> Result<Self> {
        let lights = LightSettings { count: lights, walk_dynamic: false, ..LightSettings::default() };
        let settings = IlluminationSettings {
            lights,
            views: vec![view],
            rewalk: Rewalk::Off,
            ..IlluminationSettings::default()
        };
        scene.take_changes();
        let illumination = Illumination::new(&scene, &settings)?;
        let beside = in_parts.then(|| illumination.clone());
        let mut stage = bench.stage_with(&scene, RendererOptions::default(), illumination, (view, size))?;
        stage.renderer.time_passes(in_parts && has_timestamps(bench));
        Ok(Self { bench, scene, stage, beside })
    }

    /// Moves all to where it is at the start of a frame of this number; milliseconds of visibility and of all of the
    /// update.
    fn move_to(&mut self, frame: u32) -> Result<[f64; 2]> {
        self.scene.set_time(f64::from(frame) / FPS)?;
        let changes = self.scene.take_changes();
        let start = Instant::now();
        if let Some(beside) = &mut self.beside {
            beside.update(&self.scene, &changes)?;
        }
        let visibility = if self.beside.is_some() { milliseconds(start) } else { 0.0 };
        let start = Instant::now();
        self.stage.renderer.update(&self.scene, &changes)?;
        self.bench.gpu.wait()?;
        Ok([visibility, milliseconds(start)])
    }

    /// Starts again at a frame of the path, with all shadow maps up to date.
    pub fn restart(&mut self, frame: u32) -> Result<()> {
        self.move_to(frame)?;
        self.stage.frame(&RenderSettings::default())?;
        Ok(())
    }

    /// The next frame, without a picture.
    pub fn skip(&mut self, frame: u32, settings: &RenderSettings) -> Result<()> {
        self.move_to(frame)?;
        self.stage.renderer.skip_frame(&self.stage.view, settings)?;
        Ok(self.bench.gpu.wait()?)
    }

    /// The next frame: moves all to where it is then, and renders.
    pub fn frame(&mut self, frame: u32, settings: &RenderSettings) -> Result<FrameCost> {
        let [visibility, update] = self.move_to(frame)?;
        if self.beside.is_some() && !has_timestamps(self.bench) {
            return self.frame_of_two(settings, [visibility, update]);
        }
        let time = self.stage.frame(settings)?;
        let stats = self.stage.stats()?;
        let maps = stats.gpu_ms.get("shadow_maps_gpu_ms").copied().unwrap_or_default();
        Ok(FrameCost {
            visibility,
            maps,
            rest: (update + time - visibility - maps).max(0.0),
            drawn: f64::from(stats.maps_drawn),
            texels: if stats.maps_drawn == 0 { 0.0 } else { stats.texels_drawn as f64 },
            stale: f64::from(stats.stale.maps),
        })
    }

    /// The same where the device has no timestamps: shadow maps are drawn before the frame, and waited for.
    fn frame_of_two(
        &mut self,
        settings: &RenderSettings,
        [visibility, update]: [f64; 2],
    ) -> Result<FrameCost> {
        let start = Instant::now();
        self.stage.renderer.draw_shadow_maps_for(&self.stage.view, settings)?;
        self.bench.gpu.wait()?;
        let maps = milliseconds(start);
        let stats = self.stage.stats()?;
        let time = self.stage.frame(&with_updates(Some(0)))?;
        let stale = f64::from(self.stage.stats()?.stale.maps);
        let drawn = f64::from(stats.maps_drawn);
        let texels = if stats.maps_drawn == 0 { 0.0 } else { stats.texels_drawn as f64 };
        let rest = (update - visibility).max(0.0) + time;
        Ok(FrameCost { visibility, maps, rest, drawn, texels, stale })
    }

    /// Radiance of the last frame.
    pub fn picture(&self) -> Result<Image> {
        Ok(self.bench.gpu.block_on(self.stage.renderer.radiance(&self.stage.viewport))??)
    }

    /// So many frames from the path's start, with so many shadow maps drawn a frame at most.
    pub fn path(&mut self, most: u32, frames: u32) -> Result<Vec<FrameCost>> {
        self.restart(0)?;
        let settings = with_updates(Some(most));
        (1..=frames).map(|frame| self.frame(frame, &settings)).collect()
    }

    /// The mean of these frames, each the quicker of two times.
    pub fn mean_path(&mut self, most: u32, frames: u32) -> Result<FrameCost> {
        let mut costs = self.path(most, frames)?;
        FrameCost::take_quicker(&mut costs, self.path(most, frames)?);
        Ok(FrameCost::mean(&costs))
    }
}

/// Whether passes are timed on the device. Software has timestamps, but of when work is queued: shadow maps that
/// take 100 ms have 0.2 ms by them.
pub fn has_timestamps(bench: &Bench) -> bool {
    let is_software = bench.gpu.info.device_type == DeviceType::Cpu;
    !is_software && bench.gpu.device.features().contains(Features::TIMESTAMP_QUERY)
}

/// Default settings with so many shadow maps a frame.
pub fn with_updates(most: Option<u32>) -> RenderSettings {
    RenderSettings { updates: MapUpdates { most, ..MapUpdates::default() }, ..RenderSettings::default() }
}

/// Since then.
pub fn milliseconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}
