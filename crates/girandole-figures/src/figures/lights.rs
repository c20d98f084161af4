//! Figures 5-2 and 5-3: the time of a frame against the number of light samples, of a view in which nothing moves.

use super::Figure;
use super::fit::{Line, exponent, from, two, verdict};
use super::scenes::ROOMS;
use crate::bench::Bench;
use crate::report::{Outcome, Plot, Table, number};
use anyhow::Result;
use girandole::{Mode, RenderSettings, RendererOptions};
use girandole_core::lights::LightSettings;
use girandole_core::scene::Scene;

pub const SCENES: Figure = Figure {
    id: "5-2",
    title: "Time of a frame against the number of lights, three rooms",
    thesis: "In each of the three rooms the time of a frame grows linearly with the number of light samples.",
    run: run_scenes,
};

pub const MODES: Figure = Figure {
    id: "5-3",
    title: "What each optimisation gains, against the number of lights",
    thesis: "In the room with area lights brute force is linear in the number of lights and far slower than the \
             optimised system, by direct light as by indirect; visibility determination pays from two lights on, \
             the low-resolution pass above some number of lights, and indirect light takes longer than direct.",
    run: run_modes,
};

/// How a mode is called in the thesis.
const NAMES: [(&str, Mode); 4] =
    [("naive", Mode::Naive), ("VD", Mode::Visibility), ("VD+LP", Mode::LowResolution), ("full", Mode::Full)];
/// Exponents are fitted from here on: with fewer lights, what a frame takes without any counts as much.
const MANY: f64 = 50.0;

/// Maps of one size, however many there are: by default fewer are larger.
fn options() -> RendererOptions {
    RendererOptions { map_size: Some(256), memory_mib: 512, ..RendererOptions::default() }
}

/// What was measured of one kind of light in one room.
struct Curves {
    /// Milliseconds of frames: for each settings, a point for each number of lights there really is.
    times: Vec<Vec<[f64; 2]>>,
    /// Pairs of point and light that read a shadow map, of the last settings and the most lights.
    looked_up: u64,
}

/// Times frames with all of these settings, for each number of lights.
fn curves(
    bench: &Bench,
    scene: &Scene,
    (lights, counts): (&LightSettings, &[u32]),
    [passes, frames]: [usize; 2],
    settings: &[RenderSettings],
) -> Result<Curves> {
    let mut looked_up = 0;
    let mut curves = vec![vec![[0.0, f64::INFINITY]; counts.len()]; settings.len()];
    // Not one after the other, lest what the machine does at one time falls on one number of lights.
    for _ in 0..passes {
        for (i, &count) in counts.iter().enumerate() {
            let lights = LightSettings { count, ..*lights };
            let size = bench.timed_size();
            let mut stage = bench.stage_of_size(scene, options(), &lights, size)?;
            let times = stage.least_times(settings, frames)?;
            for (curve, time) in curves.iter_mut().zip(times) {
                curve[i] = [stage.lights() as f64, time.min(curve[i][1])];
            }
            looked_up = stage.stats()?.pairs.looked_up;
        }
    }
    Ok(Curves { times: curves, looked_up })
}

fn settings(bench: &Bench, counts: &[u32], [passes, frames]: [usize; 2], what: &str) -> String {
    let [width, height] = bench.timed_size();
    format!(
        "{width} × {height} pixels; {counts:?} light samples, seed 0, placed for the view; {what}; the least of \
         {passes} times {frames} frames after one that draws all shadow maps; shadow maps of 256 texels."
    )
}

/// The same curves over even and over logarithmic axes.
fn plots(name: &str, title: &str, curves: &[(String, Vec<[f64; 2]>)]) -> [Plot; 2] {
    let (x, y) = ("light samples", "milliseconds a frame");
    let mut plots = [Plot::new(name, title, x, y), Plot::logarithmic(&format!("{name}-log"), title, x, y)];
    for (name, points) in curves {
        let legend = format!("{name}, exponent {}", two(exponent(&from(points, MANY))));
        plots[0].curve(name, points.clone());
        plots[1].curve(&legend, points.clone());
    }
    plots
}

