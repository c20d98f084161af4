//! A frame on one page: from shadow maps to the caller's target.

mod uniform;

use crate::Result;
use crate::device::recorder::Recorder;
use crate::passes::debug::DebugInputs;
use crate::passes::shade_naive::ShadeNaive;
use crate::passes::sort_points::ListedPoints;
use crate::passes::transfer::{LitVertices, Transfer};
use crate::passes::visibility_buffer::{DepthUse, Seen};
use crate::passes::{BandSample, GridView, LightMapsView, MapsView, batches, tonemap};
use crate::points::targets::{COARSEST, Targets};
use crate::prepare::{Adaptive, PointPasses, Prepared, PreparedMirrors, PreparedMode};
use crate::resident::Resident;
use crate::settings::{RenderSettings, Target};
use crate::shader_constants::{BATCH, GROUP};
use girandole_core::scene::LocalView;
use girandole_core::tonemap::Exposure;
use uniform::frame_uniform;

/// Pixels from point to point of the grids, from the coarsest.
const GRIDS: [u32; 4] = [COARSEST, COARSEST / 2, COARSEST / 4, COARSEST / 8];
/// Pairs of pixel and light in one dispatch of the naive mode, well below a second on a slow GPU.
const BATCH_PAIRS: u64 = 1 << 28;

