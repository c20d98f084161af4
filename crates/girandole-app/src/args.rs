//! The command line: options and their ranges.

mod command_line;
mod farm;
mod measures;
mod motion;
mod piece;
#[cfg(any(test, target_arch = "wasm32"))]
mod query;
mod scene;
mod settings;
mod transfer;
mod values;

use clap::{Args, Parser, Subcommand};
use girandole_core::lights::{LightSettings, MAX_LIGHTS, Termination};
use girandole_core::tonemap::Exposure;
use std::path::PathBuf;
use values::*;

pub use command_line::shown;
pub use farm::{Farm, JoinArgs, SubmitArgs};
pub use measures::{BenchArgs, CompareArgs};
pub use motion::{Frames, MotionArgs, RewalkArg, UpdatesArg};
pub use piece::{PieceArgs, parse_sets};
#[cfg(target_arch = "wasm32")]
pub use query::edits_in_address;
pub use scene::{BackgroundArg, EnvironmentArg, LightArg, LoadArgs, SceneArgs, ViewArg};
pub use transfer::TransferArgs;
pub use values::{
    AntiAliasing, Bounces, Clamp, DebugView, DirectShare, Engine, Mode, Pcf, Placement, ShadingArg,
    ShadowMap, Switch, TerminationArg, ToneCurve,
};

const EXAMPLES: &str = "\
Examples:
  girandole                                              a window on a living room
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
/// Without a command it shows the built-in room `living-room` in a window, or, without a display, renders it to girandole.png.
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
    /// Puts parts of a picture together that --region and --sets of `render` left
    Join(JoinArgs),
    /// Hands the pieces of a sequence or of a picture to a cluster: Slurm, or whatever takes Open Job Descriptions
    Submit(Box<SubmitArgs>),
    /// Compares two pictures: energy, relMSE, RMSE, FLIP, worst pixel
    Compare(CompareArgs),
    /// Lists the adapters and what they support, what a scene holds, or what a picture was made by
    Info(InfoArgs),
    /// Times the modes against each other
    Bench(Box<BenchArgs>),
    /// Writes a scene as it stands to a .glb file
    Export(ExportArgs),
}

/// The options of one command, from the words after its name.
fn parse<T: Args>(name: &'static str, words: &[String]) -> clap::error::Result<T> {
    let command = T::augment_args(clap::Command::new(name).no_binary_name(true));
    T::from_arg_matches(&command.try_get_matches_from(words)?)
}

const VIEW_EXAMPLES: &str = "\
Examples:
  girandole view
  girandole view table --lights 1024 --aa 2
  girandole view room.glb --camera Front --mode naive";

/// Options of `girandole view`: what the window starts with.
#[derive(Args, Clone, Debug)]
#[command(after_help = format!("{}\n{VIEW_EXAMPLES}", crate::window::help()), allow_negative_numbers = true)]
pub struct ViewArgs {
    /// A built-in room (living-room, area-lights, table, pillars, block, gap, mirrors, mirror-corridor, blinds, moulding, shelf, hall) or
    /// a .glb, .gltf, .obj or .ply file
    #[arg(default_value = "living-room")]
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
    #[arg(long, value_name = "none|torus|teapot|balloon|FILE")]
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
    /// and fewer shadow maps are drawn anew, as the time demands. A moment after all is at rest the picture is as it was asked for.
    /// any: full quality always. If not given, 100 on software devices and any on others
    #[arg(long, value_name = "MS|any", value_parser = parse_budget)]
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

    /// For tests: opens the scene so many seconds later, as a large one does
    #[arg(long, hide = true, value_name = "SECONDS", value_parser = clap::value_parser!(u64).range(1..=3600))]
    pub slow_opening: Option<u64>,

    /// Asks for files by dialogs of its own, where the system's are not wanted
    #[arg(long)]
    pub own_dialogs: bool,
}

const RENDER_EXAMPLES: &str = "\
Examples:
  girandole render -o room.png
  girandole render table --lights 1024 --bounces 3 --aa 2 -o table.png
  girandole render block --object teapot --exposure 1.5 --tonemap aces -o block.png
  girandole render room.glb --camera Front --engine cpu -o room.exr --stats room.json
  girandole render pillars --time 2.5 -o later.png
  girandole render table --refine 64 -o exact.exr
  girandole render table --view 0,1.7,2,0,0.8,0,0,1,0,60 --edits moved.json -o moved.png
  girandole render table --object bunny.ply --transfer grid -o bunny.png
  girandole render pillars --frames 0..239 --exposure 0.5 -o pillars.####.png
  girandole render pillars --frames 0..239 --part 3/8 -o pillars.####.exr
  girandole render table --region 512,0,512,384 -o right.exr

