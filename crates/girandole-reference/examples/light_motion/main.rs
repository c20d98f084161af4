//! How light samples follow a walk through a scene: the exact sum over them, every shadow traced.
//!
//! ```text
//! cargo run --release -p girandole-reference --example light_motion -- <scene> [key=value]…
//! ```
//!
//! `<scene>` is a built-in room or a file. The walk leads from the first camera to the farthest place that can be reached
//! at its height, within `reach=12` metres, at 1.4 m/s and `fps=30` frames a second. `lights=300`, `paths` and `fade` are how
//! samples follow; `frames=150` of the walk, every `every=30`th compared; `truth=4096` samples of the moment make the picture to compare with; `size=64x48`; `seed=0`.
//!
//! Prints for some frames relMSE (without the worst 0.1 %) of the samples that follow and of as many that were sampled for the moment,
//! then their means. Between any two frames, for the same view: how many samples differ, and the largest change of a pixel through
//! them, as a share of the picture's mean; at the end the largest of all.

mod way;

use girandole_core::glam::Vec3;
use girandole_core::illumination::{Illumination, IlluminationSettings, Rewalk};
use girandole_core::image::Image;
use girandole_core::lights::{Clamp, LightSet, LightSettings, Pace};
use girandole_core::scene::{Geometry, Scene, View, builtin};
use girandole_core::trace::SceneTracer;
use girandole_core::{Error, Result};
use girandole_reference::metrics::{CompareOptions, compare};
use girandole_reference::{OracleSettings, oracle};
use std::collections::BTreeMap;

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_else(|| "pillars".into());
    let options: BTreeMap<String, String> =
        arguments.filter_map(|a| a.split_once('=').map(|(k, v)| (k.to_owned(), v.to_owned()))).collect();
    let number = |key: &str, default: u32| -> Result<u32> {
        let Some(text) = options.get(key) else { return Ok(default) };
        text.parse().map_err(|_| Error::Invalid(format!("{key}={text}: give a number")))
    };
    let mut scene = if builtin::NAMES.contains(&name.as_str()) {
        builtin::build(&name, builtin::default_object(&name))?
    } else {
        Scene::load(name.as_ref())?
    };
    scene.ensure_camera();
    scene.take_changes();
    let still = scene.take_changes();
    let size = options.get("size").and_then(|s| s.split_once('x')).map_or(Ok([64, 48]), |(w, h)| {
        let parse = |n: &str| n.parse().map_err(|_| Error::Invalid("give the size as in size=64x48".into()));
        Ok::<[u32; 2], Error>([parse(w)?, parse(h)?])
    })?;
    let seed = number("seed", 0)?;
    let lights = LightSettings { count: number("lights", 300)?, seed, ..LightSettings::default() };
    let pace =
        Pace { paths: number("paths", Pace::default().paths)?, fade: number("fade", Pace::default().fade)? };
    let (frames, every) = (number("frames", 150)?, number("every", 30)?.max(1));
    let truth = LightSettings { count: number("truth", 4096)?, seed: seed + 1000, ..lights };

    let geometry = Geometry::new(&scene);
    let tracer = SceneTracer::new(&scene, &geometry);
    let start = View::new(&scene, &scene.cameras[0], size[0] as f32 / size[1] as f32);
    let views = way::walk(&tracer, &start, f64::from(number("reach", 12)?), (frames, number("fps", 30)?));
    let exact = OracleSettings { clamp: Clamp::Own, ..OracleSettings::default() };
    let picture = |set: &LightSet, view: &View| oracle(&tracer, set, view, size, &exact, &|_| ());
    let compared = CompareOptions { trim: 0.001, ..CompareOptions::default() };

    let settings =
        IlluminationSettings { lights, visibility: None, views: vec![views[0]], rewalk: Rewalk::Paths(pace) };
    let mut light = Illumination::new(&scene, &settings)?;
    println!("{:>5} {:>8} {:>8} {:>7} {:>9} {:>9}", "frame", "moved", "differ", "change", "relMSE", "fresh");
    let (mut worst, mut errors) = (0.0_f32, [0.0, 0.0]);
    let mut count = 0;
    for (frame, view) in views.iter().enumerate() {
        let before = light.lights().clone();
        light.place_for(&scene, &[*view])?;
        light.update(&scene, &still)?;
        let now = light.lights();
        let pairs = || before.samples().iter().zip(now.samples());
        let moved = pairs().filter(|(a, b)| a.position != b.position).count();
        let differ = pairs().filter(|(a, b)| a != b).count();
        let (after, then) = (picture(now, view), picture(&before, view));
        let change = largest_change(&after, &then);
        worst = worst.max(change);
        let mut line = format!("{frame:5} {moved:8} {differ:8} {change:7.4}");
        if frame as u32 % every == every - 1 {
            let reference = picture(&LightSet::sample_for(&scene, &geometry, &truth, &[*view])?, view);
            let fresh = picture(&LightSet::sample_for(&scene, &geometry, &lights, &[*view])?, view);
            let both = [&after, &fresh].map(|picture| compare(&reference, picture, &compared));
            for (sum, one) in errors.iter_mut().zip(both) {
                let error = one?.rel_mse;
                *sum += error;
                line += &format!(" {error:9.5}");
            }
            count += 1;
        }
        println!("{line}");
    }
    let [following, fresh] = errors.map(|sum| sum / f64::from(count.max(1)));
    println!(
        "largest change {worst:.4}; relMSE {following:.5}, fresh {fresh:.5}, ratio {:.3}",
        following / fresh
    );
    Ok(())
}

/// Of a pixel, as a share of the mean.
fn largest_change(a: &Image, b: &Image) -> f32 {
    let change = |(a, b): (&Vec3, &Vec3)| (*a - *b).abs().max_element();
    a.pixels.iter().zip(&b.pixels).map(change).fold(0.0, f32::max) / (a.mean().element_sum() / 3.0)
}