/// Records a frame into the picture, and from there into `target`.
///
/// # Errors
/// [`crate::Error::TooLarge`] where a list exceeds the device's limits.
pub(crate) fn record_frame(
    recorder: &mut Recorder,
    prepared: &Prepared,
    view: &LocalView,
    settings: &RenderSettings,
    target: Option<&Target>,
) -> Result<()> {
    let &Prepared { passes, shared, scene, targets, .. } = prepared;

    // The shadow map of each light, where they are stale.
    let maps = passes.shadow_maps.record(recorder, scene, prepared.map_updates)?;
    // What the vertices of objects receive whose transfer is known.
    let transfer = prepared.transfer.as_ref().map(|transfer| {
        let whole = first_samples(view, (scene, targets), settings);
        let light = (&scene.lights, &transfer.previous_transforms);
        (transfer.pass, transfer.pass.record(recorder, &whole, maps, light, transfer.objects))
    });
    // For each receiver, the sum of the lights that nothing shadows.
    let lighting = match &prepared.mode {
        PreparedMode::Naive(pass) => Lighting::Naive(pass),
        PreparedMode::Adaptive(adaptive) => {
            recorder.encoder().clear_buffer(&adaptive.lists.tally, 0, None);
            let (pass, receivers) = (&adaptive.passes.light_maps, adaptive.receivers);
            let light_maps = match &adaptive.light_map_changes {
                Some(changes) => pass.record(recorder, scene, receivers, changes, settings.clamp)?,
                None => LightMapsView { receivers, used: false },
            };
            Lighting::Adaptive(adaptive, light_maps)
        }
    };
    let samples = settings.samples_per_axis.pow(2);
    let in_view = || scene.geometry.transparent.in_view(view, targets.size);
    let seen_through = prepared.layers.and_then(|layers| Some((layers, in_view()?)));
    let depth = match target {
        Some(Target { depth_in: Some(callers), .. }) => DepthUse::Behind(&passes.caller_depth, callers),
        Some(Target { depth_out: Some(_), .. }) => DepthUse::Keep,
        _ if seen_through.is_some() => DepthUse::Keep,
        _ => DepthUse::Discard,
    };
    if prepared.debug.is_some() {
        recorder.encoder().clear_buffer(&targets.partial_sums, 0, None);
    }

    for rows in targets.bands() {
        for sample in 0..samples {
            let frame = frame_uniform(view, (scene, targets), settings, rows, sample);
            let band = BandSample { frame, scene: &scene.geometry, targets };

            // Which triangle of which surface does each pixel show?
            let seen = passes.visibility_buffer.record(recorder, &band, depth);

            // What do they receive?
            let (lit, is_radiance) = match lighting {
                // Further samples lie between the first ones of their pixel and its neighbours.
                Lighting::Adaptive(adaptive, light_maps)
                    if sample > 0 && settings.mode.has_low_resolution() =>
                {
                    let kernels = adaptive.kernels(true);
                    let inputs = ShadeInputs { prepared, adaptive, kernels, seen, maps, light_maps };
                    let grids = [targets.grid(1), targets.sample_grid()];
                    let points =
                        kernels.edges.record(recorder, &band, seen, light_maps, adaptive.lists, grids);
                    (shade(recorder, &band, inputs, points, grids[1]), kernels.writes_radiance)
                }
                _ => {
                    let ends_in_radiance = settings.samples_per_axis == 1;
                    light(recorder, &band, lighting, prepared, settings, (seen, maps), ends_in_radiance)
                }
            };

            // What shows an object with transfer, as irradiance or as radiance, as all the rest is.
            let ends_as_radiance =
                matches!(lighting, Lighting::Adaptive(Adaptive { to_radiance: Some(_), .. }, _));
            if let Some((pass, vertices)) = transfer.filter(|_| !ends_as_radiance) {
                pass.put(recorder, &band, seen, (vertices, false), lit);
            }

            // Multiply by albedo, add emission, average samples.
            match lighting {
                _ if is_radiance => {}
                Lighting::Adaptive(Adaptive { to_radiance: Some(passes), .. }, _) => {
                    passes.first_samples.record(recorder, &band, seen, lit);
                }
                _ => prepared.resolve.record(recorder, &band, seen, lit),
            }
            if let Some((pass, vertices)) = transfer.filter(|_| ends_as_radiance) {
                pass.put(recorder, &band, seen, (vertices, true), lit);
            }
            if let Some((debug, view)) = prepared.debug {
                let adaptive = match lighting {
                    Lighting::Adaptive(adaptive, light_maps) => Some((light_maps, adaptive.lists)),
                    Lighting::Naive(_) => None,
                };
                let inputs = DebugInputs { view, seen, maps, lights: &scene.lights, lit, adaptive };
                debug.record(recorder, &band, inputs)?;
            }
            recorder.split();
        }
    }

    // What lies behind.
    let shown = scene.geometry.environment.as_ref().and_then(|environment| environment.shown.as_ref());
    if let (Some(background), Some(environment)) = (prepared.background, shown) {
        background.record(recorder, &first_samples(view, (scene, targets), settings), environment);
    }

    // What smooth surfaces mirror.
    let inputs = prepared.mirrors.as_ref();
    let inputs = inputs.map(|mirrors| MirrorInputs { prepared, mirrors, lighting, transfer, maps });
    if let Some(inputs) = inputs.filter(|_| !scene.features.only_layers_mirror) {
        for rows in targets.bands() {
            for sample in 0..samples {
                let frame = frame_uniform(view, (scene, targets), settings, rows, sample);
                let band = BandSample { frame, scene: &scene.geometry, targets };
                let seen = passes.visibility_buffer.record(recorder, &band, depth);
                mirror_images(recorder, &band, inputs, settings, seen);
            }
            let frame = frame_uniform(view, (scene, targets), settings, rows, 0);
            inputs.mirrors.pass.put(recorder, &BandSample { frame, scene: &scene.geometry, targets });
        }
    }

    // What is seen through.
    if let Some((layers, in_view)) = seen_through {
        let peeled = targets.layers(recorder.device);
        let inputs = inputs.filter(|_| scene.features.mirrors_in_layers);
        let bands =
            targets.bands().map(|[first, end]| [first.max(in_view.rows.start), end.min(in_view.rows.end)]);
        for rows in bands.filter(|[first, end]| first < end) {
            let band = |sample| BandSample {
                frame: frame_uniform(view, (scene, targets), settings, rows, sample),
                scene: &scene.geometry,
                targets,
            };
            for sample in 0..samples {
                let band = band(sample);
                if samples > 1 {
                    passes.visibility_buffer.record(recorder, &band, depth);
                }
                for layer in 0..in_view.count {
                    let seen = passes.visibility_buffer.record_layer(recorder, &band, peeled, layer);
                    let band = if inputs.is_some() { band } else { band.without_mirrors() };
                    if let Some(inputs) = inputs {
                        mirror_images(recorder, &band.as_first_sample(), inputs, settings, seen);
                    }
                    let lit = light(recorder, &band, lighting, prepared, settings, (seen, maps), false).0;
                    let band = band.with_layer(layer, layer + 1 == in_view.count);
                    layers.add(recorder, &band, seen, lit, inputs.is_some());
                    recorder.split();
                }
            }
            layers.put_before(recorder, &band(0));
        }
    }

    // Our depth, that of first samples. It may go where the caller's came from, which every sample has read by now.
    if let Some(callers) = target.and_then(|t| t.depth_out) {
        let whole = first_samples(view, (scene, targets), settings);
        let seen = passes.visibility_buffer.record(recorder, &whole, depth);
        passes.caller_depth.export(recorder, shared, &whole, seen, callers);
    }

    // Display.
    if let Some(target) = target {
        let stops = match settings.exposure {
            Exposure::Auto => passes.exposure.record(recorder, targets),
            Exposure::Ev(_) => passes.exposure.stops(),
        };
        tonemap::record(recorder, shared, targets, stops, settings, target);
    }
    Ok(())
}

