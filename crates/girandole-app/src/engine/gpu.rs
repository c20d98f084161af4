//! The renderer on wgpu, without a window.

use super::windows::Window;
use super::{Job, Picture};
use crate::args;
use crate::output::{Progress, Stats, say};
use crate::transfer::{Transferred, light_by};
use anyhow::{Result, anyhow};
use girandole::wgpu;
use girandole::{FrameStats, Gpu, MapUpdates, RenderSettings, Renderer, Viewport};
use girandole_core::illumination::IlluminationSettings;
use girandole_core::image::{Image, Region};
use girandole_core::lights::LightSet;
use girandole_core::scene::{Geometry, Scene, SceneChanges, View};
use girandole_core::visibility::{MOST_LIGHTS, VisibilityDatabase, VisibilitySettings};
use pollster::block_on;
use std::future::Future;
use std::sync::Arc;
use std::time::Instant;

pub use girandole::{AdapterReport, Error};

/// All adapters of this machine, the best first.
pub fn adapters() -> Vec<AdapterReport> {
    block_on(girandole::adapters())
}

/// An opened adapter.
pub struct Device {
    gpu: Gpu,
    /// Kept from picture to picture, as it holds what was compiled.
    renderer: Option<Renderer>,
    viewport: Viewport,
    /// What a shadow map took lately, if some were drawn.
    ms_per_map: Option<f64>,
    /// Whether it was said that memory makes shadow maps small.
    said_small: bool,
}

impl Device {
    /// Opens the adapter whose name contains `name`, or the best one.
    pub fn open(name: Option<&str>) -> Result<Self, Error> {
        let gpu = block_on(Gpu::new(name))?;
        Ok(Self { gpu, renderer: None, viewport: Viewport::default(), ms_per_map: None, said_small: false })
    }

    /// The adapter's name, and how it is reached.
    pub fn name(&self) -> String {
        format!("{} ({:?})", self.gpu.info.name, self.gpu.info.backend)
    }

    /// Begins to compile what pictures of a scene will need.
    pub fn compile_for(&mut self, scene: &Scene, geometry: &Geometry, args: &args::RenderArgs) -> Result<()> {
        let renderer = renderer(&self.gpu, &mut self.renderer, args)?;
        renderer.compile_for(scene, geometry, &picture_settings(args));
        Ok(())
    }

    /// Renders with shadow maps.
    pub fn render(&mut self, job: &Job) -> Result<Picture> {
        let args = job.args;
        if args.refine > 1 {
            return self.refine(job);
        }
        let _progress = Progress::spinner(&format!("rendering on {}", self.name()));
        let (mut found, mut visibility_ms) = (None, 0.0);
        if job.visibility.is_none()
            && let Some((database, ms)) =
                visibility(job.scene, job.geometry, job.lights, (&[args.mode], &[job.view]))?
        {
            (found, visibility_ms) = (Some(Arc::new(database)), ms);
        }
        let start = Instant::now();
        let renderer = renderer(&self.gpu, &mut self.renderer, args)?;
        renderer.time_passes(args.stats.is_some());
        light_by(renderer, job.scene, job.transfers)?;
        renderer.load(job.scene, job.geometry, job.lights)?;
        if let Some(database) = job.visibility.cloned().or(found) {
            renderer.load_visibility(job.scene, job.geometry, job.lights, database)?;
        }
        self.gpu.wait()?;
        let setup_ms = milliseconds(start);
        let mut picture = self.picture(&job.view, args)?;
        picture.frame_ms += visibility_ms;
        picture.stats.insert("setup_ms".into(), setup_ms.into());
        picture.stats.insert("visibility_ms".into(), visibility_ms.into());
        Ok(picture)
    }

