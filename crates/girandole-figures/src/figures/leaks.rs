//! Figure 4-3: light that leaks under a wall where shadow maps are paraboloids.
//!
//! Girandole draws parabolic maps as the thesis did: corners are projected, and edges are straight between them.

use super::Figure;
use crate::bench::{Bench, Stage, first_view};
use crate::report::{Outcome, Picture, Plot, Table, Verdict, number};
use anyhow::{Context, Result};
use girandole::{Mode, RenderSettings, RendererOptions, ShadowMap};
use girandole_core::glam::{Vec2, Vec3, vec3};
use girandole_core::illumination::{Illumination, IlluminationSettings};
use girandole_core::image::Image;
use girandole_core::lights::{Clamp, LightSample, LightSettings};
use girandole_core::scene::{
    Camera, ClipPlanes, Geometry, Material, MaterialId, Mesh, MeshTriangle, NONE, Projection, PunctualKind,
    PunctualLight, Scene, Transform, View,
};
use girandole_core::tonemap::{Exposure, Tonemap};
use girandole_core::trace::SceneTracer;

/// The room: x and z about 0, y from 0 on, metres.
const ROOM: Vec3 = Vec3::new(6.0, 3.0, 5.0);
/// The wall that casts the shadow goes across it: its thickness, height and width.
const WALL: Vec3 = Vec3::new(0.05, 2.0, 5.0);
/// Pixels count as hidden behind a wall so much lower, and as lit over one so much higher: nearer to the shadow's
/// edge, texels of any map are too wide.
const MARGIN: f32 = 0.1;
/// Squares along each side of the wall. Of 25 and 60 vertices the thesis speaks.
const SQUARES: [u32; 7] = [1, 2, 4, 8, 16, 24, 59];
/// Shapes of maps, their names, and with how many squares they are tried.
const SHAPES: [(ShadowMap, &str, &[u32]); 3] = [
    (ShadowMap::Parabolic, "parabolic", &SQUARES),
    (ShadowMap::Octahedral, "octahedral", &[1, 24]),
    (ShadowMap::Cube, "cube", &[1]),
];
/// Shares of the hidden pixels, %: below this there is no leak to be seen; plots have none smaller than that.
const UNSEEN: f64 = 0.1;
const LEAST: f64 = 0.01;
/// Of leaks, and of what is dark where it faces the view.
const RED: Vec3 = Vec3::new(0.8, 0.02, 0.02);
const DIM: Vec3 = Vec3::new(0.02, 0.025, 0.045);

pub const FIGURE: Figure = Figure {
    id: "4-3",
    title: "Light leaks in a parabolic map",
    thesis: "In a parabolic map, slivers of light leak through the bottom of a wall: with 25 × 25 vertices they \
             still are prominent, with 60 × 60 they are gone. An octahedral map has none, without tessellation.",
    run,
};

/// A light sample.
#[derive(Clone, Copy)]
struct Place {
    name: &'static str,
    word: &'static str,
    /// In words.
    place: &'static str,
    position: Vec3,
    /// Where it shines.
    normal: Vec3,
    /// Squares of which there are pictures.
    shown: [u32; 3],
}

const OPPOSITE: Place = Place {
    name: "opposite",
    word: "2.9 m away",
    place: "2.9 m before the wall",
    position: Vec3::new(-2.9, 1.3, 0.4),
    normal: Vec3::X,
    shown: [1, 2, 4],
};
const BESIDE: Place = Place {
    name: "beside",
    word: "5 cm away",
    place: "on the floor, 5 cm before the wall",
    position: Vec3::new(-0.075, 0.02, 0.4),
    normal: Vec3::Y,
    shown: [4, 24, 59],
};

/// A share of leaks, %.
struct Leak {
    light: &'static str,
    shape: ShadowMap,
    squares: u32,
    share: f64,
}

