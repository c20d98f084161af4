//! Figure 6-2: the silhouette of an object that comes too close to a light sample, and what later methods do about it.

use super::Figure;
use super::failures::{Measured, extent, label, shown};
use super::fit::verdict;
use super::variants::{BOUNCES, Contributions, Truth, Variant, points, row, table};
use super::views::{looking, stand};
use crate::bench::{Bench, median, moving_object};
use crate::report::{Outcome, Picture, Table, magnified, number};
use anyhow::{Context, Result};
use girandole::{DebugView, RenderSettings, RendererOptions};
use girandole_core::glam::{DVec3, Vec3};
use girandole_core::illumination::Illumination;
use girandole_core::image::{Image, Region, luminance};
use girandole_core::lights::Clamp;
use girandole_core::scene::{Scene, View, builtin};
use girandole_core::tonemap::{Exposure, srgb_decode};
use girandole_core::trace::SceneTracer;

pub const FIGURE: Figure = Figure {
    id: "6-2",
    title: "A silhouette where an object comes too close to a light sample",
    thesis: "An object close to a sample on the floor casts a large silhouette on the wall, which the light from \
        around the object would hide; only thousands of samples would help.",
    run,
};

/// A silhouette is seen where it takes this share of the light.
const SEEN: f64 = 0.05;

/// Where one looks at the wall from, and near which point of the floor a sample is looked for.
const EYE: DVec3 = DVec3::new(1.7, 1.1, 0.5);
const TARGET: DVec3 = DVec3::new(4.0, 0.42, -0.1);
const DEGREES: f64 = 52.0;
const WANTED: DVec3 = DVec3::new(3.35, 0.0, 0.0);
/// Where the object waits.
const CORNER: DVec3 = DVec3::new(-3.0, 0.001, 2.6);
/// The wall's x, the object's extent, and how far from the sample towards the wall it stands, metres.
const FAR_WALL: f32 = 3.999;
const EXTENT: f64 = 0.2;
const DISTANCE: f64 = 0.24;

/// Which of the variants is ours with as many samples as the thesis's.
const OURS: usize = 5;

fn silhouette_variants(bench: &Bench) -> Vec<Variant> {
    let [few, some, many] = bench.of([[16, 32, 64], [300, 1024, 2048], [300, 1024, 4096]]);
    let thesis = Variant {
        name: "the thesis's",
        of_thesis: true,
        for_view: false,
        clamp: Clamp::Off,
        ..Variant::default()
    };
    let ours = Variant { name: "ours", ..Variant::default() };
    vec![
        Variant { count: few, ..thesis },
        Variant { count: few, clamp: Clamp::At(1.0), ..thesis },
        Variant { count: few, clamp: Clamp::Own, ..thesis },
        Variant { count: some, ..thesis },
        Variant { count: many, ..thesis },
        Variant { count: few, ..ours },
        Variant { count: some, ..ours },
        Variant { name: "ours, refined", count: few, sets: bench.of([2, 8, 64]), ..ours },
    ]
}

/// Where the sample on the floor is, in the world, that is nearest to where one is wanted; any where none lies there.
fn sample_on_floor(illumination: &Illumination) -> Result<DVec3> {
    let origin = illumination.geometry().origin;
    let places = illumination.lights().samples().iter().map(|light| light.position.as_dvec3() + origin);
    // What lies higher is farther off.
    let distance =
        |place: &DVec3| (*place - WANTED).length_squared() + if place.y < 0.05 { 0.0 } else { 100.0 };
    places.min_by(|a, b| distance(a).total_cmp(&distance(b))).context("there is no light sample")
}

/// `pillars` with the object between a sample of this variant and the wall, whose samples stay where they are; and its
/// light.
fn before_sample(mut scene: Scene, view: &View, variant: &Variant) -> Result<(Scene, Illumination)> {
    let object = moving_object(&scene)?;
    stand(&mut scene, object, EXTENT, CORNER);
    let mut illumination = variant.illumination(&scene, view)?;
    let sample = sample_on_floor(&illumination)?;
    let mut moved = scene.clone();
    stand(&mut moved, object, EXTENT, DVec3::new(sample.x + DISTANCE, 0.001, sample.z));
    let node = scene.objects[object.index()].node;
    scene.take_changes();
    scene.set_transform(node, moved.nodes[node].local)?;
    let changes = scene.take_changes();
    illumination.update(&scene, &changes)?;
    Ok((scene, illumination))
}

