//! `girandole-figures`: makes the report. `cargo xtask figures` builds and runs it.

use anyhow::{Context, Result, bail};
use clap::Parser;
use girandole_figures::bench::{Bench, Scale, shared_file};
use girandole_figures::figures::{FIGURES, Figure};
use girandole_figures::report::Report;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// Makes the figures of the thesis, and of what Girandole adds to it, as one page
#[derive(Parser)]
#[command(
    name = "cargo xtask figures",
    after_help = "Examples:
  cargo xtask figures
  cargo xtask figures --quick --only 5-2,5-3
  cargo xtask figures --adapter llvmpipe --bunny bunny.ply"
)]
struct Arguments {
    /// Makes these figures alone
    #[arg(long, value_name = "FIGURES", value_delimiter = ',')]
    only: Vec<String>,
    /// Fewer points of fewer curves, and small pictures
    #[arg(long)]
    quick: bool,
    /// The graphics adapter: a part of its name, as `girandole info` lists it
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// The Stanford bunny, about 3000 vertices (.ply, .obj or .glb) [default: models/bunny.ply of --shared, else a teapot takes its place]
    #[arg(long, value_name = "FILE")]
    bunny: Option<PathBuf>,
    /// Folder with truth/ and real/: scenes with pictures by an independent renderer
    #[arg(long, value_name = "FOLDER", default_value = "../shared")]
    shared: PathBuf,
    /// Folder of the report
    #[arg(short, long, value_name = "FOLDER", default_value = "target/figures")]
    output: PathBuf,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}

fn run(arguments: &Arguments) -> Result<ExitCode> {
    let chosen = chosen(&arguments.only)?;
    let scale = if arguments.quick { Scale::Quick } else { Scale::Full };
    let mut bench = Bench::new(arguments.adapter.as_deref(), scale)?;
    bench.shared = Some(arguments.shared.clone()).filter(|folder| folder.is_dir());
    bench.bunny = match &arguments.bunny {
        Some(file) if !file.is_file() => {
            bail!("there is no file {}; give another to --bunny", file.display())
        }
        Some(file) => Some(file.clone()),
        None => shared_file(bench.shared.as_deref(), "models/bunny.ply"),
    };
    let mut report = Report::new(&arguments.output, made_on(&bench))
        .with_context(|| format!("cannot make the folder {}", arguments.output.display()))?;
    let bar = progress(chosen.len() as u64);
    let mut failed = Vec::new();
    for figure in chosen {
        bar.set_message(format!("{} {}", figure.id, figure.title));
        let start = Instant::now();
        let outcome = (figure.run)(&bench);
        let seconds = start.elapsed().as_secs_f64();
        report.add(figure, &outcome, seconds)?;
        if let Err(error) = &outcome {
            bar.suspend(|| eprintln!("{} failed: {error:#}", figure.id));
            failed.push(figure.id);
        } else if bar.is_hidden() {
            eprintln!("{} {}: {seconds:.0} s", figure.id, figure.title);
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    eprintln!("wrote {}", report.path().display());
    if failed.is_empty() {
        return Ok(ExitCode::SUCCESS);
    }
    eprintln!("these figures failed: {}", failed.join(", "));
    Ok(ExitCode::FAILURE)
}

fn chosen(only: &[String]) -> Result<Vec<&'static Figure>> {
    for id in only {
        if !FIGURES.iter().any(|figure| figure.id == id) {
            let known: Vec<&str> = FIGURES.iter().map(|figure| figure.id).collect();
            bail!("there is no figure {id}; these are known: {}", known.join(", "));
        }
    }
    Ok(FIGURES.iter().filter(|f| only.is_empty() || only.iter().any(|id| f.id == id)).collect())
}

/// Where the report was made.
fn made_on(bench: &Bench) -> Vec<(String, String)> {
    let info = &bench.gpu.info;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let scale = match bench.scale {
        Scale::Full => "full",
        Scale::Quick | Scale::Toy => "quick",
    };
    [
        ("adapter", format!("{} ({}), {}", info.name, info.backend, info.driver_info)),
        ("machine", format!("{} {}, {cores} cores", std::env::consts::OS, std::env::consts::ARCH)),
        ("version", format!("girandole {}", env!("CARGO_PKG_VERSION"))),
        ("scale", scale.into()),
    ]
    .map(|(heading, words)| (heading.into(), words))
    .into()
}

fn progress(figures: u64) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(figures), ProgressDrawTarget::hidden());
    if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} {elapsed}") {
        bar.set_style(style);
    }
    if std::io::stderr().is_terminal() {
        bar.set_draw_target(ProgressDrawTarget::stderr());
        bar.enable_steady_tick(Duration::from_millis(200));
    }
    bar
}
