//! `cargo xtask test-farm`: render farms, in which a worker dies, make the pictures that one process makes.

mod daemons;
mod efficiency;
mod jobs;
mod openjd;
mod processes;
mod sequence;
mod still;

use crate::{adapter, apt, built, cargo};
use anyhow::{Context, Result, bail, ensure};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::time::Duration;

/// Brings Slurm and MUNGE.
const PACKAGE: &str = "slurm-wlm";
/// For what takes a moment on any machine.
const PATIENCE: Duration = Duration::from_secs(60);
/// Of the sequence.
const FRAMES: u32 = 40;
const FRAME_NAMES: &str = "frame.####.exr";
const STILL: &str = "still.exr";
/// Variables of a farm that this very test may run on.
const OF_SLURM: [&str; 6] = ["SLURM", "SBATCH_", "SCONTROL_", "SINFO_", "SQUEUE_", "MUNGE_"];

/// Options of `cargo xtask test-farm`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Asks instead that two workers with a core each are 1.8 times as fast as one, which takes minutes
    #[arg(long)]
    efficiency: bool,
    /// Frames that --efficiency renders
    #[arg(long, value_name = "N", default_value_t = 200, requires = "efficiency")]
    #[arg(value_parser = clap::value_parser!(u32).range(2..=10_000))]
    frames: u32,
    /// A `girandole` that is built already, instead of building it
    #[arg(long, value_name = "FILE")]
    program: Option<PathBuf>,
}

/// What all checks need.
struct Setting {
    program: PathBuf,
    folder: tempfile::TempDir,
    /// Folder of the frames that one process makes.
    frames: PathBuf,
    /// The still that one process makes, and one of fewer sets.
    still: PathBuf,
    coarse: PathBuf,
}

type Check<'a> = (&'a str, Box<dyn Fn(&Setting) -> Result<String>>);

/// Runs all checks, and says how many passed.
pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let setting = Setting::new(arguments.program.as_deref())?;
    let frames = arguments.frames;
    let checks: Vec<Check> = if arguments.efficiency {
        vec![("efficiency", Box::new(move |setting| efficiency::run(setting, frames)))]
    } else {
        vec![
            ("a sequence on Slurm", Box::new(sequence::run)),
            ("a still on Slurm", Box::new(still::run)),
            ("a sequence by Open Job Description", Box::new(openjd::sequence)),
            ("a still by Open Job Description", Box::new(openjd::still)),
        ]
    };
    let mut failed = Vec::new();
    for (name, check) in &checks {
        eprintln!("{name} …");
        match check(&setting) {
            Ok(said) => println!("{name}: {said}"),
            Err(error) => {
                println!("{name} failed: {error:#}");
                failed.push(*name);
            }
        }
    }
    if failed.is_empty() {
        println!("test-farm: {} checks passed", checks.len());
        return Ok(ExitCode::SUCCESS);
    }
    println!("what was made, and all logs, are in {}", setting.folder.keep().display());
    println!("test-farm: {} of {} checks failed: {}", failed.len(), checks.len(), failed.join(", "));
    Ok(ExitCode::FAILURE)
}

impl Setting {
    fn new(program: Option<&Path>) -> Result<Self> {
        let program = match program {
            Some(program) => {
                program.canonicalize().with_context(|| format!("there is no {}", program.display()))?
            }
            None => {
                if !cargo().args(["build", "--release", "--locked", "--bin", "girandole"]).status()?.success()
                {
                    bail!("the program does not build");
                }
                built("release", "girandole")?
            }
        };
        let folder = tempfile::Builder::new().prefix("test-farm-").tempdir()?;
        let path = folder.path().join("by one process");
        std::fs::create_dir(&path)?;
        let setting = Self {
            program,
            frames: path.clone(),
            still: path.join(STILL),
            coarse: path.join("coarse.exr"),
            folder,
        };
        setting.require_slurm()?;
        adapter::ensure(&setting.program)?;
        eprintln!("the same by one process …");
        setting.render(&sequence_options())?;
        setting.render(&still_options("15"))?;
        std::fs::rename(&setting.still, &setting.coarse)?;
        setting.render(&still_options("16"))?;
        Ok(setting)
    }

