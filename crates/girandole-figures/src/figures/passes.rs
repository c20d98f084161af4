//! Figures 4-11 and 4-12: passes of multipass shading, before and after they are optimised.

use super::Figure;
use super::views::{looking, mean, points};
use crate::bench::{Bench, Stage, median};
use crate::report::{Outcome, Picture, Plot, Table, Verdict, number};
use anyhow::{Context, Result};
use girandole::{DebugView, Mode, RenderSettings, RendererOptions, Shading};
use girandole_core::glam::dvec3;
use girandole_core::illumination::{Illumination, IlluminationSettings, Rewalk};
use girandole_core::image::Image;
use girandole_core::lights::LightSettings;
use girandole_core::scene::{Geometry, ObjectId, Scene, View};
use girandole_core::trace::SceneTracer;

pub const VIEWS: Figure = Figure {
    id: "4-11",
    title: "Passes before and after they are optimised",
    thesis: "Grouping objects that have lights in common takes substantially fewer render passes in each \
             of several views.",
    run: run_views,
};

pub const PILLAR: Figure = Figure {
    id: "4-12",
    title: "A pillar that fills the view",
    thesis: "A pillar in the foreground, which reads no shadow map, covers much of the picture: 447 passes \
             instead of 1563, and 24 frames a second instead of 18, with the time of the optimisation, \
             which is made anew in each frame.",
    run: run_pillar,
};

/// Those whose views are counted.
const ROOMS: [&str; 4] = ["block", "pillars", "table", "area-lights"];
/// The thesis's.
const LIGHTS_PER_PASS: u32 = 7;
/// The thesis's passes and frames a second in figure 4-12, before and after.
const THESIS: [[f64; 2]; 2] = [[1563.0, 18.0], [447.0, 24.0]];
/// Room, name, eye, target and vertical angle of views besides those of the rooms' cameras.
type OwnView = (&'static str, &'static str, [f64; 3], [f64; 3], f64);
const PILLAR_VIEW: OwnView = ("pillars", "behind a pillar", [1.75, 1.5, 1.95], [1.4, 1.25, 0.0], 60.0);
const OWN_VIEWS: [OwnView; 4] = [
    ("area-lights", "from the floor", [-3.5, 0.4, 2.5], [0.5, 0.8, -1.2], 60.0),
    ("table", "under the table", [0.6, 0.35, 1.6], [0.0, 0.4, -0.8], 60.0),
    PILLAR_VIEW,
    ("block", "from behind", [3.0, 1.2, -1.7], [0.5, 0.5, 0.5], 60.0),
];

/// Multipass shading with light maps. These two modes differ in the optimisation of passes and in nothing else.
fn settings(is_optimised: bool) -> RenderSettings {
    let mode = if is_optimised { Mode::Full } else { Mode::LowResolution };
    let shading = Shading::Multipass { lights_per_pass: LIGHTS_PER_PASS };
    RenderSettings { mode, light_maps: Some(true), shading, ..RenderSettings::default() }
}

fn own(view: &OwnView, size: [u32; 2]) -> Result<View> {
    let (_, _, [a, b, c], [x, y, z], degrees) = *view;
    looking(dvec3(a, b, c), dvec3(x, y, z), degrees, size)
}

/// A view, and its passes: after optimisation, and before.
struct Counted {
    name: String,
    passes: [u32; 2],
    picture: Image,
}

impl Counted {
    /// How much fewer passes it takes.
    fn saved(&self) -> f64 {
        1.0 - f64::from(self.passes[0]) / f64::from(self.passes[1].max(1))
    }
}

fn run_views(bench: &Bench) -> Result<Outcome> {
    let size = bench.of([[32, 24], [160, 120], [240, 180]]);
    let lights = bench.of([16, 300, 300]);
    let mut counted = Vec::new();
    for room in &ROOMS[..bench.of([2, 4, 4])] {
        count_room(bench, room, lights, size, &mut counted)?;
    }
    let mut outcome = Outcome::default();
    let mut table = Table::new(
        "passes",
        &format!("Passes of {LIGHTS_PER_PASS} lights"),
        &["number", "view", "before", "after", "saved %"],
    );
    for (number_of, view) in (1..).zip(&counted) {
        let Counted { name, passes: [after, before], picture } = view;
        let caption = format!("{number_of}. {name}: {before} passes, optimised {after}");
        outcome.pictures.push(Picture::new(&format!("view-{number_of}"), &caption, picture));
        let saved = number(view.saved() * 100.0, 0);
        table.row([number_of.to_string(), name.clone(), before.to_string(), after.to_string(), saved]);
    }
    outcome.tables.push(table);
    outcome.plots.push(bars(&counted));
    let least = counted.iter().min_by(|a, b| a.saved().total_cmp(&b.saved())).context("no view")?;
    let most = counted.iter().max_by(|a, b| a.saved().total_cmp(&b.saved())).context("no view")?;
    let fewer = counted.iter().filter(|view| view.passes[0] < view.passes[1]).count();
    let sums = [1, 0].map(|which| counted.iter().map(|view| view.passes[which]).sum::<u32>());
    outcome.seen = format!(
        "In {fewer} of {} views the optimisation takes fewer passes. It saves between {:.0} % ({}) and \
         {:.0} % ({}) of them; all views together take {} passes instead of {}.",
        counted.len(),
        least.saved() * 100.0,
        least.name,
        most.saved() * 100.0,
        most.name,
        sums[1],
        sums[0],
    );
    outcome.settings = format!(
        "{lights} light samples, placed for each room's first camera, {LIGHTS_PER_PASS} lights a pass, \
         light maps; objects are leaf receivers that may be in view. Pictures of {} × {} pixels.",
        size[0], size[1]
    );
    outcome.verdict = if fewer == counted.len() {
        Verdict::Agrees
    } else {
        Verdict::Differs(format!("{} views take as many passes as before.", counted.len() - fewer))
    };
    Ok(outcome)
}

