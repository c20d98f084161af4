//! How good N light samples are: the exact sum over them, every shadow traced, against a path-traced picture.
//!
//! ```text
//! cargo run --release -p girandole-reference --example light_quality -- <scene> [key=value]…
//! ```
//!
//! `<scene>` is a built-in room, `hall` (four hundred small lamps), `window` or `flats` (a room lit through a window alone, by itself or
//! in a building, by `environment=sky`, `sun` or `gradient`) or a file. `what` is `placement` (default), `clamp`, `share`, `candidates` or `termination`:
//! what the rows of the table differ in. `lights=300,1024`, `seeds=3`, `bounces=4`, `size=256x192`; `reference=PICTURE.exr`
//! and `mask=MASK.exr` (as `girandole compare` takes them) of that size with light of the same bounces; without, one is
//! traced with `paths=256` a pixel.
//!
//! Prints relMSE (without the worst 0.1 %, with its standard error over seeds), the energy as a share of the reference's,
//! FLIP, relMSE within a hand's breadth of something else (corners, feet, contacts), how many samples are direct, and milliseconds for
//! sampling.
//!
//! `what=expectation` instead asks whether samples placed for the view bring the light of those placed for none in the mean
//! over many seeds, with a bound of 1 m⁻² for both: mean energy of small pictures (`size=24x18`) with its standard error,
//! then the largest deviation among all and twelve blocks of the picture, in standard errors. A control leaves out
//! the weights.

mod hall;
mod window;

use girandole_core::glam::{Vec2, Vec3};
use girandole_core::image::Image;
use girandole_core::lights::{Clamp, LightSample, LightSet, LightSettings, Termination};
use girandole_core::scene::{Environment, Geometry, NONE, Scene, Sky, View, builtin};
use girandole_core::trace::SceneTracer;
use girandole_core::visibility::{VisibilityDatabase, VisibilitySettings};
use girandole_core::{Error, Result};
use girandole_reference::metrics::{CompareOptions, compare};
use girandole_reference::{
    OracleSettings, PathSettings, image_file, oracle, oracle_with_states, path_trace_through,
};
use std::collections::BTreeMap;
use std::path::Path;
use std::str::FromStr;
use std::time::Instant;

/// A row of the table.
struct Row {
    label: String,
    settings: LightSettings,
    clamp: Clamp,
    for_view: bool,
}

fn rows(what: &str, usual: LightSettings) -> Result<Vec<Row>> {
    let row = |label: String, settings| Row { label, settings, clamp: Clamp::Own, for_view: true };
    let share = |s: f32| LightSettings { direct_share: Some(s), ..usual };
    Ok(match what {
        "placement" => vec![
            row("view".into(), usual),
            Row { for_view: false, ..row("scene".into(), usual) },
            Row { for_view: false, ..row("scene, a quarter direct".into(), share(0.25)) },
        ],
        "clamp" => [Clamp::Own, Clamp::Off, Clamp::At(4.0), Clamp::At(1.0), Clamp::At(0.25)]
            .map(|clamp| Row { clamp, ..row(format!("{clamp:?}"), usual) })
            .into(),
        "share" => std::iter::once(row("auto".into(), usual))
            .chain([0.05, 0.1, 0.2, 0.25, 0.4, 0.6].map(|s| row(format!("direct share {s}"), share(s))))
            .collect(),
        "candidates" => [1, 4, 16, 64]
            .map(|c| row(format!("{c} candidates"), LightSettings { candidates: c, ..usual }))
            .into(),
        "termination" => [Termination::Throughput, Termination::Albedo]
            .map(|t| row(format!("{t:?}"), LightSettings { termination: t, ..usual }))
            .into(),
        _ => {
            return Err(Error::Invalid(
                "what is one of placement, clamp, share, candidates and termination".into(),
            ));
        }
    })
}

/// The value of a key, as text or parsed.
struct Options(BTreeMap<String, String>);

impl Options {
    fn text<'a>(&'a self, key: &str, default: &'a str) -> &'a str {
        self.0.get(key).map_or(default, String::as_str)
    }

