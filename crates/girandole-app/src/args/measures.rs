//! Options of what is measured: of comparisons, and of times.

use super::motion::{self, RewalkArg, UpdatesArg, parse_numbered_updates};
use super::values::*;
use super::{QualityArgs, SceneArgs};
use clap::Args;
use girandole_core::lights::MAX_LIGHTS;
use std::path::PathBuf;

const COMPARE_EXAMPLES: &str = "\
relMSE = mean((test − reference)² / (reference² + 0.01)) over valid pixels and channels.
Exit code: 0, or 1 where a --max-… threshold is exceeded, or 2 where there is nothing to compare.

Examples:
  girandole compare d6.exr picture.exr --mask mask.exr --trim 0.001 --max-rel-mse 0.005
  girandole compare reference.png picture.png --json --out errors.png";

/// Options of `girandole compare`.
#[derive(Args, Clone, Debug)]
#[command(after_help = COMPARE_EXAMPLES, allow_negative_numbers = true)]
pub struct CompareArgs {
    /// The reference picture, .exr or .png
    #[arg(value_name = "REF")]
    pub reference: PathBuf,

    /// The picture to compare with it, of the same size
    #[arg(value_name = "TEST")]
    pub test: PathBuf,

    /// Leaves pixels out: R and G above 0 always (emitters, background), B above 0 unless --edges; may be given more than once
    #[arg(long, value_name = "M.exr|M.png")]
    pub mask: Vec<PathBuf>,

    /// Keeps the mask's edge pixels (for anti-aliased pictures)
    #[arg(long, requires = "mask")]
    pub edges: bool,

    /// Share of the worst pixels that relMSE leaves out, at least 0 and less than 1
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = parse_trim)]
    pub trim: f32,

    /// Largest relMSE
    #[arg(long, value_name = "X", value_parser = parse_threshold)]
    pub max_rel_mse: Option<f64>,

    /// Largest root mean square error
    #[arg(long, value_name = "X", value_parser = parse_threshold)]
    pub max_rmse: Option<f64>,

    /// Largest mean FLIP error
    #[arg(long, value_name = "X", value_parser = parse_threshold)]
    pub max_flip: Option<f64>,

    /// Largest distance of the energy ratio (test / reference) from 1
    #[arg(long, value_name = "X", value_parser = parse_threshold)]
    pub max_energy_error: Option<f64>,

    /// Writes a heat map of the error, .png
    #[arg(long, value_name = "HEAT.png")]
    pub out: Option<PathBuf>,

    /// Prints one flat JSON object instead of a table
    #[arg(long)]
    pub json: bool,
}

const BENCH_EXAMPLES: &str = "\
A frame is everything from the camera to tone-mapped pixels with shadow maps, visibility and light maps in place and the
exposure fixed, by the clock around submitting and waiting. Modes take turns; the first round warms up; medians are shown.

Examples:
  girandole bench
  girandole bench area-lights table --lights 25,50,100,200,300 --modes naive,vd,vd-lp,full --json times.json
  girandole bench pillars --moving --updates 50,100,all
  girandole bench pillars --moving --rewalk 200
  girandole bench room.glb --view 0,1.7,2,0,0.8,0,0,1,0,60 --edits moved.json
  girandole bench pillars --modes vd,full --light-maps on --size 1920x1080 --csv times.csv";

/// Options of `girandole bench`.
#[derive(Args, Clone, Debug)]
#[command(after_help = BENCH_EXAMPLES, allow_negative_numbers = true)]
pub struct BenchArgs {
    /// Built-in rooms, .glb, .gltf, .obj or .ply files
    #[arg(default_values = ["area-lights", "table", "pillars"])]
    pub scenes: Vec<String>,

    /// Numbers of light samples
    #[arg(long, value_name = "N,…", default_value = "300", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_LIGHTS)))]
    pub lights: Vec<u32>,

    /// Times mode full along the scene's motion: frames after updates, and static ones
    #[arg(long, conflicts_with = "modes")]
    pub moving: bool,

    /// With --moving: stale shadow maps that a frame draws at most
    #[arg(long, value_name = "N|all,…", default_value = "all", value_delimiter = ',', requires = "moving", value_parser = parse_numbered_updates)]
    pub updates: Vec<UpdatesArg>,

    /// With --moving: which light samples follow; see `girandole render --help`
    #[arg(long, value_name = "off|N|all", default_value = "off", value_parser = motion::parse_rewalk, requires = "moving")]
    pub rewalk: RewalkArg,

    /// With --moving: frames a second
    #[arg(long, value_name = "N", default_value_t = 30.0, value_parser = motion::parse_fps, requires = "moving")]
    pub fps: f64,

    /// Modes to compare; ratios refer to the first
    #[arg(long, value_enum, value_name = "MODE,…", default_values = ["naive", "vd", "vd-lp", "full"], value_delimiter = ',')]
    pub modes: Vec<Mode>,

    /// Timed rounds, after one to warm up
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub repeat: u32,

    /// Pixels in x and y, each from 1 to 8192
    #[arg(long, value_name = "WxH", default_value = "1024x768", value_parser = parse_size, allow_hyphen_values = true)]
    pub size: [u32; 2],

    #[command(flatten)]
    pub seen: SceneArgs,

    /// The moving object of built-in rooms; see `girandole render --help`
    #[arg(long, value_name = "none|torus|teapot|balloon|FILE")]
    pub object: Option<String>,

    /// Anti-aliasing: samples along each axis of a pixel
    #[arg(long, value_enum, default_value_t)]
    pub aa: AntiAliasing,

    /// Same seed, same light samples
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u32,

    #[command(flatten)]
    pub quality: QualityArgs,

    /// The adapter whose name contains this; see `girandole info`
    #[arg(long, value_name = "NAME")]
    pub adapter: Option<String>,

    /// Writes the table as comma-separated values
    #[arg(long, value_name = "FILE.csv")]
    pub csv: Option<PathBuf>,

    /// Writes everything that was measured as an array of flat objects
    #[arg(long, value_name = "FILE.json")]
    pub json: Option<PathBuf>,
}
