//! Figures 4-13 and 4-14: an object lit by precomputed radiance transfer, what it hides from itself, and a
//! shadow's edge across it.

use super::Figure;
use super::lit::{CENTER, GRID, Lit, MAPS, Subject, Way, light, table};
use super::views::{mean, put};
use crate::bench::{Bench, moving_object};
use crate::report::{Outcome, Picture, Plot, Verdict, number};
use anyhow::Result;
use girandole_core::glam::{DVec3, Vec2, Vec3, dvec3, vec3};
use girandole_core::image::{Image, luminance};
use girandole_core::lights::Clamp;
use girandole_core::math::{sequence, sh, warp};
use girandole_core::scene::builtin;
use girandole_core::scene::{Geometry, ObjectId, Scene};
use girandole_core::tonemap::{Exposure, srgb_decode};
use girandole_core::trace::SceneTracer;
use girandole_core::transfer::{Gathering, IncidentLight, ObjectTransfer, TransferSettings};
use std::f32::consts::PI;

pub const SELF_SHADOWS: Figure = Figure {
    id: "4-13",
    title: "A bunny by precomputed radiance transfer",
    thesis: "Transfer shows in detail what the bunny hides from itself: behind the head and above the feet.",
    run: run_self_shadows,
};

pub const EDGE: Figure = Figure {
    id: "4-14",
    title: "A shadow's edge across an object by transfer",
    thesis: "Transfer does not produce an accurate edge of a shadow on the object that brute force shows, \
             as light is gathered at one point for all of it. A grid would do better, if it were dense.",
    run: run_edge,
};

/// From where the bunny is seen, from its centre.
const FROM: DVec3 = dvec3(0.4, 0.45, 1.0);
/// Where less of an even light than this arrives, the object hides much from itself.
const HIDDEN: f64 = 0.7;

fn run_self_shadows(bench: &Bench) -> Result<Outcome> {
    let (moving, name) = bench.bunny()?;
    let scene = builtin::build("table", moving)?;
    let (paths, frames) = (bench.of([2, 32, 96]), bench.of([1, 3, 5]));
    let subject = Subject::new(bench, scene, FROM, [bench.of([16, 300, 300]), paths])?;
    let lit = light(bench, &subject, &[MAPS, CENTER, GRID], frames)?;
    let openness = Openness::of(bench, &subject)?;
    let convex = without_own_shadows(&subject)?;

    let hidden: Vec<bool> =
        openness.traced.iter().map(|open| open.is_some_and(|open| f64::from(open) < HIDDEN)).collect();
    let energy = |picture: &Image| subject.compare(picture, &hidden).map_or(1.0, |error| error.energy_ratio);
    let mut outcome = Outcome::default();
    outcome.tables.push(table(&lit, "energy where it hides much from itself", |lit| energy(&lit.picture)));
    let ev = Exposure::Auto.ev(&subject.truth.mean);
    let mut show = |file: &str, caption: &str, picture: &Image| {
        outcome.pictures.push(Picture::exposed(file, caption, picture, ev));
    };
    show("path-tracer", "Path tracer", &subject.truth.mean);
    for (file, lit) in ["maps", "centre", "grid"].into_iter().zip(&lit) {
        show(file, lit.way.name, &lit.picture);
    }
    show("convex", "Light at the centre, without what the object hides from itself", &convex);
    let picture = openness.picture(&subject);
    let caption = "Share of an even light that arrives, by transfer: black none, white all";
    outcome.pictures.push(Picture::of_colors("openness", caption, &picture));

    let count = |of: &[bool]| of.iter().filter(|is_in| **is_in).count() as f64;
    let share = count(&hidden) / count(&subject.within).max(1.0);
    let ways: Vec<f64> = lit.iter().map(|lit| energy(&lit.picture)).collect();
    let [maps, center, grid] = ways[..] else { anyhow::bail!("a way is missing") };
    let without = energy(&convex);
    outcome.seen = format!(
        "The {name} hides more than {:.0} % of an even light from itself over {:.0} % of its pixels; \
         there, transfer knows that to {:.3} (root of the mean square against {} rays a pixel: {:.3} over \
         all its pixels). At those pixels light at the centre gives {center:.2} of the path tracer's \
         energy, the grid {grid:.2}, shadow maps {maps:.2}, and light at the centre without the object's \
         own shadows {without:.2}.",
        (1.0 - HIDDEN) * 100.0,
        share * 100.0,
        openness.error(&hidden),
        openness.rays,
        openness.error(&subject.within),
    );
    outcome.settings = format!("table, {name}. {}", subject.words(paths, frames));
    let off = |energy: f64| (energy - 1.0).abs();
    outcome.verdict = if share > 0.02
        && openness.error(&subject.within) < 0.05
        && off(center) < 0.5 * off(without)
    {
        Verdict::Agrees
    } else {
        Verdict::Differs(format!(
            "Where the object hides much from itself ({:.1} % of its pixels), transfer is off by {:.2} of \
             the energy, and by {:.2} without own shadows; it knows what is hidden to {:.3}.",
            share * 100.0,
            off(center),
            off(without),
            openness.error(&subject.within),
        ))
    };
    Ok(outcome)
}

