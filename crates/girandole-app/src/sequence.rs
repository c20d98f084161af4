//! `girandole render --frames`: a numbered sequence, of which each frame is the same alone, resumed and in sequence.

use crate::args::{Engine, Frames, Mode, Placement, RenderArgs, RewalkArg};
use crate::engine::{Job, Ready};
use crate::output::{self, Progress, say};
use crate::render::write_shown;
use anyhow::{Context, Result};
use girandole_core::illumination::{Illumination, IlluminationSettings, Rewalk};
use girandole_core::lights::{LightSet, LightSettings};
use girandole_core::scene::{Geometry, Scene, View};
use girandole_core::visibility::{MOST_LIGHTS, VisibilityDatabase, VisibilitySettings};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Moments of an animation that light samples are placed for where the camera moves.
const VIEWS: u32 = 8;

/// Renders those frames that are not there yet.
pub fn render(args: &RenderArgs, mut scene: Scene, frames: Frames) -> Result<ExitCode> {
    let file = |frame| Frames::file(&args.output, frame).context("the name has no run of # for the number");
    let missing: Vec<(u32, PathBuf)> = frames
        .iter()
        .map(|frame| Ok((frame, file(frame)?)))
        .filter(|frame| frame.as_ref().map_or(true, |(_, path)| !path.exists()))
        .collect::<Result<_>>()?;
    let kept = frames.count() - missing.len();
    let mut light = Light::new(&scene, args)?;
    let mut engine = Ready::choose(args)?;
    let mut said = Vec::new();
    warn_once(&mut said, &scene.warnings);
    if scene.duration() == 0.0 {
        warn_once(&mut said, &[format!("nothing in {} is animated: all frames are the same", args.scene)]);
    }
    let bar = Progress::bar("rendering frames");
    let mut total_ms = 0.0;
    for (done, (frame, path)) in missing.iter().enumerate() {
        scene.set_time(f64::from(*frame) / args.motion.fps)?;
        let view = view(&scene, args)?;
        let start = Instant::now();
        let (geometry, lights, visibility) = light.at(&mut scene, view)?;
        total_ms += start.elapsed().as_secs_f64() * 1e3;
        let clamp = args.quality.clamp.0;
        let job = Job { scene: &scene, geometry, lights, visibility, view, clamp, args };
        let picture = engine.render(&job)?;
        warn_once(&mut said, &lights.warnings);
        total_ms += picture.frame_ms;
        write_shown(args, path, &picture.radiance)?;
        bar.set((done + 1) as f32 / missing.len() as f32);
    }
    drop(bar);
    warn_once(&mut said, &scene.warnings);
    let [width, height] = args.size;
    let there = if kept > 0 { format!(", {kept} were there") } else { String::new() };
    let time = match missing.len() {
        0 => String::new(),
        n => format!(", {} a frame", output::duration(total_ms / n as f64)),
    };
    say(&format!(
        "wrote {} of {} frames{there} to {} ({width}×{height}): {}{time} on {} ({} engine)",
        missing.len(),
        frames.count(),
        args.output.display(),
        args.scene,
        engine.adapter(),
        engine.name(),
    ));
    Ok(ExitCode::SUCCESS)
}

/// Prints those warnings that were not printed before.
fn warn_once(said: &mut Vec<String>, warnings: &[String]) {
    for warning in warnings {
        if !said.contains(warning) {
            say(&format!("warning: {warning}"));
            said.push(warning.clone());
        }
    }
}

fn view(scene: &Scene, args: &RenderArgs) -> Result<View> {
    let camera = scene.camera(args.camera.as_deref().unwrap_or("0"))?;
    Ok(View::new(scene, camera, args.size[0] as f32 / args.size[1] as f32))
}

type Parts<'a> = (&'a Geometry, &'a LightSet, Option<&'a VisibilityDatabase>);

/// The light samples of a sequence.
enum Light {
    /// Those of the scene as it was loaded, moved along.
    Held(Box<Illumination>),
    /// Other ones at each frame.
    Fresh(Placement, IlluminationSettings, Option<Box<Illumination>>),
    /// None: the path tracer has its own.
    None(Option<Box<(Geometry, LightSet)>>),
}

impl Light {
    fn new(scene: &Scene, args: &RenderArgs) -> Result<Self> {
        let lights = args.lights.settings();
        let is_for_gpu = matches!(args.engine, Engine::Gpu | Engine::Auto);
        let needs_visibility =
            is_for_gpu && args.mode != Mode::Naive && args.lights.lights as usize <= MOST_LIGHTS;
        let visibility = needs_visibility.then(VisibilitySettings::default);
        let settings = IlluminationSettings { lights, visibility, ..IlluminationSettings::default() };
        if args.engine == Engine::Path {
            return Ok(Self::None(None));
        }
        if args.motion.rewalk == RewalkArg::All {
            return Ok(Self::Fresh(args.lights.placement, settings, None));
        }
        // Whatever the range of frames is, the samples are placed for all of the camera's way.
        let (mut posed, mut views) = (scene.clone(), Vec::new());
        for moment in 0..VIEWS {
            posed.set_time(scene.duration() * f64::from(moment) / f64::from(VIEWS))?;
            let view = view(&posed, args)?;
            if !views.contains(&view) {
                views.push(view);
            }
        }
        let settings = IlluminationSettings {
            lights: LightSettings { walk_dynamic: false, ..lights },
            views: args.lights.placement.views(&views).to_vec(),
            rewalk: Rewalk::Off,
            ..settings
        };
        Ok(Self::Held(Box::new(Illumination::new(scene, &settings)?)))
    }

    /// The scene as it stands, flattened, its light, and which of it needs a shadow map where.
    fn at(&mut self, scene: &mut Scene, view: View) -> Result<Parts<'_>> {
        let changes = scene.take_changes();
        match self {
            Self::Held(illumination) => {
                illumination.update(scene, &changes)?;
                Ok((illumination.geometry(), illumination.lights(), illumination.visibility()))
            }
            Self::Fresh(placement, settings, illumination) => {
                settings.views = placement.views(&[view]).to_vec();
                let illumination = illumination.insert(Box::new(Illumination::new(scene, settings)?));
                Ok((illumination.geometry(), illumination.lights(), illumination.visibility()))
            }
            Self::None(made) => {
                let geometry = Geometry::new(scene);
                let lights = LightSet::from_samples(&geometry, Vec::new());
                let (geometry, lights) = &**made.insert(Box::new((geometry, lights)));
                Ok((geometry, lights, None))
            }
        }
    }
}