fn run_scenes(bench: &Bench) -> Result<Outcome> {
    let times = bench.of([[1, 1], [2, 2], [2, 3]]);
    let counts = bench.of([&[8, 16][..], &[2, 50, 100, 200, 300], &[2, 10, 50, 100, 200, 300, 600, 1024]]);
    let mut named = Vec::new();
    for room in ROOMS {
        let scene = bench.room(room)?;
        let lights = (&LightSettings::default(), counts);
        for points in curves(bench, &scene, lights, times, &[RenderSettings::default()])?.times {
            named.push((room.to_owned(), points));
        }
    }
    let mut table = Table::new(
        "times",
        "Times of frames; light samples that are asked for, and that there are in the three rooms",
        &["asked for", "lights", "area-lights ms", "table ms", "pillars ms"],
    );
    for (i, count) in counts.iter().enumerate() {
        let lights: Vec<String> = named.iter().map(|(_, points)| number(points[i][0], 0)).collect();
        let [first, second, third] = [0, 1, 2].map(|room| two(named[room].1[i][1]));
        table.row([count.to_string(), lights.join(", "), first, second, third]);
    }
    let mut claims = Vec::new();
    let mut seen = Vec::new();
    for (room, points) in &named {
        let (Line { slope, intercept, explained }, power) =
            (Line::through(points), exponent(&from(points, MANY)));
        let sentence = format!(
            "{room}: {} ms and {} ms a light (R² {explained:.3}), exponent {} from {MANY} lights on.",
            two(intercept),
            number(slope, 3),
            two(power)
        );
        let [lights, time] = points.last().copied().unwrap_or_default();
        let why = format!(
            "In {room} it is no line: R² {explained:.3}, exponent {}. With {lights} lights {:.0} % of the frame \
             are what it takes without any.",
            two(power),
            100.0 * intercept / time
        );
        claims.push((explained >= 0.9 && power <= 1.15, why));
        seen.push(sentence);
    }
    Ok(Outcome {
        plots: plots("scenes", "Mode full, nothing moves", &named).into(),
        tables: vec![table],
        seen: seen.join(" "),
        settings: settings(bench, counts, times, "mode full"),
        verdict: verdict(claims),
        ..Outcome::default()
    })
}

/// The times of the four modes by light of one kind.
struct Kind {
    name: &'static str,
    /// In the order of [`NAMES`].
    curves: Vec<Vec<[f64; 2]>>,
}

impl Kind {
    /// How many times as long one mode takes as another, with the i-th number of lights.
    fn ratio(&self, [of, to]: [usize; 2], i: usize) -> f64 {
        self.curves[of][i][1] / self.curves[to][i][1]
    }

    /// From which number of lights on one mode is slower than another.
    fn pays(&self, modes: [usize; 2]) -> Option<usize> {
        (0..=self.last()).find(|&i| (i..=self.last()).all(|j| self.ratio(modes, j) > 1.0))
    }

    fn last(&self) -> usize {
        self.curves[0].len() - 1
    }

    fn exponents(&self) -> Vec<f64> {
        self.curves.iter().map(|points| exponent(&from(points, MANY))).collect()
    }

    fn seen(&self) -> String {
        let (last, naive) = (self.last(), Line::through(&self.curves[0]));
        let lights = |i: usize| number(self.curves[0][i][0], 0);
        let exponents: Vec<String> = NAMES
            .iter()
            .zip(self.exponents())
            .map(|((name, _), power)| format!("{name} {}", two(power)))
            .collect();
        let pays = self.pays([1, 2]).map_or_else(
            || "VD+LP is not quicker than VD".into(),
            |i| format!("VD+LP is quicker than VD from {} lights on", lights(i)),
        );
        format!(
            "By {} light naive takes {} ms and {} ms a light (R² {:.3}); exponents from {MANY} lights on are {}. \
             With {} lights naive takes {} times as long as full and {} times as long as VD; with {} it takes {} \
             times as long as VD. {pays}.",
            self.name,
            two(naive.intercept),
            two(naive.slope),
            naive.explained,
            exponents.join(", "),
            lights(last),
            two(self.ratio([0, 3], last)),
            two(self.ratio([0, 1], last)),
            lights(0),
            two(self.ratio([0, 1], 0))
        )
    }