/// How much of an even light arrives at the object's pixels, as a share of what would without the object's own
/// shadows.
struct Openness {
    by_transfer: Vec<Option<f32>>,
    /// By so many rays a pixel.
    traced: Vec<Option<f32>>,
    rays: u32,
}

impl Openness {
    fn of(bench: &Bench, subject: &Subject) -> Result<Self> {
        let Subject { scene, object, points, within, .. } = subject;
        let settings = TransferSettings {
            bounces: 0,
            bands: 1,
            directions: bench.of([64, 512, 1024]),
            ..TransferSettings::default()
        };
        let shadows = ObjectTransfer::simulate(scene, *object, &settings, &|_| ())?;
        let alone = alone(scene, *object)?;
        let geometry = Geometry::new(&alone);
        let tracer = SceneTracer::new(&alone, &geometry);
        let even = [Vec3::splat((4.0 * PI).sqrt() / PI)];
        let rays = bench.of([4, 32, 64]);
        let whole = Geometry::new(scene);
        let first = whole.objects[object.index()].vertices.start;
        let shown = |i: usize| points[i].filter(|_| within[i]);
        let by_transfer = |i: usize| {
            let point = shown(i)?;
            let corners = whole.triangles[point.triangle as usize].vertices;
            let at = |corner: usize| shadows.irradiance((corners[corner] - first) as usize, &even).x;
            Some((0..3).map(|corner| point.weights[corner] * at(corner)).sum())
        };
        let traced = |i: usize| {
            let point = shown(i)?;
            let origin = tracer.offset_ray_origin(point.position, point.normal);
            let (right, up) = warp::frame(point.normal);
            let is_open = |ray: &u32| {
                let seed = sequence::hash(i as u32);
                let at = Vec2::new(sequence::sample(*ray, 0, seed), sequence::sample(*ray, 1, seed));
                let local = warp::cosine_hemisphere(at);
                let direction = right * local.x + up * local.y + point.normal * local.z;
                tracer.closest_hit(origin, direction, f32::INFINITY, u32::MAX).is_none()
            };
            Some((0..rays).filter(is_open).count() as f32 / rays as f32)
        };
        let all = 0..points.len();
        Ok(Self {
            by_transfer: all.clone().map(by_transfer).collect(),
            traced: all.map(traced).collect(),
            rays,
        })
    }

    /// Root of the mean square of what transfer is off by, over these pixels.
    fn error(&self, pixels: &[bool]) -> f64 {
        let pairs = self.by_transfer.iter().zip(&self.traced).zip(pixels).filter(|(_, is_in)| **is_in);
        let errors: Vec<f64> =
            pairs.filter_map(|((a, b), _)| Some(f64::from((*a)? - (*b)?).powi(2))).collect();
        (errors.iter().sum::<f64>() / errors.len().max(1) as f64).sqrt()
    }

    fn picture(&self, subject: &Subject) -> Image {
        let [width, height] = subject.size;
        let pixel = |open: &Option<f32>| {
            open.map_or(vec3(0.1, 0.2, 0.4), |open| Vec3::splat(srgb_decode(open.clamp(0.0, 1.0))))
        };
        Image { width, height, pixels: self.by_transfer.iter().map(pixel).collect() }
    }
}

/// The scene with nothing but the object in it.
fn alone(scene: &Scene, object: ObjectId) -> Result<Scene> {
    let mut alone = scene.clone();
    for other in (0..scene.objects.len()).map(ObjectId::from).filter(|other| *other != object) {
        if !scene.objects[other.index()].removed {
            alone.remove_object(other)?;
        }
    }
    Ok(alone)
}

