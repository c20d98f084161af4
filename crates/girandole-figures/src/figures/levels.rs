//! Several levels of resolution, chosen by the light, in place of the thesis's one, chosen by edges.

use super::Figure;
use super::low_resolution::{Surfaces, error};
use crate::bench::Bench;
use crate::report::{Outcome, Picture, Plot, Table, Verdict, number};
use anyhow::Result;
use girandole::{DebugView, Mode, RenderSettings, RendererOptions};
use girandole_core::image::Image;
use girandole_core::lights::LightSettings;
use girandole_reference::metrics::{CompareOptions, HeatMap, heat_map};

const ROOMS: [&str; 2] = ["table", "pillars"];
const TOLERANCES: [f32; 8] = [0.0, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4];
/// Pixels from point to point of the thesis's one level; the thesis does not say how many.
const SPACINGS: [u32; 3] = [2, 4, 8];
/// The one that sentences and pictures tell of.
const SHOWN: u32 = 4;
const LEGEND: &str = "points every 8 pixels blue, 4 green, 2 yellow, 1 red; the rest is interpolated";

pub const FIGURE: Figure = Figure {
    id: "levels",
    title: "Several levels of resolution",
    thesis: "Do four grids, from every 8 pixels to each, that are refined where light differs, shade fewer \
             pixels for the same error than the thesis's one grid and edges do? What does a tolerance cost, and \
             what does it give?",
    run,
};

/// What a room gives.
struct Measured {
    /// Of each tolerance.
    own: Vec<Level>,
    /// Of each spacing.
    thesis: Vec<Level>,
    /// Milliseconds at each pixel.
    full_ms: f64,
    pictures: Vec<Picture>,
}

/// A picture with fewer pixels shaded.
struct Level {
    /// Shares of the picture's pixels, %: every 8, 4, 2 and each; or all.
    by_step: Vec<f64>,
    rel_mse: f64,
    flip: f64,
    ms: f64,
}

impl Level {
    fn shaded(&self) -> f64 {
        self.by_step.iter().sum()
    }
}

fn run(bench: &Bench) -> Result<Outcome> {
    let mut outcome = Outcome { verdict: Verdict::Shown, ..Outcome::default() };
    let mut table = Table::new(
        "levels",
        "By tolerance, compared with the picture that is shaded at every pixel",
        &[
            "room",
            "low resolution",
            "shaded %",
            "every 8 %",
            "every 4 %",
            "every 2 %",
            "each %",
            "relMSE",
            "FLIP",
            "frame ms",
        ],
    );
    let by_share = |name: &str, error: &str| {
        let title = format!("{error} by share of pixels shaded");
        Plot::logarithmic(name, &title, "pixels shaded, %", error)
    };
    let mut errors = [by_share("rel-mse", "relMSE"), by_share("flip", "FLIP")];
    let mut times = Plot::new("time", "Frame by tolerance", "tolerance", "ms");
    let mut seen = Vec::new();
    for room in ROOMS {
        let measured = measure(bench, room)?;
        rows(&mut table, room, &measured);
        for (plot, error) in errors.iter_mut().zip([|l: &Level| l.rel_mse, |l: &Level| l.flip]) {
            for (levels, name) in [(&measured.own, "Girandole"), (&measured.thesis, "one level")] {
                let with_error = levels.iter().filter(|level| error(level) > 0.0);
                let points = with_error.map(|level| [level.shaded(), error(level)]).collect();
                plot.curve(&format!("{room}, {name}"), points);
            }
        }
        let time = TOLERANCES.iter().zip(&measured.own).map(|(&t, level)| [f64::from(t), level.ms]);
        times.curve(room, time.collect());
        seen.push(sentence(room, &measured));
        outcome.pictures.extend(measured.pictures);
    }
    outcome.seen = seen.join(" ");
    outcome.plots = errors.into_iter().chain([times]).collect();
    outcome.tables.push(table);
    let [width, height] = bench.timed_size();
    outcome.settings = format!(
        "{width} × {height} pixels, {} light samples, without light maps; medians of {} frames. One level: as \
         the thesis describes it, on the CPU, edges by steps as long as points are apart; no time is measured.",
        lights(bench),
        frames(bench)
    );
    Ok(outcome)
}

fn lights(bench: &Bench) -> u32 {
    bench.of([16, 300, 300])
}

fn frames(bench: &Bench) -> usize {
    bench.of([1, 3, 7])
}

