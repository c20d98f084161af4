//! How good N light samples are: the error of the light they bring to what a camera sees, every pair traced exactly,
//! against very many samples.
//!
//! ```text
//! cargo run --release -p girandole-core --example light_quality -- <scene> <what> [seeds] [counts]
//! ```
//!
//! `<scene>` is a built-in room or a file, `<what>` one of `count`, `share`, `candidates`, `termination`, `clamp`,
//! `seconds`. Prints relMSE, mean((t − r)² / (r² + 0.01)) over points and channels with the worst 0.1 % left out (with
//! its standard error and its median over seeds), and the energy as a share of the reference's.

use girandole_core::glam::{DVec3, Vec2};
use girandole_core::image::luminance;
use girandole_core::lights::{LightSet, LightSettings, Termination};
use girandole_core::scene::{Geometry, Scene, View, builtin};
use girandole_core::trace::SceneTracer;
use girandole_core::{Result, brdf::Surface};
use std::time::Instant;

/// Pixels whose surface points are lit, in x and y.
const PIXELS: [u32; 2] = [56, 42];
const REFERENCE_SAMPLES: u32 = 1 << 17;
const REFERENCE_SEED: u32 = 0x00c0_ffee;

struct Points<'a> {
    tracer: SceneTracer<'a>,
    points: Vec<(Surface, u32)>,
}

impl<'a> Points<'a> {
    /// What the first camera sees of surfaces that do not emit.
    fn new(scene: &'a Scene, geometry: &'a Geometry) -> Self {
        let tracer = SceneTracer::new(scene, geometry);
        let view = View::new(scene, &scene.cameras[0], PIXELS[0] as f32 / PIXELS[1] as f32);
        let view = view.relative_to(geometry.origin);
        let mut points = Vec::new();
        for i in 0..PIXELS[0] * PIXELS[1] {
            let pixel = Vec2::new((i % PIXELS[0]) as f32 + 0.5, (i / PIXELS[0]) as f32 + 0.5);
            let (origin, direction) = view.pixel_ray(pixel, PIXELS);
            let Some(hit) = tracer.closest_visible(origin, direction) else { continue };
            let wo = -direction.normalize();
            let mut surface = geometry.surface(scene, hit.triangle, hit.barycentric, wo);
            surface.position = tracer.offset_ray_origin(surface.position, surface.geometric_normal);
            if luminance(surface.emission) == 0.0 {
                points.push((surface, hit.triangle));
            }
        }
        Self { tracer, points }
    }

    /// Radiance reflected diffusely towards the camera.
    fn radiance(&self, set: &LightSet, clamp: f32) -> Vec<DVec3> {
        let one = |(surface, triangle): &(Surface, u32)| {
            let mut sum = DVec3::ZERO;
            for light in set.samples() {
                let (position, geometric) = (surface.position, surface.geometric_normal);
                let g = light.geometric_factor(position, geometric, surface.shading_normal, clamp);
                if let Some((g, _)) = g
                    && !self.tracer.occluded(position, *triangle, light.position, light.triangle())
                {
                    sum += (light.intensity * g).as_dvec3();
                }
            }
            sum * surface.albedo.as_dvec3() / std::f64::consts::PI
        };
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let chunks = self.points.chunks(self.points.len().div_ceil(threads).max(1));
        std::thread::scope(|scope| {
            let parts: Vec<_> =
                chunks.map(|part| scope.spawn(move || part.iter().map(one).collect::<Vec<_>>())).collect();
            parts.into_iter().flat_map(|part| part.join().unwrap_or_default()).collect()
        })
    }
}

