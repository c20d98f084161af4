//! The renderer: passes, a scene on the GPU, and a frame as one function.

use crate::atlas::AtlasLayout;
use crate::device_tuning::DeviceTuning;
use crate::elements::{MAX_LIGHTS_PER_PASS, MultipassPlan};
use crate::gpu_scene::{GpuScene, gpu_lights, light_buffer};
use crate::layout::Light;
use crate::occluders::{CullCounts, Occluders};
use crate::packed::unpack_radiance;
use crate::passes::Layouts;
use crate::passes::debug::Debug;
use crate::passes::exposure;
use crate::passes::multipass::Multipass;
use crate::passes::resolve::Resolve;
use crate::passes::select::Select;
use crate::passes::shade::{SceneFeatures, Shade};
use crate::passes::shadow_maps::{Atlas, ShadowMaps};
use crate::passes::tonemap::ToneMapping;
use crate::passes::visibility::Visibility;
use crate::readback::TextureCopy;
use crate::receivers::Receivers;
use crate::selection::PointLists;
use crate::settings::{DebugView, Mode, RenderSettings, RendererOptions, Shading};
use crate::shader_constants::{COSINE, DIRECTIONAL};
use crate::targets::Targets;
use crate::timers::Timers;
use crate::{Error, Result};
use girandole_core::image::Image;
use girandole_core::lights::LightSet;
use girandole_core::scene::{Geometry, Scene, View};
use girandole_core::tonemap::Exposure;
use girandole_core::visibility::VisibilityDatabase;
use std::future::Future;

/// Lights a scene; see the [crate's front page](crate) for an example.
///
/// 1. [`Renderer::new`] compiles what is fixed. 2. [`Renderer::load`] takes a scene and its light samples.
/// 3. [`Renderer::render`] draws shadow maps that are missing and sums all lights into a picture in floating point.
/// 4. [`Renderer::show`] tone-maps it into a texture view of the caller; [`Renderer::radiance`] reads it back.
pub struct Renderer {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) options: RendererOptions,
    pub(crate) layouts: Layouts,
    shadow_maps: ShadowMaps,
    pub(crate) visibility: Visibility,
    /// Compiled for the scene that is loaded.
    pub(crate) shade: Option<Shade>,
    /// The same.
    pub(crate) select: Option<Select>,
    /// The same.
    pub(crate) resolve: Option<Resolve>,
    /// Made when it is asked for.
    pub(crate) multipass: Option<Multipass>,
    /// Made when it is asked for.
    pub(crate) debug: Option<Debug>,
    exposure: exposure::Exposure,
    tone_mapping: ToneMapping,
    pub(crate) timers: Timers,
    pub(crate) loaded: Option<Loaded>,
    pub(crate) targets: Option<Targets>,
    pub(crate) selection: Option<PointLists>,
    /// How the last picture was drawn.
    pub(crate) drawn: Option<Drawn>,
}

/// How a picture was drawn.
pub(crate) struct Drawn {
    pub settings: RenderSettings,
    pub size: [u32; 2],
}

/// A scene and its lights on the GPU.
pub(crate) struct Loaded {
    pub scene: GpuScene,
    pub lights: Vec<Light>,
    pub light_buffer: wgpu::Buffer,
    pub atlas: Atlas,
    maps_are_stale: bool,
    pub counts: CullCounts,
    /// Length of the bounds' diagonal, metres.
    pub diagonal: f32,
    pub needs: SceneFeatures,
    pub receivers: Option<Receivers>,
    /// What multipass shading draws.
    pub draws: Option<MultipassPlan>,
    /// The bound of the geometric factor that light maps were made with.
    pub light_maps_for: Option<Option<f32>>,
}

