//! What everything costs, as powers of how much of it there is.

use super::Figure;
use super::fit::{exponent, two};
use super::motion::{Motion, milliseconds};
use super::swarm::swarm;
use crate::bench::{Bench, first_view};
use crate::report::{Outcome, Plot, Table, Verdict, number};
use anyhow::Result;
use girandole::{MapUpdates, Mode, RenderSettings, RendererOptions};
use girandole_core::illumination::{Illumination, IlluminationSettings, Rewalk};
use girandole_core::lights::LightSettings;
use girandole_core::scene::builtin::{self, MovingObject};
use girandole_core::scene::{MaterialId, Scene};
use std::time::Instant;

pub const FIGURE: Figure = Figure {
    id: "cost",
    title: "What everything costs",
    thesis: "Which power of the number of lights, triangles, movers, pixels and drawn shadow maps does each part \
             of the work grow by?",
    run,
};

/// A part of the work, with its milliseconds for each amount.
type Part = (&'static str, Vec<[f64; 2]>);

/// What parts of the work cost, by how much there is of something.
struct Law {
    /// Of what.
    amount: &'static str,
    /// How the rest was.
    at: String,
    parts: Vec<Part>,
}

impl Law {
    /// Of parts that are all measured for one amount after another.
    fn measure<const N: usize>(
        (amount, at): (&'static str, String),
        names: [&'static str; N],
        amounts: &[u32],
        mut measure: impl FnMut(u32) -> Result<(f64, [f64; N])>,
    ) -> Result<Self> {
        let mut parts: Vec<Part> = names.into_iter().map(|name| (name, Vec::new())).collect();
        for &wanted in amounts {
            let (amount, times) = measure(wanted)?;
            parts.iter_mut().zip(times).for_each(|((_, points), time)| points.push([amount, time]));
        }
        Ok(Self { amount, at, parts })
    }

    /// By all of the points, and by the last two.
    fn exponents(points: &[[f64; 2]]) -> [f64; 2] {
        [exponent(points), exponent(&points[points.len().saturating_sub(2)..])]
    }

    fn plot(&self) -> Plot {
        let title = format!("Time against {}", self.amount);
        let name = format!("{}-cost", self.name());
        let largest = self.parts.iter().flat_map(|(_, points)| points).map(|p| p[0]).fold(0.0, f64::max);
        // Numbers of many digits would run into one another.
        let (unit, x) = match largest > 1e4 {
            true => (1e3, format!("thousand {}", self.amount)),
            false => (1.0, self.amount.into()),
        };
        let mut plot = Plot::logarithmic(&name, &title, &x, "milliseconds");
        for (part, points) in &self.parts {
            let legend = format!("{part}, exponent {}", two(exponent(points)));
            plot.curve(&legend, points.iter().map(|point| [point[0] / unit, point[1]]).collect());
        }
        plot
    }

    fn table(&self) -> Table {
        let caption = format!("Time against {}; {}", self.amount, self.at);
        let mut table = Table::new(&format!("{}-times", self.name()), &caption, &[self.amount]);
        table.columns.extend(self.parts.iter().map(|(part, _)| format!("{part} ms")));
        for i in 0..self.parts.first().map_or(0, |(_, points)| points.len()) {
            let amount = self.parts[0].1[i][0];
            let digits = if amount.fract() == 0.0 { 0 } else { 1 };
            let times = self.parts.iter().map(|(_, points)| two(points[i][1]));
            table.rows.push(std::iter::once(number(amount, digits)).chain(times).collect());
        }
        table
    }

    fn name(&self) -> String {
        self.amount.replace(' ', "-")
    }

    fn seen(&self) -> String {
        let parts: Vec<String> = self
            .parts
            .iter()
            .map(|(part, points)| {
                let [all, end] = Self::exponents(points).map(two);
                format!("{part} {all} ({end} at the end)")
            })
            .collect();
        format!("With the number of {}: {}.", self.amount, parts.join(", "))
    }
}

fn run(bench: &Bench) -> Result<Outcome> {
    let laws = [lights(bench)?, triangles(bench)?, movers(bench)?, pixels(bench)?, maps(bench)?];
    let columns = ["amount", "from", "to", "part", "exponent of the ms", "exponent at the end of the ms"];
    let mut exponents =
        Table::new("laws", "Exponents by least squares on logarithms, and by the last two points", &columns);
    for law in &laws {
        for (part, points) in &law.parts {
            let end = |point: Option<&[f64; 2]>| number(point.map_or(0.0, |point| point[0]), 0);
            let [all, last] = Law::exponents(points).map(two);
            let ends = [end(points.first()), end(points.last())];
            let [from, to] = ends;
            exponents.row([law.amount.into(), from, to, (*part).into(), all, last]);
        }
    }
    let mut outcome = Outcome { tables: vec![exponents], verdict: Verdict::Shown, ..Outcome::default() };
    outcome.plots = laws.iter().map(Law::plot).collect();
    outcome.tables.extend(laws.iter().map(Law::table));
    let seen: Vec<String> = laws.iter().map(Law::seen).collect();
    outcome.seen = format!("Exponents of time. {}", seen.join(" "));
    let [width, height] = bench.timed_size();
    outcome.settings = format!(
        "{width} × {height} pixels where they are not what grows, {} light samples likewise, seed 0; maps of 128 \
         texels against lights and triangles; frames in mode full without motion as the least of {}; those with \
         motion as means over the path's start, of each frame the least of two times.",
        many_lights(bench),
        frames(bench)
    );
    Ok(outcome)
}

fn many_lights(bench: &Bench) -> u32 {
    bench.of([16, 300, 300])
}

fn frames(bench: &Bench) -> usize {
    bench.of([1, 3, 5])
}

/// Milliseconds of sampling light and determining visibility, of drawing all shadow maps, and of a frame.
fn opened(bench: &Bench, scene: &Scene, lights: u32) -> Result<(f64, [f64; 3])> {
    let size = bench.timed_size();
    let view = first_view(scene, size)?;
    let settings = IlluminationSettings {
        lights: LightSettings { count: lights, ..LightSettings::default() },
        views: vec![view],
        rewalk: Rewalk::Off,
        ..IlluminationSettings::default()
    };
    let start = Instant::now();
    let illumination = Illumination::new(scene, &settings)?;
    let light = milliseconds(start);
    // Maps of one size, however many there are.
    let options = RendererOptions { map_size: Some(128), ..RendererOptions::default() };
    let mut stage = bench.stage_with(scene, options, illumination, (view, size))?;
    bench.gpu.wait()?;
    let start = Instant::now();
    stage.renderer.draw_shadow_maps(&MapUpdates::default())?;
    bench.gpu.wait()?;
    let maps = milliseconds(start);
    let frame = stage.least_times(&[RenderSettings::default()], frames(bench))?[0];
    Ok((stage.lights() as f64, [light, maps, frame]))
}

const OPENED: [&str; 3] = ["light and visibility", "all shadow maps", "frame"];

fn lights(bench: &Bench) -> Result<Law> {
    let scene = bench.room("table")?;
    let counts = bench.of([&[8, 16][..], &[30, 100, 300], &[30, 100, 300, 1000, 3000]]);
    // Once for what is compiled.
    opened(bench, &scene, counts[0])?;
    Law::measure(("lights", "table".into()), OPENED, counts, |count| opened(bench, &scene, count))
}

fn triangles(bench: &Bench) -> Result<Law> {
    let segments = bench.of([&[3, 6][..], &[4, 12, 36], &[6, 12, 24, 48, 96]]);
    let at = format!("table with teapots of more and more triangles, {} lights", many_lights(bench));
    Law::measure(("triangles", at), OPENED, segments, |segments| {
        let teapot = builtin::teapot(segments, MaterialId(0));
        let scene = builtin::build("table", MovingObject::Model(Box::new(teapot)))?;
        let (_, times) = opened(bench, &scene, many_lights(bench))?;
        let of_objects = scene.objects.iter().map(|object| scene.meshes[object.mesh].triangles.len());
        Ok((of_objects.sum::<usize>() as f64, times))
    })
}

/// What moves costs these parts of a frame.
const MOVING: [&str; 3] = ["visibility", "shadow maps", "frame with update"];

fn movers(bench: &Bench) -> Result<Law> {
    let counts = bench.of([&[1, 2][..], &[1, 4, 16], &[1, 4, 16, 64, 200]]);
    let lights = many_lights(bench);
    let at = format!("block with tori of 192 triangles that all move, {lights} lights, all stale maps drawn");
    Law::measure(("movers", at), MOVING, counts, |count| {
        let mut motion = Motion::new(bench, swarm(count as usize)?, lights, bench.timed_size(), true)?;
        motion.path(lights, 1)?;
        let cost = motion.mean_path(lights, bench.of([1, 2, 3]))?;
        Ok((f64::from(count), [cost.visibility, cost.maps, cost.total()]))
    })
}

fn pixels(bench: &Bench) -> Result<Law> {
    let scene = bench.room("table")?;
    let widths = bench.of([&[32, 64][..], &[80, 160, 320], &[64, 128, 256, 512, 1024]]);
    let lights = LightSettings { count: many_lights(bench), ..LightSettings::default() };
    let at = format!("table, {} lights, nothing moves", lights.count);
    Law::measure(("pixels", at), ["naive frame", "frame"], widths, |width| {
        let size = [width, width * 3 / 4];
        let modes =
            [Mode::Naive, Mode::Full].map(|mode| RenderSettings { mode, ..RenderSettings::default() });
        let mut stage = bench.stage_of_size(&scene, RendererOptions::default(), &lights, size)?;
        let times = stage.least_times(&modes, bench.of([1, 1, 2]))?;
        Ok((f64::from(size[0]) * f64::from(size[1]), [times[0], times[1]]))
    })
}

fn maps(bench: &Bench) -> Result<Law> {
    let counts = bench.of([&[2, 8][..], &[25, 75, 225], &[15, 30, 60, 120, 240]]);
    let scene = builtin::build("pillars", MovingObject::Torus)?;
    let mut motion = Motion::new(bench, scene, many_lights(bench), bench.timed_size(), true)?;
    motion.path(1, 1)?;
    let at = format!("pillars with a torus that moves, {} lights", many_lights(bench));
    Law::measure(("maps drawn", at), ["shadow maps", "frame with update"], counts, |count| {
        let cost = motion.mean_path(count, bench.of([1, 3, 10]))?;
        Ok((cost.drawn, [cost.maps, cost.total()]))
    })
}
