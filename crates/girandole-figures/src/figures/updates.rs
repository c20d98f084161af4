//! Figures 5-4, 5-5 and 5-6: the time of a frame in which something moves, against the number of shadow maps drawn a
//! frame.

use super::Figure;
use super::fit::{Line, two, verdict};
use super::motion::{FrameCost, Motion, has_timestamps};
use crate::bench::{Bench, moving_object};
use crate::report::{Outcome, Plot, Table, number};
use anyhow::{Context, Result};
use girandole::RenderSettings;
use girandole::wgpu::DeviceType;
use girandole_core::scene::builtin::{self, MovingObject};

pub const FRAMES: Figure = Figure {
    id: "5-4",
    title: "Time of a frame with something that moves, against shadow maps drawn a frame",
    thesis: "With 300 lights and a torus (820 vertices) or a bunny (3000) that moves, the time of a frame grows \
             linearly with the number of shadow maps that it draws; the table takes less than the four pillars.",
    run: run_frames,
};

pub const MAPS: Figure = Figure {
    id: "5-5",
    title: "Time of drawing shadow maps, against their number",
    thesis: "It is linear in the number of maps, and the bunny's slope is to the torus's about as their numbers \
             of vertices are.",
    run: run_maps,
};

pub const SHARES: Figure = Figure {
    id: "5-6",
    title: "What a frame consists of with something that moves",
    thesis: "With the bunny among four pillars, drawing shadow maps comes to dominate the time of a frame as \
             more of them are drawn; visibility determination for one mover is little beside it.",
    run: run_shares,
};

/// Where it moves.
const ROOMS: [&str; 2] = ["table", "pillars"];

/// A part of what a frame takes.
type Value = fn(&FrameCost) -> f64;

/// What one mover does in one room.
struct Case {
    name: String,
    room: &'static str,
    is_torus: bool,
    vertices: usize,
    /// Of all the room.
    triangles: usize,
    /// Milliseconds of a frame in which nothing moves.
    still: f64,
    /// For each number of updates.
    costs: Vec<FrameCost>,
}

impl Case {
    /// Points over the number of maps that were drawn, which is at most the number asked for.
    fn points(&self, value: Value) -> Vec<[f64; 2]> {
        self.costs.iter().map(|cost| [cost.drawn, value(cost)]).collect()
    }

    fn most_drawn(&self) -> f64 {
        self.costs.iter().map(|cost| cost.drawn).fold(0.0, f64::max)
    }
}

/// Shadow maps a frame at most.
fn counts(bench: &Bench) -> &'static [u32] {
    bench.of([&[0, 4, 8][..], &[0, 100, 200, 300], &[0, 50, 100, 150, 200, 300]])
}

fn lights(bench: &Bench) -> u32 {
    bench.of([16, 300, 300])
}

/// 200 as in the thesis, fewer on software.
fn frames(bench: &Bench) -> u32 {
    let is_software = bench.gpu.info.device_type == DeviceType::Cpu;
    bench.of([2, if is_software { 3 } else { 50 }, if is_software { 20 } else { 200 }])
}

/// How shadow maps are timed.
fn clock(bench: &Bench) -> &'static str {
    if has_timestamps(bench) {
        "by the device's timestamps"
    } else {
        "by drawing them before the frame and waiting, as software has no timestamps that tell"
    }
}

/// Times that each path is gone: of each frame the least time counts, as what else the machine does can only make it
/// slower.
fn rounds(bench: &Bench) -> u32 {
    bench.of([1, 2, 3])
}

/// A case that is open, and what was measured of it.
struct Trial<'a> {
    motion: Motion<'a>,
    case: Case,
    /// For each number of updates, of each frame.
    costs: Vec<Vec<FrameCost>>,
}

impl<'a> Trial<'a> {
    fn new(bench: &'a Bench, room: &'static str, is_torus: bool, in_parts: bool) -> Result<Self> {
        let (object, name) = if is_torus { (MovingObject::Torus, "torus") } else { bench.bunny()? };
        let scene = builtin::build(room, object)?;
        let object = moving_object(&scene)?;
        let vertices = scene.meshes[scene.objects[object.index()].mesh].positions.len();
        let triangles = scene.objects.iter().map(|object| scene.meshes[object.mesh].triangles.len()).sum();
        let mut motion = Motion::new(bench, scene, lights(bench), bench.timed_size(), in_parts)?;
        let still = motion.stage.least_times(&[RenderSettings::default()], bench.of([1, 5, 9]))?[0];
        // Once for what is compiled and allocated.
        motion.path(1, 1)?;
        let name = format!("{name}-{room}");
        let case = Case { name, room, is_torus, vertices, triangles, still, costs: Vec::new() };
        Ok(Self { motion, case, costs: vec![Vec::new(); counts(bench).len()] })
    }
}