/// How a frame is shaded.
#[derive(Clone, Copy)]
enum Lighting<'a> {
    /// Every light at every pixel.
    Naive(&'a ShadeNaive),
    /// What the picture needs.
    Adaptive(&'a Adaptive<'a>, LightMapsView<'a>),
}

/// What shading takes beside its points.
#[derive(Clone, Copy)]
struct ShadeInputs<'a> {
    prepared: &'a Prepared<'a>,
    adaptive: &'a Adaptive<'a>,
    kernels: &'a PointPasses,
    seen: Seen<'a>,
    maps: MapsView<'a>,
    light_maps: LightMapsView<'a>,
}

/// What mirror images take.
#[derive(Clone, Copy)]
struct MirrorInputs<'a> {
    prepared: &'a Prepared<'a>,
    mirrors: &'a PreparedMirrors<'a>,
    /// Of what the camera sees.
    lighting: Lighting<'a>,
    transfer: Option<(&'a Transfer, LitVertices<'a>)>,
    maps: MapsView<'a>,
}

/// What rays bring that what is `seen` mirrors, and what it makes of that.
fn mirror_images(
    recorder: &mut Recorder,
    band: &BandSample,
    inputs: MirrorInputs,
    settings: &RenderSettings,
    seen: Seen,
) {
    let MirrorInputs { prepared, mirrors, lighting, transfer, maps } = inputs;
    let lighting = match (&mirrors.mode, lighting) {
        (PreparedMode::Naive(pass), _) => Lighting::Naive(pass),
        (PreparedMode::Adaptive(adaptive), Lighting::Adaptive(_, light_maps)) => {
            Lighting::Adaptive(adaptive, light_maps)
        }
        (PreparedMode::Adaptive(_), naive) => naive,
    };
    let mut ends = seen;
    for index in 0..mirrors.count {
        ends = mirrors.pass.trace(recorder, band, mirrors.hierarchies, ends, index);
        // What the last one meets shows a blur of the light samples about it.
        let band = if index + 1 < mirrors.count { *band } else { band.without_mirrors() };
        let lit = light(recorder, &band, lighting, prepared, settings, (ends, maps), false).0;
        if let (Some(pass), Some((_, vertices))) = (mirrors.transfer, transfer) {
            pass.put(recorder, &band, ends, (vertices, false), lit);
        }
        mirrors.pass.add(recorder, &band, ends, lit);
        recorder.split();
    }
    mirrors.pass.blur(recorder, band, seen);
}

