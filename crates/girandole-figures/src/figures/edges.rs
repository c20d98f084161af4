//! Figures 4-7 and 4-8: light interpolated between every few pixels, without edges, and with edges found by steps of
//! one pixel and of several.

use super::Figure;
use super::low_resolution::{Interpolated, Surfaces, error, percent, relative_errors, wrong};
use crate::bench::{Bench, Stage};
use crate::report::{Outcome, Picture, Plot, Table, Verdict, magnified, number};
use anyhow::Result;
use girandole::{DebugView, Mode, RenderSettings, RendererOptions};
use girandole_core::glam::Vec3;
use girandole_core::image::{Image, Region, luminance};
use girandole_core::lights::LightSettings;
use girandole_core::tonemap::Exposure;

/// Pixels from point to point.
const SPACING: u32 = 4;
/// Pixels of what is magnified, and by how much.
const CROP: [u32; 2] = [48, 36];
const FACTOR: u32 = 6;
/// With edges, the error of figure 4-7 has to be this much smaller for it to agree.
const MUCH: f64 = 4.0;
const ROOM: &str = "pillars";

pub const WITHOUT: Figure = Figure {
    id: "4-7",
    title: "Interpolation without edge detection",
    thesis: "Light computed at a low resolution and interpolated is smooth, but has an unacceptable jagged look \
             at the edges of objects.",
    run: without_edges,
};

pub const STEPS: Figure = Figure {
    id: "4-8",
    title: "Edge detection by steps of one pixel and of several",
    thesis: "Where edges are found by stepping one pixel in each direction, colour bleeds across them as light \
             is interpolated; stepping several pixels corrects that.",
    run: steps,
};

/// The view, and what is to be interpolated in it.
struct View<'a> {
    stage: Stage<'a>,
    surfaces: Surfaces,
    full: Image,
    ev: f32,
}

impl<'a> View<'a> {
    fn new(bench: &'a Bench) -> Result<Self> {
        let scene = bench.room(ROOM)?;
        let lights = LightSettings { count: bench.of([16, 100, 300]), ..LightSettings::default() };
        let mut stage = bench.stage(&scene, RendererOptions::default(), &lights)?;
        let full = stage.picture(&RenderSettings { mode: Mode::Visibility, ..RenderSettings::default() })?;
        let surfaces = Surfaces::new(&scene, &stage.view, stage.size);
        let ev = Exposure::Auto.ev(&full);
        Ok(Self { stage, surfaces, full, ev })
    }

    /// Interpolated, with edges found by this step; 0 = without.
    fn by_step(&self, step: u32) -> Interpolated {
        self.surfaces.interpolate(&self.full, SPACING, &self.surfaces.edges(step))
    }

    fn settings(&self) -> String {
        let [width, height] = self.stage.size;
        format!(
            "{ROOM}, {width} × {height} pixels, {} light samples, points every {SPACING} pixels. Light is that \
             of visibility determination at every pixel; planes differ by 5° or 1 cm.",
            self.stage.lights()
        )
    }

    /// A part of a picture, magnified.
    fn crop(&self, name: &str, caption: &str, image: &Image, region: Region) -> Picture {
        Picture::exposed(name, caption, &magnified(image, region, FACTOR), self.ev)
    }

    /// What was interpolated by steps of so many pixels, and a part of it.
    fn pictures(&self, name: &str, what: &str, result: &Interpolated, region: Region) -> [Picture; 3] {
        let caption = format!("steps of {what}: what is interpolated, green");
        let same = format!("steps of {what}: the same part");
        [
            self.green(&format!("{name}-green"), &caption, result, None),
            self.green(&format!("{name}-green-crop"), "a part of it, magnified", result, Some(region)),
            self.crop(&format!("{name}-crop"), &same, &result.picture, region),
        ]
    }