    fn numbers<T: FromStr>(&self, key: &str, default: &str, separator: char) -> Result<Vec<T>> {
        let parse = |n: &str| n.parse().map_err(|_| Error::Invalid(format!("{key}={n}: give a number")));
        self.text(key, default).split(separator).map(parse).collect()
    }

    fn number<T: FromStr + Copy>(&self, key: &str, default: &str) -> Result<T> {
        Ok(self.numbers(key, default, ',')?[0])
    }
}

/// Which pixels show an emitter, the background, or an edge: something else at a corner than in the middle.
fn mask(tracer: &SceneTracer, view: &View, size: [u32; 2]) -> Image {
    let geometry = tracer.geometry();
    let view = view.relative_to(geometry.origin);
    let seen = |at: Vec2| {
        let (origin, direction) = view.pixel_ray(at, size);
        let hit = tracer.closest_visible(origin, direction)?;
        let surface = geometry.surface(tracer.scene(), hit.triangle, hit.barycentric, -direction.normalize());
        Some((surface, geometry.triangles[hit.triangle as usize].material))
    };
    let mut mask = Image::new(size[0], size[1]);
    for (index, pixel) in (0..).zip(&mut mask.pixels) {
        let middle = Vec2::new((index % size[0]) as f32 + 0.5, (index / size[0]) as f32 + 0.5);
        let Some((surface, material)) = seen(middle) else {
            pixel.y = 1.0;
            continue;
        };
        let continues = |corner: &[f32; 2]| {
            seen(middle + Vec2::from_array(*corner) * 0.5).is_some_and(|(other, m)| {
                let apart = (other.position - surface.position).dot(surface.geometric_normal).abs();
                m == material
                    && other.geometric_normal.dot(surface.geometric_normal) > 0.9
                    && apart < 0.5 * other.position.distance(surface.position) + 1e-4
            })
        };
        let corners = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]];
        pixel.x = f32::from(surface.emission.max_element() > 0.0);
        pixel.z = f32::from(!corners.iter().all(continues));
    }
    mask
}

/// A hand's breadth, m.
const HAND: f32 = 0.1;

/// A mask that leaves out what has nothing before it within a hand's breadth, besides what another one leaves out.
fn corners(tracer: &SceneTracer, view: &View, mask: &Image) -> Image {
    const DIRECTIONS: u32 = 64;
    let view = view.relative_to(tracer.geometry().origin);
    let size = [mask.width, mask.height];
    let is_close = |index: u32| {
        let middle = Vec2::new((index % size[0]) as f32 + 0.5, (index / size[0]) as f32 + 0.5);
        let (origin, direction) = view.pixel_ray(middle, size);
        let Some(hit) = tracer.closest_visible(origin, direction) else { return false };
        let wo = -direction.normalize();
        let surface = tracer.geometry().surface(tracer.scene(), hit.triangle, hit.barycentric, wo);
        let normal = surface.geometric_normal;
        let across = normal.any_orthonormal_vector();
        let start = tracer.offset_ray_origin(surface.position, normal);
        (0..DIRECTIONS).any(|i| {
            let height = (i as f32 + 0.5) / DIRECTIONS as f32;
            let golden = std::f32::consts::PI * (3.0 - 5f32.sqrt());
            let (sin, cos) = (i as f32 * golden).sin_cos();
            let flat = (1.0 - height * height).sqrt();
            let towards = normal * height + (across * cos + normal.cross(across) * sin) * flat;
            tracer.occluded(start, hit.triangle, start + towards * HAND, NONE)
        })
    };
    let pixels = (0..)
        .zip(&mask.pixels)
        .map(|(index, &pixel)| if is_close(index) { pixel } else { Vec3::new(pixel.x, 1.0, pixel.z) });
    Image { pixels: pixels.collect(), ..*mask }
}

const BLOCKS: [u32; 2] = [4, 3];

