//! The renderer: a scene with its light on the GPU, and frames of it.

mod compiling;
mod opening;
mod rays;
mod readback;
mod refinement;
mod stats;
mod transfer;

use crate::checks::{check, check_display};
use crate::device::compiled::Compiled;
use crate::device::context::Context;
use crate::device::kernel::Shared;
use crate::device::loop_steps;
use crate::device::recorder::Recorder;
use crate::device::timers::Timers;
use crate::frame::record_frame;
use crate::gpu_scene::receivers::{Receivers, Sources};
use crate::gpu_scene::transfer::Transfers;
use crate::maps::cache::StaleCounts;
use crate::maps::occlusion_culling::OccludedObjects;
use crate::passes::tonemap;
use crate::passes::trace_rays::TraceRays;
use crate::prepare::{Passes, ScenePasses, allocate, prepare};
use crate::resident::Resident;
use crate::settings::{MapUpdates, RenderSettings, RendererOptions, Target};
use crate::tier::{Kernels, Tier};
use crate::viewport::{LastFrame, Picture, Viewport};
use crate::{Error, Remedy, Result};
use girandole_core::Generation;
use girandole_core::illumination::{Illumination, IlluminationSettings};
use girandole_core::image::Region;
use girandole_core::lights::LightSet;
use girandole_core::scene::{Geometry, Scene, SceneChanges, View};
use girandole_core::tonemap::Exposure;
use girandole_core::visibility::VisibilityDatabase;
use refinement::SetAside;
use std::sync::{Arc, OnceLock};

/// Lights a scene; see the [crate's front page](crate) for an example.
///
/// 1. [`Renderer::new`] compiles what is fixed.
/// 2. [`Renderer::open`] takes a scene, [`Renderer::follow`] its changes and where cameras go.
/// 3. [`Renderer::record`] records a frame into the caller's encoder and target. Or [`Renderer::render`] submits a frame by
///    itself, in parts, and [`Renderer::show`] tone-maps it into a texture view of the caller.
/// 4. [`Renderer::radiance`] and [`Renderer::stats`] read back.
/// 5. [`Renderer::refine`] goes on with a picture of [`Renderer::render`] while everything is at rest.
pub struct Renderer {
    context: Context,
    passes: Passes,
    scene_passes: Option<ScenePasses>,
    scene: Option<Resident>,
    /// What the scene was opened with; nothing where the caller loads lights of his own.
    illumination: Option<Illumination>,
    /// Which objects are lit by transfer.
    transfers: Transfers,
    /// While the light samples of a later set of a refined picture are on the device.
    set_aside: Option<SetAside>,
    /// Another one whenever the scene or its light changes.
    version: Generation,
    /// The last frame, while scene and shadow maps are those that it shows.
    last_frame: Option<Generation>,
    /// Compiled when somebody asks about rays.
    trace_rays: OnceLock<TraceRays>,
}

