//! What several views of one scene cost: two in turn, against each alone.
//!
//! ```text
//! cargo run --release -p girandole --example viewports [scene [lights [frames [adapter]]]]
//! ```
//!
//! Prints milliseconds of both, and fails where further frames allocate, or pictures in turn are others than alone.

use girandole::image::Image;
use girandole::light::IlluminationSettings;
use girandole::light::LightSettings;
use girandole::scene::builtin::{self, MovingObject};
use girandole::scene::{Scene, View};
use girandole::{Gpu, RenderSettings, Renderer, RendererOptions, Viewport};
use std::error::Error;
use std::time::Instant;

const SIZES: [[u32; 2]; 2] = [[640, 360], [256, 256]];

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let scene = args.first().map_or("pillars", String::as_str);
    let number = |index: usize, default| args.get(index).map_or(Ok(default), |text| text.parse::<u32>());
    let (count, frames) = (number(1, 300)?, number(2, 100)?);
    let mut scene = match scene.contains('.') {
        true => Scene::load(scene.as_ref())?,
        false => builtin::build(scene, MovingObject::Torus)?,
    };
    scene.ensure_camera();
    let wide = View::new(&scene, &scene.cameras[0], 16.0 / 9.0);
    // It sees less, nearer: in maps of other sizes.
    let narrow = View::new(&scene, &scene.cameras[0], 1.0);
    let narrow = View { half_extent: narrow.half_extent * 0.4, ..narrow };
    let views = [wide, narrow];

    let gpu = pollster::block_on(Gpu::new(args.get(3).map(String::as_str)))?;
    let lights = LightSettings { count, ..LightSettings::default() };
    let settings = IlluminationSettings { lights, views: views.to_vec(), ..IlluminationSettings::default() };
    let renderer = Renderer::new(&gpu.device, &gpu.queue, RendererOptions::default())?;
    let lit = |mut renderer: Renderer| -> Result<Renderer, girandole::Error> {
        renderer.open(&scene, &settings)?;
        Ok(renderer)
    };
    let mut alone =
        [lit(renderer.another(*renderer.options())?)?, lit(renderer.another(*renderer.options())?)?];
    let mut both = lit(renderer)?;
    let mut viewports = [Viewport::default(), Viewport::default()];
    let mut viewports_alone = [Viewport::default(), Viewport::default()];

    let frame =
        |renderer: &mut Renderer, viewport: &mut Viewport, view: usize| -> Result<f64, girandole::Error> {
            let start = Instant::now();
            renderer.render(viewport, &views[view], SIZES[view], &RenderSettings::default())?;
            gpu.wait()?;
            Ok(start.elapsed().as_secs_f64() * 1e3)
        };
    let picture = |renderer: &Renderer, viewport: &Viewport| -> Result<Image, Box<dyn Error>> {
        Ok(gpu.block_on(renderer.radiance(viewport))??)
    };
    let allocated = || {
        let report = gpu.device.generate_allocator_report();
        report.map(|report| (report.allocations.len(), report.total_allocated_bytes))
    };
    // Milliseconds of each view, in turn with the other and alone; the first frames draw maps and compile.
    let (mut in_turn, mut by_itself) = ([(); 2].map(|()| Vec::new()), [(); 2].map(|()| Vec::new()));
    let mut before = None;
    for round in 0..frames.div_ceil(2) + 2 {
        for view in 0..2 {
            let mut both = || frame(&mut both, &mut viewports[view], view);
            let mut alone = || frame(&mut alone[view], &mut viewports_alone[view], view);
            // What comes second finds caches warm.
            let (ms, ms_alone) = match round % 2 {
                0 => (both()?, alone()?),
                _ => {
                    let ms_alone = alone()?;
                    (both()?, ms_alone)
                }
            };
            if round >= 2 {
                in_turn[view].push(ms);
                by_itself[view].push(ms_alone);
            }
        }
        if round == 1 {
            before = allocated();
        }
    }
    if allocated() != before {
        return Err(format!("further frames allocate: {before:?} before, {:?} now", allocated()).into());
    }
    for view in 0..2 {
        if picture(&both, &viewports[view])? != picture(&alone[view], &viewports_alone[view])? {
            return Err(format!("view {view} is another picture than alone").into());
        }
    }
    let median = |times: &mut Vec<f64>| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    };
    let [in_turn, by_itself] = [in_turn, by_itself].map(|mut times| times.each_mut().map(median));
    let ratio = in_turn.iter().sum::<f64>() / by_itself.iter().sum::<f64>();
    println!("{} with {count} lights on {}", args.first().map_or("pillars", String::as_str), gpu.info.name);
    for (view, [width, height]) in SIZES.iter().enumerate() {
        println!("{width:>5} × {height}: {:7.1} ms in turn, {:7.1} ms alone", in_turn[view], by_itself[view]);
    }
    let memory =
        before.map_or("not told".into(), |(count, bytes)| format!("{} MiB in {count} pieces", bytes >> 20));
    println!(
        "in turn {ratio:.3} × the sum of both alone; pictures the same; memory before and after: {memory}"
    );
    Ok(())
}