/// The largest share of a wall point's light that a single sample would add were the object not there, and the mean
/// over the points that any is hidden from.
fn depths(scene: &Scene, illumination: &Illumination, view: &View, clamp: Clamp) -> Result<[f64; 2]> {
    let geometry = illumination.geometry();
    let tracer = SceneTracer::new(scene, geometry);
    let empty = SceneTracer::without(scene, geometry, moving_object(scene)?);
    let points = points(&tracer, view, |position| position.x > FAR_WALL);
    let [with, without] = [&tracer, &empty]
        .map(|tracer| Contributions::new(tracer, &points, (illumination.lights().samples(), clamp)));
    let mut depths = Vec::new();
    for (with, without) in with.points.iter().zip(&without.points) {
        let light: f64 = with.iter().filter(|c| c.1).map(|c| c.0).sum();
        let hidden = with.iter().zip(without).filter(|(with, without)| without.1 && !with.1);
        let most = hidden.map(|(c, _)| c.0).fold(0.0, f64::max);
        if most > 0.0 {
            depths.push(most / (light + most));
        }
    }
    let most = depths.iter().copied().fold(0.0, f64::max);
    Ok([most, depths.iter().sum::<f64>() / depths.len().max(1) as f64])
}

/// How many times its contrast a picture is shown with.
const CONTRAST: f32 = 2.5;

/// Luminance as its distance from the median of the upper half, where the wall is, grey; so that faint silhouettes are
/// seen.
fn contrast(bench: &Bench, name: &str, caption: &str, image: &Image) -> Picture {
    let wall = &image.pixels[..image.pixels.len() / 2];
    let middle = median(wall.iter().map(|&p| f64::from(luminance(p))).collect()).max(1e-9) as f32;
    let grey = |&pixel: &Vec3| {
        let shade = (0.5 + CONTRAST * (luminance(pixel) / middle - 1.0)).clamp(0.0, 1.0);
        Vec3::splat(srgb_decode(shade))
    };
    let grey = Image { pixels: image.pixels.iter().map(grey).collect(), ..*image };
    let whole = Region::whole([image.width, image.height]);
    let caption = format!("{caption}: {CONTRAST} times the contrast");
    Picture::of_colors(&format!("{name}-contrast"), &caption, &magnified(&grey, whole, bench.of([1, 2, 2])))
}

/// A scene with its truth, and how it is shown.
struct Subject<'a> {
    bench: &'a Bench,
    scene: Scene,
    shown: (View, [u32; 2]),
    truth: Truth,
    ev: f32,
}

impl Subject<'_> {
    /// Adds a variant's picture and row, and with `has_dots` the picture with its samples.
    fn add(
        &self,
        outcome: &mut Outcome,
        errors: &mut Table,
        (name, label): (&str, &str),
        (variant, illumination): (Variant, Illumination),
        has_dots: bool,
    ) -> Result<Measured> {
        let Self { bench, scene, shown: (view, size), truth, ev } = self;
        let own = depths(scene, &illumination, view, variant.clamp)?;
        let mut stage = bench.stage_with(scene, RendererOptions::default(), illumination, (*view, *size))?;
        if has_dots {
            let debug = Some(DebugView::LightPositions);
            let dots = stage.picture(&RenderSettings { debug, ..variant.settings() })?;
            let caption = format!("{label}: its samples");
            outcome.pictures.push(shown(bench, &format!("{name}-samples"), &caption, &dots, *ev));
        }
        let image = variant.picture(bench, scene, &mut stage)?;
        let (error, lights) = (truth.error(&image)?, stage.lights());
        outcome.pictures.push(shown(bench, name, label, &image, *ev));
        if has_dots {
            outcome.pictures.push(contrast(bench, name, label, &image));
        }
        row(errors, label, lights, &own.map(|share| number(100.0 * share, 1)), &error);
        Ok(Measured { variant, lights, error, own: [own[0], own[1], 0.0] })
    }

    fn show_truth(&self, outcome: &mut Outcome, name: &str, caption: &str) {
        outcome.pictures.push(shown(self.bench, name, caption, &self.truth.image, self.ev));
        outcome.pictures.push(contrast(self.bench, name, caption, &self.truth.image));
    }
}

