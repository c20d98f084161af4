//! `girandole render`, also the default without a command.

use crate::args::{
    BackgroundArg, Bounces, Engine, Frames, Mode, RenderArgs, RewalkArg, ShadingArg, Switch, UpdatesArg,
};
use crate::engine::{self, Job, Ready};
use crate::output::{self, Stats, say};
use crate::picture::{self, Shown};
use crate::provenance::Maker;
use crate::{scene, sequence, transfer};
use anyhow::{Result, bail};
use girandole_core::image::Image;
use girandole_core::lights::{Clamp, LightSet, MAX_BOUNCES};
use girandole_core::scene::{Geometry, Scene, View};
use girandole_core::trace::SceneTracer;
use girandole_reference::{Provenance, coverage};
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

/// The default where no window can be shown: renders the room `living-room` to a file.
pub fn main_job(why: &str) -> Result<ExitCode> {
    let args = RenderArgs::defaults()?;
    check(&args)?;
    say(&format!("{why}: rendering the room {} to {}", args.scene, args.output.display()));
    render(args)
}

/// Renders by the options of the command line.
pub fn run(args: RenderArgs) -> Result<ExitCode> {
    check(&args)?;
    render(args)
}

/// Refuses impossible combinations of options before the work.
fn check(args: &RenderArgs) -> Result<()> {
    output::check_writable(&args.output, &["exr", "png"])?;
    if let Some(frames) = args.motion.frames {
        if Frames::file(&args.output, frames.last).is_none() {
            bail!(
                "{} is one file; with --frames, give its name a run of # for the number, as in frame.####.exr",
                args.output.display()
            );
        }
        if args.refine > 1 {
            bail!("--refine belongs to single pictures; leave it or --frames out");
        }
        if args.stats.is_some() {
            bail!("--stats belongs to single pictures; leave it or --frames out");
        }
    }
    if args.motion.updates != UpdatesArg::All {
        if matches!(args.engine, Engine::Cpu | Engine::Path) {
            bail!("--updates belongs to --engine gpu; leave one of them out");
        }
        if args.motion.rewalk == RewalkArg::All {
            bail!(
                "--rewalk all draws every shadow map at each frame; leave --updates out, or take --rewalk off or a number"
            );
        }
    }
    if let Some(stats) = &args.stats {
        output::check_writable(stats, &["json"])?;
        if stats == &args.output {
            bail!("the picture and --stats cannot both be {}", stats.display());
        }
    }
    if args.lights.bounces == Bounces::Unlimited && args.engine != Engine::Path {
        bail!("only --engine path can follow light without limit; give --bounces a number");
    }
    if let Some(bounces) = args.lights.bounces.limit()
        && bounces > MAX_BOUNCES
        && args.engine != Engine::Path
    {
        bail!("only --engine path follows {bounces} bounces; give --bounces {MAX_BOUNCES} or fewer");
    }
    if args.mode == Mode::Naive && args.quality.shading == ShadingArg::Multipass {
        bail!("--mode naive has no passes; choose another mode or leave --shading out");
    }
    if args.mode == Mode::Naive && args.quality.light_maps == Some(Switch::On) {
        bail!("--mode naive has no light maps; choose another mode or leave --light-maps out");
    }
    if args.debug.is_some() && matches!(args.engine, Engine::Cpu | Engine::Path) {
        bail!("--debug belongs to --engine gpu; leave one of them out");
    }
    if args.seen.load.background == BackgroundArg::Transparent && args.debug.is_some() {
        bail!("--debug shows no background; leave --background out");
    }
    if args.refine > 1 && matches!(args.engine, Engine::Cpu | Engine::Path) {
        bail!("--refine belongs to --engine gpu; leave one of them out");
    }
    if args.refine > 1 && args.debug.is_some() {
        bail!("--debug shows one light set; leave --refine out");
    }
    if args.transfer.gathering().is_some() && args.engine == Engine::Path {
        bail!("--transfer belongs to --engine gpu and cpu; leave one of them out");
    }
    if args.adapter.is_some() && matches!(args.engine, Engine::Cpu | Engine::Path) {
        bail!("--adapter belongs to --engine gpu; leave one of them out");
    }
    Ok(())
}

