//! Figure 5-9: colour that a wall bleeds onto an object, and a pillar between the two.

use super::Figure;
use super::views::{Point, around, looking, mean, part, points, put, within};
use crate::bench::{Bench, Stage, moving_object};
use crate::report::{Outcome, Picture, Table, Verdict, number};
use anyhow::{Context, Result};
use girandole::{RenderSettings, RendererOptions};
use girandole_core::glam::{DVec3, dvec3};
use girandole_core::illumination::{Illumination, IlluminationSettings, Rewalk};
use girandole_core::image::Image;
use girandole_core::lights::LightSettings;
use girandole_core::scene::builtin::{self, MovingObject};
use girandole_core::scene::{Geometry, ObjectId, Scene, View};
use girandole_core::tonemap::Exposure;
use girandole_core::trace::SceneTracer;
use girandole_reference::{PathSettings, path_trace};

pub const FIGURE: Figure = Figure {
    id: "5-9",
    title: "Colour that a pillar keeps off",
    thesis: "Colour that the green wall bleeds onto a moving object disappears when the object moves \
             behind a pillar.",
    run,
};

/// Where the object floats: in the open, and behind a pillar as the wall sees it.
const OPEN: DVec3 = dvec3(-1.2, 0.91, 0.35);
const BEHIND: DVec3 = dvec3(-1.2, 0.91, 1.3);
/// Its largest extent, metres: less than the pillar's width.
const SIZE: f64 = 0.32;
const EYE: DVec3 = dvec3(-1.35, 1.1, 3.0);
const TARGET: DVec3 = dvec3(-1.5, 0.9, 0.8);
const ANGLE: f64 = 42.0;
/// What faces the wall is within this cosine of its normal.
const FACING: f32 = 0.5;

/// Where the object is, and whether the pillar stands.
struct Case {
    name: &'static str,
    file: &'static str,
    at: DVec3,
    has_pillar: bool,
}

const CASES: [Case; 3] = [
    Case { name: "in the open", file: "open", at: OPEN, has_pillar: true },
    Case { name: "behind the pillar", file: "behind", at: BEHIND, has_pillar: true },
    Case { name: "there, without the pillar", file: "without", at: BEHIND, has_pillar: false },
];

/// What is seen of a case.
struct Seen {
    picture: Image,
    /// The object, larger.
    close: Image,
    /// Green over red with the green wall, and with a white one.
    ratios: [Ratios; 2],
}

/// Green over red, by our light and by the path tracer: of what faces the wall, and of all of the object that
/// is seen.
type Ratios = [[f64; 2]; 2];

/// Of what faces the wall.
const FACING_WALL: usize = 0;
/// Of all of the object that is seen.
const WHOLE: usize = 1;

impl Seen {
    /// How much greener the object, or what of it faces the wall, is for the wall's green, by us and by the
    /// path tracer.
    fn bled(&self, of: usize) -> [f64; 2] {
        let [green, white] = self.ratios;
        [0, 1].map(|by| green[by][of] / white[by][of] - 1.0)
    }
}

fn run(bench: &Bench) -> Result<Outcome> {
    let (moving, name) = bench.bunny()?;
    let seen = CASES.iter().map(|case| see(bench, case, &moving)).collect::<Result<Vec<Seen>>>()?;
    let mut outcome = Outcome::default();
    let columns = [
        "the object",
        "green over red",
        "with a white wall",
        "greener for the wall %",
        "by the path tracer %",
        "all of it greener %",
        "all of it by the path tracer %",
    ];
    let mut table = Table::new("colour", "Mean colour of the object's pixels that face the wall", &columns);
    let ev = seen.first().map_or(0.0, |first| Exposure::Auto.ev(&first.picture));
    for (case, seen) in CASES.iter().zip(&seen) {
        let [ours, truth] = seen.bled(FACING_WALL);
        let whole = seen.bled(WHOLE);
        let [green, white] = seen.ratios.map(|ratios| ratios[0][FACING_WALL]);
        let percent = |share: f64| number(share * 100.0, 1);
        table.row([
            case.name.into(),
            number(green, 3),
            number(white, 3),
            percent(ours),
            percent(truth),
            percent(whole[0]),
            percent(whole[1]),
        ]);
        let caption = format!("{name} {}: {:.1} % greener for the wall", case.name, ours * 100.0);
        outcome.pictures.push(Picture::exposed(case.file, &caption, &seen.picture, ev));
    }
    for (case, seen) in CASES.iter().zip(&seen) {
        let caption = format!("{}, closer", case.name);
        outcome.pictures.push(Picture::exposed(&format!("{}-close", case.file), &caption, &seen.close, ev));
    }
    let [open, behind, without] = &seen[..] else { anyhow::bail!("a case is missing") };
    let whole = [open, behind].map(|seen| seen.bled(WHOLE)[0] * 100.0);
    let [open, behind, without] = [open, behind, without].map(|seen| seen.bled(FACING_WALL));
    let left = [0, 1].map(|which| behind[which] / open[which]);
    outcome.seen = format!(
        "In the open the wall makes what of the {name} faces it {:.1} % greener, behind the pillar {:.1} \
         %: {:.0} % of it is left (by the path tracer {:.1} and {:.1} %, {:.0} % is left). At the same \
         place without the pillar it is {:.1} % (path tracer {:.1} %). All of it that is seen is {:.1} % \
         greener in the open and {:.1} % behind.",
        open[0] * 100.0,
        behind[0] * 100.0,
        left[0] * 100.0,
        open[1] * 100.0,
        behind[1] * 100.0,
        left[1] * 100.0,
        without[0] * 100.0,
        without[1] * 100.0,
        whole[0],
        whole[1],
    );
    outcome.settings = settings(bench, name);
    outcome.tables.push(table);
    outcome.verdict = if open[0] > 0.05 && left[0] < 1.0 / 3.0 && without[0] > 2.0 * behind[0] {
        Verdict::Agrees
    } else {
        Verdict::Differs(format!(
            "Behind the pillar {:.0} % of the wall's green is left, by the path tracer {:.0} %.",
            left[0] * 100.0,
            left[1] * 100.0
        ))
    };
    Ok(outcome)
}