/// Counts the passes of a room's views.
fn count_room(
    bench: &Bench,
    room: &str,
    lights: u32,
    size: [u32; 2],
    counted: &mut Vec<Counted>,
) -> Result<()> {
    let scene = bench.room(room)?;
    let lights = LightSettings { count: lights, ..LightSettings::default() };
    let mut stage = bench.stage(&scene, RendererOptions::default(), &lights)?;
    stage.size = size;
    let aspect = size[0] as f32 / size[1] as f32;
    let cameras =
        scene.cameras.iter().map(|camera| (camera.name.as_str(), View::new(&scene, camera, aspect)));
    let mut views: Vec<(&str, View)> = cameras.collect();
    for view in OWN_VIEWS.iter().filter(|view| view.0 == room) {
        views.push((view.1, own(view, size)?));
    }
    for (name, view) in views {
        stage.view = view;
        let picture = stage.picture(&settings(true))?;
        let passes = stage.stats()?.passes;
        let name = if name == room { room.into() } else { format!("{room}, {name}") };
        counted.push(Counted { name, passes, picture });
    }
    Ok(())
}

/// A bar for each number of each view.
fn bars(counted: &[Counted]) -> Plot {
    let title = format!("Passes of {LIGHTS_PER_PASS} lights");
    let mut plot = Plot::new("passes-bars", &title, "view (number in the table)", "passes");
    for (name, which, left) in [("before", 1, -0.35), ("after optimisation", 0, 0.0)] {
        let bar = |(x, view): (f64, &Counted)| {
            let (left, right, height) = (x + left, x + left + 0.35, f64::from(view.passes[which]));
            [[left, 0.0], [left, height], [right, height], [right, 0.0]]
        };
        let places = (1..).map(f64::from);
        plot.curve(name, places.zip(counted).flat_map(bar).collect());
    }
    plot
}

/// What figure 4-12 measures.
struct Measured {
    /// Passes after optimisation, and before.
    passes: [u32; 2],
    /// Milliseconds with and without optimisation, of a frame that keeps its passes and of one that makes them
    /// anew.
    times: [[f64; 2]; 2],
    /// Of one-dispatch shading, for reference.
    fused: f64,
    /// The largest difference of the two pictures, as a share of the brightest channel.
    difference: f32,
    /// Share of the picture that shows the pillar.
    covered: f64,
    /// Share of lights that read a shadow map, on the pillar and on all else.
    looked_up: [f64; 2],
}

fn run_pillar(bench: &Bench) -> Result<Outcome> {
    let size = bench.timed_size();
    let (lights, frames) = (bench.of([16, 300, 300]), bench.of([1, 7, 15]));
    let scene = bench.room(PILLAR_VIEW.0)?;
    let view = own(&PILLAR_VIEW, size)?;
    let settings_of_light = IlluminationSettings {
        lights: LightSettings { count: lights, ..LightSettings::default() },
        views: vec![view],
        rewalk: Rewalk::Off,
        ..IlluminationSettings::default()
    };
    let light = Illumination::new(&scene, &settings_of_light)?;
    let mut stage = bench.stage_with(&scene, RendererOptions::default(), light, (view, size))?;
    let pictures = [settings(true), settings(false)].map(|settings| stage.picture(&settings));
    let [after, before] = pictures;
    let (after, before) = (after?, before?);
    let brightest = before.pixels.iter().map(|pixel| pixel.max_element()).fold(0.0, f32::max);
    let pairs = before.pixels.iter().zip(&after.pixels);
    let difference = pairs.map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f32::max);
    let debug = RenderSettings { debug: Some(DebugView::States(None)), ..RenderSettings::default() };
    let states = stage.picture(&debug)?;
    let (covered, looked_up) = pillar_share(&scene, &view, &states)?;
    stage.picture(&settings(true))?;
    let passes = stage.stats()?.passes;
    let times = times(&mut stage, frames)?;
    let fused = stage.times(&[RenderSettings::default()], frames)?[0];
    let difference = difference / brightest.max(f32::MIN_POSITIVE);
    let measured = Measured { passes, times, fused, difference, covered, looked_up };
    let mut outcome = judged(&measured);
    let caption = format!("The view; the pillar covers {:.0} % of it", covered * 100.0);
    outcome.pictures.push(Picture::new("view", &caption, &after));
    outcome.pictures.push(Picture::of_colors(
        "states",
        "How many of the lights read a shadow map; white: all",
        &states,
    ));
    outcome.settings = format!(
        "{} × {} pixels, {lights} light samples placed for this view, {LIGHTS_PER_PASS} lights a pass, \
         light maps, low resolution; modes that differ in nothing but the optimisation, in turn; medians \
         of {frames} frames.",
        size[0], size[1]
    );
    Ok(outcome)
}

