//! Figure 4-16: what pictures lose where only some shadow maps are drawn a frame.

use super::Figure;
use super::fit::verdict;
use super::motion::{FPS, Motion};
use crate::bench::Bench;
use crate::report::{Outcome, Picture, Table, magnified, number};
use anyhow::{Context, Result};
use girandole::{MapPriority, MapUpdates, RenderSettings};
use girandole_core::image::{Image, Region};
use girandole_core::scene::builtin;
use girandole_core::tonemap::Exposure;
use girandole_reference::metrics::{CompareOptions, HeatMap, compare, heat_map};

pub const FIGURE: Figure = Figure {
    id: "4-16",
    title: "Fewer shadow maps a frame than are stale",
    thesis: "Of 300 lights, with an object that moves: 50 shadow maps drawn a frame against 100. All of them \
             over two or three frames, that is 100 to 150 a frame, show no objectionable artefacts; fewer put \
             shadows where they no longer belong.",
    run,
};

const ROOM: &str = "table";
/// Mean FLIP below which nobody objects: an error of a hundredth everywhere, or plainly seen in some hundredth of
/// the picture.
const UNOBJECTIONABLE: f64 = 0.01;

/// How maps were drawn, and what came of it.
struct Trial {
    most: u32,
    priority: MapPriority,
    /// Of the last moment.
    picture: Image,
    /// Means over the moments.
    flip: f64,
    relative_error: f64,
    /// Mean over all frames of maps that are left stale.
    stale: f64,
    /// Frames that the oldest has waited, at any time.
    oldest: u32,
    /// All frames.
    frames: u32,
}

impl Trial {
    fn priority(&self) -> &'static str {
        match self.priority {
            MapPriority::Brightness => "brightness (thesis)",
            MapPriority::BrightnessAndExtent => "brightness and extent (ours)",
        }
    }
}

/// Frames at whose ends pictures are compared.
fn moments(bench: &Bench) -> &'static [u32] {
    bench.of([&[3, 4][..], &[8, 14], &[7, 14, 21, 28]])
}

fn lights(bench: &Bench) -> u32 {
    bench.of([16, 300, 300])
}

/// Pictures of the moments, mean number of stale maps, and frames that the oldest had waited.
fn play(bench: &Bench, motion: &mut Motion, updates: MapUpdates) -> Result<(Vec<Image>, f64, u32)> {
    let settings = RenderSettings { updates, ..RenderSettings::default() };
    motion.restart(0)?;
    let last = moments(bench).last().copied().unwrap_or_default();
    let (mut pictures, mut stale, mut oldest) = (Vec::new(), 0.0, 0);
    for frame in 1..=last {
        if moments(bench).contains(&frame) {
            motion.frame(frame, &settings)?;
            pictures.push(motion.picture()?);
        } else {
            motion.skip(frame, &settings)?;
        }
        let counts = motion.stage.renderer.stale();
        stale += f64::from(counts.maps) / f64::from(last);
        oldest = oldest.max(counts.oldest);
    }
    Ok((pictures, stale, oldest))
}

fn trial(
    bench: &Bench,
    motion: &mut Motion,
    (most, priority): (u32, MapPriority),
    truth: &[Image],
) -> Result<Trial> {
    let updates = MapUpdates { most: Some(most), priority, ..MapUpdates::default() };
    let (mut pictures, stale, oldest) = play(bench, motion, updates)?;
    let (mut flip, mut relative_error) = (0.0, 0.0);
    for (truth, picture) in truth.iter().zip(&pictures) {
        let comparison = compare(truth, picture, &CompareOptions::default())?;
        flip += comparison.flip / pictures.len() as f64;
        relative_error += comparison.rel_mse / pictures.len() as f64;
    }
    let picture = pictures.pop().context("no moments")?;
    let frames = moments(bench).last().copied().unwrap_or_default();
    Ok(Trial { most, priority, picture, flip, relative_error, stale, oldest, frames })
}