    /// Opens a scene whose changes [`Device::follow`] follows.
    pub fn open_scene(
        &mut self,
        scene: &Scene,
        light: &IlluminationSettings,
        transfers: &[Transferred],
        args: &args::RenderArgs,
    ) -> Result<()> {
        let renderer = renderer(&self.gpu, &mut self.renderer, args)?;
        light_by(renderer, scene, &[])?;
        let illumination = super::illumination(scene, light, args);
        let opened = illumination.map_err(girandole::Error::from).and_then(|i| renderer.open_with(scene, i));
        opened.map_err(|error| too_many(error.into(), light.lights.count as usize))?;
        light_by(renderer, scene, transfers)
    }

    /// Follows the changes of the scene that is open.
    pub fn follow(&mut self, scene: &Scene, changes: &SceneChanges) -> Result<()> {
        Ok(self.opened()?.update(scene, changes)?)
    }

    /// Places the light samples of the scene that is open for other views, and those to come.
    pub fn place_on_way(&mut self, scene: &Scene, views: &[View], to_come: &[View]) -> Result<()> {
        Ok(self.opened()?.place_on_way(scene, views, to_come)?)
    }

    /// Draws the shadow maps of a frame that is not rendered.
    pub fn skip_frame(&mut self, view: &View, args: &args::RenderArgs) -> Result<()> {
        let settings = RenderSettings { updates: args.motion.map_updates(None), ..picture_settings(args) };
        Ok(self.opened()?.skip_frame(view, &settings)?)
    }

    /// What the light samples of the scene that is open warn of.
    pub fn warnings(&self) -> &[String] {
        let open = self.renderer.as_ref().and_then(Renderer::illumination);
        open.map_or(&[], |illumination| &illumination.lights().warnings)
    }

    pub(super) fn opened(&mut self) -> Result<&mut Renderer> {
        self.with_viewport().map(|(renderer, _)| renderer)
    }

    /// The renderer with the scene that is open, and where its pictures are.
    pub(super) fn with_viewport(&mut self) -> Result<(&mut Renderer, &mut Viewport)> {
        let renderer = self.renderer.as_mut().ok_or_else(|| anyhow!("no scene is open"))?;
        Ok((renderer, &mut self.viewport))
    }

    /// A picture of what was loaded or opened.
    pub fn picture(&mut self, view: &View, args: &args::RenderArgs) -> Result<Picture> {
        let windows = Window::all(args.size, args.piece.region);
        if let [window] = &windows[..] {
            return self.picture_in(window, view, args);
        }
        let asked = args.piece.region.unwrap_or(Region::whole(args.size));
        let mut radiance = Image::new(asked.size[0], asked.size[1]);
        let (mut frame_ms, mut stats) = (0.0, Stats::new());
        for window in &windows {
            let drawn = self.picture_in(window, view, args)?;
            window.put(&drawn.radiance, asked, &mut radiance);
            (frame_ms, stats) = (frame_ms + drawn.frame_ms, drawn.stats);
        }
        Ok(Picture { radiance, frame_ms, stats, sum: None })
    }