/// Share of the picture that shows the pillar in the middle; the mean of the states on it, and on all else.
fn pillar_share(scene: &Scene, view: &View, states: &Image) -> Result<(f64, [f64; 2])> {
    let geometry = Geometry::new(scene);
    let size = [states.width, states.height];
    let points = points(&SceneTracer::new(scene, &geometry), view, size);
    let pillar = scene.objects.iter().position(|object| object.name == "pillar 4").context("no pillar")?;
    let pillar = ObjectId::from(pillar);
    let is_on: Vec<bool> = points.iter().map(|p| p.is_some_and(|p| p.object == pillar)).collect();
    let is_off: Vec<bool> = is_on.iter().map(|is_on| !is_on).collect();
    let share = is_on.iter().filter(|is_on| **is_on).count() as f64 / is_on.len() as f64;
    let looked_up = [is_on, is_off].map(|pixels| mean(states, &pixels).map_or(0.0, |mean| mean.y));
    Ok((share, looked_up))
}

/// Median milliseconds with and without optimisation, of frames that keep their passes and of frames that make
/// them anew: the renderer
/// keeps those of the last settings alone.
fn times(stage: &mut Stage, frames: usize) -> Result<[[f64; 2]; 2]> {
    let mut times = [const { [const { Vec::new() }; 2] }; 2];
    for _ in 0..frames {
        for (is_optimised, [kept, anew]) in [true, false].into_iter().zip(&mut times) {
            let settings = settings(is_optimised);
            anew.push(stage.frame(&settings)?);
            kept.push(stage.frame(&settings)?);
        }
    }
    Ok(times.map(|times| times.map(median)))
}

fn judged(measured: &Measured) -> Outcome {
    let Measured {
        passes: [after, before],
        times: [optimised, plain],
        fused,
        difference,
        covered,
        looked_up,
    } = measured;
    let mut table =
        Table::new("frames", "Passes and times", &["way", "passes", "passes kept ms", "passes made anew ms"]);
    for (way, passes, times) in [("before", before, plain), ("optimised", after, optimised)] {
        table.row([way.into(), passes.to_string(), number(times[0], 2), number(times[1], 2)]);
    }
    table.row(["one dispatch".into(), "0".into(), number(*fused, 2), String::new()]);
    let ratio = f64::from(*before) / f64::from((*after).max(1));
    let [[thesis_before, _], [thesis_after, _]] = THESIS;
    let gained = [0, 1].map(|i| plain[i] / optimised[i]);
    let thesis_gained = THESIS[1][1] / THESIS[0][1];
    let seen = format!(
        "{after} passes instead of {before}, {ratio:.1} times fewer (the thesis: {:.1} times). On the \
         pillar, which covers {:.0} % of the picture, {:.1} % of the lights read a shadow map, elsewhere \
         {:.1} %. A frame that keeps its passes takes {:.1} ms instead of {:.1}: {:.2} times as many \
         frames a second (the thesis: {thesis_gained:.2}); one that makes them anew, {:.1} instead of \
         {:.1}. The pictures differ by {difference:.0e} of the brightest value at most. One dispatch, our \
         default, takes {fused:.1} ms.",
        thesis_before / thesis_after,
        covered * 100.0,
        looked_up[0] * 100.0,
        looked_up[1] * 100.0,
        optimised[0],
        plain[0],
        gained[0],
        optimised[1],
        plain[1],
    );
    let verdict = if ratio < 2.0 {
        Verdict::Differs(format!("There are only {ratio:.2} times fewer passes."))
    } else if gained[0] < 1.05 {
        Verdict::Differs(format!(
            "The passes become {ratio:.1} times fewer, and the frame takes {:.2} of the time: all passes \
             are one indirect draw here, which costs the CPU the same however many there are.",
            1.0 / gained[0]
        ))
    } else {
        Verdict::Agrees
    };
    Outcome { tables: vec![table], seen, verdict, ..Outcome::default() }
}
