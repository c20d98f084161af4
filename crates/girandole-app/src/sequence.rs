//! `girandole render --frames`: a numbered sequence, of which each frame is the same alone, resumed and in sequence.

use crate::args::{Frames, Mode, RenderArgs, RewalkArg, UpdatesArg};
use crate::engine::{Job, Picture, Ready};
use crate::output::Stats;
use crate::output::{self, Progress, say};
use crate::render::write_shown;
use crate::transfer::{self, Transferred};
use anyhow::{Context, Result};
use girandole_core::illumination::{Illumination, IlluminationSettings};
use girandole_core::lights::{LightSet, LightSettings};
use girandole_core::scene::{Geometry, Scene, View};
use girandole_core::visibility::VisibilitySettings;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Moments of an animation that light samples are placed for where the camera moves.
const VIEWS: u32 = 8;

/// Views to come that light samples are placed for where they follow paths, and frames between them.
const TO_COME: u32 = 6;
const FRAMES_BETWEEN: u32 = 10;

/// Renders those frames that are not there yet.
pub fn render(args: &RenderArgs, mut scene: Scene, frames: Frames) -> Result<ExitCode> {
    let file = |frame| Frames::file(&args.output, frame).context("the name has no run of # for the number");
    let missing: Vec<(u32, PathBuf)> = frames
        .iter()
        .map(|frame| Ok((frame, file(frame)?)))
        .filter(|frame| frame.as_ref().map_or(true, |(_, path)| !path.exists()))
        .collect::<Result<_>>()?;
    let kept = frames.count() - missing.len();
    let mut engine = Ready::choose(args)?;
    let transfers = transfer::load(&scene, &args.transfer)?;
    let mut way = Way::new(&scene, args);
    let mut light = Light::new(&mut scene, &mut engine, &transfers, (args, &way.ahead_of(0)?))?;
    let mut said = Vec::new();
    warn_once(&mut said, &scene.warnings);
    if scene.duration() == 0.0 {
        warn_once(&mut said, &[format!("nothing in {} is animated: all frames are the same", args.scene)]);
    }
    let bar = Progress::bar("rendering frames");
    let (mut total_ms, mut staleness) = (0.0, Staleness::default());
    let mut next = 0;
    for (done, (frame, path)) in missing.iter().enumerate() {
        let moment = |frame: u32| f64::from(frame) / args.motion.fps;
        // What depends on the frames before, of which those that are there are not rendered again.
        if has_history(args) {
            for skipped in next..*frame {
                scene.set_time(moment(skipped))?;
                light.skip(&mut scene, &mut engine, (args, &way.ahead_of(skipped)?))?;
            }
            next = frame + 1;
        }
        scene.set_time(moment(*frame))?;
        let start = Instant::now();
        let to_come = way.ahead_of(*frame)?;
        let picture = light.picture(&mut scene, &mut engine, &transfers, (args, &to_come))?;
        total_ms += start.elapsed().as_secs_f64() * 1e3;
        staleness.note(&picture.stats);
        warn_once(&mut said, light.warnings(&engine));
        write_shown(args, path, (&scene, &view(&scene, args)?), &picture.radiance)?;
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
        "wrote {} of {} frames{there} to {} ({width}×{height}): {}{time}{staleness} on {} ({} engine)",
        missing.len(),
        frames.count(),
        args.output.display(),
        args.scene,
        engine.adapter(),
        engine.name(),
    ));
    Ok(ExitCode::SUCCESS)
}

/// How old shadow maps were, and what error of the pictures that makes.
#[derive(Default)]
struct Staleness {
    oldest: f64,
    /// Of each frame.
    errors: Vec<f64>,
}

impl Staleness {
    fn note(&mut self, stats: &Stats) {
        let value = |key: &str| stats.get(key).and_then(serde_json::Value::as_f64);
        self.oldest = self.oldest.max(value("oldest_map_frames").unwrap_or(0.0));
        self.errors.extend(value("stale_map_error"));
    }
}

impl std::fmt::Display for Staleness {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let Self { oldest, errors } = self;
        if *oldest == 0.0 || errors.is_empty() {
            return Ok(());
        }
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        write!(f, ", shadow maps up to {oldest} frames old with a mean error of {:.2} %", mean * 100.0)
    }
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

/// Whether frames depend on those before.
fn has_history(args: &RenderArgs) -> bool {
    matches!(args.motion.rewalk, RewalkArg::Paths(_)) || matches!(args.motion.updates, UpdatesArg::Maps(_))
}

fn view(scene: &Scene, args: &RenderArgs) -> Result<View> {
    crate::scene::view(scene, &args.seen, args.camera.as_deref(), args.size)
}

/// What the camera will see: none of it where light samples do not follow paths.
struct Way<'a> {
    posed: Option<Scene>,
    args: &'a RenderArgs,
    /// By frame, as far as they were looked up.
    views: Vec<View>,
}

impl<'a> Way<'a> {
    fn new(scene: &Scene, args: &'a RenderArgs) -> Self {
        let follows = matches!(args.motion.rewalk, RewalkArg::Paths(_));
        Self { posed: follows.then(|| scene.clone()), args, views: Vec::new() }
    }

    /// The views to come at a frame, whether these frames are rendered or not.
    fn ahead_of(&mut self, frame: u32) -> Result<Vec<View>> {
        let Some(posed) = &mut self.posed else { return Ok(Vec::new()) };
        let frames = (1..=TO_COME).map(|step| (frame + step * FRAMES_BETWEEN) as usize);
        while self.views.len() <= (frame + TO_COME * FRAMES_BETWEEN) as usize {
            posed.set_time(self.views.len() as f64 / self.args.motion.fps)?;
            self.views.push(view(posed, self.args)?);
        }
        let views: Vec<View> = frames.map(|frame| self.views[frame]).collect();
        Ok(self.args.lights.placement.views(&views).to_vec())
    }
}

