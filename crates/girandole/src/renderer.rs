//! The renderer: passes, a scene on the GPU, and a frame as one function.

use crate::atlas::AtlasLayout;
use crate::frame::{FrameUniforms, frame, steps};
use crate::gpu_scene::{GpuScene, gpu_lights, light_buffer};
use crate::layout::{DIRECTIONAL, Light};
use crate::occluders::{CullCounts, Occluders};
use crate::passes::exposure::Exposure;
use crate::passes::resolve::{Resolve, ResolveInputs};
use crate::passes::shade::{BATCH, GROUP, Needs, Shade, ShadeInputs};
use crate::passes::shadow_maps::{Atlas, ShadowMaps};
use crate::passes::tonemap::ToneMapping;
use crate::passes::visibility::Visibility;
use crate::passes::{Band, Layouts};
use crate::readback::{self, TextureCopy};
use crate::settings::{RenderSettings, RendererOptions};
use crate::targets::Targets;
use crate::timers::Timers;
use crate::{Error, Result};
use girandole_core::image::Image;
use girandole_core::lights::LightSet;
use girandole_core::scene::{Geometry, Scene, View};
use std::collections::BTreeMap;
use std::future::Future;

/// Pairs of pixel and light in one dispatch, well below a second on a slow GPU.
const BATCH_PAIRS: u64 = 1 << 28;

/// Lights a scene; see the [crate's front page](crate) for an example.
///
/// 1. [`Renderer::new`] compiles what is fixed. 2. [`Renderer::load`] takes a scene and its light samples.
/// 3. [`Renderer::render`] draws shadow maps that are missing and sums all lights into a picture in floating point.
/// 4. [`Renderer::show`] tone-maps it into a texture view of the caller; [`Renderer::radiance`] reads it back.
pub struct Renderer {
    device: wgpu::Device,
    queue: wgpu::Queue,
    options: RendererOptions,
    layouts: Layouts,
    shadow_maps: ShadowMaps,
    visibility: Visibility,
    /// Compiled for the scene that is loaded.
    shade: Option<Shade>,
    resolve: Resolve,
    exposure: Exposure,
    tone_mapping: ToneMapping,
    timers: Timers,
    loaded: Option<Loaded>,
    targets: Option<Targets>,
}

/// A scene and its lights on the GPU.
struct Loaded {
    scene: GpuScene,
    lights: Vec<Light>,
    light_buffer: wgpu::Buffer,
    atlas: Atlas,
    maps_are_stale: bool,
    counts: CullCounts,
    /// Length of the bounds' diagonal, metres.
    diagonal: f32,
}

/// What a frame did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameStats {
    /// Light samples.
    pub lights: u32,
    /// Texels across each shadow map.
    pub map_size: u32,
    /// Pages of the atlas.
    pub atlas_pages: u32,
    /// Bytes of the atlas.
    pub atlas_bytes: u64,
    /// Triangles left out of the shadow maps because they cannot block.
    pub non_blockers: usize,
    /// Faces and clusters drawn and culled when the maps were last drawn.
    pub culling: CullCounts,
    /// Milliseconds on the device by pass, where it has timestamps; names end in `_gpu_ms`.
    pub gpu_ms: BTreeMap<&'static str, f64>,
}

