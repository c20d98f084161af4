//! Drawing a frame: with every light at every pixel, or with no more than the picture needs.

use crate::Result;
use crate::elements::{MultipassKey, MultipassPlan, in_view};
use crate::frame::{FrameUniforms, Step, frame, steps};
use crate::passes::Band;
use crate::passes::debug::DebugInputs;
use crate::passes::multipass::Multipass;
use crate::passes::resolve::ResolveInputs;
use crate::passes::select::{Choice, Select, batch_of};
use crate::passes::shade::{BATCH, GROUP, Shade, ShadeInputs};
use crate::receivers::Receivers;
use crate::renderer::{Loaded, Renderer, invalid};
use crate::selection::PointLists;
use crate::settings::{Mode, RenderSettings, Shading};
use crate::targets::{COARSEST, Targets};
use girandole_core::scene::View;

/// Pairs of pixel and light in one dispatch, well below a second on a slow GPU.
const BATCH_PAIRS: u64 = 1 << 28;

impl Renderer {
    /// Every light at every pixel.
    pub(crate) fn draw_naive(
        &mut self,
        view: &View,
        size: [u32; 2],
        settings: &RenderSettings,
    ) -> Result<()> {
        let (Some(loaded), Some(targets), Some(resolve)) = (&self.loaded, &self.targets, &self.resolve)
        else {
            return Err(invalid("load a scene before rendering".into()));
        };
        let needs = loaded.needs;
        if self.shade.as_ref().is_none_or(|s| s.needs != needs) {
            self.shade = Some(Shade::new(&self.device, &self.layouts, &self.options, needs));
        }
        let Some(shade) = &self.shade else { return Ok(()) };

        // One uniform for each band of rows, sub-pixel sample and batch of lights.
        let lights = loaded.lights.len() as u32;
        let band_pixels = u64::from(size[0]) * u64::from(targets.band_rows);
        let batch =
            settings.lights_per_batch.unwrap_or_else(|| (BATCH_PAIRS / band_pixels).clamp(1, 1 << 20) as u32);
        let steps = steps(
            size,
            targets.band_rows,
            settings.samples_per_axis,
            &[1],
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
                let views = [&targets.ids, &targets.keys, &targets.depth];
                self.visibility.record(device, &mut encoder, timers, band, &loaded.scene, views);
            }
            // Sum this batch of lights, each with its shadow map.
            let inputs = ShadeInputs {
                ids: &targets.ids,
                atlas: &loaded.atlas.view,
                lights: batch_of(&loaded.light_buffer, step.first_light),
                maps: &loaded.atlas.maps,
                sums: &targets.sums,
                grid: targets.grids[0].each_ref(),
            };
            shade.record(device, &mut encoder, timers, band, inputs);
            // Multiply by albedo, add emission, average sub-pixel samples.
            if step.last_batch {
                let inputs = ResolveInputs {
                    ids: &targets.ids,
                    grid: &targets.grids[0],
                    sums: &targets.sums,
                    picture: &targets.picture_view,
                };
                resolve.record(device, &mut encoder, timers, band, inputs);
                self.record_debug(&mut encoder, band, settings, (loaded, targets), None)?;
            }
            self.queue.submit([encoder.finish()]);
        }
        Ok(())
    }

    /// What the picture needs (Barczak §4.3): each point sums the lights that its receiver is known to see or may see;
    /// at low resolution, points that their neighbours cannot stand for.
    pub(crate) fn draw_selected(
        &mut self,
        view: &View,
        size: [u32; 2],
        settings: &RenderSettings,
    ) -> Result<()> {
        self.prepare_selected(view, settings)?;
        let (Some(loaded), Some(select), Some(targets), Some(selection), Some(resolve)) =
            (&self.loaded, &self.select, &self.targets, &self.selection, &self.resolve)
        else {
            return Err(invalid("load a scene before rendering".into()));
        };
        let Some(receivers) = &loaded.receivers else { return Ok(()) };
        let (device, timers) = (&self.device, &self.timers);

        // One uniform for each band of rows, sub-pixel sample, grid of points and batch of lights.
        let grids: &[u32] = if settings.mode.has_low_resolution() { &GRIDS } else { &[1] };
        let lights = loaded.lights.len() as u32;
        let mut steps = steps(size, targets.band_rows, settings.samples_per_axis, grids, lights, BATCH);
        if settings.mode.has_low_resolution() {
            // Coarse grids do not grow with anti-aliasing.
            steps.retain(|s| s.sample == 0 || s.step == 1);
        }
        let frames = FrameUniforms::new(device, &self.layouts.frame, &steps, |step| {
            frame(view, size, settings, loaded.diagonal, step)
        });
        let mut encoder = device.create_command_encoder(&Default::default());
        encoder.clear_buffer(&selection.tally, 0, None);
        if settings.debug.is_some() {
            encoder.clear_buffer(&targets.sums, 0, None);
        }
        // Nothing but the picture asks for what its pixels receive, unless further samples do of the first ones.
        let stores_radiance = settings.debug.is_none()
            && settings.mode.has_low_resolution()
            && settings.shading == Shading::Fused
            && select.stores_radiance();
        for (index, step) in steps.iter().enumerate() {
            let band = Band {
                frame: &frames.group,
                frame_offset: index as u32 * frames.stride,
                scene: &loaded.scene.group,
                size: [size[0], step.band[1] - step.band[0]],
            };
            let is_first = step.first_light == 0;
            let is_further = step.sample > 0 && settings.mode.has_low_resolution();
            let is_final =
                stores_radiance && step.step == 1 && (is_further || settings.samples_per_axis == 1);
            // Which triangle does each pixel show, and of which surface?
            if is_first && (step.step == grids[0] || is_further) {
                let views = [&targets.ids, &targets.keys, &targets.depth];
                self.visibility.record(device, &mut encoder, timers, band, &loaded.scene, views);
            }
            // Which points of this grid have to be shaded? At low resolution, all samples of a pixel but the first
            // take what that one and its neighbours have, where they can.
            if is_first {
                let choice = match () {
                    () if is_further => Choice::Edges,
                    () if step.step == grids[0] => Choice::Every,
                    () => Choice::Refine,
                };
                let points = (choice, step.step, is_final);
                let buffers = (receivers, selection, targets);
                select.record_points(device, &mut encoder, timers, band, points, buffers);
            }
            // Sum this batch of their receivers' lights.
            let grid = if is_further { &targets.sample } else { &targets.grids[step.step.ilog2() as usize] };
            let inputs = ShadeInputs {
                ids: &targets.ids,
                atlas: &loaded.atlas.view,
                lights: batch_of(&loaded.light_buffer, step.first_light),
                maps: &loaded.atlas.maps,
                sums: &targets.sums,
                grid: grid.each_ref(),
            };
            let buffers = (receivers, selection, targets);
            match (&self.multipass, &loaded.draws) {
                (Some(multipass), Some(draws))
                    if settings.shading != Shading::Fused && settings.debug.is_none() =>
                {
                    // Debug views show what fused shading leaves. Multipass shading has no batches: the last step sums all lights.
                    if step.last_batch {
                        let rows = step.band[1].min(size[1] - 1) + 1 - step.band[0];
                        let place = (band, step.step, rows);
                        let lights = (draws, &loaded.light_buffer);
                        multipass.record(device, &mut encoder, timers, place, inputs, buffers, lights);
                    }
                }
                _ => {
                    let is_sparse = settings.mode.has_low_resolution();
                    let what = (band, is_sparse, is_final);
                    select.record_gather(device, &mut encoder, timers, what, inputs, buffers);
                }
            }
            // Multiply by albedo, add emission, average sub-pixel samples.
            if step.last_batch && step.step == 1 {
                if stores_radiance && !is_final {
                    select.record_first(device, &mut encoder, timers, band, (selection, targets));
                } else if !is_final {
                    let inputs = ResolveInputs {
                        ids: &targets.ids,
                        grid,
                        sums: &targets.sums,
                        picture: &targets.picture_view,
                    };
                    resolve.record(device, &mut encoder, timers, band, inputs);
                }
                let pair = Some((receivers, selection));
                self.record_debug(&mut encoder, band, settings, (loaded, targets), pair)?;
                // A watchdog's patience is limited.
                let full =
                    std::mem::replace(&mut encoder, device.create_command_encoder(&Default::default()));
                self.queue.submit([full.finish()]);
            }
        }
        Ok(())
    }

    /// The debug view over a band, if one is asked for.
    fn record_debug(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        band: Band,
        settings: &RenderSettings,
        (loaded, targets): (&Loaded, &Targets),
        selected: Option<(&Receivers, &PointLists)>,
    ) -> Result<()> {
        let (Some(debug), Some(view)) = (&self.debug, settings.debug) else { return Ok(()) };
        let inputs = DebugInputs {
            targets,
            atlas: &loaded.atlas.view,
            lights: &loaded.light_buffer,
            maps: &loaded.atlas.maps,
            selected,
        };
        debug.record(&self.device, encoder, band, (view, loaded.lights.len() as u32), inputs)
    }

    /// Compiles, allocates and bakes what is missing.
    fn prepare_selected(&mut self, view: &View, settings: &RenderSettings) -> Result<()> {
        let (Some(loaded), Some(targets)) = (&mut self.loaded, &self.targets) else { return Ok(()) };
        let Some(receivers) = &loaded.receivers else {
            return Err(invalid(
                "load a visibility database before rendering, or choose the naive mode".into(),
            ));
        };
        let needs = loaded.needs;
        if self.select.as_ref().is_none_or(|s| s.needs != needs) {
            self.select = Some(Select::new(&self.device, &self.layouts, &self.options, needs));
        }
        if let Shading::Multipass { lights_per_pass } = settings.shading {
            if self.multipass.as_ref().is_none_or(|m| m.needs != needs) {
                self.multipass = Some(Multipass::new(&self.device, &self.layouts, &self.options, needs));
            }
            let key = MultipassKey {
                lights_per_pass,
                light_maps: settings.uses_light_maps(),
                optimised: settings.mode == Mode::Full,
                in_view: in_view(receivers, view),
            };
            if loaded.draws.as_ref().is_none_or(|d| d.key != key) {
                loaded.draws = Some(MultipassPlan::new(&self.device, receivers, key)?);
            }
        }
        let capacity = PointLists::capacity(targets);
        let plan = PointLists::offsets(receivers, capacity);
        if self.selection.as_ref().is_none_or(|s| s.key != (capacity, plan)) {
            self.selection = None;
            self.selection = Some(PointLists::new(&self.device, capacity, plan)?);
        }
        if let Some(selection) = &mut self.selection {
            selection.light_maps = settings.uses_light_maps();
        }
        if settings.uses_light_maps()
            && loaded.light_maps_for != Some(settings.clamp)
            && let Some(select) = &self.select
        {
            bake_light_maps(
                &self.device,
                &self.queue,
                (&self.layouts.frame, &self.timers, select),
                loaded,
                settings,
            );
            loaded.light_maps_for = Some(settings.clamp);
        }
        Ok(())
    }
}