fn run(bench: &Bench) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    let mut table = Table::new(
        "leaks",
        "One light sample's pixels, compared with shadow rays",
        &["light sample", "map", "squares a side of the wall", "lit though hidden %", "dark though lit %"],
    );
    let mut plot = Plot::logarithmic(
        "leaks",
        "Light that leaks through a wall, by its tessellation",
        "squares a side of the wall",
        "of hidden pixels lit, % (0.01 = none)",
    );
    let mut leaks = Vec::new();
    for light in [OPPOSITE, BESIDE] {
        let truth = Truth::new(light, bench.picture_size())?;
        outcome.pictures.push(truth.picture(light));
        for (shape, name, tried) in SHAPES {
            let mut curve = Vec::new();
            for &squares in tried {
                let map = Map { light, shape, name, squares };
                let [share, darkened] = map.measure(bench, &truth, &mut outcome)?;
                let [share_cell, darkened] = [share, darkened].map(|share| number(share, 2));
                table.row([light.place.into(), name.into(), squares.to_string(), share_cell, darkened]);
                curve.push([f64::from(squares), share.max(LEAST)]);
                leaks.push(Leak { light: light.name, shape, squares, share });
            }
            if shape != ShadowMap::Cube {
                plot.curve(&format!("{name}, {}", light.word), curve);
            }
        }
    }
    outcome.plots.push(plot);
    outcome.tables.push(table);
    judge(&mut outcome, &leaks);
    let [width, height] = bench.picture_size();
    let texels = texels(bench);
    outcome.settings = format!(
        "A room of 6 × 3 × 5 m, halved by a wall 2 m high and 5 cm thick; one light sample; maps of {texels}² \
         texels, drawn by Girandole: in parabolic ones corners are projected, with straight edges between, as in \
         the thesis; {width} × {height} pixels, every map looked up at every pixel. {MARGIN} m about the wall's \
         upper edge does not count."
    );
    Ok(outcome)
}

/// Across a map: the thesis's with hundreds of lights.
fn texels(bench: &Bench) -> u32 {
    bench.of([64, 256, 256])
}

fn judge(outcome: &mut Outcome, leaks: &[Leak]) {
    let leak = |light: Place, squares| {
        let is_it =
            |l: &&Leak| l.light == light.name && l.shape == ShadowMap::Parabolic && l.squares == squares;
        leaks.iter().find(is_it).map_or(f64::NAN, |leak| leak.share)
    };
    let worst =
        |shape| leaks.iter().filter(|leak| leak.shape == shape).map(|leak| leak.share).fold(0.0, f64::max);
    let [coarse, medium, fine] = [4, 24, 59].map(|squares| leak(BESIDE, squares));
    let octahedral = worst(ShadowMap::Octahedral);
    outcome.seen = format!(
        "Through the parabolic map of a light {}, {:.1} % of the pixels that the wall hides are lit where it is \
         one square, in a sliver along its foot; {:.2} % with 4 × 4 squares. Finer walls are needed as the light \
         nears the wall: {}, {coarse:.0} % with 4 × 4, {medium:.2} % with 24 × 24 and {fine:.2} % with 59 × 59. \
         Through octahedral maps it is {octahedral:.2} % at most, through cubes {:.2} %, without tessellation. \
         Pictures show what leaked in red.",
        OPPOSITE.place,
        leak(OPPOSITE, 1),
        leak(OPPOSITE, 4),
        BESIDE.place,
        worst(ShadowMap::Cube)
    );
    let is_so = leak(OPPOSITE, 1) > UNSEEN && medium > UNSEEN && fine <= UNSEEN && octahedral <= UNSEEN;
    outcome.verdict = if is_so {
        Verdict::Agrees
    } else {
        Verdict::Differs(format!(
            "of the hidden pixels {medium:.2} % are lit with 24 × 24 squares and {fine:.2} % with 59 × 59, and \
             {octahedral:.2} % through octahedral maps; below {UNSEEN} % counts as none"
        ))
    };
}

/// A shadow map of the room.
#[derive(Clone, Copy)]
struct Map {
    light: Place,
    shape: ShadowMap,
    name: &'static str,
    /// Along each side of the wall.
    squares: u32,
}

impl Map {
    /// What is wrong of the picture by it ([`Truth::wrong`]), and pictures of some.
    fn measure(self, bench: &Bench, truth: &Truth, outcome: &mut Outcome) -> Result<[f64; 2]> {
        let Self { light, shape, name, squares } = self;
        let (mut stage, picture) = self.lit(bench)?;
        let is_parabolic = shape == ShadowMap::Parabolic;
        let is_shown = if is_parabolic { light.shown.contains(&squares) } else { squares == 1 };
        if is_shown && shape != ShadowMap::Cube {
            let caption = format!("{name} map of a light {}, {squares} × {squares} squares", light.place);
            let file = format!("{}-{name}-{squares}", light.name);
            outcome.pictures.push(Picture::of_colors(&file, &caption, &truth.marked(&picture)));
            if light.name == OPPOSITE.name && squares != 2 {
                outcome.pictures.push(self.stored(bench, &mut stage)?);
            }
        }
        Ok(truth.wrong(&picture))
    }

    /// The picture by it.
    fn lit(self, bench: &Bench) -> Result<(Stage<'_>, Image)> {
        let scene = room(self.light, self.squares, WALL.y);
        let size = bench.picture_size();
        let view = first_view(&scene, size)?;
        let map_size = Some(texels(bench));
        let options = RendererOptions { shadow_map: self.shape, map_size, ..RendererOptions::default() };
        let light = Illumination::new(&scene, &one_sample())?;
        let mut stage = bench.stage_with(&scene, options, light, (view, size))?;
        let picture = stage.picture(&RenderSettings { mode: Mode::Naive, ..RenderSettings::default() })?;
        Ok((stage, picture))
    }

