//! Figure 5-7: what few light samples do to the soft shadow of an area light, and what a floor's texture hides of it.

use super::Figure;
use super::fit::{two, verdict};
use super::structure::dissimilarity;
use super::views::{looking, stand};
use crate::bench::{Bench, moving_object};
use crate::report::{Outcome, Picture, Plot, Scaling, Table, number};
use anyhow::{Context, Result};
use girandole::{Mode, RenderSettings, RendererOptions};
use girandole_core::glam::{Affine2, DVec3, Vec2, vec3};
use girandole_core::illumination::{Illumination, IlluminationSettings, Rewalk};
use girandole_core::image::Image;
use girandole_core::lights::{Clamp, LightSettings};
use girandole_core::scene::builtin;
use girandole_core::scene::{ColorSpace, Filter, Scene, Texture, TextureRef, View, Wrap};
use girandole_core::tonemap::{Exposure, srgb_decode};
use girandole_core::trace::SceneTracer;
use girandole_reference::metrics::{CompareOptions, Comparison, compare};
use girandole_reference::{OracleSettings, oracle};

pub const FIGURE: Figure = Figure {
    id: "5-7",
    title: "Shadows by direct light, on a plain and on a textured floor",
    thesis: "By 25, 50 and 100 direct samples with maps of 512 × 512 texels, the shadow's steps are less perceptible \
        on a textured floor than on a plain one.",
    run,
};

/// Where the object is and how large, and from where its shadow is looked at.
const FOOT: DVec3 = DVec3::new(0.25, 0.2, 0.95);
const EXTENT: f64 = 0.7;
pub(super) const EYE: DVec3 = DVec3::new(0.95, 1.75, 2.75);
pub(super) const TARGET: DVec3 = DVec3::new(0.12, 0.05, 1.15);
pub(super) const DEGREES: f64 = 30.0;
/// Texels across the floor's texture, and how often it lies across the floor.
const TEXELS: u32 = 256;
const REPEATS: Vec2 = Vec2::new(3.0, 4.0);

/// `table` with the bunny over its floor, and what it is called.
pub(super) fn scene(bench: &Bench) -> Result<(Scene, &'static str)> {
    let (object, name) = bench.bunny()?;
    let mut scene = builtin::build("table", object)?;
    let object = moving_object(&scene)?;
    stand(&mut scene, object, EXTENT, FOOT);
    Ok((scene, name))
}

/// A number from 0 to 1 for a place and an octave.
fn chance(x: u32, y: u32, octave: u32) -> f32 {
    let mut bits =
        x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca6b) ^ octave.wrapping_mul(0xc2b2_ae35);
    for _ in 0..2 {
        bits = (bits ^ (bits >> 15)).wrapping_mul(0x2c1b_3c6d);
        bits ^= bits >> 12;
    }
    (bits >> 8) as f32 / (1 << 24) as f32
}

/// Speckled stone in tiles: details from one texel to an eighth of the texture.
fn stone() -> Texture {
    let shade = |x: u32, y: u32| {
        let octaves = [1, 2, 4, 8, 32];
        let noise: f32 = octaves.iter().map(|&size| chance(x / size, y / size, size)).sum();
        let is_joint = x % 64 < 2 || y % 64 < 2;
        let shade = if is_joint { 0.3 } else { 0.2 + 0.75 * noise / octaves.len() as f32 };
        let byte = (shade * 255.0).round() as u8;
        [byte, byte, byte, 255]
    };
    Texture {
        name: "stone".into(),
        width: TEXELS,
        height: TEXELS,
        texels: (0..TEXELS * TEXELS).map(|i| shade(i % TEXELS, i / TEXELS)).collect(),
        color_space: ColorSpace::Srgb,
        wrap: [Wrap::Repeat; 2],
        filter: Filter::Linear,
    }
}

