//! The program `girandole`: shows scenes lit by many shadowed point lights in a window or renders them to files, compares
//! pictures, and describes scenes and adapters.
//!
//! Exit codes: 0 done, 1 a comparison is beyond its thresholds (or a required adapter is missing), 2 anything else,
//! with one sentence on the standard error stream.

mod args;
mod bench;
mod compare;
mod engine;
mod info;
mod output;
mod picture;
mod render;
mod scene;
mod sequence;
mod window;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    silence_layer();
    tracing_subscriber::fmt()
        .with_env_filter(
            tracing_subscriber::EnvFilter::try_from_default_env().unwrap_or_else(|_| "off".into()),
        )
        .with_writer(std::io::stderr)
        .init();
    let cli = match args::Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return output::command_line_error(&error),
    };
    let result = match cli.command {
        None => window::main_job(),
        Some(args::Command::View(args)) => window::run(*args),
        Some(args::Command::Render(args)) => render::run(*args),
        Some(args::Command::Compare(args)) => compare::run(&args),
        Some(args::Command::Info(args)) => info::run(&args),
        Some(args::Command::Bench(args)) => bench::run(&args),
    };
    result.unwrap_or_else(|error| {
        output::error(&sentence(&error));
        ExitCode::from(2)
    })
}

/// The error with its causes, each of them once: some messages already include theirs.
fn sentence(error: &anyhow::Error) -> String {
    error.chain().fold(String::new(), |text, cause| {
        let cause = cause.downcast_ref().map_or_else(|| cause.to_string(), engine::sentence);
        if text.is_empty() {
            cause
        } else if text.contains(&cause) {
            text
        } else {
            format!("{text}: {cause}")
        }
    })
}

/// Without a desktop session, Mesa's device-selection layer prints two lines that begin with "error:". It only reorders
/// adapters, which the library does itself: it is switched off.
#[allow(unsafe_code, reason = "there is no other way to reach the layer, and no other thread yet")]
fn silence_layer() {
    let unset = |name| std::env::var_os(name).is_none();
    if cfg!(target_os = "linux") && unset("XDG_RUNTIME_DIR") && unset("NODEVICE_SELECT") {
        // SAFETY: this is the first statement of the program; no other thread can read the environment.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}
