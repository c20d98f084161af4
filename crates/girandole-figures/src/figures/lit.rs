//! An object lit in several ways, each beside a path tracer: how far it is from that over the object's pixels,
//! and what it costs.

use super::views::{Point, looking, only, points, within};
use crate::bench::{Bench, Stage, median, moving_object};
use crate::report::{Table, number};
use anyhow::Result;
use girandole::{RenderSettings, RendererOptions};
use girandole_core::glam::DVec3;
use girandole_core::illumination::{Illumination, IlluminationSettings, Rewalk};
use girandole_core::image::Image;
use girandole_core::lights::LightSettings;
use girandole_core::scene::{Geometry, ObjectId, Scene, View};
use girandole_core::trace::SceneTracer;
use girandole_core::transfer::{Gathering, ObjectTransfer, TransferSettings};
use girandole_reference::metrics::{Comparison, compare};
use girandole_reference::{Estimate, PathSettings, path_trace};
use std::sync::Arc;

/// Metres from the eye to the object, in units of its radius.
const DISTANCE: f64 = 3.2;
/// Vertical angle of view, degrees.
const ANGLE: f64 = 34.0;
/// What is shaded point by point takes the time of these.
const SHADING: [&str; 3] = ["select_gpu_ms", "sort_gpu_ms", "shade_gpu_ms"];
/// Lighting by transfer takes the time of these.
const TRANSFER: [&str; 3] = ["incident_light_gpu_ms", "transfer_vertices_gpu_ms", "transfer_gpu_ms"];

/// A scene and what is seen of its object.
pub struct Subject {
    /// With the object where it is looked at.
    pub scene: Scene,
    /// What is lit.
    pub object: ObjectId,
    /// What it does to light.
    pub transfer: Arc<ObjectTransfer>,
    /// The object fills it.
    pub view: View,
    /// Pixels.
    pub size: [u32; 2],
    /// Light of the room, for this view.
    pub light: Illumination,
    /// What pixels show.
    pub points: Vec<Option<Point>>,
    /// The pixels that show the object and nothing else.
    pub within: Vec<bool>,
    /// By the path tracer.
    pub truth: Estimate,
}

impl Subject {
    /// The object of a scene, from a direction, by so many light samples, and by so many paths.
    ///
    /// # Errors
    /// Where nothing moves in the scene, or the object cannot have transfer.
    pub fn new(bench: &Bench, mut scene: Scene, from: DVec3, [lights, paths]: [u32; 2]) -> Result<Self> {
        let size = bench.of([[48, 36], [200, 150], [320, 240]]);
        let object = moving_object(&scene)?;
        let settings =
            TransferSettings { directions: bench.of([64, 512, 1024]), ..TransferSettings::default() };
        let transfer = Arc::new(ObjectTransfer::simulate(&scene, object, &settings, &|_| ())?);
        let frame = transfer.frame(&scene, object)?.world_from_transfer;
        let center = frame.transform_point3(transfer.center().as_dvec3());
        let radius = frame.transform_vector3(DVec3::X).length() * f64::from(transfer.radius());
        let view = looking(center + from.normalize() * radius * DISTANCE, center, ANGLE, size)?;
        scene.take_changes();
        let settings = IlluminationSettings {
            lights: LightSettings { count: lights, ..LightSettings::default() },
            views: vec![view],
            rewalk: Rewalk::Off,
            ..IlluminationSettings::default()
        };
        let light = Illumination::new(&scene, &settings)?;
        let geometry = Geometry::new(&scene);
        let tracer = SceneTracer::new(&scene, &geometry);
        let points = points(&tracer, &view, size);
        let within = within(&points, object, size);
        let settings = PathSettings { paths, bounces: Some(5), seed: 0 };
        let truth = path_trace(&tracer, &view, size, &settings, &|_| ());
        Ok(Self { scene, object, transfer, view, size, light, points, within, truth })
    }

    /// How far a picture is from the path tracer's over these pixels.
    ///
    /// # Errors
    /// Where there is no such pixel.
    pub fn compare(&self, picture: &Image, pixels: &[bool]) -> Result<Comparison> {
        Ok(compare(&self.truth.mean, picture, &only(pixels, self.size))?)
    }

    /// relMSE of the path tracer's picture itself over the object's pixels, by its variance.
    pub fn noise(&self) -> f64 {
        let pixels = self.truth.mean.pixels.iter().zip(&self.truth.variance.pixels).zip(&self.within);
        let errors = pixels.filter(|(_, is_within)| **is_within).flat_map(|((mean, variance), _)| {
            let (mean, variance) = (mean.as_dvec3().to_array(), variance.as_dvec3().to_array());
            mean.into_iter().zip(variance).map(|(mean, variance)| variance / (mean * mean + 0.01))
        });
        let errors: Vec<f64> = errors.collect();
        errors.iter().sum::<f64>() / errors.len().max(1) as f64
    }

    /// What it is, for an experiment's settings.
    pub fn words(&self, paths: u32, frames: usize) -> String {
        format!(
            "{} × {} pixels; {} light samples placed for this view; five bands (25 coefficients), {} \
             vertices; path tracer of {paths} paths and five bounces (relMSE of its own {:.4}); medians \
             of {frames} frames, each way in turn. What is compared are the {} pixels that show the \
             object alone.",
            self.size[0],
            self.size[1],
            self.light.lights().len(),
            self.transfer.vertex_count(),
            self.noise(),
            self.within.iter().filter(|is_within| **is_within).count(),
        )
    }
}