/// relMSE without the worst 0.1 %, and the ratio of energies.
fn compare(test: &[DVec3], reference: &[DVec3]) -> (f64, f64) {
    let error = |(t, r): (&DVec3, &DVec3)| {
        let d = *t - *r;
        (d * d / (*r * *r + 0.01)).element_sum() / 3.0
    };
    let mut errors: Vec<f64> = test.iter().zip(reference).map(error).collect();
    errors.sort_by(f64::total_cmp);
    errors.truncate((errors.len() as f64 * 0.999) as usize);
    let energy = |x: &[DVec3]| x.iter().sum::<DVec3>().element_sum();
    (errors.iter().sum::<f64>() / errors.len() as f64, energy(test) / energy(reference))
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let argument = |i: usize, default: &str| arguments.get(i).map_or(default.to_string(), Clone::clone);
    let name = argument(0, "table");
    let mut scene = if builtin::NAMES.contains(&name.as_str()) {
        builtin::build(&name, builtin::default_object(&name))?
    } else {
        Scene::load(name.as_ref())?
    };
    scene.ensure_camera();
    let geometry = Geometry::new(&scene);
    let seeds: u32 = argument(2, "8").parse().unwrap_or(8);
    let counts: Vec<u32> = argument(3, "300,1024").split(',').filter_map(|n| n.parse().ok()).collect();
    let usual = LightSettings::default();
    let what = argument(1, "count");
    let with = |label: String, settings| (label, settings, f32::INFINITY);
    let rows: Vec<(String, LightSettings, f32)> = match what.as_str() {
        "share" => [0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5]
            .map(|s| (format!("direct share {s}, clamp 2"), LightSettings { direct_share: s, ..usual }, 2.0))
            .to_vec(),
        "candidates" => [1, 4, 16, 64]
            .into_iter()
            .flat_map(|c| [f32::INFINITY, 2.0].map(|clamp| (c, clamp)))
            .map(|(c, clamp)| {
                let settings = LightSettings { candidates: c, ..usual };
                (format!("candidates {c}, clamp {clamp}"), settings, clamp)
            })
            .collect(),
        "termination" => [Termination::Throughput, Termination::Albedo]
            .map(|t| (format!("{t:?}, clamp 2"), LightSettings { termination: t, ..usual }, 2.0))
            .to_vec(),
        "clamp" => [f32::INFINITY, 30.0, 10.0, 5.0, 3.0, 2.0, 1.0, 0.5, 0.25]
            .map(|c| (format!("clamp {c}"), usual, c))
            .to_vec(),
        "seconds" => {
            for count in counts {
                let start = Instant::now();
                LightSet::sample(&scene, &geometry, &LightSettings { count, ..usual })?;
                println!("{name}: {count} samples in {:.3} s", start.elapsed().as_secs_f64());
            }
            return Ok(());
        }
        _ => vec![with("usual".into(), usual), ("clamp 1".into(), usual, 1.0)],
    };
    let points = Points::new(&scene, &geometry);
    let settings = LightSettings { count: REFERENCE_SAMPLES, seed: REFERENCE_SEED, candidates: 1, ..usual };
    let reference = points.radiance(&LightSet::sample(&scene, &geometry, &settings)?, f32::INFINITY);
    for (label, settings, clamp) in rows {
        print!("{name:12} {label:26}");
        for &count in &counts {
            let mut results = Vec::new();
            for seed in 0..seeds {
                let set = LightSet::sample(&scene, &geometry, &LightSettings { count, seed, ..settings })?;
                results.push(compare(&points.radiance(&set, clamp), &reference));
            }
            let n = f64::from(seeds);
            let mean = results.iter().map(|r| r.0).sum::<f64>() / n;
            let error = (results.iter().map(|r| (r.0 - mean).powi(2)).sum::<f64>() / (n * (n - 1.0))).sqrt();
            let energy = results.iter().map(|r| r.1).sum::<f64>() / n;
            results.sort_by(|a, b| a.0.total_cmp(&b.0));
            let median = results.get(results.len() / 2).map_or(0.0, |r| r.0);
            print!(" | {count}: {mean:.4} ± {error:.4} ({median:.4}), {energy:.3}");
        }
        println!();
    }
    Ok(())
}