/// The frame with the object lit by the light at its centre as if it hid nothing from itself and sent itself no
/// light; black elsewhere.
fn without_own_shadows(subject: &Subject) -> Result<Image> {
    let Subject { scene, object, transfer, light, points, within, .. } = subject;
    let geometry = light.geometry();
    let tracer = SceneTracer::new(scene, geometry);
    let frame = transfer.frame(scene, *object)?;
    let center = frame.world_from_transfer.transform_point3(transfer.center().as_dvec3()) - geometry.origin;
    let gathered = IncidentLight::new(&tracer, light.lights(), None, *object, Clamp::Own);
    let bands = transfer.bands();
    let environment = gathered.at(center.as_vec3(), &frame, bands);
    let mut cosine = vec![0.0; environment.len()];
    let mut picture = Image::new(subject.size[0], subject.size[1]);
    for ((pixel, point), _) in picture.pixels.iter_mut().zip(points).zip(within).filter(|(_, is_in)| **is_in)
    {
        let Some(point) = point else { continue };
        let normal = (frame.transfer_from_world_direction * point.normal).normalize_or_zero();
        sh::clamped_cosine(normal, bands, &mut cosine);
        let irradiance: Vec3 = environment.iter().zip(&cosine).map(|(light, weight)| *light * *weight).sum();
        let material = geometry.triangles[point.triangle as usize].material;
        *pixel = (irradiance * scene.materials[material].base_color / PI).max(Vec3::ZERO);
    }
    Ok(picture)
}

/// Where the object floats, so that the edge of the block's shadow lies across it; how large it is there, and
/// from where it is seen.
const PLACE: DVec3 = dvec3(0.8, 1.64, 0.2);
const SIZE: f64 = 0.8;
const EDGE_FROM: DVec3 = dvec3(-0.2, 0.5, 1.0);
/// Points of the lamp that are looked for from each pixel.
const LAMP_POINTS: u32 = 32;

fn run_edge(bench: &Bench) -> Result<Outcome> {
    let (scene, name) = scene_of_edge(bench)?;
    let (paths, frames) = (bench.of([2, 32, 96]), bench.of([1, 3, 5]));
    let subject = Subject::new(bench, scene, EDGE_FROM, [bench.of([16, 300, 300]), paths])?;
    let fine = |points, name| Way { name, gathering: Some(Gathering::Grid { points }) };
    let (finer, finest) = (fine(8, "transfer, grid of 8³"), fine(16, "transfer, grid of 16³"));
    let ways = [MAPS, CENTER, GRID, finer, finest];
    let lit = light(bench, &subject, &ways[..bench.of([3, 4, 5])], frames)?;
    let sides = sides(&subject)?;
    let ratio = |picture: &Image| ratio(picture, &sides);
    let truth = ratio(&subject.truth.mean);
    let ratios: Vec<f64> = lit.iter().map(|lit| ratio(&lit.picture)).collect();
    let [maps, center, grid, ..] = ratios[..] else { anyhow::bail!("a way is missing") };
    let best = ratios.last().copied().unwrap_or(grid);

    let mut outcome = Outcome::default();
    outcome.tables.push(table(&lit, "lit side over shadowed side", |lit| ratio(&lit.picture)));
    outcome.plots.push(plot(&lit, &ratios, truth));
    let ev = Exposure::Auto.ev(&subject.truth.mean);
    let captions = std::iter::once(("path-tracer", "Path tracer", &subject.truth.mean));
    let files = ["maps", "centre", "grid-4", "grid-8", "grid-16"];
    for (file, what, picture) in
        captions.chain(files.into_iter().zip(&lit).map(|(f, lit)| (f, lit.way.name, &lit.picture)))
    {
        let caption = format!("{what}: lit side {:.1} times the shadowed one", ratio(picture));
        outcome.pictures.push(Picture::exposed(file, &caption, picture, ev));
    }
    let count = |side: &[bool]| side.iter().filter(|is_in| **is_in).count();
    outcome.seen = format!(
        "The block's shadow lies across the {name}: where it faces the lamp, {} pixels see all of it and \
         {} nothing. The lit ones are {truth:.2} times as bright as the shadowed ones by the path tracer, \
         {maps:.2} times by shadow maps, {center:.2} times by light at the centre, {grid:.2} by our grid \
         of 4³, {best:.2} by one of {}³.",
        count(&sides[0]),
        count(&sides[1]),
        finest_points(&lit),
    );
    outcome.settings = format!("block, {name}. {}", subject.words(paths, frames));
    outcome.verdict = verdict([truth, maps, center, best]);
    Ok(outcome)
}

