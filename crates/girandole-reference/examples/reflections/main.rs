//! How well spheres from smooth to rough reflect what is around them: the sum over light samples against a path-traced picture.
//!
//! ```text
//! cargo run --release -p girandole-reference --example reflections -- [gradient|sky|room] [key=value]…
//! ```
//!
//! `lights=300,1024`, `seeds=2`, `size=320x80`, `paths=256` a pixel for the truth, `bounces=5`, `axis=2` (samples of a pixel along each
//! side: the sun's highlight on a smooth sphere is narrower than a pixel), `reflected=rays` (or `samples`, as the renderer does it), `mirrors=2`
//! (rays that follow one another from what is smooth),
//! `folder=FOLDER` for pictures and for a truth that is kept.
//!
//! Prints the energy of each sphere as a share of the truth's, and FLIP over its pixels.

#[path = "../../tests/reference/sphere_rows.rs"]
mod sphere_rows;
#[path = "../../tests/reference/spheres.rs"]
mod spheres;

use girandole_core::image::Image;
use girandole_core::lights::{Clamp, LightSet, LightSettings};
use girandole_core::scene::Geometry;
use girandole_core::tonemap::{Exposure, Tonemap, to_srgb8};
use girandole_core::trace::SceneTracer;
use girandole_core::{Error, Result};
use girandole_reference::{OracleSettings, PathSettings, Reflected, image_file, oracle, path_trace};
use spheres::{ROUGHNESS, Surroundings};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

fn main() -> Result<()> {
    let mut settings = BTreeMap::new();
    let mut places = Vec::new();
    for argument in std::env::args().skip(1) {
        match (argument.as_str(), argument.split_once('=')) {
            (_, Some((key, value))) => _ = settings.insert(key.to_owned(), value.to_owned()),
            ("gradient", _) => places.push(Surroundings::Gradient),
            ("sky", _) => places.push(Surroundings::Sky),
            ("room", _) => places.push(Surroundings::Room),
            _ => return Err(Error::Invalid(format!("`{argument}` is neither gradient, sky nor room"))),
        }
    }
    if places.is_empty() {
        places = vec![Surroundings::Gradient, Surroundings::Sky, Surroundings::Room];
    }
    let text = |key: &str, default: &str| settings.get(key).map_or(default.to_owned(), Clone::clone);
    let number = |text: &str| {
        text.parse::<u32>().map_err(|_| Error::Invalid(format!("`{text}` is not a whole number")))
    };
    let lights = text("lights", "300,1024").split(',').map(number).collect::<Result<Vec<_>>>()?;
    let [seeds, paths] = [number(&text("seeds", "2"))?, number(&text("paths", "256"))?];
    let [bounces, samples_per_axis] = [number(&text("bounces", "5"))?, number(&text("axis", "2"))?];
    let size = text("size", "320x80");
    let (width, height) =
        size.split_once('x').ok_or_else(|| Error::Invalid("size is WIDTHxHEIGHT".into()))?;
    let size = [number(width)?, number(height)?];
    let reflected = match text("reflected", "rays").as_str() {
        "rays" => Reflected::Rays,
        "samples" => Reflected::Samples,
        other => return Err(Error::Invalid(format!("`{other}` is neither rays nor samples"))),
    };
    let mirrors = number(&text("mirrors", "2"))?;
    let folder = settings.get("folder").map(Path::new);
    println!("{:34} {}", "", ROUGHNESS.map(|r| format!("{r:6.2}")).concat());
    for place in places {
        let (scene, view) = spheres::spheres(place);
        let geometry = Geometry::new(&scene);
        let tracer = SceneTracer::new(&scene, &geometry);
        let seen = sphere_rows::seen(&tracer, &view, size);
        let name = format!("{place:?}").to_lowercase();
        let kept = folder.map(|folder| folder.join(format!("{name}-truth.exr")));
        let truth = match &kept {
            Some(kept) if kept.exists() => image_file::read_exr(kept)?,
            _ => {
                path_trace(
                    &tracer,
                    &view,
                    size,
                    &PathSettings { paths, bounces: Some(bounces), seed: 7 },
                    &|_| (),
                )
                .mean
            }
        };
        if let Some(kept) = &kept {
            image_file::write_exr(kept, &truth)?;
            write_png(&kept.with_extension("png"), &truth)?;
        }
        for &count in &lights {
            let start = Instant::now();
            let mut rows = Vec::new();
            for seed in 0..seeds {
                let settings = LightSettings { count, bounces, seed, ..LightSettings::default() };
                let set = LightSet::sample_for(&scene, &geometry, &settings, &[view])?;
                let settings = OracleSettings { samples_per_axis, clamp: Clamp::Own, reflected, mirrors };
                let picture = oracle(&tracer, &set, &view, size, &settings, &|_| ());
                rows.push(sphere_rows::rows(&truth, &picture, &seen));
                if let Some(folder) = folder {
                    write_png(&folder.join(format!("{name}-{count}-{seed}.png")), &picture)?;
                }
            }
            for i in 0..2 {
                let what = if rows[0][i].is_metal { "metal" } else { "plastic" };
                let mean = |of: &dyn Fn(&sphere_rows::Row) -> f64| {
                    rows.iter().map(|rows| of(&rows[i])).sum::<f64>() / f64::from(seeds)
                };
                let line = |of: &dyn Fn(&sphere_rows::Row, usize) -> f64| {
                    (0..ROUGHNESS.len())
                        .map(|s| format!("{:6.3}", mean(&|row| of(row, s))))
                        .collect::<String>()
                };
                println!("{name:8} {count:5} {what:8} energy    {}", line(&|row, s| row.energy[s]));
                println!("{name:8} {count:5} {what:8} FLIP      {}", line(&|row, s| row.flip[s]));
            }
            println!("{:.1} s", start.elapsed().as_secs_f64());
        }
    }
    Ok(())
}

fn write_png(path: &Path, picture: &Image) -> Result<()> {
    let bytes = to_srgb8(picture, Exposure::Auto.ev(picture), Tonemap::default());
    image_file::write_png(path, picture.width, picture.height, &bytes)
}