fn run(bench: &Bench) -> Result<Outcome> {
    let (object, name) = bench.bunny()?;
    let room = builtin::build("pillars", object)?;
    let (size, paths) = (extent(bench), bench.of([4, 128, 192]));
    let view = looking(EYE, TARGET, DEGREES, size)?;
    let mut outcome = Outcome::default();
    let mut errors = table(&["silhouette, largest %", "silhouette, mean %"]);
    let variants = silhouette_variants(bench);
    let subject = |variant: &Variant| -> Result<(Subject, Illumination)> {
        let (scene, light) = before_sample(room.clone(), &view, variant)?;
        let truth = Truth::new(&scene, (view, size), paths);
        let ev = Exposure::Auto.ev(&truth.image);
        Ok((Subject { bench, scene, shown: (view, size), truth, ev }, light))
    };
    let (by_thesis, _) = subject(&variants[0])?;
    let mut all = Vec::new();
    for (i, &variant) in variants.iter().enumerate() {
        let light = variant.illumination(&by_thesis.scene, &view)?;
        let label = format!("{}{}", label(&variant), near(&variant));
        let names = (format!("{i}"), label);
        let names = (names.0.as_str(), names.1.as_str());
        all.push(by_thesis.add(&mut outcome, &mut errors, names, (variant, light), i == 0 || i == OURS)?);
    }
    by_thesis.show_truth(&mut outcome, "truth", &format!("Path tracer, {paths} paths"));
    let ours = Variant { count: variants[0].count, ..Variant::default() };
    let (by_ours, light) = subject(&ours)?;
    let label = "ours, the object before one of its own samples";
    all.push(by_ours.add(&mut outcome, &mut errors, ("own", label), (ours, light), true)?);
    by_ours.show_truth(&mut outcome, "own-truth", &format!("Path tracer, {paths} paths, the object there"));
    outcome.tables.push(errors);
    tell_silhouettes(&mut outcome, &all, by_thesis.truth.noise);
    outcome.settings = format!(
        "pillars with the {name}, {EXTENT} m, {DISTANCE} m from a sample on the floor towards the wall; {} × {} \
         pixels, {BOUNCES} bounces, seed 0, mode VD; the thesis's samples: one candidate each, 1 in 12 on the light, \
         no view. relMSE without the worst 0.1 % of pixels. Truth: {paths} paths a pixel. A silhouette's share: of the \
         light of a point of the wall were the object not there, what comes from the one sample that it hides.",
        size[0], size[1]
    );
    Ok(outcome)
}

/// What a variant does close to samples, in words.
fn near(variant: &Variant) -> String {
    match variant.clamp {
        Clamp::Own if !variant.of_thesis => String::new(),
        Clamp::Own => ", means close to samples".into(),
        Clamp::At(bound) => format!(", at most {bound} m⁻²"),
        Clamp::Off => ", no bound".into(),
    }
}

/// What is seen, and the verdict.
fn tell_silhouettes(outcome: &mut Outcome, all: &[Measured], noise: f64) {
    let percent = |share: f64| number(100.0 * share, 1);
    let sentence = |m: &Measured| {
        format!(
            "{}{}: a silhouette takes up to {} % of the wall's light, relMSE {}, FLIP {}.",
            label(&m.variant),
            near(&m.variant),
            percent(m.own[0]),
            number(m.error.rel_mse, 4),
            number(m.error.flip, 3)
        )
    };
    let seen: Vec<String> = all.iter().map(sentence).collect();
    outcome.seen = format!(
        "{} The last is with the object before one of our own samples. The truth's own noise is relMSE {}, which was \
         taken off, and is part of FLIP.",
        seen.join(" "),
        number(noise, 5)
    );
    let few = &all[0];
    let most = all.iter().rfind(|m| m.variant.of_thesis).unwrap_or(few);
    outcome.verdict = verdict([
        (
            few.own[0] > SEEN,
            format!("The silhouette takes only {} % of the wall's light.", percent(few.own[0])),
        ),
        (
            most.own[0] < 0.5 * few.own[0] && most.error.rel_mse < few.error.rel_mse,
            format!(
                "With {} samples it takes {} % and relMSE is {}, against {} % and {} with {}.",
                most.lights,
                percent(most.own[0]),
                number(most.error.rel_mse, 4),
                percent(few.own[0]),
                number(few.error.rel_mse, 4),
                few.lights
            ),
        ),
    ]);
}