/// The scene with stone on its floor, which reflects as much as before in the mean.
fn textured(mut scene: Scene) -> Result<Scene> {
    let texture = stone();
    let sum: f64 = texture.texels.iter().map(|t| f64::from(srgb_decode(f32::from(t[0]) / 255.0))).sum();
    let mean = (sum / texture.texels.len() as f64) as f32;
    let floor = scene.objects.iter().find(|object| object.name == "floor").context("there is no floor")?;
    let material = scene.meshes[floor.mesh].triangles.first().context("the floor is empty")?.material;
    let index = scene.textures.len() as u32;
    scene.textures.push(texture);
    let material = &mut scene.materials[material];
    material.base_color_texture =
        Some(TextureRef { transform: Affine2::from_scale(REPEATS), ..TextureRef::new(index) });
    material.base_color /= mean;
    Ok(scene)
}

/// Direct light by so many samples, by power alone: the same for any texture.
fn direct(count: u32) -> LightSettings {
    LightSettings { count, bounces: 0, ..LightSettings::default() }
}

fn illumination(scene: &Scene, count: u32) -> Result<Illumination> {
    let settings = IlluminationSettings {
        lights: direct(count),
        rewalk: Rewalk::Off,
        ..IlluminationSettings::default()
    };
    Ok(Illumination::new(scene, &settings)?)
}

/// Every pixel by itself: nothing is interpolated.
fn settings() -> RenderSettings {
    RenderSettings { mode: Mode::Visibility, ..RenderSettings::default() }
}

/// A picture by shadow maps.
pub(super) fn mapped(
    bench: &Bench,
    scene: &Scene,
    (view, size): (View, [u32; 2]),
    count: u32,
    (map_size, pcf): (u32, u32),
) -> Result<Image> {
    let options = RendererOptions { map_size: Some(map_size), pcf, ..RendererOptions::default() };
    bench.stage_with(scene, options, illumination(scene, count)?, (view, size))?.picture(&settings())
}

/// The picture that so many samples give with traced visibility, without a shadow map.
pub(super) fn traced(scene: &Scene, (view, size): (View, [u32; 2]), count: u32) -> Result<Image> {
    let illumination = illumination(scene, count)?;
    let tracer = SceneTracer::new(scene, illumination.geometry());
    let settings = OracleSettings { clamp: Clamp::Own, ..OracleSettings::default() };
    Ok(oracle(&tracer, illumination.lights(), &view, size, &settings, &|_| {}))
}

pub(super) fn error(reference: &Image, test: &Image) -> Result<Comparison> {
    Ok(compare(reference, test, &CompareOptions::default())?)
}

/// What is written of an error.
pub(super) fn small(value: f64) -> String {
    number(value, 5)
}

/// A plain floor and the same floor with stone on it, by the same light.
struct Floors {
    plain: Image,
    stone: Image,
}

impl Floors {
    /// What stone makes of another picture of the plain floor: radiance is albedo times illumination.
    fn stone_of(&self, plain: &Image) -> Image {
        let pixel = |i: usize| {
            let share = |stone: f32, plain: f32| if plain > 0.0 { stone / plain } else { 1.0 };
            let [stone, plain] = [self.stone.pixels[i], self.plain.pixels[i]];
            vec3(share(stone.x, plain.x), share(stone.y, plain.y), share(stone.z, plain.z))
        };
        let pixels = plain.pixels.iter().enumerate().map(|(i, &p)| p * pixel(i)).collect();
        Image { width: plain.width, height: plain.height, pixels }
    }
}

/// Stone hides steps where 1 − SSIM is below this share of the plain floor's.
const MASKED: f64 = 0.9;

/// Errors on the plain floor and on stone with so many lights.
struct Banding {
    lights: u32,
    flip: [f64; 2],
    dissimilarity: [f64; 2],
    rel_mse: f64,
}

