//! Development tasks: `cargo xtask --help`.

mod adapter;
mod apt;
mod figures;
mod gallery;
mod release_check;
mod swiftshader;
mod test;
mod test_bevy;
mod test_farm;
mod test_window;
mod truth;
mod web;

use clap::{Parser, Subcommand};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

/// Tasks of the workspace.
#[derive(Parser)]
#[command(name = "xtask", bin_name = "cargo xtask")]
struct Cli {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Runs all tests; without a graphics adapter, installs the software one first if possible
    Test {
        /// Runs only the smallest set of tests of pictures, on this device: `swiftshader`, the software one of chromium
        #[arg(long, value_name = "DEVICE")]
        adapter: Option<test::Adapter>,
        /// Passed on to `cargo test`
        #[arg(last = true)]
        arguments: Vec<String>,
    },
    /// Builds the window as a page, and the component as a package, for browsers; `--serve` serves them
    #[command(disable_help_flag = true)]
    Web {
        /// `--help` lists them
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<OsString>,
    },
    /// Tests them in Chromium, with WebGPU on the processor; needs chromium
    #[command(disable_help_flag = true)]
    TestWeb {
        /// `--help` lists them
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<OsString>,
    },
    /// Drives the window by keys and mouse under Xvfb; needs Xvfb, xdotool and a graphics adapter
    TestWindow,
    /// Tests bevy_girandole, and compares its picture with the program's; needs Rust 1.97 and a graphics adapter
    TestBevy,
    /// Renders on a farm of two Slurm workers, of which one dies, and by Open Job Description; needs slurm-wlm
    TestFarm(test_farm::Arguments),
    /// Makes the figures of the thesis, and of what was added to it, as one HTML page
    #[command(disable_help_flag = true)]
    Figures {
        /// `--help` lists them
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<OsString>,
    },
    /// Renders every glTF file below a folder beside the path tracer, to one HTML page
    #[command(disable_help_flag = true)]
    Gallery {
        /// `--help` lists them
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<OsString>,
    },
    /// Prints how far renderer and path tracer are from pictures by an independent renderer
    Truth(truth::Arguments),
    /// Checks what is published: packages, licences, advisories, interfaces, the oldest compiler and dependencies
    ReleaseCheck(release_check::Arguments),
}

fn main() -> ExitCode {
    let result = match Cli::parse().task {
        Task::Test { adapter: None, arguments } => test::run(&arguments),
        Task::Test { adapter: Some(adapter), arguments } => test::run_on(adapter, &arguments),
        Task::Web { arguments } => web::build(&arguments),
        Task::TestWeb { arguments } => web::test(&arguments),
        Task::TestWindow => test_window::run(),
        Task::TestBevy => test_bevy::run(),
        Task::TestFarm(arguments) => test_farm::run(&arguments),
        Task::Figures { arguments } => figures::run(&arguments),
        Task::Gallery { arguments } => gallery::run(&arguments),
        Task::Truth(arguments) => truth::run(&arguments),
        Task::ReleaseCheck(arguments) => release_check::run(&arguments),
    };
    result.unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        ExitCode::FAILURE
    })
}

/// Cargo, in the workspace's root.
fn cargo() -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root());
    command
}

/// The workspace's root.
fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new("."))
}

/// Path of a program of the workspace that was built with a profile, beside this one's.
fn built(profile: &str, program: &str) -> std::io::Result<PathBuf> {
    let mut path = std::env::current_exe()?;
    path.pop();
    path.set_file_name(profile);
    path.push(format!("{program}{}", std::env::consts::EXE_SUFFIX));
    Ok(path)
}