impl Renderer {
    /// Compiles the renderer for a device. Needs WebGPU's default limits and compute; uses
    /// [`WANTED_FEATURES`](crate::WANTED_FEATURES) where the device was created with them: without clip distances
    /// shadow maps are confined by discarding fragments, without timestamps [`FrameStats::gpu_ms`] stays empty.
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
        let layouts = Layouts::new(device);
        Ok(Self {
            shadow_maps: ShadowMaps::new(device, &layouts, &options),
            visibility: Visibility::new(device, &layouts),
            shade: None,
            resolve: Resolve::new(device, &layouts),
            exposure: Exposure::new(device),
            tone_mapping: ToneMapping::new(device),
            timers: Timers::new(device, queue),
            device: device.clone(),
            queue: queue.clone(),
            options,
            layouts,
            loaded: None,
            targets: None,
        })
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
            light.place = layout.place(slot);
        }
        let needs = Needs {
            specular: scene.materials.iter().any(|m| m.specular > 0.0 || m.metallic > 0.0),
            plain_lights: samples.iter().all(|l| l.profile == 0),
        };
        if self.shade.as_ref().is_none_or(|s| s.needs != needs) {
            self.shade = Some(Shade::new(&self.device, &self.layouts, &self.options, needs));
        }
        let occluders = Occluders::new(scene, geometry, &samples, self.options.skip_non_blockers);
        self.loaded = Some(Loaded {
            scene: GpuScene::new(&self.device, &self.layouts.scene, scene, geometry)?,
            light_buffer: light_buffer(&self.device, &samples)?,
            atlas: Atlas::new(&self.device, layout, scene, geometry, occluders)?,
            lights: samples,
            maps_are_stale: true,
            counts: CullCounts::default(),
            diagonal: geometry.diagonal(),
        });
        Ok(())
    }

    /// Draws the shadow maps that are stale and submits; [`Renderer::render`] does so by itself.
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
        check(size, settings, &self.device.limits())?;
        self.timers.reset();
        self.draw_shadow_maps()?;
        if self.targets.as_ref().is_none_or(|t| t.size != size) {
            self.targets = None;
            self.targets = Some(Targets::new(&self.device, size));
        }
        let (Some(loaded), Some(shade), Some(targets)) = (&self.loaded, &self.shade, &self.targets) else {
            return Err(invalid("load a scene before rendering".into()));
        };

        // One uniform for each band of rows, sub-pixel sample and batch of lights.
        let lights = loaded.lights.len() as u32;
        let band_pixels = u64::from(size[0]) * u64::from(targets.band_rows);
        let batch =
            settings.lights_per_batch.unwrap_or_else(|| (BATCH_PAIRS / band_pixels).clamp(1, 1 << 20) as u32);
        let steps = steps(
            size,
            targets.band_rows,
            settings.samples_per_axis,
            lights,
            batch.next_multiple_of(GROUP).clamp(GROUP, BATCH),
        );
        let frames = FrameUniforms::new(&self.device, &self.layouts.frame, &steps, |step| {
            frame(view, size, settings, loaded.diagonal, step)
        });

        for (index, step) in steps.iter().enumerate() {
            let band = Band {
                frame: &frames.group,
                frame_offset: index as u32 * frames.stride,
                scene: &loaded.scene.group,
                size: [size[0], step.band[1] - step.band[0]],
            };
            let mut encoder = self.device.create_command_encoder(&Default::default());
            let (device, timers) = (&self.device, &self.timers);
            // Which triangle does each pixel show, at this sub-pixel sample?
            if step.first_light == 0 {
                let views = [&targets.ids, &targets.depth];
                self.visibility.record(device, &mut encoder, timers, band, &loaded.scene, views);
            }
            // Sum this batch of lights, each with its shadow map.
            let inputs = ShadeInputs {
                ids: &targets.ids,
                atlas: &loaded.atlas.view,
                lights: wgpu::BufferBinding {
                    buffer: &loaded.light_buffer,
                    offset: u64::from(step.first_light) * size_of::<Light>() as u64,
                    size: wgpu::BufferSize::new(u64::from(BATCH) * size_of::<Light>() as u64),
                },
                maps: &loaded.atlas.maps,
                sums: &targets.sums,
            };
            shade.record(device, &mut encoder, timers, band, inputs);
            // Multiply by albedo, add emission, average sub-pixel samples.
            if step.end_light == lights {
                let inputs = ResolveInputs {
                    ids: &targets.ids,
                    sums: &targets.sums,
                    pixels: &targets.pixels,
                    radiance: &targets.radiance_view,
                };
                self.resolve.record(device, &mut encoder, timers, band, inputs);
            }
            self.queue.submit([encoder.finish()]);
        }
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
        self.exposure.record(&self.device, &mut encoder, &targets.radiance_view, targets.size);
        self.tone_mapping.record(
            &self.device,
            &mut encoder,
            &targets.radiance_view,
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
                    TextureCopy::record(&self.device, &mut encoder, &targets.radiance, origin, size, 16)
                })
                .collect();
            self.queue.submit([encoder.finish()]);
            (targets.size, copies)
        });
        async move {
            let (size, copies) = copy.ok_or_else(|| invalid("render before reading back".into()))?;
            let mut floats = Vec::with_capacity(size[0] as usize * size[1] as usize * 4);
            for copy in copies {
                floats.extend(copy.floats().await?);
            }
            Ok(readback::image(size, &floats))
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
            let page = copy.floats().await?;
            let [x, y] = slot.origin.map(|o| o as usize);
            let size = slot.size as usize;
            Ok((y..y + size).flat_map(|row| page[row * width + x..row * width + x + size].to_vec()).collect())
        }
    }

    /// What the last frame did. The future completes while the device is polled.
    ///
    /// # Errors
    /// [`Error::Device`] where the device was lost.
    pub async fn stats(&self) -> Result<FrameStats> {
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let timestamps = self.timers.resolve(&self.device, &mut encoder);
        self.queue.submit([encoder.finish()]);
        let mut stats = FrameStats::default();
        if let Some(l) = &self.loaded {
            stats.lights = l.lights.len() as u32;
            stats.map_size = l.atlas.layout.map_size;
            stats.atlas_pages = l.atlas.layout.pages;
            stats.atlas_bytes = l.atlas.layout.bytes();
            stats.non_blockers = l.atlas.left_out();
            stats.culling = l.counts;
        }
        if let Some(buffer) = timestamps {
            let bytes = readback::bytes(&buffer).await?;
            stats.gpu_ms = self.timers.sums(&bytemuck::pod_collect_to_vec::<u8, u64>(&bytes));
        }
        Ok(stats)
    }
}

fn invalid(sentence: String) -> Error {
    Error::Scene(girandole_core::Error::Invalid(sentence))
}

fn check(size: [u32; 2], settings: &RenderSettings, limits: &wgpu::Limits) -> Result<()> {
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
    if settings.clamp.is_some_and(|c| c.is_nan() || c <= 0.0) {
        return Err(invalid("the bound of the geometric factor (--clamp) has to be positive, or off".into()));
    }
    Ok(())
}
