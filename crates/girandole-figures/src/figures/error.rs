//! Error against time, from scratch: light samples in two modes, our path tracer, and Mitsuba's.

use super::Figure;
use super::mitsuba;
use super::subjects::{BOUNCES, Subject};
use crate::bench::Bench;
use crate::report::{Outcome, Picture, Plot, Table, Verdict, number};
use anyhow::{Context, Result};
use girandole::{Mode, RenderSettings, RendererOptions};
use girandole_core::illumination::{Illumination, IlluminationSettings, Rewalk};
use girandole_core::image::Image;
use girandole_core::lights::LightSettings;
use girandole_core::scene::Geometry;
use girandole_core::tonemap::Exposure;
use girandole_core::trace::SceneTracer;
use girandole_core::visibility::VisibilitySettings;
use girandole_reference::metrics::Comparison;
use girandole_reference::{PathSettings, ProgressivePathTracer};
use std::time::Instant;

pub const FIGURE: Figure = Figure {
    id: "error",
    title: "Error against time",
    thesis: "How long does a picture of an error take, from scratch: by light samples with and without the thesis's \
        optimisations, and by path tracing?",
    run,
};

/// One number of a comparison.
type Metric = fn(&Comparison) -> f64;

/// A picture: what it took and how far off it is.
struct Point {
    /// Light samples, or paths a pixel.
    count: u32,
    /// From the scene to the picture.
    seconds: f64,
    /// Of the frame alone, where there is more.
    frame: Option<f64>,
    error: Comparison,
}

/// Pictures by one method.
struct Series {
    name: String,
    points: Vec<Point>,
}

fn run(bench: &Bench) -> Result<Outcome> {
    let subjects = Subject::all(bench)?;
    let mut outcome = Outcome { verdict: Verdict::Shown, ..Outcome::default() };
    let mut seen = Vec::new();
    let version = mitsuba::version();
    for subject in &subjects {
        let mut all = vec![
            samples(bench, subject, ("naive", Mode::Naive))?,
            samples(bench, subject, ("full", Mode::Full))?,
            paths(bench, subject)?,
        ];
        if let Some(version) = version.as_ref().filter(|_| !subject.is_real) {
            all.push(by_mitsuba(bench, subject, version)?);
        }
        seen.push(tell(&mut outcome, subject, &all));
    }
    if version.is_none() {
        seen.push("Mitsuba was not run: python3 cannot import it.".into());
    }
    if subjects.iter().any(|subject| subject.is_real) {
        seen.push(
            "Rooms that people made have materials that are not translated for Mitsuba; it made their truth."
                .into(),
        );
    }
    outcome.seen = seen.join(" ");
    outcome.settings = settings(&subjects);
    Ok(outcome)
}

fn settings(subjects: &[Subject]) -> String {
    let truths = subjects.iter().map(|subject| {
        let [width, height] = subject.size;
        format!("{} in {width} × {height} pixels, truth by {}", subject.name, subject.made)
    });
    let truths: Vec<String> = truths.collect();
    format!(
        "{}. {BOUNCES} bounces. Light samples: seed 0, placed for the view, from the loaded scene by sampling, \
         visibility (full alone) and shadow maps to the picture, one run after one that is not counted; the frame \
         alone is a median of three; maps of 512 texels up to 64 lights, of 256 above, less where 256 MiB do not hold \
         them. Paths: one a pixel after the other, the hierarchy's build included. Mitsuba: rendering alone, without \
         loading and building. relMSE without the worst 0.1 % of pixels.",
        truths.join("; ")
    )
}

/// By more and more light samples.
fn samples(bench: &Bench, subject: &Subject, (name, mode): (&str, Mode)) -> Result<Series> {
    let all = bench.of([&[4, 16][..], &[16, 64, 256, 1024], &[16, 32, 64, 128, 256, 512, 1024, 2048, 4096]]);
    let counts = if subject.is_real { &[64, 256, 1024] } else { all };
    let settings = RenderSettings { mode, ..RenderSettings::default() };
    let illumination = |count| -> Result<Illumination> {
        let light = IlluminationSettings {
            lights: LightSettings { count, bounces: BOUNCES, ..LightSettings::default() },
            visibility: (mode != Mode::Naive).then(VisibilitySettings::default),
            views: vec![subject.view],
            rewalk: Rewalk::Off,
        };
        Ok(Illumination::new(&subject.scene, &light)?)
    };
    let shown = (subject.view, subject.size);
    let open = |light| bench.stage_with(&subject.scene, RendererOptions::default(), light, shown);
    let mut points = Vec::new();
    // Kernels are compiled.
    open(illumination(counts[0])?)?.frame(&settings)?;
    for &count in counts {
        let start = Instant::now();
        let mut stage = open(illumination(count)?)?;
        stage.frame(&settings)?;
        let seconds = start.elapsed().as_secs_f64();
        let frame = stage.times(&[settings], 3)?.first().copied().context("no frame was timed")? / 1e3;
        let error = subject.error(&stage.picture(&settings)?)?;
        points.push(Point { count: stage.lights() as u32, seconds, frame: Some(frame), error });
    }
    Ok(Series { name: name.into(), points })
}