    /// A picture, or a part of it, with what was interpolated in green.
    fn green(&self, name: &str, caption: &str, result: &Interpolated, region: Option<Region>) -> Picture {
        let scale = self.ev.exp2();
        let color = |(&radiance, &is_green): (&Vec3, &bool)| {
            let grey = luminance(radiance) * scale;
            let grey = grey / (1.0 + grey);
            if is_green { Vec3::new(0.05, 0.25 + 0.6 * grey, 0.05) } else { Vec3::splat(grey) }
        };
        let pixels = result.picture.pixels.iter().zip(&result.pixels).map(color).collect();
        let image = Image { pixels, ..result.picture.clone() };
        let image = region.map_or_else(|| image.clone(), |region| magnified(&image, region, FACTOR));
        Picture::of_colors(name, caption, &image)
    }
}

/// The part of a picture in which it is most wrong, by the sum of errors of up to 1 each.
fn worst_region(full: &Image, test: &Image) -> Region {
    let errors = relative_errors(full, test);
    let size = [CROP[0].min(full.width), CROP[1].min(full.height)];
    let mut worst = (Region { first: [0; 2], size }, 0.0);
    for y in (0..=full.height - size[1]).step_by(4) {
        for x in (0..=full.width - size[0]).step_by(4) {
            let region = Region { first: [x, y], size };
            let rows = region.rows(full.width).flat_map(|row| &errors[row]);
            let sum: f32 = rows.map(|error| error.min(1.0)).sum();
            if sum > worst.1 {
                worst = (region, sum);
            }
        }
    }
    worst.0
}

fn without_edges(bench: &Bench) -> Result<Outcome> {
    let view = View::new(bench)?;
    let [none, with] = [0, SPACING].map(|step| view.by_step(step));
    let region = worst_region(&view.full, &none.picture);
    let mut outcome = Outcome { settings: view.settings(), ..Outcome::default() };
    outcome.pictures = vec![
        Picture::exposed("without", "interpolated, without edges", &none.picture, view.ev),
        view.crop("without-crop", "a part of it, magnified", &none.picture, region),
        view.crop("with-crop", "with edges, which are shaded at every pixel", &with.picture, region),
        view.crop("full-crop", "shaded at every pixel", &view.full, region),
    ];
    let mut table = Table::new(
        "errors",
        "Interpolated pictures, compared with one that is shaded at every pixel",
        &["picture", "pixels interpolated %", "relMSE", "pixels off by a tenth %"],
    );
    let mut errors = Vec::new();
    for (name, result) in [("without edges", &none), ("with edges", &with)] {
        let found = error(&view.full, &result.picture)?;
        let off = percent(&wrong(&view.full, &result.picture));
        table.row([
            name.into(),
            number(percent(&result.pixels), 1),
            format!("{:.1e}", found.rel_mse),
            number(off, 2),
        ]);
        errors.push((found.rel_mse, off));
    }
    // Of what is wrong without edges, what lies next to one.
    let near = view.surfaces.edges(SPACING);
    let off = wrong(&view.full, &none.picture);
    let at_edges: Vec<bool> = off.iter().zip(&near).filter(|(off, _)| **off).map(|(_, near)| *near).collect();
    let [(before, off), (after, off_after)] = [errors[0], errors[1]];
    outcome.seen = format!(
        "Without edges relMSE is {before:.1e} and {off:.1} % of the pixels are off by more than a tenth; {:.0} % \
         of these lie within {SPACING} pixels of an edge, where stairs of {SPACING} pixels show. With edges \
         shaded at every pixel relMSE is {after:.1e}, and {off_after:.1} % are off.",
        percent(&at_edges)
    );
    outcome.tables.push(table);
    outcome.verdict = if before > MUCH * after && percent(&at_edges) > 50.0 {
        Verdict::Agrees
    } else {
        let ratio = before / after;
        Verdict::Differs(format!(
            "edges lower relMSE by a factor of {ratio:.1}, and {:.0} % of what is wrong lies at them",
            percent(&at_edges)
        ))
    };
    Ok(outcome)
}

