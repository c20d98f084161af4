//! Figure 5-10: shadows in indirect light, with a large block and without.

use super::Figure;
use super::views::{Point, around, mean, part, points, within};
use crate::bench::{Bench, first_view, moving_object};
use crate::report::{Outcome, Picture, Plot, Table, Verdict, magnified, number};
use anyhow::{Context, Result};
use girandole::{RenderSettings, RendererOptions};
use girandole_core::glam::Vec3;
use girandole_core::image::{Image, Region, luminance};
use girandole_core::lights::LightSettings;
use girandole_core::scene::builtin;
use girandole_core::scene::{Geometry, ObjectId, Scene, View};
use girandole_core::tonemap::Exposure;
use girandole_core::trace::SceneTracer;
use girandole_reference::{PathSettings, path_trace};

pub const FIGURE: Figure = Figure {
    id: "5-10",
    title: "Shadows in indirect light",
    thesis: "By 25 direct and 275 indirect samples and five bounces the object has a contact shadow on the \
             floor, and the large grey block darkens what is behind it; without the block that is light.",
    run,
};

/// Light samples on the lamp, and all of them.
const SAMPLES: [u32; 2] = [25, 300];
/// Centimetres from the object, between which pixels of the floor are taken together.
const RINGS: [f32; 7] = [0.0, 3.0, 6.0, 12.0, 24.0, 48.0, 96.0];

/// A scene, and its picture by us and by the path tracer.
struct Shown {
    picture: Image,
    /// Black outside of the part that is drawn.
    truth: Image,
}

fn run(bench: &Bench) -> Result<Outcome> {
    let (moving, name) = bench.bunny()?;
    let whole = builtin::build("block", moving)?;
    let object = moving_object(&whole)?;
    let block = whole.objects.iter().position(|object| object.name == "block").context("no block")?;
    let without_block = without(&whole, block.into())?;
    let without_object = without(&whole, object)?;
    let size = bench.picture_size();
    let floor = Floor::of(bench, &whole, object, size)?;
    let scenes = [&whole, &without_block, &without_object];
    let [with, open, bare] = scenes.map(|scene| show(bench, scene, floor.region));
    let (with, open, bare) = (with?, open?, bare?);

    let darkened = [(&with.picture, &open.picture), (&with.truth, &open.truth)];
    let darkened = darkened.map(|(with, open)| ratio(with, open, &floor.behind));
    let contact = [(&with.picture, &bare.picture), (&with.truth, &bare.truth)]
        .map(|(with, bare)| floor.rings.iter().map(|ring| ratio(with, bare, ring)).collect::<Vec<_>>());
    let mut outcome = Outcome::default();
    let ev = Exposure::Auto.ev(&with.picture);
    for (file, caption, picture) in [
        ("with", "With the block", &with.picture),
        ("without", "Without the block", &open.picture),
        ("bare", "With the block, without the object", &bare.picture),
        ("path-tracer", "With the block, path tracer", &magnified(&with.truth, floor.region, 1)),
    ] {
        outcome.pictures.push(Picture::exposed(file, caption, picture, ev));
    }
    outcome.tables.push(table(&contact, darkened));
    outcome.plots.push(plot(&contact));
    judge(&mut outcome, name, darkened, &contact);
    outcome.settings = format!(
        "block, {name}; {} × {} pixels, {} direct and {} indirect light samples of {} that are asked for, \
         five bounces. Darkening: mean luminance of the floor that the block hides from all of the lamp, \
         over that without the block. Contact shadow: the floor by its distance from the object, of that \
         alone, over the same without the object. Both in the part of the picture about the object that \
         the path tracer draws, of pixels whose neighbours show the floor, too. Path tracer: {} paths, \
         five bounces.",
        size[0],
        size[1],
        SAMPLES[0],
        SAMPLES[1] - SAMPLES[0],
        bench.of([16, SAMPLES[1], SAMPLES[1]]),
        paths(bench),
    );
    Ok(outcome)
}

