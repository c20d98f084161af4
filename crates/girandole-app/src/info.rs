//! `girandole info`: the adapters, the contents of a scene, and what a picture was made by.

use crate::args::InfoArgs;
use crate::engine::gpu::{self, AdapterReport};
use crate::{output, scene};
use anyhow::{Context, Result};
use girandole_core::glam::{Vec2, Vec3};
use girandole_core::image::luminance;
use girandole_core::scene::{Geometry, Projection, PunctualKind, Scene};
use girandole_reference::Provenance;
use std::fmt::Write;
use std::path::Path;
use std::process::ExitCode;

/// Prints the adapters, and the scene if one is given; of a picture, what it was made by.
pub fn run(args: &InfoArgs) -> Result<ExitCode> {
    if args.shaders {
        output::data(&serde_json::to_string(&girandole::shaders())?)?;
        return Ok(ExitCode::SUCCESS);
    }
    if let Some(path) = args.scene.as_deref().map(Path::new).filter(|path| is_picture(path)) {
        output::data(&about_picture(path)?)?;
        return Ok(ExitCode::SUCCESS);
    }
    let scene = args.scene.as_deref().map(|name| scene::load(name, None, &args.load)).transpose()?;
    let adapters = gpu::adapters();
    let mut text = String::new();
    about_adapters(&mut text, &adapters)?;
    if let Some(scene) = &scene {
        about_scene(&mut text, scene)?;
    }
    output::data(&text)?;
    if args.require_adapter && !adapters.iter().any(|a| a.usable) {
        output::error(
            "no adapter of this machine can run the gpu engine; install a driver, or use --engine cpu",
        );
        return Ok(ExitCode::from(1));
    }
    Ok(ExitCode::SUCCESS)
}

fn is_picture(path: &Path) -> bool {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
    ["png", "exr"].iter().any(|known| extension.eq_ignore_ascii_case(known))
}

/// What a picture was made by.
fn about_picture(path: &Path) -> Result<String> {
    let made_by = Provenance::read(path)?;
    let made_by = made_by.with_context(|| format!("{} does not say what it was made by", path.display()))?;
    let lines = made_by.0.iter().map(|(key, value)| format!("  {key:18} {value}\n"));
    Ok(format!("picture {}\n{}", path.display(), lines.collect::<String>()))
}

fn about_adapters(text: &mut String, adapters: &[AdapterReport]) -> std::fmt::Result {
    writeln!(text, "adapters")?;
    if adapters.is_empty() {
        writeln!(text, "  none: the cpu engine is used")?;
    }
    for a in adapters {
        let yes_or = |has: bool, without: &'static str| if has { "yes" } else { without };
        let usable = yes_or(a.usable, "no, it lacks compute shaders or WebGPU's default limits");
        let timestamps = yes_or(a.timestamps, "no, passes are not timed on the device");
        writeln!(text, "  {} ({}, {})", a.name, a.backend, a.kind)?;
        writeln!(text, "    driver          {}", a.driver)?;
        writeln!(text, "    usable          {usable}")?;
        writeln!(text, "    timestamps      {timestamps}")?;
        writeln!(text, "    largest texture {} texels across", a.max_texture)?;
        writeln!(text, "    largest buffer  {} MiB", a.max_storage >> 20)?;
    }
    Ok(())
}