impl Renderer {
    /// Compiles the renderer for a device. Needs WebGPU's default limits and compute; uses
    /// [`WANTED_FEATURES`](crate::WANTED_FEATURES) where the device was created with them: without timestamps
    /// [`FrameStats::gpu_ms`](crate::FrameStats::gpu_ms) stays empty, without blending of 32-bit floats multipass shading
    /// sums in 16 bits. Where the device was given more than eight storage buffers a stage
    /// ([`wanted_limits`](crate::wanted_limits)), GPUs read lights quicker.
    ///
    /// # Errors
    /// [`Error::Unsupported`] where the device's limits are below WebGPU's defaults, [`Error::TooLarge`] for options out of
    /// range.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, options: RendererOptions) -> Result<Self> {
        Self::with_compiled((device, queue), options, Compiled::default())
    }

    /// Another one for the same device, which shares what was compiled for this: kernels that both need are there at once.
    ///
    /// # Errors
    /// As [`Renderer::new`].
    pub fn another(&self, options: RendererOptions) -> Result<Self> {
        let Context { device, queue, shared, .. } = &self.context;
        Self::with_compiled((device, queue), options, shared.compiled.clone())
    }

    fn with_compiled(
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        options: RendererOptions,
        compiled: Compiled,
    ) -> Result<Self> {
        let limits = device.limits();
        if limits.max_storage_buffers_per_shader_stage < 8 || limits.max_texture_dimension_2d < 8192 {
            return Err(Error::Unsupported {
                adapter: "given".into(),
                what: "WebGPU's default limits".into(),
            });
        }
        if options.pcf > 16 {
            let what = format!("a filter of {} texels is too wide", options.pcf);
            return Err(Error::too_large(what, Remedy::NarrowerFilter { to: 16 }));
        }
        let tier = options.tier.unwrap_or_else(|| Tier::for_device(device));
        let context = Context {
            device: device.clone(),
            queue: queue.clone(),
            options,
            shared: Shared::new(device, Kernels::new(tier, device), compiled),
            timers: Timers::new(device, queue),
        };
        Ok(Self {
            passes: Passes::new(&context),
            context,
            scene_passes: None,
            scene: None,
            illumination: None,
            transfers: Transfers::new(),
            set_aside: None,
            version: Generation::fresh(),
            last_frame: None,
            trace_rays: OnceLock::new(),
        })
    }

    /// What it was made with.
    pub fn options(&self) -> &RendererOptions {
        &self.context.options
    }

    /// Whether passes are timed from now on, for [`FrameStats::gpu_ms`](crate::FrameStats::gpu_ms) (default no). On
    /// software devices timestamps take about a tenth of a frame in [`Mode::Full`](crate::Mode::Full).
    pub fn time_passes(&mut self, on: bool) {
        self.context.timers.on = on;
    }

    /// Opens a scene: samples its light, determines visibility, and loads both. [`Renderer::update`] follows its changes.
    ///
    /// # Errors
    /// [`Error::Scene`] where the scene has no light or a setting is out of range, and as for [`Renderer::load`].
    pub fn open(&mut self, scene: &Scene, settings: &IlluminationSettings) -> Result<()> {
        let illumination = Illumination::new(scene, settings)?;
        self.load_illumination(scene, illumination)
    }

    /// Follows the changes of the scene that is open, as [`Scene::take_changes`] returned them: the next frame is, bit for
    /// bit, that of a renderer that opens the scene as it stands; where light samples are
    /// [held](girandole_core::illumination::Rewalk::Off), or follow
    /// [a few paths a frame](girandole_core::illumination::Rewalk::Paths), that of one that loads it with these samples, and only what
    /// changed is made anew. In the latter case each update is a frame, of no changes even. Shadow maps are stale where something moved, until frames draw them
    /// ([`RenderSettings::updates`]). Submit what was recorded before the update first: it would show the scene after it.
    ///
    /// # Errors
    /// [`Error::Scene`] before [`Renderer::open`] and for changes that do not follow what was loaded (nothing changes
    /// then); otherwise as for [`Renderer::open`], and the scene has to be opened again.
    pub fn update(&mut self, scene: &Scene, changes: &SceneChanges) -> Result<()> {
        self.update_with(|illumination| illumination.update(scene, changes), scene, changes)
    }

    fn update_with(
        &mut self,
        update: impl FnOnce(&mut Illumination) -> girandole_core::Result<()>,
        scene: &Scene,
        changes: &SceneChanges,
    ) -> Result<()> {
        let Some(illumination) = &mut self.illumination else {
            return Err(Error::invalid("open a scene before updating it"));
        };
        let lights = illumination.lights().generation();
        let resident = &mut self.scene;
        hold(resident, None);
        let updated = update(illumination);
        hold(resident, illumination.visibility());
        updated?;
        if changes.is_empty() && illumination.lights().generation() == lights {
            return Ok(());
        }
        self.change();
        let illumination = self.illumination.take().ok_or_else(nothing_loaded)?;
        let follows = match &mut self.scene {
            Some(resident) if changes.is_motion() => {
                resident.follow(&self.context, scene, &illumination, changes)?
            }
            _ => false,
        };
        if !follows {
            return self.load_illumination(scene, illumination);
        }
        self.illumination = Some(illumination);
        self.transfer_anew(scene)
    }

    /// Light samples and visibility of the scene that is open.
    pub fn illumination(&self) -> Option<&Illumination> {
        self.illumination.as_ref()
    }

    /// Shadow maps that the last frame left stale: frames to come draw them, as far as their budgets allow.
    pub fn stale(&self) -> StaleCounts {
        self.scene.as_ref().map(Resident::stale).unwrap_or_default()
    }

    fn load_illumination(&mut self, scene: &Scene, illumination: Illumination) -> Result<()> {
        let (geometry, lights) = (illumination.geometry(), illumination.lights());
        self.load_lights(scene, geometry, lights)?;
        if let Some(database) = illumination.visibility() {
            self.load_database(scene, geometry, lights, database)?;
        }
        self.illumination = Some(illumination);
        self.transfer_anew(scene)
    }

    /// Takes a scene and light samples of the caller's; their shadow maps are drawn with the next frame.
    ///
    /// # Errors
    /// [`Error::TooLarge`] where buffers or the atlas exceed the device's limits or the memory budget;
    /// [`Error::Scene`] where geometry or lights are not this scene's.
    pub fn load(&mut self, scene: &Scene, geometry: &Geometry, lights: &LightSet) -> Result<()> {
        self.load_lights(scene, geometry, lights)?;
        self.transfer_with(scene, geometry, lights, None)
    }

    fn load_lights(&mut self, scene: &Scene, geometry: &Geometry, lights: &LightSet) -> Result<()> {
        geometry.belongs_to(scene)?;
        lights.belongs_to(geometry)?;
        // What was there leaves first: two atlases may not fit.
        self.scene = None;
        self.illumination = None;
        self.set_aside = None;
        self.change();
        let resident = Resident::new(&self.context, scene, geometry, lights)?;
        if self.scene_passes.as_ref().is_none_or(|p| p.features != resident.features) {
            self.scene_passes = Some(ScenePasses::new(resident.features));
        }
        self.scene = Some(resident);
        Ok(())
    }

    /// Takes what visibility determination says of the scene that is loaded: every mode but [`Mode::Naive`](crate::Mode::Naive) needs it.
    ///
    /// # Errors
    /// [`Error::Scene`] before [`Renderer::load`] or where the database was built for other lights or another scene;
    /// [`Error::TooLarge`] where it exceeds the device's limits.
    pub fn load_visibility(
        &mut self,
        scene: &Scene,
        geometry: &Geometry,
        lights: &LightSet,
        database: impl Into<Arc<VisibilityDatabase>>,
    ) -> Result<()> {
        let database = database.into();
        self.load_database(scene, geometry, lights, &database)?;
        self.transfer_with(scene, geometry, lights, Some(&database))
    }

    fn load_database(
        &mut self,
        scene: &Scene,
        geometry: &Geometry,
        lights: &LightSet,
        database: &Arc<VisibilityDatabase>,
    ) -> Result<()> {
        self.change();
        let Some(resident) = &mut self.scene else {
            return Err(Error::invalid("load the scene before its visibility"));
        };
        geometry.belongs_to(scene)?;
        database.belongs_to(geometry, lights)?;
        if resident.generations != [geometry.generation(), lights.generation()] {
            return Err(Error::invalid("this visibility database belongs to another scene or other lights"));
        }
        let Context { device, queue, .. } = &self.context;
        let sources = Sources { scene, geometry, lights, database };
        let receivers = Receivers::new((device, queue), sources)?;
        resident.set_receivers(receivers, OccludedObjects::of(scene, Some(&**database)));
        Ok(())
    }

    /// Draws the shadow maps of all lights, whatever looks them up, as far as the budget allows, and submits; a frame does so by itself for
    /// those that it looks up.
    ///
    /// # Errors
    /// [`Error::Scene`] before [`Renderer::load`], [`Error::TooLarge`] where a list of what to draw exceeds the device's
    /// limits.
    pub fn draw_shadow_maps(&mut self, updates: &MapUpdates) -> Result<()> {
        self.draw_maps(None, updates)
    }

    /// Draws the shadow maps that a frame would draw, and submits.
    ///
    /// # Errors
    /// As for [`Renderer::draw_shadow_maps`].
    pub fn draw_shadow_maps_for(&mut self, view: &View, settings: &RenderSettings) -> Result<()> {
        self.draw_maps(Some((view, settings)), &settings.updates)
    }

    fn draw_maps(&mut self, seen: Option<(&View, &RenderSettings)>, updates: &MapUpdates) -> Result<()> {
        self.change();
        let Context { device, queue, shared, timers, .. } = &self.context;
        let scene = self.scene.as_mut().ok_or_else(nothing_loaded)?;
        let seen = seen.map(|(view, settings)| (view.relative_to(scene.origin), settings));
        scene.see(None, seen.as_ref().map(|(view, settings)| (view, *settings)));
        scene.plan_maps(device, updates);
        let mut recorder = Recorder::submitting(device, queue, &shared.frame, timers);
        self.passes.shadow_maps.record(&mut recorder, scene, &scene.map_updates)?;
        recorder.finish();
        scene.count_maps();
        Ok(())
    }

    /// Does to shadow maps what a frame does, without a picture: where only a few are drawn at a time, a sequence can so be
    /// begun in the middle.
    ///
    /// # Errors
    /// As for [`Renderer::draw_shadow_maps`].
    pub fn skip_frame(&mut self, view: &View, settings: &RenderSettings) -> Result<()> {
        self.draw_shadow_maps_for(view, settings)?;
        self.scene.iter_mut().for_each(Resident::advance);
        Ok(())
    }

    /// Records a frame into the caller's encoder: from shadow maps that are stale to the tone-mapped picture on `target`.
    /// Frames have to be submitted in the order in which they were recorded; several may be recorded into one encoder. A
    /// dispatch of [`Mode::Naive`](crate::Mode::Naive) stays well below a second, a whole frame of it on a slow device may not: there,
    /// [`Renderer::render`] submits in parts.
    ///
    /// # Errors
    /// [`Error::TooLarge`] where the picture exceeds the device's limits; [`Error::Scene`] for settings or a target out of
    /// range or before [`Renderer::load`].
    pub fn record(
        &mut self,
        viewport: &mut Viewport,
        encoder: &mut wgpu::CommandEncoder,
        view: &View,
        target: &Target,
        settings: &RenderSettings,
    ) -> Result<()> {
        target.check(self.context.device.features())?;
        if settings.region.is_some() {
            return Err(no_part());
        }
        check_display(settings.exposure, target.format)?;
        self.restart(viewport, None);
        self.frame(viewport, Some(encoder), view, target.size, settings, Some(target))
    }

    /// Renders a picture of `size` pixels: radiance in linear floating point. Work is submitted in parts, not waited for.
    ///
    /// # Errors
    /// As for [`Renderer::record`].
    pub fn render(
        &mut self,
        viewport: &mut Viewport,
        view: &View,
        size: [u32; 2],
        settings: &RenderSettings,
    ) -> Result<()> {
        self.restart(viewport, None);
        self.frame(viewport, None, view, size, settings, None)?;
        self.restart(viewport, Some(Picture { view: *view, size, settings: settings.of_radiance() }));
        Ok(())
    }

    fn frame(
        &mut self,
        viewport: &mut Viewport,
        encoder: Option<&mut wgpu::CommandEncoder>,
        view: &View,
        size: [u32; 2],
        settings: &RenderSettings,
        target: Option<&Target>,
    ) -> Result<()> {
        let context = &self.context;
        let (Some(scene), Some(scene_passes)) = (&mut self.scene, &self.scene_passes) else {
            return Err(nothing_loaded());
        };
        check(size, settings, scene.lights.count(), &context.device.limits())?;
        loop_steps::check(context.shared.kernels.tier, context.options.pcf, scene.lights.count())?;
        let view = &view.relative_to(scene.origin);
        context.timers.reset();
        viewport.move_to(&context.device);
        (self.last_frame, viewport.last) = (None, None);
        allocate(context, scene, viewport, view, size, settings)?;
        scene.plan_maps(&context.device, &settings.updates);
        let passes = (&self.passes, scene_passes);
        let prepared = prepare(context, passes, scene, viewport, settings)?;
        let Context { device, queue, shared, timers, .. } = context;
        let mut recorder = match encoder {
            Some(encoder) => Recorder::into_encoder(device, &shared.frame, timers, encoder),
            None => Recorder::submitting(device, queue, &shared.frame, timers),
        };
        record_frame(&mut recorder, &prepared, view, settings, target)?;
        recorder.finish();
        let light_map_changes = prepared.light_map_changes();
        scene.count_maps();
        scene.advance();
        if let Some(changes) = light_map_changes {
            scene.count_light_maps(changes, settings.clamp);
        }
        let id = Generation::fresh();
        let is_stale = scene.stale().maps > 0;
        self.last_frame = Some(id);
        viewport.last = Some(LastFrame { id, settings: *settings, view: *view, is_stale });
        Ok(())
    }

    /// Shows the last picture on `target`, tone-mapped by the settings' exposure and curve. Targets with an sRGB
    /// format encode by themselves, other normalised ones get sRGB values, floating-point ones linear values, and
    /// without a curve ([`Tonemap::None`](girandole_core::tonemap::Tonemap::None)) ones above 1 as well.
    ///
    /// # Errors
    /// [`Error::Scene`] before the first frame, for an exposure out of range, or a format that holds no colours.
    pub fn show(
        &self,
        viewport: &Viewport,
        settings: &RenderSettings,
        target: &wgpu::TextureView,
        format: wgpu::TextureFormat,
    ) -> Result<()> {
        let targets = viewport.rendered()?;
        if targets.drawn.region != Region::whole(targets.size) {
            return Err(no_part());
        }
        check_display(settings.exposure, format)?;
        let Context { device, queue, shared, timers, .. } = &self.context;
        let mut recorder = Recorder::submitting(device, queue, &shared.frame, timers);
        let stops = match settings.exposure {
            Exposure::Auto => self.passes.exposure.record(&mut recorder, targets),
            Exposure::Ev(_) => self.passes.exposure.stops(),
        };
        let target = Target::new(target, format, targets.size);
        tonemap::record(&mut recorder, shared, targets, stops, settings, &target);
        recorder.finish();
        Ok(())
    }
}

/// Has receivers hold what they were made of, or let go of it, lest that be copied to be changed.
fn hold(resident: &mut Option<Resident>, database: Option<&Arc<VisibilityDatabase>>) {
    if let Some(receivers) = resident.as_mut().and_then(|resident| resident.receivers.as_mut()) {
        receivers.hold(database);
    }
}

fn nothing_loaded() -> Error {
    Error::invalid("load a scene before rendering")
}

fn no_part() -> Error {
    Error::invalid("a part of a picture is not shown; read its radiance back, or render the whole")
}