/// Measures these rooms and whether it is the torus, in turn, so that what else the machine does falls on all alike.
fn measure(bench: &Bench, cases: &[(&'static str, bool)], in_parts: bool) -> Result<Vec<Case>> {
    let trials = cases.iter().map(|&(room, is_torus)| Trial::new(bench, room, is_torus, in_parts));
    let mut trials: Vec<Trial> = trials.collect::<Result<_>>()?;
    for _ in 0..rounds(bench) {
        for (i, &most) in counts(bench).iter().enumerate() {
            for trial in &mut trials {
                let again = trial.motion.path(most, frames(bench))?;
                FrameCost::take_quicker(&mut trial.costs[i], again);
            }
        }
    }
    let end = |trial: Trial| {
        let costs = trial.costs.iter().map(|costs| FrameCost::mean(costs)).collect();
        Case { costs, ..trial.case }
    };
    Ok(trials.into_iter().map(end).collect())
}

/// In the order of the rooms, with the torus first.
fn cases(bench: &Bench, in_parts: bool) -> Result<Vec<Case>> {
    let cases = ROOMS.map(|room| [(room, true), (room, false)]);
    measure(bench, cases.as_flattened(), in_parts)
}

fn settings(bench: &Bench, also: &str) -> String {
    let [width, height] = bench.timed_size();
    format!(
        "{width} × {height} pixels, {} light samples that stay (seed 0), maps of 256 texels; {:?} shadow maps a \
         frame at most, of those that are looked up and stale; means of the path's first {} frames, 25 to the \
         second, each time from maps that are all up to date, of each frame the least of {} times; {also}.",
        lights(bench),
        counts(bench),
        frames(bench),
        rounds(bench)
    )
}

fn table(bench: &Bench, cases: &[Case], time: &str, value: Value) -> Table {
    let caption = format!("{time}; for each mover and room");
    let columns = ["mover and room", "at most", "maps drawn", "texels a map", "maps left stale", "time ms"];
    let mut table = Table::new("times", &caption, &columns);
    for case in cases {
        for (most, cost) in counts(bench).iter().zip(&case.costs) {
            let texels = number(cost.texels / cost.drawn.max(1.0), 0);
            let (drawn, stale) = (number(cost.drawn, 1), number(cost.stale, 1));
            table.row([case.name.clone(), most.to_string(), drawn, texels, stale, two(value(cost))]);
        }
    }
    table
}

/// The line through a case's times, in words, and whether it is one.
fn line(case: &Case, value: Value) -> (Line, String) {
    let line = Line::through(&case.points(value));
    let words = format!(
        "{}: {} ms and {} ms a map (R² {:.3}, up to {} maps)",
        case.name,
        two(line.intercept),
        number(line.slope, 4),
        line.explained,
        number(case.most_drawn(), 0)
    );
    (line, words)
}

fn run_frames(bench: &Bench) -> Result<Outcome> {
    let cases = cases(bench, false)?;
    let mut plot = Plot::new(
        "frames",
        &format!("{} lights, one thing moves or nothing", lights(bench)),
        "maps drawn a frame",
        "milliseconds a frame",
    );
    let (mut claims, mut seen) = (Vec::new(), Vec::new());
    for case in &cases {
        plot.curve(&case.name, case.points(FrameCost::total));
        let (line, words) = line(case, FrameCost::total);
        claims.push((line.explained >= 0.9, format!("Not a line for {words}.")));
        seen.push(format!("{words}, {} ms where nothing moves.", two(case.still)));
    }
    for room in ROOMS {
        let still = cases.iter().find(|case| case.room == room).map(|case| case.still).unwrap_or_default();
        let end = cases.iter().map(Case::most_drawn).fold(0.0, f64::max);
        plot.curve(&format!("{room}, nothing moves"), vec![[0.0, still], [end, still]]);
    }
    // Of the same movers, with as many maps as may be.
    for [table, pillars] in [[&cases[0], &cases[2]], [&cases[1], &cases[3]]] {
        let [a, b] = [table, pillars].map(|case| case.costs.last().map(FrameCost::total).unwrap_or_default());
        let words =
            format!("{} takes {} ms with the most maps, {} {} ms.", table.name, two(a), pillars.name, two(b));
        let why = format!(
            "{words} Where nothing moves it is {} and {} ms; the table has {} triangles, the pillars {}.",
            two(table.still),
            two(pillars.still),
            table.triangles,
            pillars.triangles
        );
        claims.push((a < b, why));
        seen.push(words);
    }
    Ok(Outcome {
        plots: vec![plot],
        tables: vec![table(bench, &cases, "Means of frames with the update before them", FrameCost::total)],
        seen: seen.join(" "),
        settings: settings(bench, "a frame's time is that of the update for what moved and of the frame"),
        verdict: verdict(claims),
        ..Outcome::default()
    })
}

fn run_maps(bench: &Bench) -> Result<Outcome> {
    let cases = cases(bench, true)?;
    let mut plot = Plot::new(
        "maps",
        &format!("{} lights, one thing moves", lights(bench)),
        "maps drawn a frame",
        "milliseconds of drawing maps",
    );
    let (mut claims, mut seen) = (Vec::new(), Vec::new());
    let mut slopes = Vec::new();
    for case in &cases {
        plot.curve(&case.name, case.points(|cost| cost.maps));
        let (line, words) = line(case, |cost| cost.maps);
        claims.push((line.explained >= 0.9, format!("Not a line for {words}.")));
        let by_texels: Vec<[f64; 2]> = case.costs.iter().map(|cost| [cost.texels, cost.maps]).collect();
        let texels = Line::through(&by_texels).explained;
        seen.push(format!("{words}, by texels drawn R² {texels:.3}."));
        slopes.push(line.slope);
    }
    for room in ROOMS {
        let of =
            |is_torus: bool| cases.iter().position(|case| case.room == room && case.is_torus == is_torus);
        let (torus, model) = (of(true).context("no torus")?, of(false).context("no bunny")?);
        let slope = slopes[model] / slopes[torus];
        let vertices = cases[model].vertices as f64 / cases[torus].vertices as f64;
        let words = format!(
            "In {room} the slope of {} is {} times that of {}; it has {} times the vertices.",
            cases[model].name,
            two(slope),
            cases[torus].name,
            two(vertices)
        );
        let last = |i: usize| cases[i].costs.last().copied().unwrap_or_default();
        let (bunny, small) = (last(model), last(torus));
        let texels = bunny.texels / small.texels.max(1.0);
        let why = format!(
            "{words} Our maps are ray cast: with the most maps {} times as many texels are stale, and a texel takes {} \
             times as long.",
            two(texels),
            two(bunny.maps / small.maps / texels.max(f64::MIN_POSITIVE))
        );
        claims.push(((0.75..1.33).contains(&(slope / vertices)), why));
        seen.push(words);
    }
    let texels = cases[0].costs.iter().filter(|cost| cost.drawn > 0.0).map(|cost| cost.texels / cost.drawn);
    let texels: Vec<String> = texels.map(|texels| number(texels, 0)).collect();
    seen.push(format!(
        "The fewer maps a frame, the more of each is stale when its turn comes: {} texels a map of {}.",
        texels.join(", "),
        cases[0].name
    ));
    Ok(Outcome {
        plots: vec![plot],
        tables: vec![table(bench, &cases, "Mean times of drawing shadow maps", |cost| cost.maps)],
        seen: seen.join(" "),
        settings: settings(bench, &format!("maps timed {}", clock(bench))),
        verdict: verdict(claims),
        ..Outcome::default()
    })
}

fn run_shares(bench: &Bench) -> Result<Outcome> {
    let case = measure(bench, &[("pillars", false)], true)?.pop().context("no case")?;
    let mut parts = Plot::new("parts", &case.name, "maps drawn a frame", "milliseconds a frame");
    let mut shares = Plot::new("shares", &case.name, "maps drawn a frame", "share of the frame in %");
    for plot in [&mut parts, &mut shares] {
        plot.is_stacked = true;
    }
    let values: [(&str, Value); 3] = [
        ("the rest", |cost| cost.rest),
        ("visibility", |cost| cost.visibility),
        ("shadow maps", |cost| cost.maps),
    ];
    for (name, value) in values {
        parts.curve(name, case.points(value));
        let share = |cost: &FrameCost| [cost.drawn, 100.0 * value(cost) / cost.total()];
        shares.curve(name, case.costs.iter().map(share).collect());
    }
    let columns =
        ["at most", "maps drawn", "visibility ms", "maps ms", "rest ms", "all ms", "% maps of the ms"];
    let mut table = Table::new("part-times", "Means of frames", &columns);
    let share = |cost: &FrameCost| 100.0 * cost.maps / cost.total();
    for (most, cost) in counts(bench).iter().zip(&case.costs) {
        let times = [cost.visibility, cost.maps, cost.rest, cost.total(), share(cost)];
        let [visibility, maps, rest, all, share] = times.map(two);
        table.row([most.to_string(), number(cost.drawn, 1), visibility, maps, rest, all, share]);
    }
    let last = *case.costs.last().context("no counts")?;
    let first = *case.costs.get(1).context("no counts")?;
    let seen = format!(
        "With {} maps a frame, drawing them takes {} % of the frame ({} of {} ms), with {} maps {} %; visibility \
         determination takes {} ms, the rest {} ms. A frame in which nothing moves takes {} ms.",
        number(last.drawn, 0),
        number(share(&last), 0),
        two(last.maps),
        two(last.total()),
        number(first.drawn, 0),
        number(share(&first), 0),
        two(last.visibility),
        two(last.rest),
        two(case.still)
    );
    let claims = [
        (share(&last) > share(&first), "The share of maps does not grow with their number.".into()),
        (
            share(&last) > 50.0,
            format!("With the most maps, they take {} % of the frame.", number(share(&last), 0)),
        ),
        (
            last.visibility < last.maps,
            format!("Visibility takes {} ms, maps {} ms.", two(last.visibility), two(last.maps)),
        ),
    ];
    Ok(Outcome {
        plots: vec![parts, shares],
        tables: vec![table],
        seen,
        settings: settings(
            bench,
            &format!("visibility timed by updating a second database beside, maps {}", clock(bench)),
        ),
        verdict: verdict(claims),
        ..Outcome::default()
    })
}