Edits are a list such as {\"version\": 1, \"edits\": [{\"set_time\": {\"seconds\": 1.5}}]}; docs/reference.md shows one of each kind.";

/// Options of `girandole render`.
#[derive(Args, Clone, Debug, PartialEq)]
#[command(after_help = RENDER_EXAMPLES, allow_negative_numbers = true)]
pub struct RenderArgs {
    /// A built-in room (living-room, area-lights, table, pillars, block, gap, mirrors, mirror-corridor, blinds, moulding, shelf, hall) or
    /// a .glb, .gltf, .obj or .ply file
    #[arg(default_value = "living-room")]
    pub scene: String,

    /// The picture: .exr (linear radiance, before exposure) or .png (tone-mapped)
    #[arg(short, long, value_name = "OUT.{exr,png}", default_value = "girandole.png")]
    pub output: PathBuf,

    /// Pixels in x and y, each from 1 to 65536; pictures of more than 8192 are drawn in several windows (engine gpu)
    #[arg(long, value_name = "WxH", default_value = "1024x768", value_parser = parse_picture_size, allow_hyphen_values = true)]
    pub size: [u32; 2],

    /// A camera of the scene, by name or index; the first if not given
    #[arg(long, value_name = "NAME|INDEX", conflicts_with = "view")]
    pub camera: Option<String>,

    #[command(flatten)]
    pub seen: SceneArgs,

    /// The moving object of a built-in room: none, torus, teapot, balloon, or a .ply, .obj or .glb file; if not given, the
    /// room's default
    #[arg(long, value_name = "none|torus|teapot|balloon|FILE")]
    pub object: Option<String>,

    #[command(flatten)]
    pub motion: MotionArgs,

    #[command(flatten)]
    pub piece: PieceArgs,

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

    /// Anti-aliasing: samples along each axis of a pixel [default: 2 with --mode full and vd-lp on a GPU, off otherwise]
    #[arg(long, value_enum)]
    pub aa: Option<AntiAliasing>,

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

    /// Share of the samples that lie on emitters and punctual lights, 0 to 1, the others are left by random walks; auto: as the
    /// light demands
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

    /// Budget for shadow maps and what is beside them while they are drawn, MiB (engine gpu)
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

    /// Mirror images: how many rays follow one another from what is smooth; 0 shows blurs in their place (engines gpu and cpu, with
    /// --clamp auto)
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u32).range(0..=16))]
    pub mirrors: u32,
}

/// Options of `girandole info`.
#[derive(Args, Clone, Debug)]
#[command(
    after_help = "Examples:\n  girandole info\n  girandole info table\n  girandole info picture.png\n  girandole info --require-adapter"
)]
pub struct InfoArgs {
    /// A built-in room or a .glb, .gltf, .obj or .ply file; or a picture, .exr or .png: then what it was made by is printed
    pub scene: Option<String>,

    #[command(flatten)]
    pub load: LoadArgs,

    /// Exits with code 1 where no adapter can run the gpu engine
    #[arg(long)]
    pub require_adapter: bool,

    /// Prints instead every shader that can be put together: JSON, pairs of name and WGSL
    #[arg(long, exclusive = true)]
    pub shaders: bool,
}

const EXPORT_EXAMPLES: &str = "\
Geometry, materials, textures, lights, cameras, names, hierarchy and animations are written as they are; what glTF has no place
for, such as an environment, is named. The file is read again as the same scene.

Examples:
  girandole export table -o table.glb
  girandole export room.glb --edits moved.json -o moved.glb
  girandole export pillars --time 2.5 -o later.glb";

/// Options of `girandole export`.
#[derive(Args, Clone, Debug)]
#[command(after_help = EXPORT_EXAMPLES, allow_negative_numbers = true)]
pub struct ExportArgs {
    /// A built-in room or a .glb, .gltf, .obj or .ply file
    pub scene: String,

    /// The file
    #[arg(short, long, value_name = "OUT.glb")]
    pub output: PathBuf,

    /// What was moved, lit, added and removed, as the library's `Edits` write it
    #[arg(long, value_name = "FILE.json")]
    pub edits: Option<PathBuf>,

    /// The moment of the scene's animations, seconds
    #[arg(long, value_name = "SECONDS", value_parser = motion::parse_seconds)]
    pub time: Option<f64>,

    #[command(flatten)]
    pub load: LoadArgs,

    /// The moving object of a built-in room; see `girandole render --help`
    #[arg(long, value_name = "none|torus|teapot|FILE")]
    pub object: Option<String>,
}
