//! How light samples follow a walk through a scene: the exact sum over them, every shadow traced.
//!
//! ```text
//! cargo run --release -p girandole-reference --example light_motion -- <scene> [key=value]…
//! ```
//!
//! `<scene>` is a built-in room or a file. The walk leads from the first camera to the farthest place that can be reached
//! at its height, within `reach=12` metres, at 1.4 m/s and `fps=30` frames a second. `lights=300`, `paths` and `fade` are how
//! samples follow; `frames=150` of the walk, every `every=30`th compared; `truth=4096` samples of the moment make the picture to compare
//! with, and the mean error of `fresh=3` sets sampled for the moment is what that of the samples that follow is compared to; `size=64x48`;
//! `seed=0`. With `known=1` samples are placed for the views to come, too, where else these are guessed (as in a window).
//!
//! Prints for some frames relMSE (without the worst 0.1 %) of the samples that follow and of those sampled for the moment, then their
//! means, the ratio of these, and the geometric mean of ratios (which single bright pixels do not decide). Between any two frames, for
//! the same view: how many samples are lit, are elsewhere, and differ, and the largest change of a pixel through those, as a share of the
//! picture's mean (of a picture half as large); at the end the largest of all, and in how many frames it is above 5 %.

mod way;

use girandole_core::glam::Vec3;
use girandole_core::illumination::{Illumination, IlluminationSettings, Rewalk};
use girandole_core::image::Image;
use girandole_core::lights::{Clamp, LightSample, LightSet, LightSettings, Pace};
use girandole_core::scene::{Geometry, Scene, View, builtin};
use girandole_core::trace::SceneTracer;
use girandole_core::{Error, Result};
use girandole_reference::metrics::{CompareOptions, compare};
use girandole_reference::{OracleSettings, oracle};
use std::collections::BTreeMap;

/// Change of a pixel through samples that come and go, as a share of the picture's mean, up to which nothing pops.
const VISIBLE: f32 = 0.05;
/// Views to come that samples are placed for, and frames between them.
const STEPS: usize = 6;
const STEP: usize = 10;

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

    let is_known = number("known", 0)? != 0;
    let to_come = |frame: usize| -> Vec<View> {
        let at = |step: usize| views[(frame + step * STEP).min(views.len() - 1)];
        if is_known { (1..=STEPS).map(at).collect() } else { Vec::new() }
    };
    let opened = std::iter::once(views[0]).chain(to_come(0)).collect();
    let settings =
        IlluminationSettings { lights, visibility: None, views: opened, rewalk: Rewalk::Paths(pace) };
    let mut light = Illumination::new(&scene, &settings)?;
    println!(
        "{:>5} {:>4} {:>8} {:>8} {:>7} {:>9} {:>9}",
        "frame", "lit", "moved", "differ", "change", "relMSE", "fresh"
    );
    let (mut worst, mut errors) = (0.0_f32, [0.0, 0.0]);
    let (mut count, mut above, mut logs) = (0, 0, 0.0);
    let fresh_sets = number("fresh", 3)?.max(1);
    for (frame, view) in views.iter().enumerate() {
        let before = light.lights().clone();
        light.place_on_way(&scene, &[*view], &to_come(frame))?;
        light.update(&scene, &still)?;
        let now = light.lights();
        let pairs = || before.samples().iter().zip(now.samples());
        let moved = pairs().filter(|(a, b)| a.position != b.position).count();
        let differ: Vec<_> = pairs().filter(|(a, b)| a != b).collect();
        let light_of = |samples: Vec<LightSample>| picture(&LightSet::from_samples(&geometry, samples), view);
        let (then, after): (Vec<_>, Vec<_>) = differ.iter().map(|(a, b)| (**a, **b)).unzip();
        let is_compared = frame as u32 % every == every - 1;
        let mean = mean_of(&oracle(&tracer, now, view, size.map(|n| n / 2), &exact, &|_| ()));
        let (then, after) = (light_of(then), light_of(after));
        let change = largest_change(&after, &then) / mean;
        worst = worst.max(change);
        above += u32::from(change > VISIBLE);
        let lit = now.samples().iter().filter(|s| s.intensity != Vec3::ZERO).count();
        let mut line = format!("{frame:5} {lit:4} {moved:8} {:8} {change:7.4}", differ.len());
        if is_compared {
            let reference = picture(&LightSet::sample_for(&scene, &geometry, &truth, &[*view])?, view);
            let error =
                |picture: &Image| -> Result<f64> { Ok(compare(&reference, picture, &compared)?.rel_mse) };
            let following = error(&picture(now, view))?;
            let mut sampled = 0.0;
            for other in 0..fresh_sets {
                let lights = LightSettings { seed: lights.seed + 100 * other, ..lights };
                sampled +=
                    error(&picture(&LightSet::sample_for(&scene, &geometry, &lights, &[*view])?, view))?;
            }
            sampled /= f64::from(fresh_sets);
            let mut ratio = 0.0;
            for (sum, error) in errors.iter_mut().zip([following, sampled]) {
                *sum += error;
                ratio = error.ln() - ratio;
                line += &format!(" {error:9.5}");
            }
            logs += ratio;
            count += 1;
        }
        println!("{line}");
    }
    let [following, fresh] = errors.map(|sum| sum / f64::from(count.max(1)));
    println!(
        "largest change {worst:.4}, above {VISIBLE} in {above} frames; relMSE {following:.5}, fresh {fresh:.5}, ratio {:.3}, in the \
         geometric mean {:.3}",
        following / fresh,
        (-logs / f64::from(count.max(1))).exp()
    );
    Ok(())
}

/// Of a pixel, in its brightest channel.
fn largest_change(a: &Image, b: &Image) -> f32 {
    let change = |(a, b): (&Vec3, &Vec3)| (*a - *b).abs().max_element();
    a.pixels.iter().zip(&b.pixels).map(change).fold(0.0, f32::max)
}

fn mean_of(image: &Image) -> f32 {
    image.mean().element_sum() / 3.0
}