fn verdict([truth, maps, center, best]: [f64; 4]) -> Verdict {
    // Of the edge's height: how many stops there are between its sides.
    let kept = |ratio: f64| ratio.max(f64::MIN_POSITIVE).ln() / truth.max(f64::MIN_POSITIVE).ln();
    if truth < 1.5 {
        return Verdict::Differs(format!("There is no edge to speak of: its sides differ {truth:.2} times."));
    }
    if kept(maps) > 0.8 && kept(center) < 0.5 && kept(best) > kept(center) {
        return Verdict::Agrees;
    }
    let stops = [maps, center, best].map(|ratio| number(100.0 * kept(ratio), 0));
    Verdict::Differs(format!(
        "Of the edge's height in stops, shadow maps keep {} %, light at the centre {} %, the finest grid \
         {} %.",
        stops[0], stops[1], stops[2]
    ))
}

fn scene_of_edge(bench: &Bench) -> Result<(Scene, &'static str)> {
    let (moving, name) = bench.bunny()?;
    let mut scene = builtin::build("block", moving)?;
    let object = moving_object(&scene)?;
    put(&mut scene, object, SIZE, PLACE);
    Ok((scene, name))
}

/// The object's pixels that face the lamp and see all of it, and those that see nothing of it, but for the
/// object itself.
fn sides(subject: &Subject) -> Result<[Vec<bool>; 2]> {
    let Subject { scene, object, points, within, light, .. } = subject;
    let geometry = light.geometry();
    let tracer = SceneTracer::without(scene, geometry, *object);
    let emits = |t: &&girandole_core::scene::Triangle| scene.materials[t.material].emits();
    let lamp: Vec<[Vec3; 3]> = geometry
        .triangles
        .iter()
        .filter(emits)
        .map(|t| t.vertices.map(|v| geometry.positions[v as usize]))
        .collect();
    anyhow::ensure!(!lamp.is_empty(), "nothing emits");
    let on_lamp = |i: u32| {
        let [a, b, c] = lamp[i as usize % lamp.len()];
        let at = warp::triangle(Vec2::new(sequence::sample(i, 0, 1), sequence::sample(i, 1, 1)));
        a + (b - a) * at.x + (c - a) * at.y
    };
    let lamp_points: Vec<Vec3> = (0..LAMP_POINTS).map(on_lamp).collect();
    let center = lamp_points.iter().sum::<Vec3>() / LAMP_POINTS as f32;
    // A little below the lamp, so that it does not hide itself.
    let seen = |from: Vec3| {
        let sees = |to: &&Vec3| !tracer.occluded(from, u32::MAX, **to - Vec3::Y * 1e-3, u32::MAX);
        lamp_points.iter().filter(sees).count()
    };
    let share = |i: usize| -> Option<usize> {
        let point = points[i].filter(|_| within[i])?;
        let facing = point.normal.dot((center - point.position).normalize_or_zero());
        (facing > 0.4).then(|| seen(tracer.offset_ray_origin(point.position, point.normal)))
    };
    let shares: Vec<Option<usize>> = (0..points.len()).map(share).collect();
    let with = |wanted: usize| shares.iter().map(|share| *share == Some(wanted)).collect();
    Ok([with(LAMP_POINTS as usize), with(0)])
}

/// How much brighter the lit side is than the shadowed one; 1 where a side is missing.
fn ratio(picture: &Image, sides: &[Vec<bool>; 2]) -> f64 {
    let [lit, dark] =
        [0, 1].map(|side| mean(picture, &sides[side]).map(|mean| f64::from(luminance(mean.as_vec3()))));
    lit.zip(dark).map_or(1.0, |(lit, dark)| lit / dark.max(1e-9))
}

/// Points along each axis of the finest grid.
fn finest_points(lit: &[Lit]) -> u32 {
    lit.iter().filter_map(|lit| lit.way.gathering).map(Gathering::points).max().unwrap_or(1)
}

fn plot(lit: &[Lit], ratios: &[f64], truth: f64) -> Plot {
    let mut plot = Plot::new(
        "edge",
        "The edge of a shadow across an object",
        "points along each axis at which light is gathered",
        "lit side over shadowed side",
    );
    let by_transfer = lit.iter().zip(ratios).filter_map(|(lit, ratio)| {
        lit.way.gathering.map(|gathering| [f64::from(gathering.points()), *ratio])
    });
    let by_transfer: Vec<[f64; 2]> = by_transfer.collect();
    let across = |value: f64| vec![[1.0, value], [f64::from(finest_points(lit)), value]];
    plot.curve("transfer", by_transfer);
    plot.curve("path tracer", across(truth));
    plot.curve("shadow maps", across(ratios.first().copied().unwrap_or_default()));
    plot
}
