//! A frame on one page: from shadow maps to the caller's target.

use crate::Result;
use crate::device::recorder::Recorder;
use crate::layout::{self, Frame};
use crate::passes::debug::DebugInputs;
use crate::passes::shade_naive::ShadeNaive;
use crate::passes::sort_points::ListedPoints;
use crate::passes::visibility_buffer::{DepthUse, Seen};
use crate::passes::{BandSample, GridView, LightMapsView, MapsView, batches, tonemap};
use crate::points::targets::{COARSEST, Targets};
use crate::prepare::{Adaptive, PointPasses, Prepared, PreparedMode};
use crate::resident::Resident;
use crate::settings::{RenderSettings, Target};
use crate::shader_constants::{BATCH, GROUP};
use girandole_core::brdf;
use girandole_core::glam::{Vec2, Vec3};
use girandole_core::lights::Clamp;
use girandole_core::scene::{ClipDepth, ClipPlanes, LocalView};
use girandole_core::tonemap::Exposure;
use girandole_core::trace::RAY_OFFSET;

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
    if let Some(mirrors) = &prepared.mirrors {
        let lighting = match (&mirrors.mode, lighting) {
            (PreparedMode::Naive(pass), _) => Lighting::Naive(pass),
            (PreparedMode::Adaptive(adaptive), Lighting::Adaptive(_, light_maps)) => {
                Lighting::Adaptive(adaptive, light_maps)
            }
            (PreparedMode::Adaptive(_), naive) => naive,
        };
        for rows in targets.bands() {
            for sample in 0..samples {
                let frame = frame_uniform(view, (scene, targets), settings, rows, sample);
                let band = BandSample { frame, scene: &scene.geometry, targets };
                let seen = passes.visibility_buffer.record(recorder, &band, depth);
                let mut ends = seen;
                for index in 0..mirrors.count {
                    ends = mirrors.pass.trace(recorder, &band, mirrors.hierarchies, ends, index);
                    // What the last one meets shows a blur of the light samples about it.
                    let band = if index + 1 < mirrors.count { band } else { band.without_mirrors() };
                    let lit = light(recorder, &band, lighting, prepared, settings, (ends, maps), false).0;
                    if let (Some(pass), Some((_, vertices))) = (mirrors.transfer, transfer) {
                        pass.put(recorder, &band, ends, (vertices, false), lit);
                    }
                    mirrors.pass.add(recorder, &band, ends, lit);
                    recorder.split();
                }
                mirrors.pass.blur(recorder, &band, seen);
            }
            let frame = frame_uniform(view, (scene, targets), settings, rows, 0);
            mirrors.pass.put(recorder, &BandSample { frame, scene: &scene.geometry, targets });
        }
    }

    // What is seen through.
    if let Some((layers, in_view)) = seen_through {
        let peeled = targets.layers(recorder.device);
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
                // Layers send no rays.
                let band = band.without_mirrors();
                for layer in 0..in_view.count {
                    let seen = passes.visibility_buffer.record_layer(recorder, &band, peeled, layer);
                    let lit = light(recorder, &band, lighting, prepared, settings, (seen, maps), false).0;
                    layers.add(recorder, &band.with_layer(layer, layer + 1 == in_view.count), seen, lit);
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

/// The uniform of a sub-pixel sample of a band of rows.
fn frame_uniform(
    view: &LocalView,
    (scene, targets): (&Resident, &Targets),
    settings: &RenderSettings,
    band: [u32; 2],
    sample: u32,
) -> Frame {
    let (n, size) = (settings.samples_per_axis, targets.size);
    let center = |i: u32| (i as f32 + 0.5) / n as f32;
    // The first sample is the one next to the pixel's centre.
    let central = (n - 1) / 2 * (n + 1);
    let place = match sample {
        0 => central,
        s if s == central => 0,
        s => s,
    };
    // Far enough to see the whole scene from any eye that sees it at all.
    let far = (view.eye.length() + scene.extent) * 2.0;
    // Depth of parallel rays is as exact as what they cross is deep.
    let deep = match view.orthographic {
        true => farthest(view, scene.bounds) + scene.detail,
        false => far,
    };
    let (depth_bias, depth_scale, is_forward) = depth_mapping(view, scene.detail * 1e-5, deep);
    let sun = scene.geometry.environment.as_ref().and_then(|environment| environment.sun);
    let mirror_solid_angle = match scene.mirrors(settings) {
        0 => 0.0,
        _ => brdf::mirror_solid_angle(scene.lights.count() as usize),
    };
    // What no ray meets, and what further sets weigh against rays.
    let has_other_gloss = scene.lights.has_punctual || targets.light_set > 0;
    Frame {
        eye: view.eye,
        orthographic: u32::from(view.orthographic),
        right: view.right,
        half_width: view.half_extent.x,
        up: view.up,
        half_height: view.half_extent.y,
        forward: view.forward,
        depth_bias,
        size,
        band,
        offset: Vec2::new(center(place % n), center(place / n)),
        end_light: scene.lights.count(),
        clamp: layout::clamp(settings.clamp),
        far,
        sample,
        samples: n * n,
        last_row: band[1].min(size[1] - 1),
        step: 1,
        last_batch: 1,
        tolerance: settings.tolerance,
        debug: u32::from(settings.debug.is_some()),
        center: view.center,
        depth_scale,
        forward_depth: u32::from(is_forward),
        environment: scene.geometry.environment.as_ref().map_or(Vec2::ZERO, |e| e.uniform),
        sun_direction: sun.map_or(Vec3::ZERO, |disc| disc.direction),
        sun_chord2: sun.map_or(0.0, |disc| disc.chord * disc.chord),
        sun_radiance: sun.map_or(Vec3::ZERO, |disc| disc.radiance),
        sample_solid_angle: if settings.clamp == Clamp::Own { scene.lights.mean_solid_angle } else { 0.0 },
        mirror_solid_angle,
        ray_offset: scene.detail * RAY_OFFSET,
        columns: targets.drawn.columns(),
        light_set: targets.light_set,
        sample_area: scene.lights.mean_area,
        polished_alpha: if has_other_gloss { 0.0 } else { brdf::polished_alpha(mirror_solid_angle) },
        ..Frame::default()
    }
}

/// How far the farthest corner of a box is along a view's axis, metres; 0 if that is behind the eye.
fn farthest(view: &LocalView, (low, high): (Vec3, Vec3)) -> f32 {
    let corner = Vec3::select(view.forward.cmpge(Vec3::ZERO), high, low);
    (corner - view.eye).dot(view.forward).max(0.0) * 1.001
}

/// [`Frame::depth_bias`], [`Frame::depth_scale`], and whether the caller's depth is greater for what is farther. `near`
/// and `far` serve views that say nothing of depth.
fn depth_mapping(view: &LocalView, near: f32, far: f32) -> (f32, f32, bool) {
    let Some(ClipDepth { offset, factor }) = view.depth else {
        let (bias, scale) = own_mapping(view, near, far);
        return (bias, scale, false);
    };
    let is_forward = (factor > 0.0) == view.orthographic;
    let (offset, factor) = if is_forward { (1.0 - offset, -factor) } else { (offset, factor) };
    if view.orthographic { (offset, -1.0 / factor, is_forward) } else { (factor, -offset, is_forward) }
}

/// The mapping of views that say nothing of depth: reversed, and cut off where the view is.
fn own_mapping(view: &LocalView, near: f32, far: f32) -> (f32, f32) {
    let ClipPlanes { near: from, far: to } = view.clip;
    if view.orthographic {
        let to = if to.is_finite() { to } else { from + far };
        return (1.0 + from / (to - from), to - from);
    }
    let near = if from > 0.0 { from } else { near };
    // Depth is 1 at the near plane and 0 at the far one.
    if to.is_finite() { (near * (to / (to - near)), near / (to - near)) } else { (near, 0.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use girandole_core::glam::camera::rh::proj::directx as proj;
    use girandole_core::glam::{DAffine3, DVec3, Mat4};
    use girandole_core::scene::View;

    /// What the visibility buffer makes of a distance, as the caller's depth.
    fn depth_at(view: &LocalView, z: f32) -> f32 {
        let (bias, scale, is_forward) = depth_mapping(view, 1e-4, 50.0);
        let reversed = if view.orthographic { bias - z / scale } else { (bias - z * scale) / z };
        if is_forward { 1.0 - reversed } else { reversed }
    }

    #[test]
    fn depth_is_the_callers() {
        let swap = Mat4::from_cols_array_2d(&[
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, -1.0, 0.0],
            [0.0, 0.0, 1.0, 1.0],
        ]);
        let (near, far) = (0.25, 40.0);
        for (clip_from_view, planes) in [
            (proj::perspective(1.0, 1.5, near, far), [0.0, 1.0]),
            (swap * proj::perspective(1.0, 1.5, near, far), [1.0, 0.0]),
            (proj::perspective_infinite(1.0, 1.5, near), [0.0, 1.0 - near / far]),
            (proj::perspective_infinite_reverse(1.0, 1.5, near), [1.0, near / far]),
            (proj::orthographic(-3.0, 3.0, -2.0, 2.0, near, far), [0.0, 1.0]),
            (swap * proj::orthographic(-3.0, 3.0, -2.0, 2.0, near, far), [1.0, 0.0]),
        ] {
            let view = View::from_matrices(DAffine3::IDENTITY, clip_from_view).expect("a view");
            let local = view.relative_to(DVec3::ZERO);
            for (z, depth) in [(near, planes[0]), (far, planes[1])] {
                assert!((depth_at(&local, z) - depth).abs() < 1e-6, "{clip_from_view}: {z}");
            }
            for z in [0.3, 1.0, 7.0, 39.0] {
                let expected = view.clip_depth(z).expect("it has depth");
                assert!((depth_at(&local, z) - expected).abs() < 1e-6, "{clip_from_view}: {z}");
            }
            assert_eq!(depth_mapping(&local, 1e-4, 50.0).2, !view.is_reversed());
            // Without the caller's depth, that of the renderer.
            let own = LocalView { depth: None, clip: ClipPlanes::NONE, ..local };
            let expected = if local.orthographic { (1.0, 50.0, false) } else { (1e-4, 0.0, false) };
            assert_eq!(depth_mapping(&own, 1e-4, 50.0), expected);
        }
    }
}