impl Renderer {
    /// Compiles the renderer for a device. SceneFeatures WebGPU's default limits and compute; uses
    /// [`WANTED_FEATURES`](crate::WANTED_FEATURES) where the device was created with them: without clip distances
    /// shadow maps are confined by discarding fragments, without timestamps
    /// [`FrameStats::gpu_ms`](crate::FrameStats::gpu_ms) stays empty, without blending of 32-bit floats multipass shading
    /// sums in 16 bits. Where the device was given a ninth storage buffer a stage
    /// ([`wanted_limits`](crate::wanted_limits)), GPUs read lights quicker.
    ///
    /// # Errors
    /// [`Error::Unsupported`] where the device's limits are below WebGPU's defaults.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, options: RendererOptions) -> Result<Self> {
        let limits = device.limits();
        if limits.max_storage_buffers_per_shader_stage < 8 || limits.max_texture_dimension_2d < 8192 {
            return Err(Error::Unsupported {
                adapter: "given".into(),
                what: "WebGPU's default limits".into(),
            });
        }
        if options.pcf > 16 {
            return Err(Error::TooLarge(format!(
                "a filter of {} texels is too wide; --pcf takes 1 to 16",
                options.pcf
            )));
        }
        let tuning = options.tuning.unwrap_or_else(|| DeviceTuning::for_device(device));
        let layouts = Layouts::new(device, tuning);
        Ok(Self {
            shadow_maps: ShadowMaps::new(device, &layouts, &options),
            visibility: Visibility::new(device, &layouts),
            shade: None,
            select: None,
            resolve: None,
            multipass: None,
            debug: None,
            exposure: exposure::Exposure::new(device, &tuning),
            tone_mapping: ToneMapping::new(device, &tuning),
            timers: Timers::new(device, queue),
            device: device.clone(),
            queue: queue.clone(),
            options,
            layouts,
            loaded: None,
            targets: None,
            selection: None,
            drawn: None,
        })
    }

    /// Whether passes are timed from now on, for [`FrameStats::gpu_ms`](crate::FrameStats::gpu_ms) (default no). On
    /// software devices timestamps take about a tenth of a frame in [`Mode::Full`].
    pub fn time_passes(&mut self, on: bool) {
        self.timers.on = on;
    }

    /// Takes a scene and its light samples; their shadow maps are drawn with the next frame.
    ///
    /// # Errors
    /// [`Error::TooLarge`] where buffers or the atlas exceed the device's limits or the memory budget.
    pub fn load(&mut self, scene: &Scene, geometry: &Geometry, lights: &LightSet) -> Result<()> {
        self.loaded = None;
        let radius = geometry.diagonal() * 0.5;
        let mut samples = gpu_lights(lights, radius);
        let directional: Vec<bool> = samples.iter().map(|l| l.profile == DIRECTIONAL).collect();
        let layout = AtlasLayout::new(&directional, &self.options, &self.device.limits())?;
        for (light, slot) in samples.iter_mut().zip(&layout.slots) {
            light.atlas_slot = layout.place(slot);
        }
        let needs = SceneFeatures {
            specular: scene.materials.iter().any(|m| m.specular > 0.0 || m.metallic > 0.0),
            plain_lights: samples.iter().all(|l| l.profile == COSINE),
            textures: !scene.textures.is_empty(),
            curved: is_curved(scene, geometry),
        };
        let key = [needs.textures, needs.specular];
        if self.resolve.as_ref().is_none_or(|r| r.key != key) {
            self.resolve = Some(Resolve::new(&self.device, &self.layouts, key));
        }
        let occluders = Occluders::new(scene, geometry, &samples, self.options.skip_non_blockers);
        self.loaded = Some(Loaded {
            scene: GpuScene::new(&self.device, &self.queue, &self.layouts.scene, scene, geometry)?,
            light_buffer: light_buffer(&self.device, &samples)?,
            atlas: Atlas::new(&self.device, &self.layouts.tuning, layout, scene, geometry, occluders)?,
            lights: samples,
            maps_are_stale: true,
            counts: CullCounts::default(),
            diagonal: geometry.diagonal(),
            needs,
            receivers: None,
            draws: None,
            light_maps_for: None,
        });
        Ok(())
    }

    /// Takes what visibility determination says of the scene that is loaded: every mode but [`Mode::Naive`] needs it.
    ///
    /// # Errors
    /// [`Error::Scene`] before [`Renderer::load`] or where the database was built for other lights or another scene;
    /// [`Error::TooLarge`] where it exceeds the device's limits.
    pub fn load_visibility(
        &mut self,
        scene: &Scene,
        geometry: &Geometry,
        lights: &LightSet,
        database: &VisibilityDatabase,
    ) -> Result<()> {
        let Some(loaded) = &mut self.loaded else {
            return Err(invalid("load the scene before its visibility".into()));
        };
        if loaded.lights.len() != lights.samples.len()
            || database.lights() != lights.samples.len()
            || database.receivers().triangles.len() != geometry.triangles.len()
        {
            return Err(invalid("this visibility database belongs to another scene or other lights".into()));
        }
        loaded.receivers = Some(Receivers::new(&self.device, scene, geometry, lights, database)?);
        loaded.light_maps_for = None;
        loaded.draws = None;
        self.selection = None;
        Ok(())
    }

    /// MultipassPlan the shadow maps that are stale and submits; [`Renderer::render`] does so by itself.
    ///
    /// # Errors
    /// [`Error::TooLarge`] where a list of what to draw exceeds the device's limits.
    pub fn draw_shadow_maps(&mut self) -> Result<()> {
        let Some(loaded) = self.loaded.as_mut().filter(|l| l.maps_are_stale) else { return Ok(()) };
        let mut encoder = self.device.create_command_encoder(&Default::default());
        loaded.counts = self.shadow_maps.record(
            &self.device,
            &mut encoder,
            &self.timers,
            &loaded.scene.group,
            (&loaded.lights, &loaded.light_buffer),
            &loaded.atlas,
        )?;
        loaded.maps_are_stale = false;
        self.queue.submit([encoder.finish()]);
        Ok(())
    }

    /// Renders a picture of `size` pixels: radiance in linear floating point. Work is submitted, not waited for.
    ///
    /// # Errors
    /// [`Error::TooLarge`] where the picture exceeds the device's limits; [`Error::Scene`] for settings out of range
    /// or before [`Renderer::load`].
    pub fn render(&mut self, view: &View, size: [u32; 2], settings: &RenderSettings) -> Result<()> {
        let lights = self.loaded.as_ref().map_or(0, |l| l.lights.len() as u32);
        check(size, settings, lights, &self.device.limits())?;
        self.timers.reset();
        self.draw_shadow_maps()?;
        if self.targets.as_ref().is_none_or(|t| t.size != size) {
            self.targets = None;
            self.targets = Some(Targets::new(&self.device, size));
        }
        self.drawn = None;
        if settings.debug.is_some() {
            self.debug.get_or_insert_with(|| Debug::new(&self.device, &self.layouts));
        }
        match settings.mode {
            Mode::Naive => self.draw_naive(view, size, settings)?,
            _ => self.draw_selected(view, size, settings)?,
        }
        self.drawn = Some(Drawn { settings: *settings, size });
        Ok(())
    }

    /// Shows the last picture on `target`, tone-mapped by the settings' exposure and curve. Targets with an sRGB
    /// format encode by themselves, other 8-bit ones get sRGB values, floating-point ones linear values.
    ///
    /// # Errors
    /// [`Error::Scene`] before the first [`Renderer::render`].
    pub fn show(
        &mut self,
        settings: &RenderSettings,
        target: &wgpu::TextureView,
        format: wgpu::TextureFormat,
    ) -> Result<()> {
        let Some(targets) = &self.targets else { return Err(invalid("render before showing".into())) };
        let mut encoder = self.device.create_command_encoder(&Default::default());
        if settings.exposure == Exposure::Auto {
            self.exposure.record(&self.device, &mut encoder, &targets.picture_view, targets.size);
        }
        self.tone_mapping.record(
            &self.device,
            &mut encoder,
            &targets.picture_view,
            &self.exposure.stops,
            settings,
            targets.size,
            (target, format),
        );
        self.queue.submit([encoder.finish()]);
        Ok(())
    }

    /// Reads the last picture back: linear radiance. The future completes while the device is polled.
    ///
    /// # Errors
    /// [`Error::Scene`] before the first [`Renderer::render`]; [`Error::Device`] where the device was lost.
    pub fn radiance(&self) -> impl Future<Output = Result<Image>> + use<> {
        let copy = self.targets.as_ref().map(|targets| {
            let mut encoder = self.device.create_command_encoder(&Default::default());
            // Bands keep each buffer small.
            let copies: Vec<_> = (0..targets.size[1])
                .step_by(targets.band_rows as usize)
                .map(|y| {
                    let size = [targets.size[0], targets.band_rows.min(targets.size[1] - y)];
                    let origin = wgpu::Origin3d { x: 0, y, z: 0 };
                    TextureCopy::record(&self.device, &mut encoder, &targets.picture, origin, size, 8)
                })
                .collect();
            self.queue.submit([encoder.finish()]);
            (targets.size, copies)
        });
        async move {
            let (size, copies) = copy.ok_or_else(|| invalid("render before reading back".into()))?;
            let mut pixels = Vec::with_capacity(size[0] as usize * size[1] as usize);
            for copy in copies {
                pixels.extend(copy.words().await?.chunks_exact(2).map(|w| unpack_radiance([w[0], w[1]])));
            }
            Ok(Image { width: size[0], height: size[1], pixels })
        }
    }

    /// Reads a light's shadow map back: `size × size` values, near / distance (directional lights: 1 − depth), 0 =
    /// nothing there.
    ///
    /// # Errors
    /// [`Error::Scene`] where there is no such light; [`Error::Device`] where the device was lost.
    pub fn shadow_map(&self, light: usize) -> impl Future<Output = Result<Vec<f32>>> + use<> {
        let slot = self.loaded.as_ref().and_then(|l| Some((l, *l.atlas.layout.slots.get(light)?)));
        let copy = slot.map(|(loaded, slot)| {
            let mut encoder = self.device.create_command_encoder(&Default::default());
            // Depth can only be copied whole.
            let origin = wgpu::Origin3d { x: 0, y: 0, z: slot.page };
            let page = loaded.atlas.layout.page_size;
            let copy =
                TextureCopy::record(&self.device, &mut encoder, &loaded.atlas.texture, origin, page, 4);
            self.queue.submit([encoder.finish()]);
            (copy, slot, page[0] as usize)
        });
        async move {
            let (copy, slot, width) = copy.ok_or_else(|| invalid(format!("there is no light {light}")))?;
            let page = copy.words().await?;
            let [x, y] = slot.origin.map(|o| o as usize);
            let size = slot.size as usize;
            Ok((y..y + size)
                .flat_map(|row| {
                    page[row * width + x..row * width + x + size].iter().map(|&bits| f32::from_bits(bits))
                })
                .collect())
        }
    }
}