    /// What a window has of it; `view` is that of all.
    fn picture_in(&mut self, window: &Window, view: &View, args: &args::RenderArgs) -> Result<Picture> {
        let settings = RenderSettings { region: window.part(), ..picture_settings(args) };
        let (view, size) = (&window.view(view, args.size), window.size());
        // The parts of a frame, in wall-clock time around submit and wait. First what is left to compile.
        let start = Instant::now();
        self.opened()?.rehearse(view, size, &settings)?;
        self.wait()?;
        let compilation_ms = milliseconds(start);
        let start = Instant::now();
        let updates = args.motion.map_updates(self.ms_per_map);
        self.opened()?.draw_shadow_maps_for(view, &RenderSettings { updates, ..settings })?;
        self.wait()?;
        let shadow_maps_ms = milliseconds(start);
        let (renderer, viewport) = self.with_viewport()?;
        let maps = renderer.stats(viewport);
        let maps = self.gpu.block_on(maps)??;
        self.say_if_small(&maps);
        if maps.maps_drawn > 0 {
            let now = shadow_maps_ms / f64::from(maps.maps_drawn);
            self.ms_per_map = Some(self.ms_per_map.map_or(now, |before| (before + now) * 0.5));
        }
        let start = Instant::now();
        let (renderer, viewport) = self.with_viewport()?;
        renderer.render(viewport, view, size, &settings)?;
        self.gpu.wait()?;
        let shading_ms = milliseconds(start);

        let pixels = size.map(u64::from).iter().product();
        let (renderer, viewport) = self.with_viewport()?;
        let (frame, radiance) = (renderer.stats(viewport), renderer.radiance(viewport));
        let mut stats = statistics(&self.gpu.block_on(frame)??, pixels);
        for (pass, ms) in maps.gpu_ms {
            stats.insert(pass.into(), ms.into());
        }
        stats.insert("maps_drawn".into(), maps.maps_drawn.into());
        stats.insert("mode".into(), args.mode.name().into());
        let kernels = self.opened()?.kernels();
        for (key, value) in [
            ("shadow_maps_ms", shadow_maps_ms),
            ("shading_ms", shading_ms),
            ("kernels", kernels.len() as f64),
            ("kernels_ms", kernels.iter().map(|kernel| kernel.ms).sum()),
            ("compilation_ms", compilation_ms),
        ] {
            stats.insert(key.into(), value.into());
        }
        let radiance = self.gpu.block_on(radiance)??;
        Ok(Picture { radiance, frame_ms: shadow_maps_ms + shading_ms, stats, sum: None })
    }

    /// Says once that shadow maps are much smaller than they would be with more memory.
    fn say_if_small(&mut self, stats: &FrameStats) {
        let FrameStats { map_size, map_size_wanted, .. } = *stats;
        if map_size * 10 < map_size_wanted * 9 && !self.said_small {
            self.said_small = true;
            say(&format!(
                "shadow maps are {map_size} texels across instead of {map_size_wanted}; give --memory more for finer shadows"
            ));
        }
    }

    /// Times modes in alternation on one scene with its lights.
    pub fn time(&self, trial: &Trial, progress: &dyn Fn(f32)) -> Result<Vec<Stats>> {
        let Trial { scene, geometry, lights, view, args, .. } = trial;
        let mut renderer = Renderer::new(&self.gpu.device, &self.gpu.queue, args.quality.options())?;
        let mut viewport = Viewport::default();
        let target = self.target(args.size);
        let clamp = args.quality.clamp.0;
        // One round to warm up, and one for pass timestamps, which would slow the others down.
        let rounds = args.repeat + 2;
        let mut times = vec![[Vec::new(), Vec::new()]; args.modes.len()];
        let [mut maps_ms, mut visibility_ms] = [0.0; 2];
        let mut results = vec![Stats::new(); args.modes.len()];
        // The parts that are needed once for a static scene; the first round warms up.
        for _ in 0..2 {
            renderer.load(scene, geometry, lights)?;
            self.gpu.wait()?;
            let start = Instant::now();
            renderer.draw_shadow_maps(&MapUpdates::default())?;
            self.gpu.wait()?;
            maps_ms = milliseconds(start);
            if let Some((database, ms)) = visibility(scene, geometry, lights, (&args.modes, &[*view]))? {
                renderer.load_visibility(scene, geometry, lights, database)?;
                visibility_ms = ms;
            }
        }
        for round in 0..rounds {
            renderer.time_passes(round + 1 == rounds);
            for (index, &mode) in args.modes.iter().enumerate() {
                let settings = RenderSettings {
                    exposure: girandole_core::tonemap::Exposure::Ev(0.0),
                    ..args.quality.settings(mode, clamp, args.aa)
                };
                let start = Instant::now();
                renderer.render(&mut viewport, view, args.size, &settings)?;
                renderer.show(&viewport, &settings, &target, FORMAT)?;
                let recorded = milliseconds(start);
                self.gpu.wait()?;
                if round > 0 && round + 1 < rounds {
                    times[index][0].push(milliseconds(start));
                    times[index][1].push(recorded);
                }
                if round + 1 == rounds {
                    let pixels = u64::from(args.size[0]) * u64::from(args.size[1]);
                    results[index] = statistics(&self.stats(&renderer, &viewport)?, pixels);
                }
                progress(
                    (round as f32 * args.modes.len() as f32 + index as f32 + 1.0)
                        / (rounds as usize * args.modes.len()) as f32,
                );
            }
        }
        for ((result, times), mode) in results.iter_mut().zip(&mut times).zip(&args.modes) {
            let shortest = times[0].iter().copied().fold(f64::INFINITY, f64::min);
            for (key, value) in [
                ("mode", mode.name().into()),
                ("frame_ms", median(&mut times[0]).into()),
                ("frame_min_ms", shortest.into()),
                ("record_ms", median(&mut times[1]).into()),
                ("shadow_maps_ms", maps_ms.into()),
                ("visibility_ms", if *mode == args::Mode::Naive { 0.0 } else { visibility_ms }.into()),
            ] {
                result.insert(key.into(), value);
            }
        }
        Ok(results)
    }

