//! Shadow maps on a walk through a building: what frames draw, and that they do not depend on where one came from.
//!
//! ```text
//! cargo run --release -p girandole --example walk -- <scene.glb> [key=value]…
//! ```
//!
//! The walk leads from the first camera to the farthest place that can be reached at its height, within `reach=12` metres, in `frames=60`
//! pictures of `size=96x72`, with one set of `lights=1024` samples placed for all of it. Each frame is rendered three times: by a renderer
//! that draws all maps that it lacks, by one that draws `updates=50` of them at most, and by one that has just loaded the scene. Prints how
//! many maps these draw and how long it takes, in milliseconds; every `rest=10`th frame is repeated until the second one's picture is
//! complete. It ends with an error where the first and the last picture differ, a still camera draws maps, more than `updates` are drawn
//! in a frame but the first, or a picture is not complete after eight.

#[path = "../../girandole-reference/examples/light_motion/way.rs"]
mod way;

use girandole::image::Image;
use girandole::scene::{Scene, View};
use girandole::{Gpu, MapUpdates, RenderSettings, Renderer, RendererOptions, Viewport};
use girandole_core::lights::{LightSet, LightSettings};
use girandole_core::scene::Geometry;
use girandole_core::trace::SceneTracer;
use girandole_core::visibility::{VisibilityDatabase, VisibilitySettings};
use std::collections::BTreeMap;
use std::error::Error;
use std::sync::Arc;
use std::time::Instant;

/// Frames at rest in which a picture has to be complete.
const SOON: u32 = 8;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().ok_or("name a scene, as in: walk building.glb lights=1024")?;
    let options: BTreeMap<String, String> =
        arguments.filter_map(|a| a.split_once('=').map(|(k, v)| (k.to_owned(), v.to_owned()))).collect();
    let number = |key: &str, default: u32| options.get(key).map_or(Ok(default), |text| text.parse());
    let (frames, most, rest) = (number("frames", 60)?, number("updates", 50)?, number("rest", 10)?.max(1));
    let size = match options.get("size").and_then(|size| size.split_once('x')) {
        Some((width, height)) => [width.parse()?, height.parse()?],
        None => [96, 72],
    };
    let mut scene = Scene::load(file.as_ref())?;
    scene.ensure_camera();
    let geometry = Geometry::new(&scene);
    let tracer = SceneTracer::new(&scene, &geometry);
    let start = View::new(&scene, &scene.cameras[0], size[0] as f32 / size[1] as f32);
    let views = way::walk(&tracer, &start, f64::from(number("reach", 12)?), (frames, number("fps", 8)?));
    let placed: Vec<View> = views.iter().step_by(views.len().div_ceil(8)).copied().collect();
    let settings = LightSettings { count: number("lights", 1024)?, ..LightSettings::default() };
    let lights = LightSet::sample_for(&scene, &geometry, &settings, &placed)?;
    let database: Arc<_> =
        VisibilityDatabase::build(&scene, &geometry, &lights, &VisibilitySettings::default())?.into();

    let gpu = pollster::block_on(Gpu::new(None))?;
    let memory_mib = number("memory", RendererOptions::default().memory_mib)?;
    let load = |renderer: &mut Renderer| -> Result<(), girandole::Error> {
        renderer.load(&scene, &geometry, &lights)?;
        renderer.load_visibility(&scene, &geometry, &lights, database.clone())
    };
    let all = RenderSettings::default();
    let some = RenderSettings { updates: MapUpdates { most: Some(most), ..MapUpdates::default() }, ..all };
    let frame = |lit: &mut Lit, view: &View, settings: &RenderSettings| -> Result<Frame, Box<dyn Error>> {
        let Lit { renderer, viewport } = lit;
        let start = Instant::now();
        renderer.render(viewport, view, size, settings)?;
        gpu.wait()?;
        let ms = start.elapsed().as_secs_f64() * 1e3;
        let stats = renderer.stats(viewport);
        let drawn = gpu.block_on(stats)??.maps_drawn;
        let picture = renderer.radiance(viewport);
        Ok(Frame { drawn, ms, picture: gpu.block_on(picture)?? })
    };
    let options = RendererOptions { memory_mib, ..RendererOptions::default() };
    let lit = |renderer| Lit { renderer, viewport: Viewport::default() };
    let mut following = lit(Renderer::new(&gpu.device, &gpu.queue, options)?);
    let [mut sparing, mut alone] =
        [following.renderer.another(options)?, following.renderer.another(options)?].map(lit);
    load(&mut following.renderer)?;
    load(&mut sparing.renderer)?;
    println!("{:>5} {:>8} {:>8} {:>8} {:>8} {:>8}", "frame", "drawn", "ms", "alone", "ms", "updates");
    let (mut drawn, mut drawn_alone, mut longest) = (0, 0, 0);
    for (index, view) in (0..).zip(&views) {
        load(&mut alone.renderer)?;
        let fresh = frame(&mut alone, view, &all)?;
        let now = frame(&mut following, view, &all)?;
        let little = frame(&mut sparing, view, &some)?;
        println!(
            "{index:5} {:8} {:8.1} {:8} {:8.1} {:8}",
            now.drawn, now.ms, fresh.drawn, fresh.ms, little.drawn
        );
        if now.picture != fresh.picture {
            return Err(format!("frame {index} is another picture than the one rendered alone").into());
        }
        if index > 0 && little.drawn > most {
            return Err(format!("frame {index} draws {} maps", little.drawn).into());
        }
        (drawn, drawn_alone) = (drawn + now.drawn, drawn_alone + fresh.drawn);
        if index % rest + 1 < rest {
            continue;
        }
        let still = frame(&mut following, view, &all)?;
        if still.drawn > 0 || still.picture != now.picture {
            return Err(format!("frame {index} again draws {} maps", still.drawn).into());
        }
        let mut repeated = 0;
        let mut at_rest = little;
        while at_rest.picture != now.picture {
            repeated += 1;
            at_rest = frame(&mut sparing, view, &some)?;
            if repeated > SOON || at_rest.drawn > most {
                return Err(format!("frame {index} is not complete after {SOON}").into());
            }
        }
        longest = longest.max(repeated);
    }
    println!(
        "{} frames: {drawn} maps drawn, {drawn_alone} by frames alone; at rest complete after {longest} frames; all as alone, to the bit",
        views.len()
    );
    Ok(())
}

struct Lit {
    renderer: Renderer,
    viewport: Viewport,
}

struct Frame {
    drawn: u32,
    ms: f64,
    picture: Image,
}
