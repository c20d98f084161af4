//! The exact sum over the light samples, with traced shadows.

use super::{Job, Picture};
use crate::output::Progress;
use crate::output::Stats;
use anyhow::Result;
use girandole_core::image::luminance;
use girandole_core::lights::{Clamp, LightSet};
use girandole_core::trace::SceneTracer;
use girandole_core::transfer::TransferredLight;
use girandole_reference::{OracleSettings, oracle, oracle_with_transfer};
use std::time::Instant;

/// Renders on all cores.
pub fn render(job: &Job) -> Result<Picture> {
    let start = Instant::now();
    let tracer = SceneTracer::new(job.scene, job.geometry);
    let progress = Progress::bar("tracing shadows");
    let settings = OracleSettings {
        samples_per_axis: job.args.aa.unwrap_or_default().samples_per_axis(),
        clamp: job.clamp,
        mirrors: job.args.quality.mirrors,
        ..OracleSettings::default()
    };
    let mut transferred = TransferredLight::new();
    for object in job.transfers {
        let light = (job.lights, job.visibility.map(|known| &**known));
        let transfer = (object.object, &*object.transfer);
        transferred.add(&tracer, light, transfer, object.gathering, job.clamp)?;
    }
    let (view, size, set) = (&job.view, job.args.size, |done: f32| progress.set(done));
    let radiance = if job.transfers.is_empty() {
        oracle(&tracer, job.lights, view, size, &settings, &set)
    } else {
        oracle_with_transfer(&tracer, job.lights, &transferred, view, size, &settings, &set)
    };
    let frame_ms = start.elapsed().as_secs_f64() * 1e3;
    Ok(Picture { radiance, frame_ms, stats: Stats::new(), sum: None })
}

/// The share of the picture's energy that clamping the geometric factor loses, estimated on a coarse grid of pixels from a few
/// hundred samples spread over all.
pub fn energy_lost_by_clamp(job: &Job) -> f64 {
    const GRID: [u32; 2] = [64, 48];
    const SAMPLES: usize = 256;
    let every = job.lights.len().div_ceil(SAMPLES).max(1);
    let samples = job.lights.samples().iter().step_by(every).copied().collect();
    let some = LightSet::from_samples(job.geometry, samples);
    let tracer = SceneTracer::new(job.scene, job.geometry);
    let mean = |clamp| {
        let settings = OracleSettings { samples_per_axis: 1, clamp, ..OracleSettings::default() };
        f64::from(luminance(oracle(&tracer, &some, &job.view, GRID, &settings, &|_| ()).mean()))
    };
    let exact = mean(Clamp::Off);
    if exact > 0.0 { 1.0 - mean(job.clamp) / exact } else { 0.0 }
}