    fn claims(&self) -> [(bool, String); 4] {
        let (naive, full) = (Line::through(&self.curves[0]), self.exponents()[3]);
        let (power, ratio) = (self.exponents()[0], self.ratio([0, 3], self.last()));
        let name = self.name;
        let pays = self.pays([0, 1]);
        [
            (
                naive.explained >= 0.95 && power <= 1.15,
                format!(
                    "By {name} light naive is no line: R² {:.3}, exponent {}.",
                    naive.explained,
                    two(power)
                ),
            ),
            (
                self.ratio([0, 1], 0) > 1.0,
                format!(
                    "By {name} light, with the fewest lights naive takes {} times as long as VD, which pays from {} \
                     lights on: by their lines, a frame by VD takes {} ms before any light, and one by naive {}.",
                    two(self.ratio([0, 1], 0)),
                    pays.map_or_else(|| "no number of".into(), |i| number(self.curves[0][i][0], 0)),
                    two(Line::through(&self.curves[1]).intercept),
                    two(naive.intercept)
                ),
            ),
            (full <= 1.1, format!("By {name} light full has exponent {}.", two(full))),
            (ratio >= 2.0, format!("By {name} light naive takes only {} times as long as full.", two(ratio))),
        ]
    }
}

fn run_modes(bench: &Bench) -> Result<Outcome> {
    let times = bench.of([[1, 1], [2, 1], [1, 2]]);
    let counts = bench.of([&[8, 16][..], &[2, 50, 150, 300], &[2, 10, 50, 100, 200, 300, 600, 1024]]);
    let scene = bench.room("area-lights")?;
    let modes = NAMES.map(|(_, mode)| RenderSettings { mode, ..RenderSettings::default() });
    let kinds = [
        ("direct", LightSettings { bounces: 0, ..LightSettings::default() }),
        ("indirect", LightSettings { direct_share: Some(0.0), ..LightSettings::default() }),
    ];
    let mut outcome = Outcome::default();
    let mut seen = Vec::new();
    let mut claims = Vec::new();
    let mut ends = Vec::new();
    for (name, lights) in kinds {
        let Curves { times, looked_up } = curves(bench, &scene, (&lights, counts), times, &modes)?;
        let kind = Kind { name, curves: times };
        let named: Vec<(String, Vec<[f64; 2]>)> = NAMES
            .iter()
            .zip(&kind.curves)
            .map(|((name, _), points)| ((*name).into(), points.clone()))
            .collect();
        outcome.plots.extend(plots(name, &format!("area-lights, {name} light only"), &named));
        outcome.tables.push(table(&kind));
        seen.push(kind.seen());
        claims.extend(kind.claims());
        ends.push([kind.curves[3][kind.last()][1], looked_up as f64]);
    }
    let [of_direct, looked_up] = [0, 1].map(|i| ends[1][i] / ends[0][i]);
    let end = format!(
        "With the most lights full takes {} times as long by indirect light as by direct, and reads shadow maps for {} \
         times as many pairs of point and light.",
        two(of_direct),
        two(looked_up)
    );
    claims.push((of_direct > 1.0, end.clone()));
    seen.push(end);
    outcome.seen = seen.join(" ");
    outcome.settings =
        settings(bench, counts, times, "area-lights; direct: no bounce; indirect: no sample on an emitter");
    outcome.verdict = verdict(claims);
    Ok(outcome)
}

fn table(kind: &Kind) -> Table {
    let caption = format!("Times of frames by {} light", kind.name);
    let columns = ["lights", "naive ms", "VD ms", "VD+LP ms", "full ms", "naive ms over full ms"];
    let mut table = Table::new(&format!("{}-times", kind.name), &caption, &columns);
    for i in 0..=kind.last() {
        let [naive, vd, lp, full] = [0, 1, 2, 3].map(|mode| two(kind.curves[mode][i][1]));
        table.row([number(kind.curves[0][i][0], 0), naive, vd, lp, full, two(kind.ratio([0, 3], i))]);
    }
    table
}