/// How an object is lit: by shadow maps, or by transfer of light gathered in this way.
#[derive(Clone, Copy)]
pub struct Way {
    /// Of its pictures and rows.
    pub name: &'static str,
    /// Nothing: shadow maps.
    pub gathering: Option<Gathering>,
}

/// By shadow maps at each pixel.
pub const MAPS: Way = Way { name: "shadow maps", gathering: None };
/// As the thesis does it.
pub const CENTER: Way = Way { name: "transfer, light at the centre", gathering: Some(Gathering::Center) };
/// As the thesis proposes it.
pub const GRID: Way = Way { name: "transfer, grid of 4³", gathering: Some(Gathering::GRID) };

/// What a way gives.
pub struct Lit {
    /// Which.
    pub way: Way,
    /// The frame.
    pub picture: Image,
    /// How far from the path tracer over the object's pixels.
    pub error: Comparison,
    /// Milliseconds of a frame, with the gathering of light on the CPU where there is any.
    pub frame: f64,
    /// Milliseconds of what lights the object; nothing where the device has no timestamps to trust.
    pub object: Option<f64>,
}

/// Lights the subject in each way; the first has to be by shadow maps.
///
/// # Errors
/// Those of rendering.
pub fn light(bench: &Bench, subject: &Subject, ways: &[Way], frames: usize) -> Result<Vec<Lit>> {
    let light = (subject.light.clone(), (subject.view, subject.size));
    let mut stage = bench.stage_with(&subject.scene, RendererOptions::default(), light.0, light.1)?;
    let (mut times, mut pictures) = (vec![Vec::new(); ways.len()], Vec::new());
    let settings = RenderSettings::default();
    for round in 0..=frames {
        for (way, times) in ways.iter().zip(&mut times) {
            if round == 0 {
                choose(&mut stage, subject, way)?;
                pictures.push(stage.picture(&settings)?);
                continue;
            }
            if way.gathering.is_none() {
                choose(&mut stage, subject, way)?;
                times.push(stage.frame(&settings)?);
                continue;
            }
            // Choosing transfer gathers light anew where the CPU does so, as each update does.
            let start = std::time::Instant::now();
            choose(&mut stage, subject, way)?;
            stage.frame(&settings)?;
            times.push(start.elapsed().as_secs_f64() * 1e3);
        }
    }
    // Timestamps of software adapters miss most of what is dispatched.
    let is_timed = bench.gpu.info.device_type != girandole::wgpu::DeviceType::Cpu;
    let parts =
        ways.iter().map(|way| if is_timed { parts(&mut stage, subject, way, frames) } else { Ok([0.0; 2]) });
    let parts = parts.collect::<Result<Vec<[f64; 2]>>>()?;
    // Where transfer lights the object, points are shaded of all else.
    let all_else = parts.iter().skip(1).map(|part| part[0]).collect();
    let by_maps = parts.first().map_or(0.0, |part| part[0]) - median(all_else);
    let all = ways.iter().zip(pictures).zip(times).zip(parts);
    all.map(|(((way, picture), times), part)| {
        let error = subject.compare(&picture, &subject.within)?;
        let object = if way.gathering.is_some() { part[1] } else { by_maps };
        Ok(Lit {
            way: *way,
            picture,
            error,
            frame: median(times),
            object: (is_timed && part[0] > 0.0).then_some(object),
        })
    })
    .collect()
}

fn choose(stage: &mut Stage, subject: &Subject, way: &Way) -> Result<()> {
    let transfer = way.gathering.map(|gathering| (subject.transfer.clone(), gathering));
    Ok(stage.renderer.set_transfer(&subject.scene, subject.object, transfer)?)
}

/// Median milliseconds of shading points, and of lighting the object by transfer.
fn parts(stage: &mut Stage, subject: &Subject, way: &Way, frames: usize) -> Result<[f64; 2]> {
    stage.renderer.time_passes(true);
    let mut samples = [const { Vec::new() }; 2];
    for _ in 0..frames {
        choose(stage, subject, way)?;
        stage.frame(&RenderSettings::default())?;
        let stats = stage.stats()?;
        let sum = |names: [&str; 3]| -> f64 { names.iter().filter_map(|name| stats.gpu_ms.get(name)).sum() };
        samples[0].push(sum(SHADING));
        samples[1].push(sum(TRANSFER) + stats.transfer.gather_ms);
    }
    stage.renderer.time_passes(false);
    Ok(samples.map(median))
}

/// A table of errors and times, with a column of the caller's own.
pub fn table(all: &[Lit], own: &str, value: impl Fn(&Lit) -> f64) -> Table {
    let mut columns = vec!["lit by", "energy", "relMSE", "FLIP", own, "frame ms"];
    if all.iter().any(|lit| lit.object.is_some()) {
        columns.push("object alone ms");
    }
    let mut table = Table::new("ways", "Over the object's pixels, against the path tracer", &columns);
    for lit in all {
        let mut row = vec![
            lit.way.name.into(),
            number(lit.error.energy_ratio, 3),
            number(lit.error.rel_mse, 4),
            number(lit.error.flip, 4),
            number(value(lit), 3),
            number(lit.frame, 2),
        ];
        row.extend(lit.object.map(|time| number(time, 2)));
        row.resize(columns.len(), String::new());
        table.rows.push(row);
    }
    table
}
