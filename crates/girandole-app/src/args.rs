//! The command line: options and their ranges.

mod command_line;
mod motion;
mod scene;
mod settings;
mod transfer;
mod values;

use clap::{Args, Parser, Subcommand};
use girandole_core::lights::{LightSettings, MAX_LIGHTS, Termination};
use girandole_core::tonemap::Exposure;
use std::path::PathBuf;
use values::*;

use motion::parse_numbered_updates;
pub use motion::{Frames, MotionArgs, RewalkArg, UpdatesArg};
pub use scene::{BackgroundArg, EnvironmentArg, LightArg, LoadArgs, SceneArgs, ViewArg};
pub use transfer::TransferArgs;
pub use values::{
    AntiAliasing, Bounces, Clamp, DebugView, DirectShare, Engine, Mode, Pcf, Placement, ShadingArg,
    ShadowMap, Switch, TerminationArg, ToneCurve,
};

const EXAMPLES: &str = "\
Examples:
  girandole                                              a window on the room `pillars`
  girandole view room.glb                                a window on a glTF file
  girandole render table -o table.png                    a built-in room, tone-mapped
  girandole render room.glb -o room.exr --camera 1       a glTF file, linear radiance
  girandole render block --object teapot --lights 1024 --aa 2 -o block.png
  girandole render table --engine path --paths 256 -o truth.exr
  girandole compare truth.exr table.exr --max-rel-mse 0.005 --out errors.png
  girandole bench area-lights --lights 100,300           time the modes against each other
  girandole info table                                   adapters, and what the scene holds";

/// Lights scenes with hundreds to thousands of shadowed point lights.
///
/// Without a command it shows the built-in room `pillars` in a window, or, without a display, renders it to girandole.png.
#[derive(Debug, Parser)]
#[command(name = "girandole", version, after_help = EXAMPLES, max_term_width = 110)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Option<Command>,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Opens a window on a scene
    View(Box<ViewArgs>),
    /// Renders a picture of a scene
    Render(Box<RenderArgs>),
    /// Compares two pictures: energy, relMSE, RMSE, FLIP, worst pixel
    Compare(CompareArgs),
    /// Lists the adapters and what they support, and what a scene holds
    Info(InfoArgs),
    /// Times the modes against each other
    Bench(Box<BenchArgs>),
}

const VIEW_EXAMPLES: &str = "\
Mouse over the picture: drag to look, right button to orbit, middle button to pan, wheel to move; click to pick an object.
Keys: W A S D to walk, E and Q up and down, Shift faster; Space plays motion; F12 saves the picture, F9 copies the
call of `girandole render` that gives it; T shows the truth beside it, V the debug views; H hides the panel; Esc lets go of
what is picked; Ctrl Q closes the window.

Examples:
  girandole view
  girandole view table --lights 1024 --aa 2
  girandole view room.glb --camera Front --mode naive";

/// Options of `girandole view`: what the window starts with.
#[derive(Args, Clone, Debug)]
#[command(after_help = VIEW_EXAMPLES, allow_negative_numbers = true)]
pub struct ViewArgs {
    /// A built-in room (area-lights, table, pillars, block, gap) or a .glb, .gltf, .obj or .ply file
    #[arg(default_value = "pillars")]
    pub scene: String,

    /// The first picture: pixels in x and y, each from 1 to 8192; the panel is beside it
    #[arg(long, value_name = "WxH", default_value = "1024x768", value_parser = parse_size, allow_hyphen_values = true)]
    pub size: [u32; 2],

    /// A camera of the scene, by name or index; the first if not given
    #[arg(long, value_name = "NAME|INDEX", conflicts_with = "view")]
    pub camera: Option<String>,

    #[command(flatten)]
    pub seen: SceneArgs,

    /// The moving object of a built-in room; see `girandole render --help`
    #[arg(long, value_name = "none|torus|teapot|FILE")]
    pub object: Option<String>,

    /// Where pictures are saved, .png or .exr; a number is added where the file is there already
    #[arg(short, long, value_name = "OUT.{exr,png}", default_value = "girandole.png")]
    pub output: PathBuf,

    #[command(flatten)]
    pub transfer: TransferArgs,

    #[command(flatten)]
    pub lights: LightArgs,

    /// How much work is avoided
    #[arg(long, value_enum, default_value_t)]
    pub mode: Mode,

    #[command(flatten)]
    pub quality: QualityArgs,

    /// What a frame may take while things move, in milliseconds from 1 to 10000: then pictures have fewer pixels, down to a quarter,
    /// and fewer shadow maps are drawn anew, as the time demands. A moment after all is at rest the picture is as it was asked for
    #[arg(long, value_name = "MS", value_parser = parse_budget)]
    pub interactive_budget: Option<f64>,

    /// Writes times and counts as one flat JSON object when the window is closed
    #[arg(long, value_name = "FILE.json")]
    pub stats: Option<PathBuf>,