fn measure(bench: &Bench, room: &str) -> Result<Measured> {
    let scene = bench.room(room)?;
    let lights = LightSettings { count: lights(bench), ..LightSettings::default() };
    let mut stage = bench.stage(&scene, RendererOptions::default(), &lights)?;
    stage.size = bench.timed_size();
    let exact = RenderSettings { mode: Mode::Visibility, ..RenderSettings::default() };
    let by_tolerance =
        TOLERANCES.map(|tolerance| RenderSettings { mode: Mode::LowResolution, tolerance, ..exact });
    let full = stage.picture(&exact)?;
    let mut own = Vec::new();
    let mut pictures = Vec::new();
    for settings in &by_tolerance {
        let picture = stage.picture(settings)?;
        let points = stage.stats()?.points;
        let share = |points: &u64| 100.0 * *points as f64 / picture.pixels.len() as f64;
        own.push(level(&full, &picture, points[..4].iter().rev().map(share).collect())?);
        if settings.tolerance == RenderSettings::default().tolerance {
            let levels =
                stage.picture(&RenderSettings { debug: Some(DebugView::Levels), mirrors: 0, ..*settings })?;
            pictures.push(Picture::of_colors(
                &format!("{room}-levels"),
                &format!("{room}: {LEGEND}"),
                &levels,
            ));
            pictures.push(wrong(&full, &picture, &format!("{room}-own"), "Girandole's grids")?);
        }
    }
    let settings: Vec<RenderSettings> = by_tolerance.into_iter().chain([exact]).collect();
    let times = stage.times(&settings, frames(bench))?;
    for (level, ms) in own.iter_mut().zip(&times) {
        level.ms = *ms;
    }
    let surfaces = Surfaces::new(&scene, &stage.view, stage.size);
    let mut thesis = Vec::new();
    for spacing in SPACINGS {
        let result = surfaces.interpolate(&full, spacing, &surfaces.edges(spacing));
        thesis.push(level(&full, &result.picture, vec![result.shaded()])?);
        if spacing == SHOWN {
            let name = format!("{room}-one-level");
            pictures.push(wrong(&full, &result.picture, &name, "one level of every 4 pixels")?);
        }
    }
    Ok(Measured { own, thesis, full_ms: times[TOLERANCES.len()], pictures })
}

/// Where a picture looks different from what it should be.
fn wrong(full: &Image, picture: &Image, name: &str, what: &str) -> Result<Picture> {
    let map = heat_map(full, picture, &CompareOptions::default(), HeatMap::Flip)?;
    Ok(Picture::of_colors(name, &format!("FLIP with {what}: black 0, white 1"), &map))
}

fn level(full: &Image, picture: &Image, by_step: Vec<f64>) -> Result<Level> {
    let found = error(full, picture)?;
    Ok(Level { by_step, rel_mse: found.rel_mse, flip: found.flip, ms: 0.0 })
}

fn rows(table: &mut Table, room: &str, measured: &Measured) {
    let mut row = |name: String, level: &Level, has_time: bool| {
        let share = |i: usize| {
            if level.by_step.len() == 4 { number(level.by_step[i], 1) } else { "–".into() }
        };
        table.row([
            room.into(),
            name,
            number(level.shaded(), 1),
            share(0),
            share(1),
            share(2),
            share(3),
            format!("{:.1e}", level.rel_mse),
            number(level.flip, 4),
            if has_time { number(level.ms, 1) } else { "–".into() },
        ]);
    };
    let full = Level { by_step: vec![100.0], rel_mse: 0.0, flip: 0.0, ms: measured.full_ms };
    row("none: every pixel".into(), &full, true);
    for (tolerance, level) in TOLERANCES.iter().zip(&measured.own) {
        row(format!("tolerance {tolerance}"), level, true);
    }
    for (spacing, level) in SPACINGS.iter().zip(&measured.thesis) {
        row(format!("one level, every {spacing} pixels"), level, false);
    }
}

/// What is seen in a room: the default tolerance, and what one level of every 4 pixels takes for the same error.
fn sentence(room: &str, measured: &Measured) -> String {
    let default = RenderSettings::default().tolerance;
    let own = TOLERANCES.iter().position(|&t| t == default).map(|i| &measured.own[i]);
    let thesis = SPACINGS.iter().position(|&s| s == SHOWN).map(|i| &measured.thesis[i]);
    let (Some(own), Some(thesis)) = (own, thesis) else { return String::new() };
    let as_good = |error: fn(&Level) -> f64| {
        let levels = TOLERANCES.iter().zip(&measured.own);
        let good = levels.filter(|(_, level)| error(level) <= error(thesis));
        good.min_by(|a, b| a.1.shaded().total_cmp(&b.1.shaded())).map_or_else(
            || "no tolerance".into(),
            |(tolerance, level)| format!("tolerance {tolerance} with {:.1} %", level.shaded()),
        )
    };
    let least =
        measured.own.iter().map(|level| level.rel_mse).filter(|&e| e > 0.0).fold(f64::INFINITY, f64::min);
    format!(
        "In {room}, tolerance {default} shades {:.1} % of the pixels with a FLIP of {:.4} and a relMSE of \
         {:.1e}, in {:.0} ms in place of {:.0} ms; one level of every {SHOWN} pixels shades {:.1} % with a FLIP \
         of {:.4} and a relMSE of {:.1e}, which is reached by {} (FLIP) and {} (relMSE). None of the tolerances \
         above 0 has a relMSE below {least:.1e}.",
        own.shaded(),
        own.flip,
        own.rel_mse,
        own.ms,
        measured.full_ms,
        thesis.shaded(),
        thesis.flip,
        thesis.rel_mse,
        as_good(|level| level.flip),
        as_good(|level| level.rel_mse)
    )
}
