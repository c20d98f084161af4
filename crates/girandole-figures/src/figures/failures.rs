//! Figure 6-1: too few light samples through a gap, and what later methods do about it.

use super::Figure;
use super::fit::verdict;
use super::variants::{BOUNCES, Contributions, Error, Truth, Variant, points, row, table};
use crate::bench::{Bench, first_view};
use crate::report::{Outcome, Picture, magnified, number};
use anyhow::Result;
use girandole_core::glam::Vec3;
use girandole_core::image::{Image, Region};
use girandole_core::scene::{Scene, View, builtin};
use girandole_core::tonemap::Exposure;
use girandole_core::trace::SceneTracer;

pub const FIGURE: Figure = Figure {
    id: "6-1",
    title: "Too few light samples through a gap",
    thesis: "Behind a narrow gap few of some hundred samples light anything, and not from all directions that light \
        comes from: the shadows of each are seen.",
    run,
};

/// Few of the samples: a quarter.
const FEW: f64 = 0.25;
/// Half the dividing wall's thickness, metres: beyond it is the dark half.
const WALL: f32 = 0.1001;

/// Pixels of what is compared.
pub(super) fn extent(bench: &Bench) -> [u32; 2] {
    bench.of([[64, 48], [160, 120], [256, 192]])
}

/// Magnified to pictures that can be looked at.
pub(super) fn shown(bench: &Bench, name: &str, caption: &str, image: &Image, ev: f32) -> Picture {
    let whole = Region::whole([image.width, image.height]);
    Picture::exposed(name, caption, &magnified(image, whole, bench.of([1, 2, 2])), ev)
}

/// What was measured of a variant.
pub(super) struct Measured {
    pub variant: Variant,
    pub lights: usize,
    pub error: Error,
    /// What each figure measures of its own.
    pub own: [f64; 3],
}

fn gap_variants(bench: &Bench) -> Vec<Variant> {
    let [few, some, many] = bench.of([[16, 32, 64], [300, 1024, 2048], [300, 1024, 4096]]);
    let thesis = Variant { of_thesis: true, for_view: false, ..Variant::default() };
    vec![
        Variant { name: "the thesis's", count: few, ..thesis },
        Variant { name: "the thesis's", count: some, ..thesis },
        Variant { name: "the thesis's", count: many, ..thesis },
        Variant { name: "spread evenly, for no view", count: few, for_view: false, ..Variant::default() },
        Variant { name: "ours, for the view", count: few, ..Variant::default() },
        Variant { name: "ours, for the view", count: some, ..Variant::default() },
        Variant { name: "ours, refined", count: few, sets: bench.of([2, 8, 64]), ..Variant::default() },
    ]
}

fn run(bench: &Bench) -> Result<Outcome> {
    let (object, name) = bench.bunny()?;
    let scene = builtin::build("gap", object)?;
    let (size, paths) = (extent(bench), bench.of([4, 128, 256]));
    let view = first_view(&scene, size)?;
    let truth = Truth::new(&scene, (view, size), paths);
    let ev = Exposure::Auto.ev(&truth.image);
    let mut outcome = Outcome::default();
    let mut errors = table(&["in the dark half", "that light a point", "worth at a point"]);
    let mut all = Vec::new();
    for (i, variant) in gap_variants(bench).into_iter().enumerate() {
        let mut stage = variant.stage(bench, &scene, (view, size))?;
        let image = variant.picture(bench, &scene, &mut stage)?;
        let own = through(&scene, &view, &variant)?;
        let (error, lights) = (truth.error(&image)?, stage.lights());
        let label = label(&variant);
        outcome.pictures.push(shown(
            bench,
            &format!("{i}"),
            &format!("{label}: {lights} lights"),
            &image,
            ev,
        ));
        let cells = [number(own[0], 0), number(own[1], 1), number(own[2], 1)];
        row(&mut errors, &label, lights, &cells, &error);
        all.push(Measured { variant, lights, error, own });
    }
    outcome.pictures.push(shown(bench, "truth", &format!("Path tracer, {paths} paths"), &truth.image, ev));
    outcome.tables.push(errors);
    tell_gap(&mut outcome, &all, truth.noise);
    outcome.settings = format!(
        "gap with the {name}, {} × {} pixels, {BOUNCES} bounces, seed 0, mode VD; the thesis's samples: one candidate \
         each, 1 in 12 on the light, no view. relMSE without the worst 0.1 % of pixels. Truth: {paths} paths a \
         pixel.",
        size[0], size[1]
    );
    Ok(outcome)
}

/// What a variant is called.
pub(super) fn label(variant: &Variant) -> String {
    match variant.sets {
        1 => format!("{}, {}", variant.name, variant.count),
        sets => format!("{}, {sets} × {}", variant.name, variant.count),
    }
}

/// How many samples lie in the dark half; how many light a point that is seen of it, in the mean; how many equal ones
/// these are worth.
fn through(scene: &Scene, view: &View, variant: &Variant) -> Result<[f64; 3]> {
    let illumination = variant.illumination(scene, view)?;
    let geometry = illumination.geometry();
    let tracer = SceneTracer::new(scene, geometry);
    let is_dark = |position: Vec3| position.x > WALL;
    let points = points(&tracer, view, is_dark);
    let samples = illumination.lights().samples();
    let beyond = samples.iter().filter(|light| is_dark(light.position + geometry.origin.as_vec3())).count();
    let found = Contributions::new(&tracer, &points, (samples, variant.clamp));
    Ok([beyond as f64, found.arriving(), found.effective()])
}

/// What is seen, and the verdict.
fn tell_gap(outcome: &mut Outcome, all: &[Measured], noise: f64) {
    let sentence = |m: &Measured| {
        format!(
            "{}: {} of {} samples lie in the dark half, {} light a point of it and are worth {} equal ones; relMSE {}, \
             FLIP {}.",
            label(&m.variant),
            number(m.own[0], 0),
            m.lights,
            number(m.own[1], 0),
            number(m.own[2], 1),
            number(m.error.rel_mse, 4),
            number(m.error.flip, 3)
        )
    };
    let seen: Vec<String> = all.iter().map(sentence).collect();
    let few = &all[0];
    let most = all.iter().rfind(|m| m.variant.of_thesis).unwrap_or(few);
    let ours = all.iter().find(|m| m.variant.for_view).unwrap_or(few);
    outcome.seen = format!(
        "{} With as many samples, ours have relMSE {} times the thesis's. The truth's own noise is relMSE {}, which \
         was taken off, and is part of FLIP.",
        seen.join(" "),
        number(ours.error.rel_mse / few.error.rel_mse.max(1e-9), 3),
        number(noise, 4)
    );
    let share = few.own[0] / few.lights.max(1) as f64;
    outcome.verdict = verdict([
        (share < FEW, format!("{} of {} samples lie in the dark half.", few.own[0], few.lights)),
        (
            few.own[2] < FEW * few.lights as f64,
            format!("A point is lit by samples worth {} equal ones.", number(few.own[2], 1)),
        ),
        (
            few.error.rel_mse > 2.0 * most.error.rel_mse,
            format!(
                "{} samples have relMSE {}, {} have {}: their number matters little.",
                few.lights,
                number(few.error.rel_mse, 4),
                most.lights,
                number(most.error.rel_mse, 4)
            ),
        ),
    ]);
}