fn paths(bench: &Bench) -> u32 {
    bench.of([2, 32, 64])
}

fn without(scene: &Scene, object: ObjectId) -> Result<Scene> {
    let mut scene = scene.clone();
    scene.remove_object(object)?;
    scene.take_changes();
    Ok(scene)
}

fn show(bench: &Bench, scene: &Scene, region: Region) -> Result<Shown> {
    let lights = LightSettings {
        count: bench.of([16, SAMPLES[1], SAMPLES[1]]),
        direct_share: Some(SAMPLES[0] as f32 / SAMPLES[1] as f32),
        bounces: 5,
        ..LightSettings::default()
    };
    let mut stage = bench.stage(scene, RendererOptions::default(), &lights)?;
    let picture = stage.picture(&RenderSettings::default())?;
    let geometry = Geometry::new(scene);
    let tracer = SceneTracer::new(scene, &geometry);
    let settings = PathSettings { paths: paths(bench), bounces: Some(5), seed: 0 };
    let traced = part(&stage.view, stage.size, region);
    let traced = path_trace(&tracer, &traced, region.size, &settings, &|_| ()).mean;
    let mut truth = Image::new(picture.width, picture.height);
    region.put(&traced.pixels, &mut truth.pixels, picture.width);
    Ok(Shown { picture, truth })
}

/// Pixels of the floor.
struct Floor {
    /// The part of the picture that they are in, about the object.
    region: Region,
    /// Those that the block hides from all of the lamp, away from the object.
    behind: Vec<bool>,
    /// Those of them at some distance from the object, from near to far.
    rings: Vec<Vec<bool>>,
}

impl Floor {
    fn of(bench: &Bench, scene: &Scene, object: ObjectId, size: [u32; 2]) -> Result<Self> {
        let geometry = Geometry::new(scene);
        let tracer = SceneTracer::without(scene, &geometry, object);
        let view: View = first_view(scene, size)?;
        let points = points(&SceneTracer::new(scene, &geometry), &view, size);
        let region = around(&within(&points, object, size), size, size[0] / 6)?;
        let floor = scene.objects.iter().position(|object| object.name == "floor").context("no floor")?;
        let mut is_floor = vec![false; points.len()];
        let on_floor = within(&points, floor.into(), size);
        for row in region.rows(size[0]) {
            is_floor[row.clone()].copy_from_slice(&on_floor[row]);
        }
        let lamp = lamp(scene, &geometry, bench.of([4, 8, 8]));
        let is_dark = |p: &Point| {
            let from = tracer.offset_ray_origin(p.position, p.normal);
            lamp.iter().all(|to| tracer.occluded(from, u32::MAX, *to, u32::MAX))
        };
        let own = geometry.objects[object.index()].vertices.clone();
        let own: Vec<Vec3> = own.map(|v| geometry.positions[v as usize]).collect();
        let distance = |p: &Point| {
            let squares = own.iter().map(|vertex| vertex.distance_squared(p.position));
            squares.fold(f32::INFINITY, f32::min).sqrt() * 100.0
        };
        let dark = |i: usize| points[i].filter(|p| is_floor[i] && is_dark(p)).map(|p| distance(&p));
        let distances: Vec<Option<f32>> = (0..points.len()).map(dark).collect();
        let between = |from: f32, to: f32| -> Vec<bool> {
            distances.iter().map(|d| d.is_some_and(|d| d >= from && d < to)).collect()
        };
        let far = RINGS[RINGS.len() - 3];
        let rings = RINGS.windows(2).map(|ring| between(ring[0], ring[1])).collect();
        Ok(Self { region, behind: between(far, f32::INFINITY), rings })
    }
}