/// Energy of a picture as a whole, then of each block.
fn energies(picture: &Image) -> Vec<f64> {
    let mut sums = vec![0.0; 1 + (BLOCKS[0] * BLOCKS[1]) as usize];
    for (index, pixel) in (0..).zip(&picture.pixels) {
        let column = (index % picture.width) * BLOCKS[0] / picture.width;
        let row = (index / picture.width) * BLOCKS[1] / picture.height;
        let energy = f64::from(girandole_core::image::luminance(*pixel));
        sums[0] += energy;
        sums[1 + (row * BLOCKS[0] + column) as usize] += energy;
    }
    sums
}

/// Means of energies over seeds, and the variances of these means.
fn over_seeds(
    seeds: std::ops::Range<u32>,
    energies: impl Fn(u32) -> Result<Vec<f64>>,
) -> Result<[Vec<f64>; 2]> {
    let n = f64::from(seeds.end - seeds.start);
    let all: Vec<Vec<f64>> = seeds.map(energies).collect::<Result<_>>()?;
    let mean = |at: usize| all.iter().map(|e| e[at]).sum::<f64>() / n;
    let means: Vec<f64> = (0..all[0].len()).map(mean).collect();
    let variance = |at: usize| all.iter().map(|e| (e[at] - means[at]).powi(2)).sum::<f64>() / (n * (n - 1.0));
    let variances = (0..means.len()).map(variance).collect();
    Ok([means, variances])
}