/// Grids of points of the low-resolution pass, from the coarsest: pixels from point to point.
const GRIDS: [u32; 4] = [COARSEST, COARSEST / 2, COARSEST / 4, COARSEST / 8];

/// Sums the lights of all leaves' light maps, batch by batch.
fn bake_light_maps(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    (layout, timers, select): (&wgpu::BindGroupLayout, &crate::timers::Timers, &Select),
    loaded: &Loaded,
    settings: &RenderSettings,
) {
    let Some(receivers) = &loaded.receivers else { return };
    let plan = receivers.offsets_buffer(device);
    let steps = steps([1, 1], 1, 1, &[1], loaded.lights.len() as u32, BATCH);
    let frames = FrameUniforms::new(device, layout, &steps, |step: &Step| crate::layout::Frame {
        batch: step.first_light / BATCH,
        clamp: settings.clamp.unwrap_or(f32::MAX),
        ..Default::default()
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    for (index, step) in steps.iter().enumerate() {
        let band = Band {
            frame: &frames.group,
            frame_offset: index as u32 * frames.stride,
            scene: &loaded.scene.group,
            size: [1, 1],
        };
        let lights = batch_of(&loaded.light_buffer, step.first_light);
        select.record_light_maps(device, &mut encoder, timers, band, lights, (receivers, &plan));
    }
    queue.submit([encoder.finish()]);
}
