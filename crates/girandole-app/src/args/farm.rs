//! Options of what shares work among machines: `girandole join` and `girandole submit`.

use super::RenderArgs;
use super::values::{ToneCurve, parse_exposure, parse_size};
use clap::{Args, ValueEnum};
use girandole_core::tonemap::Exposure;
use std::path::PathBuf;

/// Options of `girandole join`.
#[derive(Args, Clone, Debug)]
#[command(
    after_help = "Examples:\n  girandole render table --refine 64 --sets 0..31 -o a.exr\n  girandole render table --refine 64 --sets 32..63 -o b.exr\n  girandole join a.exr b.exr -o table.exr               the bytes of `girandole render table --refine 64 -o table.exr`\n  girandole join part-*.exr -o table.png",
    allow_negative_numbers = true
)]
pub struct JoinArgs {
    /// All parts of one picture, .exr files that `girandole render` wrote with --region, --sets or both, in any order
    #[arg(required = true, value_name = "PART.exr")]
    pub parts: Vec<PathBuf>,

    /// The picture: .exr (linear radiance, before exposure) or .png (tone-mapped)
    #[arg(short, long, value_name = "OUT.{exr,png}")]
    pub output: PathBuf,

    /// Exposure of a .png in stops, or auto: the mean becomes middle grey
    #[arg(long, value_name = "auto|EV", default_value = "auto", value_parser = parse_exposure)]
    pub exposure: Exposure,

    /// Tone curve of a .png
    #[arg(long, value_enum, default_value_t)]
    pub tonemap: ToneCurve,
}

/// Who hands pieces to workers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Farm {
    /// sbatch gets an array job, and for a picture a second one that joins its parts when the first is done
    Slurm,
    /// A template is written, which `openjd run` and AWS Deadline Cloud take
    Openjd,
}

/// Options of `girandole submit`.
#[derive(Args, Clone, Debug)]
#[command(
    after_help = "Examples:\n  girandole submit slurm pillars --frames 0..999 --pieces 50 -o frames/pillars.####.exr\n  girandole submit slurm room.glb --refine 256 --regions 4x4 --pieces 8 --sbatch=--gpus-per-task=1 -o room.png\n  girandole submit slurm pillars --frames 0..99 --print -o pillars.####.png\n  girandole submit openjd pillars --frames 0..99 -o pillars.####.png && openjd run girandole-farm/girandole.openjd.json",
    allow_negative_numbers = true
)]
pub struct SubmitArgs {
    /// Who gets them
    #[arg(value_enum, value_name = "slurm|openjd")]
    pub to: Farm,

    #[command(flatten)]
    pub render: RenderArgs,

    /// Pieces that the frames, or the light sets of --refine, are dealt to [default: 16, or as many as there are]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000), help_heading = SUBMIT)]
    pub pieces: Option<u32>,

    /// Parts in x and y that a single picture is cut into; each is rendered in as many pieces
    #[arg(long, value_name = "CxR", default_value = "1x1", value_parser = parse_size, help_heading = SUBMIT)]
    pub regions: [u32; 2],

    /// Where scripts, logs, parts and what workers share go: on a disk that all of them see
    #[arg(long, value_name = "DIR", default_value = "girandole-farm", help_heading = SUBMIT)]
    pub folder: PathBuf,

    /// Cores of a worker; if not given, as many as the first piece kept busy
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024), help_heading = SUBMIT)]
    pub cores: Option<u32>,

    /// A further option for sbatch, such as --sbatch=--gpus-per-task=1 or --sbatch=--time=60
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true, help_heading = SUBMIT)]
    pub sbatch: Vec<String>,

    /// Asks for what an estimate says, and renders no piece here first
    #[arg(long, help_heading = SUBMIT)]
    pub estimate: bool,

    /// Writes the scripts by an estimate, and submits nothing
    #[arg(long, help_heading = SUBMIT)]
    pub dry_run: bool,

    /// Prints the scripts by an estimate, and does nothing else
    #[arg(long, help_heading = SUBMIT)]
    pub print: bool,
}

const SUBMIT: &str = "Options of submit";
