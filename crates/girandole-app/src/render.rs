//! `girandole render`, also the default without a command.

use crate::args::{
    BackgroundArg, Bounces, Engine, Frames, Mode, PieceArgs, RenderArgs, RewalkArg, ShadingArg, Switch,
    UpdatesArg,
};
use crate::engine::{self, Job, Ready, Window};
use crate::output::{self, Stats, say};
use crate::picture::{self, MOST_PIXELS, Shown};
use crate::provenance::{Maker, There, there};
use crate::{scene, sequence, transfer};
use anyhow::{Result, bail};
use girandole_core::files::Claim;
use girandole_core::image::{Image, Region};
use girandole_core::lights::{Clamp, LightSet, MAX_BOUNCES};
use girandole_core::scene::{Geometry, Scene, View};
use girandole_core::tonemap::Exposure;
use girandole_core::trace::SceneTracer;
use girandole_reference::{Provenance, coverage, image_file};
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
pub fn check(args: &RenderArgs) -> Result<()> {
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
    check_piece(args)?;
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

/// Refuses impossible pieces of pictures.
fn check_piece(args: &RenderArgs) -> Result<()> {
    let PieceArgs { region, sets, part: _ } = args.piece;
    let is_png = !args.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
    if let Some(region) = region {
        if !region.is_in(args.size) {
            let [width, height] = args.size;
            bail!("--region {region} does not lie in the picture, which has {width}×{height} pixels");
        }
        if matches!(args.engine, Engine::Cpu | Engine::Path) {
            bail!("--region belongs to --engine gpu; leave one of them out");
        }
        if args.debug.is_some() {
            bail!("--debug shows whole pictures; leave --region out");
        }
        if is_png && args.exposure == Exposure::Auto {
            bail!("a part has no exposure of its own; save it as .exr, or give --exposure a number of stops");
        }
    }
    let [width, height] = region.map_or(args.size, |region| region.size);
    if u64::from(width) * u64::from(height) > MOST_PIXELS {
        bail!("{width}×{height} pixels are too many at once; render parts of the picture, each a --region");
    }
    if Window::are_several(args.size) {
        if matches!(args.engine, Engine::Cpu | Engine::Path) {
            bail!("pictures of more than 8192 pixels a side belong to --engine gpu; give a smaller --size");
        }
        if args.debug.is_some() {
            bail!("--debug shows pictures of 8192 pixels a side at most; give a smaller --size");
        }
        if args.motion.updates != UpdatesArg::All {
            bail!(
                "--updates counts shadow maps of pictures of 8192 pixels a side at most; give a smaller --size"
            );
        }
    }
    match sets {
        Some([_, last]) if last >= args.refine => bail!(
            "--sets ends at {last}, but --refine {} has the sets 0 to {}; give --refine the number of all sets",
            args.refine,
            args.refine - 1
        ),
        Some(_) if is_png => bail!("--sets keeps sums, which a .png cannot hold; save them as .exr"),
        _ => Ok(()),
    }
}

/// Whether an engine that was chosen since can do what is asked for.
pub fn check_engine(args: &RenderArgs, engine: &Ready) -> Result<()> {
    let asked = [
        (args.refine > 1, "--refine"),
        (args.piece.region.is_some(), "--region"),
        (Window::are_several(args.size), "a --size beyond 8192"),
    ];
    match asked.into_iter().find(|(is_asked, _)| *is_asked) {
        Some((_, option)) if !matches!(engine, Ready::Gpu(_)) => {
            bail!("{option} belongs to --engine gpu, and there is no adapter; leave it out")
        }
        _ => Ok(()),
    }
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
    check_engine(&args, &engine)?;
    args.aa.get_or_insert(engine.anti_aliasing(&args));
    let made_by = Maker::new(&args, engine.kind(), &scene, &args.output)?.still(&scene, None)?;
    let claim = args.piece.is_partial().then(|| Claim::wait(&args.output, &made_by.to_json())).transpose()?;
    if claim.is_some() && matches!(there(&args.output, &made_by), There::Picture) {
        say(&format!("{} was there", args.output.display()));
        return Ok(ExitCode::SUCCESS);
    }
    engine.compile_for(&scene, &geometry, &args)?;
    let scene_ms = milliseconds(start);

    // The light samples.
    let start = Instant::now();
    let by_samples = args.engine != Engine::Path;
    let lights = if by_samples {
        engine::sample(
            (&scene, &geometry),
            (&args.light_settings(), args.lights.placement.views(&[view])),
            &args,
        )?
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
    let ev = match picture.sum.filter(|_| args.piece.sets.is_some()) {
        Some(sum) => {
            let covered = coverage_of(&args, &scene, &view);
            image_file::write_sum(&args.output, &sum, covered.as_deref(), &made_by)?;
            0.0
        }
        None => write_shown(&args, &args.output, (&scene, &view, &made_by), &picture.radiance)?,
    };

    // Statistics and messages.
    let [width, height] = args.piece.region.map_or(args.size, |region| region.size);
    let by = match (by_samples, picture.stats.get("estimated_rel_mse").and_then(|error| error.as_f64())) {
        (false, _) => format!("{} paths a pixel", args.paths),
        (true, None) => format!("{} light samples ({} direct)", lights.len(), lights.direct),
        (true, Some(error)) => {
            let [first, last] = args.piece.sets.unwrap_or([0, args.refine - 1]);
            let sets = last - first + 1;
            format!("{sets} sets of {} light samples (estimated relMSE {error:.1e})", lights.len())
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
    let covered = coverage_of(args, scene, view);
    picture::write(path, (radiance, covered.as_deref()), shown, made_by)
}

/// The share of each pixel that is covered, where the background is transparent.
fn coverage_of(args: &RenderArgs, scene: &Scene, view: &View) -> Option<Vec<f32>> {
    if args.seen.load.background != BackgroundArg::Transparent {
        return None;
    }
    // Averaged pictures have samples everywhere in a pixel.
    let is_averaged = args.refine > 1 || args.engine == Engine::Path;
    let samples = if is_averaged { 4 } else { args.aa.unwrap_or_default().samples_per_axis() };
    let part = args.piece.region.unwrap_or(Region::whole(args.size));
    Some(coverage(&SceneTracer::new(scene, &Geometry::new(scene)), view, (args.size, part), samples))
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