fn about_scene(text: &mut String, scene: &Scene) -> std::fmt::Result {
    let geometry = Geometry::new(scene);
    let (low, high) = geometry.main_bounds();
    let size = high - low;
    let moving = scene.placed_objects().filter(|(_, o)| o.dynamic).count();
    writeln!(text, "scene {}", scene.name)?;
    writeln!(text, "  size        {:.3} × {:.3} × {:.3} m", size.x, size.y, size.z)?;
    writeln!(text, "  objects     {} ({moving} may move)", scene.placed_objects().count())?;
    let Geometry { triangles, dropped, coincident, .. } = &geometry;
    writeln!(
        text,
        "  triangles   {} ({dropped} without area and {coincident} in the place of others dropped)",
        triangles.len()
    )?;
    writeln!(text, "  patches     {}", geometry.patches.len())?;
    writeln!(text, "  materials   {}", scene.materials.len())?;
    writeln!(text, "  textures    {}", scene.textures.len())?;
    writeln!(text, "  cameras     {}", scene.cameras.len())?;
    for (i, camera) in scene.cameras.iter().enumerate() {
        let kind = match camera.projection {
            Projection::Perspective { yfov } => format!("perspective, {:.1}°", yfov.to_degrees()),
            Projection::Orthographic { ymag } => format!("orthographic, {:.3} m high", ymag * 2.0),
        };
        let girandole_core::scene::ClipPlanes { near, far } = camera.clip;
        let cut = match (near > 0.0, far.is_finite()) {
            (true, true) => format!(", from {near} m to {far} m"),
            (true, false) => format!(", from {near} m on"),
            (false, true) => format!(", up to {far} m"),
            (false, false) => String::new(),
        };
        writeln!(text, "    {i}  {} ({kind}{cut})", camera.name)?;
    }
    let emitters = emitters(scene, &geometry);
    writeln!(text, "  emitters    {}", emitters.len())?;
    for e in emitters {
        let flux = luminance(e.flux);
        writeln!(text, "    {} ({} triangles, {:.4} m², {flux:.3} W)", e.name, e.triangles, e.area)?;
    }
    writeln!(text, "  lights      {}", scene.lights.len())?;
    for light in &scene.lights {
        let (kind, unit) = match light.kind {
            PunctualKind::Point => ("point", "W/sr"),
            PunctualKind::Spot { .. } => ("spot", "W/sr"),
            PunctualKind::Directional => ("directional", "W/m²"),
        };
        writeln!(text, "    {} ({kind}, {:.3} {unit})", light.name, luminance(light.intensity))?;
    }
    writeln!(text, "  animations  {}", scene.animations.len())?;
    let playing = scene.playing_clips();
    for (i, animation) in scene.animations.iter().enumerate() {
        let last = animation.channels.iter().filter_map(|c| c.times.last()).fold(0.0_f32, |a, &b| a.max(b));
        let rests = if playing.contains(&i) { "" } else { ", rests" };
        writeln!(text, "    {i}  {} ({last:.2} s{rests})", animation.name)?;
    }
    writeln!(text, "  warnings    {}", scene.warnings.len())?;
    for warning in &scene.warnings {
        writeln!(text, "    {warning}")?;
    }
    Ok(())
}

struct Emitter {
    name: String,
    triangles: u32,
    area: f64,
    flux: Vec3,
}

/// The emitting parts of the scene by material, with their flux Φ = π · Le · A.
fn emitters(scene: &Scene, geometry: &Geometry) -> Vec<Emitter> {
    let mut found: Vec<Option<Emitter>> = scene.materials.iter().map(|_| None).collect();
    for (i, triangle) in geometry.triangles.iter().enumerate() {
        let material = &scene.materials[triangle.material];
        if !material.emits() {
            continue;
        }
        let emitter = found[triangle.material.index()].get_or_insert_with(|| Emitter {
            name: material.name.clone(),
            triangles: 0,
            area: 0.0,
            flux: Vec3::ZERO,
        });
        let area = geometry.area(i as u32);
        let sides = if material.double_sided { 2.0 } else { 1.0 };
        emitter.triangles += 1;
        emitter.area += f64::from(area);
        emitter.flux += mean_emission(scene, geometry, i as u32) * (std::f32::consts::PI * area * sides);
    }
    found.into_iter().flatten().collect()
}

/// The mean over a triangle: exact without a texture, from 64 points with one.
fn mean_emission(scene: &Scene, geometry: &Geometry, triangle: u32) -> Vec3 {
    const SIDE: u32 = 8;
    let material = &scene.materials[geometry.triangles[triangle as usize].material];
    if material.emission_texture.is_none() {
        return material.emission;
    }
    let cell = |i: u32| (i as f32 + 0.5) / SIDE as f32;
    let sum: Vec3 = (0..SIDE * SIDE)
        .map(|i| {
            let at = girandole_core::math::warp::triangle(Vec2::new(cell(i % SIDE), cell(i / SIDE)));
            geometry.emission(scene, triangle, at)
        })
        .sum();
    sum / (SIDE * SIDE) as f32
}