    /// The adapter whose name contains this; see `girandole info`
    #[arg(long, value_name = "NAME")]
    pub adapter: Option<String>,

    /// Exposure in stops, or auto: the mean becomes middle grey
    #[arg(long, value_name = "auto|EV", default_value = "auto", value_parser = parse_exposure)]
    pub exposure: Exposure,

    /// Tone curve
    #[arg(long, value_enum, default_value_t)]
    pub tonemap: ToneCurve,

    /// Anti-aliasing: samples along each axis of a pixel
    #[arg(long, value_enum, default_value_t)]
    pub aa: AntiAliasing,

    /// While everything is at rest, averages the pictures of further light sets, as `girandole render --refine` does
    #[arg(long)]
    pub refine: bool,

    /// For tests: gives the device up so many seconds after the start, as a driver does that fails
    #[arg(long, hide = true, value_name = "SECONDS", value_delimiter = ',', value_parser = clap::value_parser!(u64).range(1..=3600))]
    pub lose_device: Vec<u64>,
}

const RENDER_EXAMPLES: &str = "\
Examples:
  girandole render -o pillars.png
  girandole render table --lights 1024 --bounces 3 --aa 2 -o table.png
  girandole render block --object teapot --exposure 1.5 --tonemap aces -o block.png
  girandole render room.glb --camera Front --engine cpu -o room.exr --stats room.json
  girandole render pillars --time 2.5 -o later.png
  girandole render table --refine 64 -o exact.exr
  girandole render table --view 0,1.7,2,0,0.8,0,0,1,0,60 --edits moved.json -o moved.png
  girandole render table --object bunny.ply --transfer grid -o bunny.png
  girandole render pillars --frames 0..239 --exposure 0.5 -o pillars.####.png