    /// What it holds: near surfaces bright.
    fn stored(self, bench: &Bench, stage: &mut Stage) -> Result<Picture> {
        let Self { light, name, squares, .. } = self;
        let stored = bench.gpu.block_on(stage.renderer.shadow_map(0))??;
        let side = stored.len().isqrt() as u32;
        let nearest = stored.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
        let pixels = stored.iter().map(|stored| Vec3::splat(stored / nearest)).collect();
        let caption = format!("that {name} map");
        let image = Image { width: side, height: side, pixels };
        Ok(Picture::of_colors(&format!("{}-{name}-{squares}-map", light.name), &caption, &image))
    }
}

/// A lamp without extent is one light sample.
fn one_sample() -> IlluminationSettings {
    let lights = LightSettings { count: 1, bounces: 0, ..LightSettings::default() };
    IlluminationSettings { lights, visibility: None, ..IlluminationSettings::default() }
}

/// What shadow rays say of each pixel.
struct Truth {
    hidden: Vec<bool>,
    lit: Vec<bool>,
    /// A dim light by which pictures show what is dark.
    dim: Vec<Vec3>,
    /// Radiance without a shadow map's errors.
    image: Image,
    ev: f32,
}

impl Truth {
    fn new(light: Place, size: [u32; 2]) -> Result<Self> {
        let scene = room(light, 1, WALL.y);
        let view = first_view(&scene, size)?;
        let of = |height: f32| seen(&scene, &room(light, 1, height), &view, size);
        let [low, exact, high] = [of(WALL.y - MARGIN)?, of(WALL.y)?, of(WALL.y + MARGIN)?];
        let is_faced = |pixel: &Received| pixel.radiance != Vec3::ZERO;
        let hidden = low.iter().map(|pixel| is_faced(pixel) && pixel.is_hidden).collect();
        let lit = high.iter().map(|pixel| is_faced(pixel) && !pixel.is_hidden).collect();
        let dim = exact.iter().map(|pixel| DIM * pixel.facing).collect();
        let radiance = |pixel: &Received| if pixel.is_hidden { Vec3::ZERO } else { pixel.radiance };
        let image = Image { width: size[0], height: size[1], pixels: exact.iter().map(radiance).collect() };
        let ev = Exposure::Auto.ev(&image);
        Ok(Self { hidden, lit, dim, image, ev })
    }

    /// Shares, %: hidden pixels that a picture shows lit, and lit ones that it shows dark.
    fn wrong(&self, picture: &Image) -> [f64; 2] {
        let share = |which: &[bool], is_lit: bool| {
            let chosen = picture.pixels.iter().zip(which).filter(|(_, is)| **is);
            let (all, wrong) = chosen.fold((0_u32, 0_u32), |(all, wrong), (pixel, _)| {
                (all + 1, wrong + u32::from((*pixel != Vec3::ZERO) == is_lit))
            });
            100.0 * f64::from(wrong) / f64::from(all.max(1))
        };
        [share(&self.hidden, true), share(&self.lit, false)]
    }

    fn picture(&self, light: Place) -> Picture {
        let caption = format!("shadow rays to a light {}", light.place);
        Picture::of_colors(&format!("{}-rays", light.name), &caption, &self.marked(&self.image))
    }

    /// A picture in colours that are shown as they are, with what leaked in red.
    fn marked(&self, picture: &Image) -> Image {
        let color = |index: usize| match picture.pixels[index] {
            Vec3::ZERO => self.dim[index],
            _ if self.hidden[index] => RED,
            radiance => Tonemap::Agx.apply(radiance * self.ev.exp2()),
        };
        Image { pixels: (0..picture.pixels.len()).map(color).collect(), ..picture.clone() }
    }
}

/// What reaches a pixel.
#[derive(Clone, Copy, Default)]
struct Received {
    /// Cosine to the view.
    facing: f32,
    /// As if nothing were in between; 0 where the surface is turned away from the light.
    radiance: Vec3,
    /// Whether the wall is in between.
    is_hidden: bool,
}