    pub(super) fn handles(&self) -> (&wgpu::Device, &wgpu::Queue) {
        (&self.gpu.device, &self.gpu.queue)
    }

    /// Waits until everything is done that was submitted.
    pub(super) fn wait(&self) -> Result<()> {
        Ok(self.gpu.wait()?)
    }

    pub(super) fn block_on<T>(&self, future: impl Future<Output = girandole::Result<T>>) -> Result<T> {
        Ok(self.gpu.block_on(future)??)
    }

    pub(super) fn stats(&self, renderer: &Renderer, viewport: &Viewport) -> Result<FrameStats> {
        Ok(self.gpu.block_on(renderer.stats(viewport))??)
    }

    pub(super) fn stale_error(&self, renderer: &Renderer, viewport: &Viewport) -> Result<f64> {
        Ok(self.gpu.block_on(renderer.stale_error(viewport))??.unwrap_or(0.0))
    }

    pub(super) fn target(&self, [width, height]: [u32; 2]) -> wgpu::TextureView {
        let texture = self.gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("target"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        texture.create_view(&Default::default())
    }
}

/// Format of the target that is drawn to while timing.
pub(super) const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;

/// A scene with its lights, to be timed.
pub struct Trial<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The same, flattened.
    pub geometry: &'a Geometry,
    /// Its light.
    pub lights: &'a LightSet,
    /// The camera.
    pub view: View,
    /// Options.
    pub args: &'a args::BenchArgs,
}

/// What the options say of a picture whose shadow maps are drawn beforehand.
pub(super) fn picture_settings(args: &args::RenderArgs) -> RenderSettings {
    RenderSettings {
        exposure: args.exposure,
        tonemap: args.tonemap.into(),
        debug: args.debug.map(Into::into),
        updates: MapUpdates { most: Some(0), ..MapUpdates::default() },
        ..args.quality.settings(args.mode, args.quality.clamp.0, args.aa.unwrap_or_default())
    }
}

/// What to do where there are too many lights for a visibility database.
fn too_many(error: anyhow::Error, lights: usize) -> anyhow::Error {
    if lights > MOST_LIGHTS { anyhow!("{error}; --mode naive takes as many") } else { error }
}

/// The renderer that is there, or a new one.
fn renderer<'a>(
    gpu: &Gpu,
    renderer: &'a mut Option<Renderer>,
    args: &args::RenderArgs,
) -> Result<&'a mut Renderer> {
    if renderer.is_none() {
        *renderer = Some(Renderer::new(&gpu.device, &gpu.queue, args.quality.options())?);
    }
    renderer.as_mut().ok_or_else(|| anyhow!("there is no renderer"))
}

