//! The path tracer: ground truth, with noise.

use super::{Job, Picture};
use crate::output::Progress;
use crate::output::Stats;
use girandole_core::trace::SceneTracer;
use girandole_reference::{PathSettings, path_trace};
use std::time::Instant;

/// Renders on all cores.
pub fn render(job: &Job) -> Picture {
    let start = Instant::now();
    let tracer = SceneTracer::new(job.scene, job.geometry);
    let progress = Progress::bar("tracing paths");
    let settings = PathSettings {
        paths: job.args.paths,
        bounces: job.args.lights.bounces.limit(),
        seed: job.args.lights.seed,
    };
    let estimate = path_trace(&tracer, &job.view, job.args.size, &settings, &|done| progress.set(done));
    let frame_ms = start.elapsed().as_secs_f64() * 1e3;
    let mut stats = Stats::new();
    // Standard errors of pixels and of the whole picture's mean, W/(sr·m²).
    let variance = f64::from(estimate.variance.mean().element_sum() / 3.0);
    let values = estimate.variance.pixels.len() as f64 * 3.0;
    stats.insert("paths_per_pixel".into(), job.args.paths.into());
    stats.insert("pixel_standard_error".into(), variance.sqrt().into());
    stats.insert("mean_standard_error".into(), (variance / values).sqrt().into());
    Picture { radiance: estimate.mean, frame_ms, stats, sum: None }
}