/// The table of `what=expectation`.
fn expectation(
    tracer: &SceneTracer,
    view: &View,
    size: [u32; 2],
    usual: LightSettings,
    seeds: u32,
) -> Result<()> {
    let (scene, geometry) = (tracer.scene(), tracer.geometry());
    let bounded = OracleSettings { clamp: Clamp::At(1.0), ..OracleSettings::default() };
    let of = |views: &[View], first: u32, weighted: bool| {
        over_seeds(first..first + seeds, |seed| {
            let set = LightSet::sample_for(scene, geometry, &LightSettings { seed, ..usual }, views)?;
            // The control: all samples as strong as their mean.
            let total: f32 = set.samples().iter().map(|s| s.intensity.max_element()).sum();
            let even = |s: &LightSample| {
                let scale = total / set.len() as f32 / s.intensity.max_element();
                LightSample { intensity: s.intensity * if weighted { 1.0 } else { scale }, ..*s }
            };
            let set = LightSet::from_samples(geometry, set.samples().iter().map(even).collect());
            Ok(energies(&oracle(tracer, &set, view, size, &bounded, &|_| ())))
        })
    };
    let view = std::slice::from_ref(view);
    let [expected, spread] = of(&[], 0, true)?;
    println!("{:24} {:8.4} ± {:.4} %", "scene", expected[0], 100.0 * spread[0].sqrt() / expected[0]);
    for (label, weighted) in [("view", true), ("view without weights", false)] {
        let [means, variances] = of(view, 1 << 20, weighted)?;
        let score = |at: usize| (means[at] - expected[at]).abs() / (variances[at] + spread[at]).sqrt();
        let worst = (1..means.len()).map(score).fold(0.0, f64::max);
        let error = 100.0 * variances[0].sqrt() / expected[0];
        println!("{label:24} {:8.4} ± {error:.4} %  whole {:.2}, worst block {worst:.2}", means[0], score(0));
    }
    Ok(())
}

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_else(|| "table".into());
    let pairs = arguments.filter_map(|a| a.split_once('=').map(|(k, v)| (k.to_owned(), v.to_owned())));
    let options = Options(pairs.collect());
    let is_lit_through_window = ["window", "flats"].contains(&name.as_str());
    let mut scene = if builtin::NAMES.contains(&name.as_str()) {
        builtin::build(&name, builtin::default_object(&name))?
    } else if name == "hall" {
        hall::hall()
    } else if is_lit_through_window {
        let environment = match options.text("environment", "sky") {
            "sky" => window::sky(),
            // The sun stands before the window.
            "sun" => Environment::sky(&Sky { azimuth: 4.4, elevation: 0.6, ..Sky::default() })?,
            "gradient" => window::gradient(),
            other => return Err(Error::Invalid(format!("`{other}` is neither sky, sun nor gradient"))),
        };
        window::room(name == "flats", environment)
    } else {
        Scene::load(name.as_ref())?
    };
    scene.ensure_camera();
    let geometry = Geometry::new(&scene);
    let tracer = SceneTracer::new(&scene, &geometry);
    let &[width, height] = options.numbers("size", "256x192", 'x')?.as_slice() else {
        return Err(Error::Invalid("give the size as in size=256x192".into()));
    };
    let size: [u32; 2] = [width, height];
    let view = View::new(&scene, &scene.cameras[0], width as f32 / height as f32);
    let bounces = options.number("bounces", "4")?;
    if options.text("what", "placement") == "expectation" {
        let size = match options.numbers("size", "24x18", 'x')?.as_slice() {
            &[width, height] => [width, height],
            _ => size,
        };
        let usual = LightSettings { bounces, count: options.number("lights", "300")?, ..Default::default() };
        return expectation(&tracer, &view, size, usual, options.number("seeds", "400")?);
    }
    let read = |key: &str| options.0.get(key).map(|path| image_file::read(Path::new(path))).transpose();
    let reference = match read("reference")? {
        Some(picture) => picture,
        None => {
            let paths = options.number("paths", "256")?;
            let settings = PathSettings { paths, bounces: Some(bounces), ..PathSettings::default() };
            let opening = is_lit_through_window.then(|| window::opening(&geometry));
            path_trace_through(opening.as_slice(), &tracer, &view, size, &settings, &|_| ()).mean
        }
    };
    let mask = read("mask")?.unwrap_or_else(|| mask(&tracer, &view, size));
    let options_of = |mask| CompareOptions { mask: Some(mask), keep_edges: false, trim: 0.001 };
    let in_corners = options_of(corners(&tracer, &view, &mask));
    let compared = options_of(mask);
    let (seeds, counts) = (options.number::<u32>("seeds", "3")?, options.numbers("lights", "300,1024", ',')?);
    println!(
        "{:24} {:>6} {:>17} {:>7} {:>6} {:>7} {:>6} {:>5}",
        name, "lights", "relMSE", "energy", "FLIP", "corners", "direct", "ms"
    );
    for row in rows(options.text("what", "placement"), LightSettings { bounces, ..Default::default() })? {
        for &count in &counts {
            let (mut errors, mut energy, mut flip, mut corner) = (Vec::new(), 0.0, 0.0, 0.0);
            let (mut direct, mut ms) = (0, 0.0);
            for seed in 0..seeds {
                let settings = LightSettings { count, seed, ..row.settings };
                let start = Instant::now();
                let views = if row.for_view { std::slice::from_ref(&view) } else { &[] };
                let set = LightSet::sample_for(&scene, &geometry, &settings, views)?;
                ms += start.elapsed().as_secs_f64() * 1e3;
                let database =
                    VisibilityDatabase::build(&scene, &geometry, &set, &VisibilitySettings::default())?;
                let exact = OracleSettings { clamp: row.clamp, ..OracleSettings::default() };
                let picture = oracle_with_states(&tracer, &set, &database, &view, size, &exact, &|_| ());
                let c = compare(&reference, &picture, &compared)?;
                errors.push(c.rel_mse);
                energy += c.energy_ratio;
                flip += c.flip;
                corner += compare(&reference, &picture, &in_corners)?.rel_mse;
                direct += set.direct;
            }
            let n = f64::from(seeds);
            let mean = errors.iter().sum::<f64>() / n;
            let variance = errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (n * (n - 1.0).max(1.0));
            println!(
                "{:24} {count:6} {mean:8.5} ±{:.5} {:7.4} {:6.4} {:7.5} {:6} {:5.0}",
                row.label,
                variance.sqrt(),
                energy / n,
                flip / n,
                corner / n,
                direct / seeds,
                ms / n,
            );
        }
    }
    Ok(())
}
