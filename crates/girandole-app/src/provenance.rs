//! What pictures of a call of `girandole render` are made by: the scene by its content, and all options that
//! change a picture.

use crate::args::{Engine, RenderArgs, RewalkArg, UpdatesArg};
use crate::scene;
use anyhow::Result;
use girandole_core::scene::{Scene, View};
use girandole_reference::{Difference, Provenance, image_file};
use std::io::ErrorKind;
use std::path::Path;

/// What is named first where two pictures differ.
pub const FIRST: [&str; 5] = ["version", "scene", "size", "engine", "view"];
/// What parts of one picture differ by.
pub const OF_PARTS: [&str; 2] = ["region", "sets"];

/// Options that change no picture, or that the scene's content, the view and the engine tell more exactly.
const LEFT_OUT: [&str; 18] = [
    "--output",
    "--size",
    "--camera",
    "--view",
    "--edits",
    "--object",
    "--environment",
    "--environment-strength",
    "--environment-rotation",
    "--light",
    "--scale",
    "--time",
    "--frames",
    "--fps",
    "--part",
    "--engine",
    "--adapter",
    "--stats",
];
/// Of sequences.
const MOTION: [&str; 4] = ["--rewalk", "--fade", "--updates", "--max-map-age"];
/// Of the two engines with light samples.
const SAMPLED: [&str; 6] = ["--lights", "--direct", "--placement", "--termination", "--clamp", "--aa"];
/// Of the engine gpu.
const ON_GPU: [&str; 12] = [
    "--mode",
    "--shadow-map",
    "--map-size",
    "--pcf",
    "--memory",
    "--light-maps",
    "--shading",
    "--lights-per-pass",
    "--tolerance",
    "--mirrors",
    "--debug",
    "--refine",
];
/// Of files that hold display colours.
const SHOWN: [&str; 2] = ["--exposure", "--tonemap"];

/// What the pictures of one call have in common.
pub struct Maker<'a> {
    args: &'a RenderArgs,
    common: Provenance,
}

impl<'a> Maker<'a> {
    /// For this engine, by name; `path` is where a picture goes.
    pub fn new(args: &'a RenderArgs, engine: Engine, scene: &Scene, path: &Path) -> Result<Self> {
        let mut common = Provenance::default();
        common.set("version", env!("CARGO_PKG_VERSION"));
        common.set("scene", scene.content());
        common.set("size", format!("{}x{}", args.size[0], args.size[1]));
        common.set("engine", name(engine));
        let is_shown = !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
        for (option, value) in args.choices()? {
            let counts = match option {
                _ if LEFT_OUT.contains(&option) || MOTION.contains(&option) => false,
                _ if SHOWN.contains(&option) => is_shown,
                _ if ON_GPU.contains(&option) => engine == Engine::Gpu,
                _ if SAMPLED.contains(&option) => engine != Engine::Path,
                _ if option.starts_with("--transfer") => args.transfer.gathering().is_some(),
                "--paths" => engine == Engine::Path,
                _ => true,
            };
            if let Some(value) = value.filter(|_| counts) {
                common.set(option.trim_start_matches('-'), value);
            }
        }
        let mut maker = Self { args, common };
        if args.motion.frames.is_some() && engine != Engine::Path {
            maker.add_motion()?;
        }
        Ok(maker)
    }

    /// Samples that are taken anew at each frame are those of a single picture.
    fn add_motion(&mut self) -> Result<()> {
        let motion = &self.args.motion;
        let follows = matches!(motion.rewalk, RewalkArg::Paths(_));
        let is_late = motion.updates != UpdatesArg::All;
        for (option, value) in self.args.choices()? {
            let counts = match option {
                "--rewalk" => motion.rewalk != RewalkArg::All,
                "--fade" => follows,
                "--updates" | "--max-map-age" => is_late,
                "--fps" => follows || is_late,
                _ => false,
            };
            if let Some(value) = value.filter(|_| counts) {
                self.common.set(option.trim_start_matches('-'), value);
            }
        }
        Ok(())
    }

    /// Of the scene at a moment, in seconds, or as it stands.
    pub fn still(&self, scene: &Scene, seconds: Option<f64>) -> Result<Provenance> {
        let mut made_by = self.common.clone();
        made_by.set("moment", scene.placement(seconds));
        let view = match self.args.seen.view {
            Some(_) => numbers(&scene::view(scene, &self.args.seen, None, self.args.size)?),
            None => {
                let camera = scene.camera(self.args.camera.as_deref().unwrap_or("0"))?;
                scene.camera_placement(camera, seconds).to_string()
            }
        };
        made_by.set("view", view);
        Ok(made_by)
    }

    /// Of a frame of a sequence.
    pub fn frame(&self, scene: &Scene, frame: u32) -> Result<Provenance> {
        let mut made_by = self.still(scene, Some(f64::from(frame) / self.args.motion.fps))?;
        // Others are the picture of their moment, whatever came before.
        if self.common.0.contains_key("fps") {
            made_by.set("frame", frame);
        }
        Ok(made_by)
    }
}

/// What is at a picture's place.
pub enum There {
    Nothing,
    /// The picture.
    Picture,
    /// A file that is not it, and why.
    Other(String),
    Folder,
}

/// Whether a picture is there that was made by this, or something else.
pub fn there(path: &Path, made_by: &Provenance) -> There {
    match path.metadata() {
        Err(e) if e.kind() == ErrorKind::NotFound => return There::Nothing,
        Ok(file) if file.is_dir() => return There::Folder,
        Ok(file) if file.len() == 0 => return There::Other("it is empty".into()),
        _ => {}
    }
    let others = match Provenance::read(path) {
        Ok(Some(others)) => others,
        Ok(None) => return There::Other("it does not say what it was made by".into()),
        Err(error) => return There::Other(error.to_string()),
    };
    if let Some(difference) = made_by.difference(&others, &FIRST) {
        return There::Other(what_differs(&difference));
    }
    match image_file::read(path) {
        Ok(_) => There::Picture,
        Err(error) => There::Other(error.to_string()),
    }
}

/// As a part of a sentence about a file.
pub fn what_differs(difference: &Difference) -> String {
    let Difference { key, here, there } = difference;
    let value = |value: &Option<String>| value.clone().unwrap_or_default();
    let (here, there) = (value(here), value(there));
    match key.as_str() {
        "version" => format!("it was made by version {there} instead of {here}"),
        "scene" => "it shows another scene, or this one as it was before a change".into(),
        "size" => format!("it has {there} pixels instead of {here}"),
        "engine" => format!("it was made by --engine {there} instead of {here}"),
        "view" => "it shows another view".into(),
        "moment" | "frame" => "it shows another moment".into(),
        _ if there.is_empty() => format!("it was made without --{key} {here}"),
        _ if here.is_empty() => format!("it was made with --{key} {there}"),
        _ => format!("it was made with --{key} {there} instead of {here}"),
    }
}

/// A view that no camera of the scene has.
fn numbers(view: &View) -> String {
    let directions = [view.forward, view.up].into_iter().flat_map(|v| v.to_array()).map(f64::from);
    let extent = view.half_extent.to_array().map(f64::from);
    let numbers = view.eye.to_array().into_iter().chain(directions).chain(extent);
    let numbers: Vec<String> = numbers.map(|x| (x + 0.0).to_string()).collect();
    let kind = if view.orthographic { "parallel" } else { "perspective" };
    format!("{kind} {}", numbers.join(","))
}

fn name(engine: Engine) -> &'static str {
    match engine {
        Engine::Auto | Engine::Gpu => "gpu",
        Engine::Cpu => "cpu",
        Engine::Path => "path",
    }
}