/// The light samples of a sequence.
enum Light {
    /// Those of the scene as it was at first, which follow it; on the device, only what changes is made anew.
    OnDevice,
    Following(Box<Illumination>),
    /// Other ones at each frame.
    Fresh(Box<IlluminationSettings>, Option<Box<Illumination>>),
    /// None: the path tracer has its own.
    None,
}

impl Light {
    fn new(
        scene: &mut Scene,
        engine: &mut Ready,
        transfers: &[Transferred],
        (args, to_come): (&RenderArgs, &[View]),
    ) -> Result<Self> {
        let lights = args.lights.settings();
        let needs_visibility = matches!(engine, Ready::Gpu(_)) && args.mode != Mode::Naive;
        let visibility = needs_visibility.then(VisibilitySettings::default);
        let settings = IlluminationSettings { lights, visibility, ..IlluminationSettings::default() };
        if matches!(engine, Ready::Path) {
            return Ok(Self::None);
        }
        if args.motion.rewalk == RewalkArg::All {
            return Ok(Self::Fresh(Box::new(settings), None));
        }
        // Whatever the range of frames is: samples that are held are placed for all of the camera's way.
        let is_held = args.motion.rewalk == RewalkArg::Off;
        let (mut posed, mut views) = (scene.clone(), Vec::new());
        for moment in 0..if is_held { VIEWS } else { 1 } {
            posed.set_time(scene.duration() * f64::from(moment) / f64::from(VIEWS))?;
            let view = view(&posed, args)?;
            if !views.contains(&view) {
                views.push(view);
            }
        }
        if !is_held {
            scene.set_time(0.0)?;
            views.extend(to_come.iter().filter(|&view| *view != views[0]).copied().collect::<Vec<View>>());
        }
        let settings = IlluminationSettings {
            lights: LightSettings { walk_dynamic: !is_held, ..lights },
            views: args.lights.placement.views(&views).to_vec(),
            rewalk: args.motion.rewalk(),
            ..settings
        };
        scene.take_changes();
        match engine {
            Ready::Gpu(device) => {
                device.open_scene(scene, &settings, transfers, args).map(|()| Self::OnDevice)
            }
            _ => Ok(Self::Following(Box::new(Illumination::new(scene, &settings)?))),
        }
    }

    /// Takes the scene as it stands, the view that samples go over to, and those to come.
    fn follow(
        &mut self,
        scene: &mut Scene,
        engine: &mut Ready,
        (args, to_come): (&RenderArgs, &[View]),
    ) -> Result<()> {
        let changes = scene.take_changes();
        match (&mut *self, &mut *engine) {
            (Self::OnDevice, Ready::Gpu(device)) => device.follow(scene, &changes)?,
            (Self::Following(light), _) => light.update(scene, &changes)?,
            _ => {}
        }
        if !matches!(args.motion.rewalk, RewalkArg::Paths(_)) {
            return Ok(());
        }
        let view = [view(scene, args)?];
        let views = args.lights.placement.views(&view);
        match (self, engine) {
            (Self::OnDevice, Ready::Gpu(device)) => device.place_on_way(scene, views, to_come)?,
            (Self::Following(light), _) => light.place_on_way(scene, views, to_come)?,
            _ => {}
        }
        Ok(())
    }

    /// Passes over a frame that is not rendered.
    fn skip(&mut self, scene: &mut Scene, engine: &mut Ready, seen: (&RenderArgs, &[View])) -> Result<()> {
        self.follow(scene, engine, seen)?;
        match (self, engine) {
            (Self::OnDevice, Ready::Gpu(device)) => device.skip_frame(seen.0),
            _ => Ok(()),
        }
    }

    /// The scene as it stands.
    fn picture(
        &mut self,
        scene: &mut Scene,
        engine: &mut Ready,
        transfers: &[Transferred],
        (args, to_come): (&RenderArgs, &[View]),
    ) -> Result<Picture> {
        let (view, clamp) = (view(scene, args)?, args.quality.clamp.0);
        let job = |scene, geometry, lights, visibility| Job {
            scene,
            geometry,
            lights,
            visibility,
            transfers,
            view,
            clamp,
            args,
        };
        self.follow(scene, engine, (args, to_come))?;
        match (self, engine) {
            (Self::OnDevice, Ready::Gpu(device)) => device.picture(&view, args),
            (Self::OnDevice | Self::None, engine) => {
                let geometry = Geometry::new(scene);
                let lights = LightSet::from_samples(&geometry, Vec::new());
                engine.render(&job(scene, &geometry, &lights, None))
            }
            (Self::Following(light), engine) => {
                engine.render(&job(scene, light.geometry(), light.lights(), light.visibility()))
            }
            (Self::Fresh(settings, light), engine) => {
                settings.views = args.lights.placement.views(&[view]).to_vec();
                let light = light.insert(Box::new(Illumination::new(scene, settings)?));
                engine.render(&job(scene, light.geometry(), light.lights(), light.visibility()))
            }
        }
    }

    /// What the samples warn of.
    fn warnings<'a>(&'a self, engine: &'a Ready) -> &'a [String] {
        match (self, engine) {
            (Self::OnDevice, Ready::Gpu(device)) => device.warnings(),
            (Self::Following(light) | Self::Fresh(_, Some(light)), _) => &light.lights().warnings,
            _ => &[],
        }
    }
}