fn run(bench: &Bench) -> Result<Outcome> {
    let counts = bench.of([&[8, 16][..], &[25, 50, 100], &[25, 50, 100]]);
    let (size, many) = (bench.of([[64, 48], [240, 180], [320, 240]]), bench.of([64, 1024, 4096]));
    let map_size = bench.of([64, 512, 512]);
    let (plain, object) = scene(bench)?;
    let stone = textured(plain.clone())?;
    let view = looking(EYE, TARGET, DEGREES, size)?;
    let mut floors = Vec::new();
    for &count in counts {
        let [plain, stone] =
            [&plain, &stone].map(|scene| mapped(bench, scene, (view, size), count, (map_size, 0)));
        floors.push(Floors { plain: plain?, stone: stone? });
    }
    let last = floors.last().context("there are no pictures")?;
    let truth = traced(&plain, (view, size), many)?;
    let truth = Floors { stone: last.stone_of(&truth), plain: truth };
    let mut outcome = Outcome::default();
    let mut banding = Vec::new();
    for (&lights, floors) in counts.iter().zip(&floors) {
        let pairs = [(&truth.plain, &floors.plain), (&truth.stone, &floors.stone)];
        let [a, b] = pairs.map(|(truth, test)| error(truth, test));
        let (a, b) = (a?, b?);
        let dissimilarity = pairs.map(|(truth, test)| dissimilarity(truth, test));
        banding.push(Banding { lights, flip: [a.flip, b.flip], dissimilarity, rel_mse: a.rel_mse });
    }
    let ev = Exposure::Auto.ev(&truth.plain);
    let named = counts.iter().map(|count| format!("{count}")).chain(["truth".into()]);
    for (name, floors) in named.zip(floors.iter().chain([&truth])) {
        let what = if name == "truth" { format!("{many} lights, traced") } else { format!("{name} lights") };
        for (floor, image) in [("plain", &floors.plain), ("stone", &floors.stone)] {
            let caption = format!("{floor} floor, {what}");
            outcome.pictures.push(Picture::exposed(&format!("{floor}-{name}"), &caption, image, ev));
        }
    }
    tell_banding(&mut outcome, &banding);
    outcome.settings = format!(
        "table with the {object} over its floor, {} × {} pixels; direct light alone, {counts:?} samples by power, seed \
         0; maps of {map_size} texels without filter; mode VD. Truth: {many} samples, traced. Stone: {TEXELS} × \
         {TEXELS} texels, {} times along the room and {} times across, in the mean as bright as the plain floor.",
        size[0], size[1], REPEATS.y, REPEATS.x
    );
    Ok(outcome)
}

/// The table, the plot, what is seen, and the verdict.
fn tell_banding(outcome: &mut Outcome, banding: &[Banding]) {
    let mut table = Table::new(
        "errors",
        "Errors to the truth, whole pictures",
        &["lights", "FLIP, plain", "FLIP, stone", "1 − SSIM, plain", "1 − SSIM, stone", "relMSE, plain"],
    );
    let mut plot = Plot {
        scaling: [Scaling::Logarithmic; 2],
        ..Plot::new(
            "banding",
            "How much of the shadow's steps is seen",
            "light samples",
            "error to the truth",
        )
    };
    for row in banding {
        let [a, b, c, d] = [row.flip[0], row.flip[1], row.dissimilarity[0], row.dissimilarity[1]].map(small);
        table.row([row.lights.to_string(), a, b, c, d, small(row.rel_mse)]);
    }
    for (floor, name) in ["plain floor", "stone"].into_iter().enumerate() {
        let curve = |value: fn(&Banding, usize) -> f64| -> Vec<[f64; 2]> {
            banding.iter().map(|row| [f64::from(row.lights), value(row, floor).max(1e-6)]).collect()
        };
        plot.curve(&format!("FLIP, {name}"), curve(|row, floor| row.flip[floor]));
        plot.curve(&format!("1 − SSIM, {name}"), curve(|row, floor| row.dissimilarity[floor]));
    }
    outcome.tables.push(table);
    outcome.plots.push(plot);
    let mut claims = Vec::new();
    let mut seen = Vec::new();
    for row in banding {
        let [flip, structure] = [row.flip, row.dissimilarity].map(|pair| pair[1] / pair[0]);
        let sentence = format!(
            "With {} lights stone has {} times the plain floor's FLIP and {} times its 1 − SSIM.",
            row.lights,
            two(flip),
            two(structure)
        );
        claims.push((flip < 1.0 && structure < MASKED, sentence.clone()));
        seen.push(sentence);
    }
    outcome.seen = format!(
        "{} FLIP knows no masking, and sees the steps on stone almost as well; by structural similarity, which weighs \
         a difference against the contrast about it, stone hides them.",
        seen.join(" ")
    );
    outcome.verdict = verdict(claims);
}
