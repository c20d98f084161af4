//! `girandole render --frames`: a numbered sequence, of which each frame is the same alone, resumed and in sequence.

mod kept;
mod light;

use crate::args::{Frames, RenderArgs, RewalkArg, UpdatesArg};
use crate::engine::Ready;
use crate::output::{self, Progress, Stats, say};
use crate::provenance::Maker;
use crate::render::{check_engine, write_shown};
use crate::transfer;
use anyhow::Result;
use girandole_core::scene::{Scene, View};
use kept::Claims;
use light::Light;
use std::process::ExitCode;
use std::time::Instant;

/// Views to come that light samples are placed for where they follow paths, and frames between them.
const TO_COME: u32 = 6;
const FRAMES_BETWEEN: u32 = 10;

/// Renders those frames that are not there yet.
pub fn render(mut args: RenderArgs, mut scene: Scene, frames: Frames) -> Result<ExitCode> {
    let mut engine = Ready::choose(&args)?;
    check_engine(&args, &engine)?;
    args.aa.get_or_insert(engine.anti_aliasing(&args));
    let args = &args;
    let maker = Maker::new(args, engine.kind(), &scene, &args.output)?;
    let missing = kept::missing(args, (&scene, &maker), frames)?;
    let asked_for = frames.iter().filter(|&number| args.piece.has(frames, number)).count();
    let kept = asked_for - missing.len();
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
    let (mut next, mut written, mut by_others) = (0, 0, 0);
    let all = missing.len();
    let mut claims = Claims::new(missing, has_history(args));
    while let Some((frame, _claim)) = claims.next(&args.output, (&scene, &maker))? {
        bar.set((written + by_others) as f32 / all as f32);
        if kept::is_there(&frame, args.motion.overwrite)? {
            by_others += 1;
            continue;
        }
        let moment = |frame: u32| f64::from(frame) / args.motion.fps;
        // What depends on the frames before, of which those that are there are not rendered again.
        if has_history(args) {
            for skipped in next..frame.number {
                scene.set_time(moment(skipped))?;
                light.skip(&mut scene, &mut engine, (args, &way.ahead_of(skipped)?))?;
            }
            next = frame.number + 1;
        }
        scene.set_time(moment(frame.number))?;
        let start = Instant::now();
        let to_come = way.ahead_of(frame.number)?;
        let picture = light.picture(&mut scene, &mut engine, &transfers, (args, &to_come))?;
        total_ms += start.elapsed().as_secs_f64() * 1e3;
        staleness.note(&picture.stats);
        warn_once(&mut said, light.warnings(&engine));
        let shows = (&scene, &view(&scene, args)?, &frame.made_by);
        write_shown(args, &frame.path, shows, &picture.radiance)?;
        written += 1;
    }
    drop(bar);
    warn_once(&mut said, &scene.warnings);
    let [width, height] = args.size;
    let some = |count, what| if count > 0 { format!(", {count} {what}") } else { String::new() };
    let (there, others) = (some(kept, "were there"), some(by_others, "by another process"));
    let time = match written {
        0 => String::new(),
        n => format!(", {} a frame", output::duration(total_ms / n as f64)),
    };
    say(&format!(
        "wrote {written} of {asked_for} frames{there}{others} to {} ({width}×{height}): {}{time}{staleness} on {} ({} engine)",
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