    /// Installs Slurm where it is missing, if that needs no password.
    fn require_slurm(&self) -> Result<()> {
        let missing = || -> Vec<&str> {
            daemons::PROGRAMS.into_iter().filter(|program| !self.is_there(program)).collect()
        };
        let advice = |missing: &[&str]| {
            format!("{} not found: apt-get install {PACKAGE} (Debian, Ubuntu)", missing.join(", "))
        };
        let first = missing();
        if first.is_empty() {
            return Ok(());
        }
        let why = format!("{} not found", first.join(", "));
        apt::install(PACKAGE, &why).with_context(|| advice(&first))?;
        let still = missing();
        ensure!(still.is_empty(), "{}", advice(&still));
        Ok(())
    }

    /// Whether a program can be called.
    fn is_there(&self, program: &str) -> bool {
        std::env::split_paths(&self.search_path()).any(|folder| folder.join(program).is_file())
    }

    /// Where programs are: the one under test first, and daemons, which are not on the path of all users.
    fn search_path(&self) -> OsString {
        let own = self.program.parent().unwrap_or(Path::new(".")).to_owned();
        let given = std::env::var_os("PATH").unwrap_or_default();
        let daemons = ["/usr/sbin", "/usr/local/sbin", "/sbin"].map(PathBuf::from);
        let all = [own].into_iter().chain(std::env::split_paths(&given)).chain(daemons);
        std::env::join_paths(all).unwrap_or(given)
    }

    /// A command that finds the program under test, and no farm.
    fn command(&self, program: &str) -> Command {
        let mut command = Command::new(program);
        for (name, _) in std::env::vars_os() {
            if OF_SLURM.iter().any(|prefix| name.to_string_lossy().starts_with(prefix)) {
                command.env_remove(name);
            }
        }
        if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
            command.env("XDG_RUNTIME_DIR", std::env::temp_dir());
        }
        command.env("PATH", self.search_path());
        command
    }

    /// A folder of its own for a check, with blanks in its name.
    fn work(&self, name: &str) -> Result<PathBuf> {
        let folder = self.folder.path().join(name);
        std::fs::create_dir(&folder)?;
        Ok(folder)
    }

    /// Renders by one process.
    fn render(&self, options: &[&str]) -> Result<()> {
        let mut command = self.command(&self.program.to_string_lossy());
        command.arg("render").args(options).current_dir(&self.frames).stdout(Stdio::null());
        ensure!(command.status()?.success(), "girandole render {} failed", options.join(" "));
        Ok(())
    }
}

fn sequence_options() -> Vec<&'static str> {
    vec!["pillars", "--size", "160x120", "--lights", "64", "--frames", "0..39", "-o", FRAME_NAMES]
}

fn still_options(sets: &'static str) -> Vec<&'static str> {
    vec!["pillars", "--size", "160x120", "--lights", "64", "--refine", sets, "-o", STILL]
}

/// Of [`FRAME_NAMES`].
fn frame_name(frame: u32) -> String {
    format!("frame.{frame:04}.exr")
}

/// Whether two files are equal; that one is missing is an error.
fn same_bytes(a: &Path, b: &Path) -> Result<bool> {
    let read = |path: &Path| std::fs::read(path).with_context(|| format!("cannot read {}", path.display()));
    Ok(read(a)? == read(b)?)
}

/// The last lines of each file with this extension in a folder.
fn last_lines(folder: &Path, extension: &str) -> Result<String> {
    let mut text = String::new();
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<Result<_>>()?;
    files.sort();
    for file in files.iter().filter(|file| file.extension().is_some_and(|e| e == extension)) {
        let all = String::from_utf8_lossy(&std::fs::read(file)?).into_owned();
        let lines: Vec<&str> = all.lines().collect();
        text += &format!("{}:\n  {}\n", file.display(), lines[lines.len().saturating_sub(5)..].join("\n  "));
    }
    Ok(text)
}