fn run(bench: &Bench) -> Result<Outcome> {
    let (object, name) = bench.bunny()?;
    let scene = builtin::build(ROOM, object)?;
    let mut motion = Motion::new(bench, scene, lights(bench), bench.picture_size(), false)?;
    let (truth, ..) = play(bench, &mut motion, MapUpdates::default())?;
    let mut trials = Vec::new();
    for priority in [MapPriority::Brightness, MapPriority::BrightnessAndExtent] {
        for most in bench.of([&[3, 6][..], &[50, 100], &[50, 100, 150]]) {
            trials.push(trial(bench, &mut motion, (*most, priority), &truth)?);
        }
    }
    let mut outcome = Outcome { pictures: pictures(&truth, &trials)?, ..Outcome::default() };
    outcome.tables.push(table(&trials));
    (outcome.seen, outcome.verdict) = judge(&trials);
    let [width, height] = bench.picture_size();
    outcome.settings = format!(
        "{ROOM} with the {name}, {width} × {height} pixels, {} light samples that stay (seed 0), {FPS} frames to \
         the second from the path's start with all maps drawn; pictures are compared after frames {:?} with \
         those of the same moments by maps that are all drawn in each frame; mode full.",
        lights(bench),
        moments(bench)
    );
    Ok(outcome)
}

fn table(trials: &[Trial]) -> Table {
    let mut table = Table::new(
        "staleness",
        "Against pictures of the same moments with all maps up to date",
        &["maps a frame", "first", "mean FLIP", "relMSE", "stale maps, mean", "oldest, frames"],
    );
    for trial in trials {
        table.row([
            trial.most.to_string(),
            trial.priority().into(),
            number(trial.flip, 5),
            number(trial.relative_error, 6),
            number(trial.stale, 1),
            trial.oldest.to_string(),
        ]);
    }
    table
}

/// Where the mover and its shadow are at the last moment, as squares of two pixels.
fn crop(image: &Image) -> Image {
    let first = [image.width * 4 / 10, image.height / 4];
    let region = Region { first, size: [image.width / 2, image.height * 6 / 10] };
    magnified(image, region, 2)
}

fn pictures(truth: &[Image], trials: &[Trial]) -> Result<Vec<Picture>> {
    let last = truth.last().context("no moments")?;
    let ev = Exposure::Auto.ev(last);
    let mut pictures = vec![Picture::exposed("all", "All stale maps drawn in each frame", &crop(last), ev)];
    for trial in trials {
        let (most, priority) = (trial.most, trial.priority());
        let is_ours = trial.priority == MapPriority::BrightnessAndExtent;
        let end = if is_ours { "-ours" } else { "" };
        let caption = format!("{most} maps a frame, first by {priority}");
        pictures.push(Picture::exposed(&format!("maps-{most}{end}"), &caption, &crop(&trial.picture), ev));
        let heat = heat_map(last, &trial.picture, &CompareOptions::default(), HeatMap::Flip)?;
        let caption = format!("FLIP of {most} maps a frame, first by {priority}; white is 1");
        pictures.push(Picture::of_colors(&format!("flip-{most}{end}"), &caption, &crop(&heat)));
    }
    Ok(pictures)
}

fn judge(trials: &[Trial]) -> (String, crate::report::Verdict) {
    let (thesis, ours) = trials.split_at(trials.len() / 2);
    let words = |trial: &Trial| {
        format!(
            "{} maps a frame: {:.1} left stale, the oldest for {} of {} frames, mean FLIP {:.4}, relMSE {:.5}.",
            trial.most, trial.stale, trial.oldest, trial.frames, trial.flip, trial.relative_error
        )
    };
    let mut seen: Vec<String> = thesis.iter().map(words).collect();
    for (a, b) in thesis.iter().zip(ours) {
        seen.push(format!(
            "With extent in the priority, {} a frame have mean FLIP {:.4}, relMSE {:.5}.",
            b.most, b.flip, b.relative_error
        ));
        if a.oldest >= a.frames {
            seen.push(format!("By brightness alone some maps are not drawn once with {} a frame.", a.most));
        }
    }
    let [few, many] = [&thesis[0], &thesis[1]];
    let claims = [
        (
            few.flip > many.flip,
            format!(
                "FLIP is {:.4} with {} maps a frame, {:.4} with {}.",
                few.flip, few.most, many.flip, many.most
            ),
        ),
        (
            many.flip < UNOBJECTIONABLE,
            format!(
                "With {} maps a frame mean FLIP is {:.4}, above {UNOBJECTIONABLE}.",
                many.most, many.flip
            ),
        ),
    ];
    (seen.join(" "), verdict(claims))
}