/// Whether some surface has normals that vary from point to point.
fn is_curved(scene: &Scene, geometry: &Geometry) -> bool {
    geometry.triangles.iter().any(|t| {
        let [a, b, c] = t.vertices.map(|v| geometry.normals[v as usize]);
        a.dot(b).min(b.dot(c)) < 0.99999
            || scene.materials[t.material as usize].normal_texture.is_some()
            || t.patch == girandole_core::scene::NONE
    })
}

pub(crate) fn invalid(sentence: String) -> Error {
    Error::Scene(girandole_core::Error::Invalid(sentence))
}

fn check(size: [u32; 2], settings: &RenderSettings, lights: u32, limits: &wgpu::Limits) -> Result<()> {
    let largest = limits.max_texture_dimension_2d;
    if size.contains(&0) || size.iter().any(|&s| s > largest) {
        return Err(Error::TooLarge(format!(
            "a picture of {} × {} pixels is not possible here; each side takes 1 to {largest}",
            size[0], size[1]
        )));
    }
    if !(1..=16).contains(&settings.samples_per_axis) {
        return Err(invalid(format!(
            "{} samples per axis are not possible; take 1 to 16",
            settings.samples_per_axis
        )));
    }
    match settings.debug {
        None | Some(DebugView::LightPositions | DebugView::Atlas) => {}
        Some(_) if settings.mode == Mode::Naive => {
            return Err(invalid(
                "the naive mode has no receivers and levels to show; choose another mode".into(),
            ));
        }
        Some(DebugView::States(Some(light))) if light >= lights => {
            return Err(invalid(format!(
                "there is no light {light}; the last one is {}",
                lights.saturating_sub(1)
            )));
        }
        Some(_) => {}
    }
    if let Shading::Multipass { lights_per_pass } = settings.shading {
        if !(1..=MAX_LIGHTS_PER_PASS).contains(&lights_per_pass) {
            return Err(invalid(format!(
                "{lights_per_pass} lights a pass are not possible; take 1 to {MAX_LIGHTS_PER_PASS}"
            )));
        }
        if settings.mode == Mode::Naive {
            return Err(invalid("the naive mode has no passes; choose another mode or fused shading".into()));
        }
    }
    if settings.tolerance.is_nan() || settings.tolerance < 0.0 {
        return Err(invalid("the tolerance of interpolation has to be 0 or positive".into()));
    }
    if settings.clamp.is_some_and(|c| c.is_nan() || c <= 0.0) {
        return Err(invalid("the bound of the geometric factor (--clamp) has to be positive, or off".into()));
    }
    Ok(())
}