/// What pixels of a view of a scene receive where shadow rays go through another one, with another wall.
fn seen(scene: &Scene, blocking: &Scene, view: &View, size: [u32; 2]) -> Result<Vec<Received>> {
    let [geometry, others] = [scene, blocking].map(Geometry::new);
    let light = Illumination::new(scene, &one_sample())?;
    let light = light.lights().samples().first().copied().context("the room has no light")?;
    let tracers = [SceneTracer::new(scene, &geometry), SceneTracer::new(blocking, &others)];
    let view = view.relative_to(geometry.origin);
    let shift = (geometry.origin - others.origin).as_vec3();
    let received = |index: u32| {
        let at = Vec2::new((index % size[0]) as f32, (index / size[0]) as f32) + 0.5;
        let (origin, direction) = view.pixel_ray(at, size);
        received(scene, &tracers, (origin, direction), (&light, shift)).unwrap_or_default()
    };
    Ok((0..size[0] * size[1]).map(received).collect())
}

fn received(
    scene: &Scene,
    [tracer, blocking]: &[SceneTracer; 2],
    (origin, direction): (Vec3, Vec3),
    (light, shift): (&LightSample, Vec3),
) -> Option<Received> {
    let hit = tracer.closest_visible(origin, direction)?;
    let towards = -direction.normalize_or_zero();
    let surface = tracer.geometry().surface(scene, hit.triangle, hit.barycentric, towards);
    let normal = surface.geometric_normal;
    let facing = normal.dot(towards);
    let factor = light.geometric_factor(surface.position, normal, surface.shading_normal, Clamp::Off);
    let Some((factor, _)) = factor else { return Some(Received { facing, ..Received::default() }) };
    let from = tracer.offset_ray_origin(surface.position, normal);
    let is_hidden = blocking.occluded(from + shift, NONE, light.position + shift, NONE);
    let radiance = surface.albedo * light.intensity * (factor / std::f32::consts::PI);
    Some(Received { facing, radiance, is_hidden })
}

/// The room; its wall is so high, and divided into so many squares along each side.
fn room(light: Place, squares: u32, height: f32) -> Scene {
    let mut scene = Scene::default();
    let white = scene.add_material(Material::diffuse("white", Vec3::splat(0.7)));
    let half = ROOM * 0.5;
    let mut shell = Mesh::default();
    shell.add_box(vec3(-half.x, 0.0, -half.z), vec3(half.x, ROOM.y, half.z), white);
    scene.add_object("room", inwards(&shell, white), Transform::IDENTITY);
    let mut wall = Mesh::default();
    let (x, z) = (WALL.x * 0.5, WALL.z * 0.5);
    let across = vec3(0.0, 0.0, 2.0 * z);
    add_grid(&mut wall, [vec3(-x, 0.0, -z), across, Vec3::Y * height], squares, white);
    add_grid(&mut wall, [vec3(x, 0.0, z), -across, Vec3::Y * height], squares, white);
    add_grid(&mut wall, [vec3(-x, height, -z), across, Vec3::X * WALL.x], squares, white);
    scene.add_object("wall", wall, Transform::IDENTITY);
    let node = scene.add_node("light", Transform::looking_at(light.position, light.position + light.normal));
    let kind = PunctualKind::Spot { inner: 0.0, outer: std::f32::consts::FRAC_PI_2 };
    scene.lights.push(PunctualLight { name: "light".into(), node, kind, intensity: Vec3::splat(20.0) });
    let node = scene.add_node("camera", Transform::looking_at(vec3(2.6, 2.1, 2.3), vec3(0.2, 0.6, -1.0)));
    let projection = Projection::Perspective { yfov: 1.2 };
    scene.cameras.push(Camera { name: "camera".into(), node, projection, clip: ClipPlanes::NONE });
    scene
}

/// A box's sides, seen from within.
fn inwards(shell: &Mesh, material: MaterialId) -> Mesh {
    let mut mesh = Mesh::default();
    for patch in &shell.patches {
        let corners: Vec<Vec3> =
            patch.outline.iter().rev().map(|&vertex| shell.positions[vertex as usize]).collect();
        mesh.add_polygon(&corners, material);
    }
    mesh
}

/// A rectangle by its corner and sides, which faces right × up, as a grid of triangles.
fn add_grid(mesh: &mut Mesh, [corner, right, up]: [Vec3; 3], squares: u32, material: MaterialId) {
    let first = mesh.positions.len() as u32;
    let normal = right.cross(up).normalize_or_zero();
    let row = squares + 1;
    for index in 0..row * row {
        let share = [index % row, index / row].map(|i| i as f32 / squares as f32);
        mesh.positions.push(corner + right * share[0] + up * share[1]);
        mesh.normals.push(normal);
    }
    for index in 0..squares * squares {
        let at = first + index / squares * row + index % squares;
        for vertices in [[at, at + 1, at + row + 1], [at, at + row + 1, at + row]] {
            mesh.triangles.push(MeshTriangle { vertices, material });
        }
    }
}