/// The visibility database and its build time in milliseconds; `None` if no mode needs it.
fn visibility(
    scene: &Scene,
    geometry: &Geometry,
    lights: &LightSet,
    (modes, views): (&[args::Mode], &[View]),
) -> Result<Option<(VisibilityDatabase, f64)>> {
    if modes.iter().all(|&mode| mode == args::Mode::Naive) {
        return Ok(None);
    }
    let start = Instant::now();
    let settings = VisibilitySettings::default();
    let database = VisibilityDatabase::build_for(scene, geometry, lights, &settings, views);
    let database = database.map_err(|error| too_many(error.into(), lights.len()))?;
    Ok(Some((database, milliseconds(start))))
}

pub(super) fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 { values[middle] } else { (values[middle - 1] + values[middle]) * 0.5 }
}

pub(super) fn statistics(frame: &FrameStats, pixels: u64) -> Stats {
    let mut stats = Stats::new();
    let pairs = frame.pairs;
    let points: u64 = frame.points.iter().sum();
    let all = (pairs.evaluated() + pairs.mapped + pairs.skipped).max(1) as f64;
    for (key, value) in [
        ("share_shaded_at_step_1", frame.points[0] as f64 / pixels as f64),
        ("share_shaded_at_step_2", frame.points[1] as f64 / pixels as f64),
        ("share_shaded_at_step_4", frame.points[2] as f64 / pixels as f64),
        ("share_shaded_at_step_8", frame.points[3] as f64 / pixels as f64),
        ("share_shaded_again_at_edges", frame.points[4] as f64 / pixels as f64),
        ("share_pairs_looked_up", pairs.looked_up as f64 / all),
        ("share_pairs_unshadowed", pairs.unshadowed as f64 / all),
        ("share_pairs_in_light_maps", pairs.mapped as f64 / all),
        ("share_pairs_fully_blocked", pairs.skipped as f64 / all),
        ("look_ups_per_pixel", pairs.looked_up as f64 / pixels as f64),
        ("pairs_per_pixel", pairs.evaluated() as f64 / pixels as f64),
    ] {
        stats.insert(key.into(), value.into());
    }
    for (key, value) in [
        ("maps", u64::from(frame.lights)),
        ("map_size_texels", frame.map_size.into()),
        ("atlas_pages", frame.atlas_pages.into()),
        ("atlas_bytes", frame.atlas_bytes),
        ("maps_stale", frame.stale.maps.into()),
        ("oldest_map_frames", frame.stale.oldest.into()),
        ("triangles_that_cannot_block", frame.non_blockers as u64),
        ("map_texels_drawn", frame.texels_drawn),
        ("points_shaded", points),
        ("pairs_evaluated", pairs.evaluated()),
        ("passes", frame.passes[0].into()),
        ("passes_before_optimisation", frame.passes[1].into()),
        ("leaves", frame.leaves[0].into()),
        ("light_maps", frame.leaves[1].into()),
    ] {
        stats.insert(key.into(), value.into());
    }
    for (pass, ms) in &frame.gpu_ms {
        stats.insert((*pass).into(), (*ms).into());
    }
    let transfer = frame.transfer;
    if transfer.objects > 0 {
        let gathered_ms =
            transfer.gather_ms + frame.gpu_ms.get("incident_light_gpu_ms").copied().unwrap_or(0.0);
        for (key, value) in [
            ("transfer_objects", f64::from(transfer.objects)),
            ("transfer_vertices", f64::from(transfer.vertices)),
            ("transfer_points", f64::from(transfer.points)),
            ("transfer_rays", transfer.rays as f64),
            ("incident_light_ms", gathered_ms),
            ("incident_light_us_per_light", gathered_ms * 1e3 / f64::from(frame.lights.max(1))),
        ] {
            stats.insert(key.into(), value.into());
        }
    }
    stats
}

pub(super) fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