fn render(mut args: RenderArgs) -> Result<ExitCode> {
    // The scene, and beside it the engine.
    let start = Instant::now();
    let load = || scene::load_edited(&args.scene, args.object.as_deref(), &args.seen);
    if let Some(frames) = args.motion.frames {
        let scene = load()?.0;
        return sequence::render(args, scene, frames);
    }
    let (loaded, engine) = rayon::join(load, || Ready::open(&args));
    let (mut scene, _) = loaded?;
    if let Some(seconds) = args.motion.time {
        scene.set_time(seconds)?;
    }
    let geometry = Geometry::new(&scene);
    let view = scene::view(&scene, &args.seen, args.camera.as_deref(), args.size)?;
    let transfers = transfer::load(&scene, &args.transfer)?;
    let (mut engine, advice) = engine?;
    if args.refine > 1 && !matches!(engine, Ready::Gpu(_)) {
        bail!("--refine belongs to --engine gpu, and there is no adapter; leave it out");
    }
    args.aa.get_or_insert(engine.anti_aliasing(&args));
    engine.compile_for(&scene, &geometry, &args)?;
    let scene_ms = milliseconds(start);

    // The light samples.
    let start = Instant::now();
    let by_samples = args.engine != Engine::Path;
    let lights = if by_samples {
        LightSet::sample_for(&scene, &geometry, &args.light_settings(), args.lights.placement.views(&[view]))?
    } else {
        LightSet::from_samples(&geometry, Vec::new())
    };
    let lights_ms = milliseconds(start);

    // Nothing was printed before, so that an error is the only line.
    advice.iter().for_each(|advice| say(advice));
    for warning in scene.warnings.iter().chain(&lights.warnings) {
        say(&format!("warning: {warning}"));
    }

    // The picture.
    let clamp = args.quality.clamp.0;
    let job = Job {
        scene: &scene,
        geometry: &geometry,
        lights: &lights,
        visibility: None,
        transfers: &transfers,
        view,
        clamp,
        args: &args,
    };
    let (name, adapter) = (engine.name(), engine.adapter());
    let picture = engine.render(&job)?;
    let made_by = Maker::new(&args, engine.kind(), &scene, &args.output)?.still(&scene, None)?;
    let ev = write_shown(&args, &args.output, (&scene, &view, &made_by), &picture.radiance)?;

    // Statistics and messages.
    let [width, height] = args.size;
    let by = match (by_samples, picture.stats.get("estimated_rel_mse").and_then(|error| error.as_f64())) {
        (false, _) => format!("{} paths a pixel", args.paths),
        (true, None) => format!("{} light samples ({} direct)", lights.len(), lights.direct),
        (true, Some(error)) => {
            format!("{} sets of {} light samples (estimated relMSE {error:.1e})", args.refine, lights.len())
        }
    };
    say(&format!(
        "wrote {} ({width}×{height}): {} with {by}, {} on {adapter} ({name} engine)",
        args.output.display(),
        args.scene,
        output::duration(picture.frame_ms),
    ));
    let mut stats: Stats = picture.stats;
    if let Clamp::At(bound) = clamp
        && by_samples
    {
        let lost = engine::energy_lost_by_clamp(&job);
        say(&format!(
            "the bound of {bound:.3} m⁻² on what is close to samples loses about {:.2} % of the picture's energy",
            lost * 100.0
        ));
        stats.insert("clamp_per_square_metre".into(), bound.into());
        stats.insert("clamp_lost_energy_share".into(), lost.into());
    }
    if let Some(path) = &args.stats {
        let samples = u64::from(args.aa.unwrap_or_default().samples_per_axis()).pow(2);
        let indirect = lights.len() as u64 - u64::from(lights.direct);
        for (key, value) in [
            ("scene", args.scene.as_str().into()),
            ("command", args.command_line().ok().into()),
            ("engine", name.into()),
            ("adapter", adapter.into()),
            ("width", width.into()),
            ("height", height.into()),
            ("samples_per_pixel", samples.into()),
            ("seed", args.lights.seed.into()),
            ("bounces", args.lights.bounces.limit().into()),
            ("light_sets", args.refine.into()),
            ("lights", lights.len().into()),
            ("direct_lights", lights.direct.into()),
            ("indirect_lights", indirect.into()),
            ("paths", lights.paths.into()),
            ("triangles", geometry.triangles.len().into()),
            ("patches", geometry.patches.len().into()),
            ("pairs", (samples * u64::from(width) * u64::from(height) * lights.len() as u64).into()),
            ("exposure_ev", ev.into()),
            ("scene_ms", scene_ms.into()),
            ("light_samples_ms", lights_ms.into()),
            ("frame_ms", picture.frame_ms.into()),
        ] {
            stats.entry(key).or_insert(value);
        }
        girandole_core::files::write(
            path,
            format!("{}\n", serde_json::to_string_pretty(&stats)?).as_bytes(),
        )?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Writes a picture with what it was made by, and with the exposure and tone curve of the options where it is a
/// .png. Returns the exposure in stops.
pub fn write_shown(
    args: &RenderArgs,
    path: &Path,
    (scene, view, made_by): (&Scene, &View, &Provenance),
    radiance: &Image,
) -> Result<f32> {
    let shown = Shown::new(args.exposure, args.tonemap.into(), args.debug.map(Into::into));
    let coverage = (args.seen.load.background == BackgroundArg::Transparent).then(|| {
        // Averaged pictures have samples everywhere in a pixel.
        let is_averaged = args.refine > 1 || args.engine == Engine::Path;
        let samples = if is_averaged { 4 } else { args.aa.unwrap_or_default().samples_per_axis() };
        coverage(&SceneTracer::new(scene, &Geometry::new(scene)), view, args.size, samples)
    });
    picture::write(path, (radiance, coverage.as_deref()), shown, made_by)
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