fn paths(bench: &Bench) -> u32 {
    bench.of([2, 64, 96])
}

fn lights(bench: &Bench) -> u32 {
    bench.of([16, 300, 300])
}

fn settings(bench: &Bench, name: &str) -> String {
    let [width, height] = bench.picture_size();
    format!(
        "pillars, {name} of {SIZE} m; {width} × {height} pixels, {} light samples, five bounces, placed \
         for this view. Measured in the closer pictures: the mean radiance of the pixels of the object \
         within 60° of facing the wall, its green over its red, against the same with a white wall. Path \
         tracer: {} paths, five bounces.",
        lights(bench),
        paths(bench)
    )
}

fn see(bench: &Bench, case: &Case, moving: &MovingObject) -> Result<Seen> {
    let size = bench.picture_size();
    let view = looking(EYE, TARGET, ANGLE, size)?;
    let (scene, object) = scene(case, moving, false)?;
    let geometry = Geometry::new(&scene);
    let tracer = SceneTracer::new(&scene, &geometry);
    let region = around(&within(&points(&tracer, &view, size), object, size), size, size[0] / 80)?;
    let factor = (size[1] / region.size[1]).max(1);
    let close_size = region.size.map(|side| side * factor);
    let close_view = part(&view, size, region);
    // At toy scale the part itself has too few pixels.
    let traced_size = bench.of([close_size, region.size, region.size]);
    let ratios = |scene: &Scene, stage: &mut Stage| -> Result<(Image, Ratios)> {
        (stage.view, stage.size) = (close_view, close_size);
        let close = stage.picture(&RenderSettings::default())?;
        let geometry = Geometry::new(scene);
        let tracer = SceneTracer::new(scene, &geometry);
        let settings = PathSettings { paths: paths(bench), bounces: Some(5), seed: 0 };
        let truth = path_trace(&tracer, &close_view, traced_size, &settings, &|_| ()).mean;
        let ours = green_over_red(&tracer, object, &close_view, &close)?;
        Ok((close, [ours, green_over_red(&tracer, object, &close_view, &truth)?]))
    };
    let mut stage = stage(bench, &scene, view)?;
    let picture = stage.picture(&RenderSettings::default())?;
    let (close, green) = ratios(&scene, &mut stage)?;
    let (white_scene, _) = self::scene(case, moving, true)?;
    let (_, white) = ratios(&white_scene, &mut self::stage(bench, &white_scene, view)?)?;
    Ok(Seen { picture, close, ratios: [green, white] })
}

/// The room, perhaps with a white wall in the green one's place.
fn scene(case: &Case, moving: &MovingObject, is_white: bool) -> Result<(Scene, ObjectId)> {
    let mut scene = builtin::build("pillars", moving.clone())?;
    let object = moving_object(&scene)?;
    let material = |name: &str| scene.materials.iter().position(|material| material.name == name);
    let (green, white) = material("green").zip(material("white")).context("no green or no white material")?;
    if is_white {
        scene.materials[green].base_color = scene.materials[white].base_color;
    }
    put(&mut scene, object, SIZE, case.at);
    if !case.has_pillar {
        let pillar =
            scene.objects.iter().position(|object| object.name == "pillar 3").context("no pillar")?;
        scene.remove_object(pillar.into())?;
    }
    scene.take_changes();
    Ok((scene, object))
}

fn stage<'a>(bench: &'a Bench, scene: &Scene, view: View) -> Result<Stage<'a>> {
    let settings = IlluminationSettings {
        lights: LightSettings { count: lights(bench), ..LightSettings::default() },
        views: vec![view],
        rewalk: Rewalk::Off,
        ..IlluminationSettings::default()
    };
    let light = Illumination::new(scene, &settings)?;
    bench.stage_with(scene, RendererOptions::default(), light, (view, bench.picture_size()))
}

/// Of the object's pixels that face the wall, and of all of them.
fn green_over_red(tracer: &SceneTracer, object: ObjectId, view: &View, picture: &Image) -> Result<[f64; 2]> {
    let size = [picture.width, picture.height];
    let points = points(tracer, view, size);
    let whole = within(&points, object, size);
    let faces = |point: &Option<Point>| point.is_some_and(|point| point.normal.x < -FACING);
    let facing: Vec<bool> = whole.iter().zip(&points).map(|(is_in, point)| *is_in && faces(point)).collect();
    let ratio = |pixels: &[bool]| -> Result<f64> {
        let mean = mean(picture, pixels).context("nothing of the object that faces the wall is seen")?;
        Ok(mean.y / mean.x.max(f64::MIN_POSITIVE))
    };
    Ok([ratio(&facing)?, ratio(&whole)?])
}