Edits are a list such as {\"version\": 1, \"edits\": [{\"set_time\": {\"seconds\": 1.5}}]}; docs/reference.md shows one of each kind.";

/// Options of `girandole render`.
#[derive(Args, Clone, Debug, PartialEq)]
#[command(after_help = RENDER_EXAMPLES, allow_negative_numbers = true)]
pub struct RenderArgs {
    /// A built-in room (area-lights, table, pillars, block, gap) or a .glb, .gltf, .obj or .ply file
    #[arg(default_value = "pillars")]
    pub scene: String,

    /// The picture: .exr (linear radiance, before exposure) or .png (tone-mapped)
    #[arg(short, long, value_name = "OUT.{exr,png}", default_value = "girandole.png")]
    pub output: PathBuf,

    /// Pixels in x and y, each from 1 to 8192
    #[arg(long, value_name = "WxH", default_value = "1024x768", value_parser = parse_size, allow_hyphen_values = true)]
    pub size: [u32; 2],

    /// A camera of the scene, by name or index; the first if not given
    #[arg(long, value_name = "NAME|INDEX", conflicts_with = "view")]
    pub camera: Option<String>,

    #[command(flatten)]
    pub seen: SceneArgs,

    /// The moving object of a built-in room: none, torus, teapot, or a .ply, .obj or .glb file; if not given, the
    /// room's default
    #[arg(long, value_name = "none|torus|teapot|FILE")]
    pub object: Option<String>,

    #[command(flatten)]
    pub motion: MotionArgs,

    #[command(flatten)]
    pub transfer: TransferArgs,

    #[command(flatten)]
    pub lights: LightArgs,

    /// How much work is avoided (engine gpu)
    #[arg(long, value_enum, default_value_t)]
    pub mode: Mode,

    #[command(flatten)]
    pub quality: QualityArgs,

    /// Shows how the picture is made instead (engine gpu): receivers, states (how many lights need a shadow map), states:N
    /// (of light N: green unoccluded, yellow partially, red fully blocked), light-maps, levels (where points were
    /// shaded), lights (a marker at each light sample), atlas (of shadow maps)
    #[arg(long, value_name = "VIEW", value_parser = parse_debug)]
    pub debug: Option<DebugView>,

    /// gpu: shadow maps on a graphics adapter; cpu: the same lights with traced shadows; path: the path tracer;
    /// auto: gpu where there is an adapter, else cpu
    #[arg(long, value_enum, default_value_t)]
    pub engine: Engine,

    /// Paths a pixel (engine path only)
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub paths: u32,

    /// The adapter whose name contains this; see `girandole info`
    #[arg(long, value_name = "NAME")]
    pub adapter: Option<String>,

    /// Exposure of a .png in stops, or auto: the mean becomes middle grey
    #[arg(long, value_name = "auto|EV", default_value = "auto", value_parser = parse_exposure)]
    pub exposure: Exposure,

    /// Tone curve of a .png
    #[arg(long, value_enum, default_value_t)]
    pub tonemap: ToneCurve,

    /// Anti-aliasing: samples along each axis of a pixel
    #[arg(long, value_enum, default_value_t)]
    pub aa: AntiAliasing,

    /// Averages the pictures of so many light sets, each with --lights samples, tighter settings, and rays through other points of
    /// the pixels (engine gpu); the error falls about as their number grows, down to that of a path tracer
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub refine: u32,

    /// Writes times and counts as one flat JSON object
    #[arg(long, value_name = "FILE.json")]
    pub stats: Option<PathBuf>,
}

/// Options of the light samples.
#[derive(Args, Clone, Copy, Debug, PartialEq)]
pub struct LightArgs {
    /// Light samples in all, from 1 to 1048576
    #[arg(long, value_name = "N", default_value_t = 300, value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_LIGHTS)))]
    pub lights: u32,

    /// Share of the samples that lie on emitters, 0 to 1, the others are left by random walks; auto: as the light demands
    #[arg(long, value_name = "auto|SHARE", default_value_t, value_parser = parse_direct)]
    pub direct: DirectShare,

    /// Where the samples are placed: for what the camera sees, or for the whole scene
    #[arg(long, value_enum, default_value_t)]
    pub placement: Placement,

    /// Bounces of indirect light, from 0 (direct light only) to 1000; engine path also takes `unlimited`
    #[arg(long, value_name = "N", default_value = "5", value_parser = parse_bounces)]
    pub bounces: Bounces,

    /// Same seed, same light samples and paths
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u32,

    /// How random walks end before the bounce limit
    #[arg(long, value_enum, default_value_t)]
    pub termination: TerminationArg,
}

impl LightArgs {
    /// As the library's settings.
    pub fn settings(&self) -> LightSettings {
        LightSettings {
            count: self.lights,
            direct_share: self.direct.0,
            bounces: self.bounces.limit().unwrap_or(u32::MAX),
            seed: self.seed,
            termination: match self.termination {
                TerminationArg::Throughput => Termination::Throughput,
                TerminationArg::Albedo => Termination::Albedo,
            },
            ..LightSettings::default()
        }
    }
}

/// Options of shadows and shading.
#[derive(Args, Clone, Copy, Debug, PartialEq)]
pub struct QualityArgs {
    /// Upper bound on the geometric factor, m⁻², against bright spots near light samples; off: exact, with the spots; auto:
    /// none either, but close to a sample the mean over the surface that it stands for
    #[arg(long, value_name = "auto|off|X", default_value_t, value_parser = parse_clamp)]
    pub clamp: Clamp,

    /// Parameterisation of the shadow maps (engine gpu)
    #[arg(long, value_enum, default_value_t)]
    pub shadow_map: ShadowMap,

    /// Texels along a side of a shadow map (engine gpu); if not given, from the number of lights and --memory
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(16..=8192))]
    pub map_size: Option<u32>,

    /// Percentage-closer filtering: width in texels, 1 to 16 (engine gpu)
    #[arg(long, value_name = "off|N", default_value = "off", value_parser = parse_pcf)]
    pub pcf: Pcf,

    /// Budget for shadow maps, MiB (engine gpu); software devices take as much again where anything may move
    #[arg(long, value_name = "MiB", default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    pub memory: u32,

    /// Light maps: the sum of all lights that can reach a patch, from which what is blocked is subtracted; if not given,
    /// on in mode full only (engine gpu)
    #[arg(long, value_enum, value_name = "on|off")]
    pub light_maps: Option<Switch>,

    /// How points are shaded in all modes but naive (engine gpu); both give the same picture
    #[arg(long, value_enum, default_value_t)]
    pub shading: ShadingArg,

    /// Multipass shading: lights a pass
    #[arg(long, value_name = "K", default_value_t = settings::LIGHTS_PER_PASS, value_parser = clap::value_parser!(u32).range(1..=32))]
    pub lights_per_pass: u32,

    /// Modes vd-lp and full: by what share the light of neighbouring points may differ, and pixels between them still
    /// be interpolated; 0 shades every pixel
    #[arg(long, value_name = "SHARE", default_value_t = 0.1, value_parser = parse_share)]
    pub tolerance: f32,
}

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

    /// Leaves pixels out: R and G above 0 always (emitters, background), B above 0 unless --edges
    #[arg(long, value_name = "M.exr")]
    pub mask: Option<PathBuf>,

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
    #[arg(long, value_name = "none|torus|teapot|FILE")]
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

/// Options of `girandole info`.
#[derive(Args, Clone, Debug)]
#[command(
    after_help = "Examples:\n  girandole info\n  girandole info table\n  girandole info --require-adapter"
)]
pub struct InfoArgs {
    /// A built-in room or a .glb, .gltf, .obj or .ply file
    pub scene: Option<String>,

    /// Exits with code 1 where no adapter can run the gpu engine
    #[arg(long)]
    pub require_adapter: bool,
}