/// Points just below what emits: corners and middles of so many by so many cells.
fn lamp(scene: &Scene, geometry: &Geometry, cells: u32) -> Vec<Vec3> {
    let emits = |t: &&girandole_core::scene::Triangle| scene.materials[t.material].emits();
    let triangles = geometry.triangles.iter().filter(emits);
    let on = |t: &girandole_core::scene::Triangle| -> Vec<Vec3> {
        let [a, b, c] = t.vertices.map(|v| geometry.positions[v as usize]);
        let weights =
            (0..=cells).flat_map(|i| (0..=cells - i).map(move |j| [i, j].map(|k| k as f32 / cells as f32)));
        weights.map(|[u, v]| a + (b - a) * u + (c - a) * v - Vec3::Y * 1e-3).collect()
    };
    triangles.flat_map(on).collect()
}

/// Mean luminance of these pixels in one picture over that in another; nothing where there is no such pixel.
fn ratio(a: &Image, b: &Image, pixels: &[bool]) -> Option<f64> {
    let of = |image: &Image| mean(image, pixels).map(|mean| f64::from(luminance(mean.as_vec3())));
    Some(of(a)? / of(b)?.max(1e-9))
}

fn cell(value: Option<f64>) -> String {
    value.map_or_else(|| "no pixel".into(), |value| number(value, 3))
}

fn table(contact: &[Vec<Option<f64>>; 2], darkened: [Option<f64>; 2]) -> Table {
    let mut table = Table::new(
        "shadows",
        "Luminance of the floor where the block hides the lamp",
        &["what", "ours", "path tracer"],
    );
    let of_block = "with the block over without it".to_owned();
    table.row([of_block, cell(darkened[0]), cell(darkened[1])]);
    for (ring, (ours, truth)) in RINGS.windows(2).zip(contact[0].iter().zip(&contact[1])) {
        let what = format!("with the object over without it, {} to {} cm from it", ring[0], ring[1]);
        table.row([what, cell(*ours), cell(*truth)]);
    }
    table
}

fn plot(contact: &[Vec<Option<f64>>; 2]) -> Plot {
    let mut plot = Plot::new(
        "contact",
        "Contact shadow in indirect light",
        "distance from the object, cm",
        "luminance of the floor with it over without it",
    );
    for (name, values) in ["ours", "path tracer"].into_iter().zip(contact) {
        let middles = RINGS.windows(2).map(|ring| f64::from(ring[0] + ring[1]) * 0.5);
        let points: Vec<[f64; 2]> =
            middles.zip(values).filter_map(|(middle, value)| value.map(|value| [middle, value])).collect();
        if !points.is_empty() {
            plot.curve(name, points);
        }
    }
    plot
}

fn judge(outcome: &mut Outcome, name: &str, darkened: [Option<f64>; 2], contact: &[Vec<Option<f64>>; 2]) {
    let nearest = |of: &[Option<f64>]| of.iter().flatten().next().copied().unwrap_or(1.0);
    let farthest = |of: &[Option<f64>]| of.iter().flatten().last().copied().unwrap_or(1.0);
    let [near, far] = [nearest(&contact[0]), farthest(&contact[0])];
    let [near_truth, far_truth] = [nearest(&contact[1]), farthest(&contact[1])];
    let [block, block_truth] = darkened.map(|ratio| ratio.unwrap_or(1.0));
    outcome.seen = format!(
        "Where the block hides the lamp, the floor has {:.0} % of the light that it has without the block \
         (path tracer {:.0} %). There the {name} leaves {:.0} % of it next to it (path tracer {:.0} %), \
         {:.0} % far from it ({:.0} %).",
        block * 100.0,
        block_truth * 100.0,
        near * 100.0,
        near_truth * 100.0,
        far * 100.0,
        far_truth * 100.0,
    );
    outcome.verdict = if block < 0.7 && near < 0.8 && near < far - 0.1 {
        Verdict::Agrees
    } else {
        Verdict::Differs(format!(
            "The floor behind the block has {:.0} % of its light, next to the {name} {:.0} % and far from \
             it {:.0} %.",
            block * 100.0,
            near * 100.0,
            far * 100.0
        ))
    };
}