/// What the pixels of a sample receive, and whether that is their radiance already, if it may be.
fn light<'a>(
    recorder: &mut Recorder,
    band: &BandSample<'a>,
    lighting: Lighting,
    prepared: &Prepared,
    settings: &RenderSettings,
    (seen, maps): (Seen, MapsView),
    may_be_radiance: bool,
) -> (GridView<'a>, bool) {
    let targets = band.targets;
    match lighting {
        // The coarsest grid is shaded; finer ones are interpolated, and shaded where that is not enough.
        Lighting::Adaptive(adaptive, light_maps) => {
            let grids = if settings.mode.has_low_resolution() { &GRIDS[..] } else { &[1] };
            let kernels = adaptive.kernels(false);
            let inputs = ShadeInputs { prepared, adaptive, kernels, seen, maps, light_maps };
            let (coarsest, grid) = (band.with_step(grids[0]), targets.grid(grids[0]));
            let all = &adaptive.passes.append_all_points;
            let points = all.record(recorder, &coarsest, seen, light_maps, adaptive.lists, grid);
            let mut lit = (shade(recorder, &coarsest, inputs, points, grid), false);
            for &step in &grids[1..] {
                let kernels = adaptive.kernels(step == 1 && may_be_radiance);
                let fine = band.with_step(step).with_radiance(kernels.writes_radiance);
                let grids = [lit.0, targets.grid(step)];
                let inputs = ShadeInputs { kernels, ..inputs };
                let points = kernels.refine.record(recorder, &fine, seen, light_maps, adaptive.lists, grids);
                lit = (shade(recorder, &fine, inputs, points, grids[1]), kernels.writes_radiance);
            }
            lit
        }
        // Every light at every pixel.
        Lighting::Naive(pass) => (shade_all(recorder, band, pass, prepared, settings, (seen, maps)), false),
    }
}

/// Shades listed points of a grid: sorted by receiver, with the lights that each may see.
fn shade<'g>(
    recorder: &mut Recorder,
    band: &BandSample,
    inputs: ShadeInputs,
    points: ListedPoints,
    grid: GridView<'g>,
) -> GridView<'g> {
    let ShadeInputs { prepared, adaptive, kernels, seen, maps, light_maps } = inputs;
    let lights = &prepared.scene.lights;
    let band = &band.with_radiance(kernels.writes_radiance);
    let points = adaptive.passes.sort_points.record(recorder, band, light_maps, points);
    if let Some((multipass, plan)) = adaptive.multipass {
        return multipass.record(recorder, band, seen, (maps, light_maps), (plan, lights), points, grid);
    }
    let mut lit = grid;
    for batch in batches(lights.count(), BATCH) {
        let (band, lights) = (band.with_batch(batch), lights.batch(batch.first));
        let (maps, old) =
            ((maps, light_maps), adaptive.previous_transforms.as_ref().map(|old| old.batch(batch.first)));
        lit = kernels.shade_points(old.is_some()).record(
            recorder,
            &band,
            seen,
            maps,
            (lights, old),
            (points, adaptive.are_few),
            grid,
        );
    }
    lit
}

/// Shades all pixels with all lights.
fn shade_all<'a>(
    recorder: &mut Recorder,
    band: &BandSample<'a>,
    pass: &ShadeNaive,
    prepared: &Prepared,
    settings: &RenderSettings,
    (seen, maps): (Seen, MapsView),
) -> GridView<'a> {
    let (lights, grid) = (&prepared.scene.lights, band.targets.grid(1));
    let pixels = u64::from(band.frame.size[0]) * u64::from(band.targets.band_rows);
    let size = settings.lights_per_batch.unwrap_or_else(|| (BATCH_PAIRS / pixels).clamp(1, 1 << 20) as u32);
    let size = size.next_multiple_of(GROUP).clamp(GROUP, BATCH);
    let mut lit = grid;
    for batch in batches(lights.lit_count(), size) {
        let (band, lights) = (band.with_batch(batch), lights.lit_batch(batch.first));
        lit = pass.record(recorder, &band, seen, maps, lights, grid);
        recorder.split();
    }
    lit
}

/// The first samples of the whole picture.
pub(crate) fn first_samples<'a>(
    view: &LocalView,
    (scene, targets): (&'a Resident, &'a Targets),
    settings: &RenderSettings,
) -> BandSample<'a> {
    let frame = frame_uniform(view, (scene, targets), settings, [0, targets.size[1]], 0);
    BandSample { frame, scene: &scene.geometry, targets }
}