/// By more and more paths a pixel.
fn paths(bench: &Bench, subject: &Subject) -> Result<Series> {
    let most: u32 = bench.of([2, 64, if subject.is_real { 32 } else { 256 }]);
    let start = Instant::now();
    let geometry = Geometry::new(&subject.scene);
    let tracer = SceneTracer::new(&subject.scene, &geometry);
    let settings = PathSettings { bounces: Some(BOUNCES), ..PathSettings::default() };
    let mut tracing = ProgressivePathTracer::new(&subject.view, subject.size, &settings);
    let mut seconds = start.elapsed().as_secs_f64();
    let mut points = Vec::new();
    while tracing.paths() < most {
        let start = Instant::now();
        tracing.step(&tracer, subject.size[1]);
        seconds += start.elapsed().as_secs_f64();
        let count = tracing.paths();
        if count.is_power_of_two() {
            let error = subject.error(&tracing.estimate().mean)?;
            points.push(Point { count, seconds, frame: None, error });
        }
    }
    Ok(Series { name: "our path tracer".into(), points })
}

fn by_mitsuba(bench: &Bench, subject: &Subject, version: &str) -> Result<Series> {
    let counts = bench.of([&[1, 2][..], &[1, 4, 16], &[1, 4, 16, 64]]);
    let Subject { scene, view, size, .. } = subject;
    let rendered = mitsuba::render(version, scene, (view, *size), BOUNCES + 2, counts)?;
    let point = |(count, seconds, image): (u32, f64, Image)| {
        Ok(Point { count, seconds, frame: None, error: subject.error(&image)? })
    };
    let points: Result<Vec<Point>> = rendered.pictures.into_iter().map(point).collect();
    Ok(Series { name: rendered.name, points: points? })
}

/// Adds a scene's plots, table and truth; and what is seen there.
fn tell(outcome: &mut Outcome, subject: &Subject, all: &[Series]) -> String {
    let name = &subject.name;
    let columns =
        ["method", "samples or paths", "relMSE", "FLIP", "energy", "from scratch s", "frame alone s"];
    let mut table = Table::new(&format!("{name}-errors"), &format!("{name}: errors and times"), &columns);
    for Series { name, points } in all {
        for Point { count, seconds, frame, error } in points {
            let frame = frame.map_or_else(|| "–".into(), |frame| number(frame, 4));
            let [a, b, c] = [error.rel_mse, error.flip, error.energy_ratio].map(|value| number(value, 5));
            table.row([name.clone(), count.to_string(), a, b, c, number(*seconds, 4), frame]);
        }
    }
    outcome.tables.push(table);
    let metrics: [(&str, &str, Metric); 2] =
        [("relMSE", "relmse", |error| error.rel_mse), ("FLIP", "flip", |error| error.flip)];
    for (metric, file, value) in metrics {
        let title = format!("{name}: {metric}");
        let mut plot = Plot::logarithmic(&format!("{name}-{file}"), &title, "seconds", metric);
        for Series { name, points } in all {
            let curve = |time: fn(&Point) -> Option<f64>| -> Vec<[f64; 2]> {
                points.iter().filter_map(|p| Some([time(p)?.max(1e-6), value(&p.error).max(1e-9)])).collect()
            };
            plot.curve(name, curve(|point| Some(point.seconds)));
            let frames = curve(|point| point.frame);
            if !frames.is_empty() {
                plot.curve(&format!("{name}, frame alone"), frames);
            }
        }
        outcome.plots.push(plot);
    }
    let ev = Exposure::Auto.ev(&subject.truth);
    outcome.pictures.push(Picture::exposed(
        &format!("{name}-truth"),
        &format!("{name}: truth, {}", subject.made),
        &subject.truth,
        ev,
    ));
    sentence(name, all)
}

/// The best picture of each method, and how long others take to be as good.
fn sentence(name: &str, all: &[Series]) -> String {
    let best = |series: &Series| {
        let point = series.points.iter().min_by(|a, b| a.error.rel_mse.total_cmp(&b.error.rel_mse))?;
        Some(format!(
            "{}: relMSE {} and FLIP {} after {} s ({})",
            series.name,
            number(point.error.rel_mse, 4),
            number(point.error.flip, 3),
            number(point.seconds, 2),
            point.count
        ))
    };
    let each: Vec<String> = all.iter().filter_map(best).collect();
    format!("{name}: {}. {}", each.join("; "), overtaken(all))
}

/// How long each method takes to an error that all reach.
fn overtaken(all: &[Series]) -> String {
    let least = |s: &Series| s.points.iter().map(|p| p.error.rel_mse).fold(f64::INFINITY, f64::min);
    let wanted = all.iter().map(least).fold(0.0, f64::max);
    let time = |s: &Series| {
        s.points.iter().filter(|p| p.error.rel_mse <= wanted).map(|p| p.seconds).fold(f64::INFINITY, f64::min)
    };
    let each: Vec<String> =
        all.iter().map(|series| format!("{} {} s", series.name, number(time(series), 2))).collect();
    format!("The first picture of relMSE {} or less takes {}.", number(wanted, 4), each.join(", "))
}
