//! What a first picture waits for: how many kernels are compiled, what they take, and how much of that is not hidden by other work; with
//! the driver's cache and without (Mesa's; other drivers see no difference).
//!
//! `cargo run --release --example first_picture -- [scene, default table] [lights, 300] [width, 1024] [height, 768] [adapter]`

use girandole::scene::builtin::{self, MovingObject};
use girandole::scene::{Scene, View};
use girandole::{Gpu, RenderSettings, Renderer, RendererOptions, Viewport};
use girandole_core::lights::{LightSet, LightSettings};
use girandole_core::scene::Geometry;
use girandole_core::visibility::{VisibilityDatabase, VisibilitySettings};
use std::error::Error;
use std::process::Command;
use std::sync::Arc;
use std::time::Instant;

/// Set for a process that renders the picture.
const CHILD: &str = "GIRANDOLE_FIRST_PICTURE";

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if std::env::var_os(CHILD).is_some() {
        return picture(&arguments);
    }
    let cache = std::env::temp_dir().join(format!("girandole-first-picture-{}", std::process::id()));
    let child = |name: &str| -> Result<(), Box<dyn Error>> {
        let mut command = Command::new(std::env::current_exe()?);
        command.args(&arguments).env(CHILD, name).env("MESA_SHADER_CACHE_DIR", &cache);
        if name == "cold" {
            command.env("MESA_SHADER_CACHE_DISABLE", "true");
        }
        let status = command.status()?;
        if status.success() { Ok(()) } else { Err(format!("{name}: {status}").into()) }
    };
    // The second one fills the cache.
    let result = ["cold", "filling", "warm"].into_iter().try_for_each(child);
    let _ = std::fs::remove_dir_all(&cache);
    result
}

fn picture(arguments: &[String]) -> Result<(), Box<dyn Error>> {
    let argument = |index: usize, or: &str| arguments.get(index).map_or(or, String::as_str).to_owned();
    let (name, lights) = (argument(0, "table"), argument(1, "300").parse()?);
    let size: [u32; 2] = [argument(2, "1024").parse()?, argument(3, "768").parse()?];
    let start = Instant::now();
    let since = |start: Instant| start.elapsed().as_secs_f64() * 1e3;
    let scene = if builtin::NAMES.contains(&name.as_str()) {
        builtin::build(&name, MovingObject::Torus)?
    } else {
        Scene::load(name.as_ref())?
    };
    let geometry = Geometry::new(&scene);
    let view = View::new(&scene, scene.cameras.first().ok_or("no camera")?, size[0] as f32 / size[1] as f32);
    let scene_ms = since(start);

    let opening = Instant::now();
    let gpu = pollster::block_on(Gpu::new(arguments.get(4).map(String::as_str)))?;
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, RendererOptions::default())?;
    let mut viewport = Viewport::default();
    let open_ms = since(opening);

    // As early as possible.
    renderer.compile_for(&scene, &geometry, &RenderSettings::default());
    let light = Instant::now();
    let settings = LightSettings { count: lights, ..Default::default() };
    let lights = LightSet::sample_for(&scene, &geometry, &settings, &[view])?;
    let database: Arc<_> =
        VisibilityDatabase::build(&scene, &geometry, &lights, &VisibilitySettings::default())?.into();
    let light_ms = since(light);

    // A picture with its shadow maps, twice: the second time all is compiled.
    let mut frame = || -> Result<f64, Box<dyn Error>> {
        let start = Instant::now();
        renderer.load(&scene, &geometry, &lights)?;
        renderer.load_visibility(&scene, &geometry, &lights, database.clone())?;
        renderer.time_passes(std::env::var_os("KERNELS").is_some());
        renderer.render(&mut viewport, &view, size, &RenderSettings::default())?;
        gpu.wait()?;
        Ok(since(start))
    };
    let [first_ms, second_ms] = [frame()?, frame()?];
    let total_ms = since(start) - second_ms;

    let compilation = renderer.compilation();
    let kernels = renderer.kernels();
    let all_ms: f64 = kernels.iter().map(|kernel| kernel.ms).sum();
    if std::env::var_os("KERNELS").is_some() {
        for kernel in &kernels {
            println!("  {:8.1} ms  {} ({})", kernel.ms, kernel.shader, kernel.entries);
        }
    }
    println!(
        "{:8} {total_ms:7.0} ms: scene {scene_ms:.0}, device {open_ms:.0}, light and visibility {light_ms:.0}, picture {second_ms:.0}, \
         compilation {:.0}; {} of {} kernels, {all_ms:.0} ms on all threads, {:.0} ms waited for",
        std::env::var(CHILD)?,
        first_ms - second_ms,
        compilation.done,
        compilation.total,
        compilation.waited_ms,
    );
    Ok(())
}
