//! The program `girandole`: shows scenes lit by many shadowed point lights in a window or renders them to files, compares
//! pictures, and describes scenes and adapters.
//!
//! Exit codes: 0 done, 1 a comparison is beyond its thresholds (or a required adapter is missing), 2 anything else,
//! with one sentence on the standard error stream.

#![cfg_attr(
    target_arch = "wasm32",
    allow(
        dead_code,
        unused_imports,
        reason = "browsers have no command line, and none of its other commands"
    )
)]

mod advice;
mod args;
mod export;
mod output;
mod picture;
mod provenance;
mod scene;
mod transfer;
mod window;

#[cfg(target_arch = "wasm32")]
mod page;

// Browsers have the window alone.
#[cfg(not(target_arch = "wasm32"))]
mod bench;
#[cfg(not(target_arch = "wasm32"))]
mod compare;
#[cfg(not(target_arch = "wasm32"))]
mod engine;
#[cfg(not(target_arch = "wasm32"))]
mod info;
#[cfg(not(target_arch = "wasm32"))]
mod join;
#[cfg(not(target_arch = "wasm32"))]
mod render;
#[cfg(not(target_arch = "wasm32"))]
mod sequence;
#[cfg(not(target_arch = "wasm32"))]
mod submit;

#[cfg(target_arch = "wasm32")]
fn main() {
    page::start();
}

#[cfg(not(target_arch = "wasm32"))]
fn main() -> std::process::ExitCode {
    use clap::Parser;
    use std::process::ExitCode;

    silence_layer();
    #[cfg(unix)]
    clean_up_when_interrupted();
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
        None => main_job(),
        Some(args::Command::View(args)) => window::run(*args),
        Some(args::Command::Render(args)) => render::run(*args),
        Some(args::Command::Join(args)) => join::run(&args),
        Some(args::Command::Submit(args)) => submit::run(&args),
        Some(args::Command::Compare(args)) => compare::run(&args),
        Some(args::Command::Info(args)) => info::run(&args),
        Some(args::Command::Bench(args)) => bench::run(&args),
        Some(args::Command::Export(args)) => export::run(&args),
    };
    result.unwrap_or_else(|error| {
        output::error(&sentence(&error));
        ExitCode::from(2)
    })
}

/// The default without a command: a window on the room `living-room`, or a picture of it where there is no display or no GPU.
#[cfg(not(target_arch = "wasm32"))]
fn main_job() -> anyhow::Result<std::process::ExitCode> {
    if !window::has_display() {
        render::main_job("there is no display")
    } else if !engine::gpu::adapters().iter().any(|adapter| adapter.usable) {
        render::main_job("there is no GPU adapter")
    } else {
        window::run(args::ViewArgs::defaults()?)
    }
}

/// The error with its causes, each of them once: some messages already include theirs.
fn sentence(error: &anyhow::Error) -> String {
    error.chain().fold(String::new(), |text, cause| {
        let cause = cause.downcast_ref().map_or_else(|| cause.to_string(), advice::sentence);
        if text.is_empty() {
            cause
        } else if text.contains(&cause) {
            text
        } else {
            format!("{text}: {cause}")
        }
    })
}

/// Leaves no half-written file when the user or the system ends the program, which then ends as it would have.
#[cfg(unix)]
fn clean_up_when_interrupted() {
    use signal_hook::consts::{SIGINT, SIGTERM};

    // Without a handler, interrupts end the program all the same.
    let Ok(mut signals) = signal_hook::iterator::Signals::new([SIGINT, SIGTERM]) else { return };
    std::thread::spawn(move || {
        for signal in signals.forever() {
            girandole_core::files::abandon();
            let _ = signal_hook::low_level::emulate_default_handler(signal);
        }
    });
}

/// Without a desktop session, Mesa's device-selection layer prints two lines that begin with "error:". It only reorders
/// adapters, which the library does itself: it is switched off.
#[cfg(not(target_arch = "wasm32"))]
#[allow(unsafe_code, reason = "there is no other way to reach the layer, and no other thread yet")]
fn silence_layer() {
    let unset = |name| std::env::var_os(name).is_none();
    if cfg!(target_os = "linux") && unset("XDG_RUNTIME_DIR") && unset("NODEVICE_SELECT") {
        // SAFETY: this is the first statement of the program; no other thread can read the environment.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}
