//! Figure 5-1: the views that are timed.

use super::Figure;
use crate::bench::Bench;
use crate::report::{Outcome, Picture, Verdict};
use anyhow::Result;
use girandole::{RenderSettings, RendererOptions};
use girandole_core::lights::LightSettings;

/// The rooms whose frames are timed, and the views of them.
pub const ROOMS: [&str; 3] = ["area-lights", "table", "pillars"];

pub const FIGURE: Figure = Figure {
    id: "5-1",
    title: "The views that are timed",
    thesis: "A room with two large area lights, a room with a table, and a room with four pillars, by 300 light samples.",
    run,
};

fn run(bench: &Bench) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    let lights = LightSettings { count: bench.of([16, 300, 300]), ..LightSettings::default() };
    for room in ROOMS {
        let scene = bench.room(room)?;
        let mut stage = bench.stage(&scene, RendererOptions::default(), &lights)?;
        let picture = stage.picture(&RenderSettings::default())?;
        let what = format!("{room}, {} light samples", stage.lights());
        outcome.pictures.push(Picture::new(room, &what, &picture));
    }
    outcome.seen =
        "The three rooms, modelled from the thesis's text, as they are timed in the figures that follow."
            .into();
    let [width, height] = bench.picture_size();
    outcome.settings = format!(
        "{width} × {height} pixels, mode full, light samples placed for the view, five bounces, seed 0."
    );
    outcome.verdict = Verdict::Shown;
    Ok(outcome)
}