fn steps(bench: &Bench) -> Result<Outcome> {
    let mut view = View::new(bench)?;
    let mut outcome = Outcome { settings: view.settings(), ..Outcome::default() };
    let mut table = Table::new(
        "steps",
        "By how far is stepped to find edges, compared with a picture that is shaded at every pixel",
        &["edges", "pixels interpolated %", "relMSE", "pixels off by a tenth %"],
    );
    let mut plot = Plot::new("steps", "Error by step", "step, pixels", "share of pixels, %; relMSE × 1000");
    let mut curves = [Vec::new(), Vec::new()];
    let mut results = Vec::new();
    for step in [1, 2, 3, SPACING, 6, 8] {
        let result = view.by_step(step);
        let found = error(&view.full, &result.picture)?;
        let off = percent(&wrong(&view.full, &result.picture));
        let name = format!("step {step}");
        table.row([
            name,
            number(percent(&result.pixels), 1),
            format!("{:.1e}", found.rel_mse),
            number(off, 2),
        ]);
        curves[0].push([f64::from(step), off]);
        curves[1].push([f64::from(step), found.rel_mse * 1e3]);
        results.push((step, result, found.rel_mse, off));
    }
    let [off, rel_mse] = curves;
    plot.curve("pixels off by a tenth, %", off);
    plot.curve("relMSE × 1000", rel_mse);
    outcome.plots.push(plot);
    let several = results.iter().position(|(step, ..)| *step == SPACING).unwrap_or(0);
    let (_, one, one_error, one_off) = &results[0];
    let (_, wide, wide_error, wide_off) = &results[several];
    let region = worst_region(&wide.picture, &one.picture);
    for (name, what, result) in [("one", "one pixel", one), ("several", "several pixels", wide)] {
        outcome.pictures.extend(view.pictures(name, what, result, region));
    }
    outcome.pictures.push(view.crop("full-crop", "shaded at every pixel", &view.full, region));
    let seen = format!(
        "With steps of one pixel relMSE is {one_error:.1e} and {one_off:.2} % of the pixels are off by more than \
         a tenth, as light of the other surface bleeds across edges; with steps of {SPACING} pixels \
         {wide_error:.1e} and {wide_off:.2} %. For that {:.1} % of the pixels are interpolated in place of {:.1} \
         %.",
        percent(&wide.pixels),
        percent(&one.pixels)
    );
    outcome.verdict = if *one_error > 2.0 * wide_error && one_off > wide_off {
        Verdict::Agrees
    } else {
        Verdict::Differs(format!(
            "relMSE with steps of one pixel is {:.1} times that with steps of {SPACING}",
            one_error / wide_error
        ))
    };
    outcome.seen = format!("{seen} {}", own_grids(&mut view, &mut outcome, &mut table, region)?);
    outcome.tables.push(table);
    Ok(outcome)
}

/// Girandole's own low resolution beside it; what is seen.
fn own_grids(view: &mut View, outcome: &mut Outcome, table: &mut Table, region: Region) -> Result<String> {
    let settings = RenderSettings { mode: Mode::LowResolution, ..RenderSettings::default() };
    let picture = view.stage.picture(&settings)?;
    let points: u64 = view.stage.stats()?.points[..4].iter().sum();
    let levels =
        view.stage.picture(&RenderSettings { debug: Some(DebugView::Levels), mirrors: 0, ..settings })?;
    let interpolated = 100.0 * (1.0 - points as f64 / picture.pixels.len() as f64);
    let found = error(&view.full, &picture)?;
    let off = percent(&wrong(&view.full, &picture));
    table.row([
        "Girandole's grids".into(),
        number(interpolated, 1),
        format!("{:.1e}", found.rel_mse),
        number(off, 2),
    ]);
    let caption =
        "Girandole's grids: points every 8 pixels blue, 4 green, 2 yellow, 1 red; the rest is interpolated";
    outcome.pictures.push(Picture::of_colors("grids", caption, &levels));
    outcome.pictures.push(view.crop("grids-crop", "Girandole's grids: the same part", &picture, region));
    Ok(format!(
        "Girandole's own grids interpolate {interpolated:.1} %, with a relMSE of {:.1e} and {off:.2} % off by a \
         tenth.",
        found.rel_mse
    ))
}
