//! Output: messages on the standard error stream, data on standard output, files written whole or not at all.

use anyhow::{Context, Result, bail};
use clap::error::ErrorKind;
use girandole_core::files;
use serde_json::{Map, Value};
use std::io::{self, ErrorKind as IoKind, Write};
use std::path::Path;
use std::process::ExitCode;

#[cfg(not(target_arch = "wasm32"))]
mod progress;

#[cfg(not(target_arch = "wasm32"))]
pub use progress::Progress;

/// Flat statistics, sorted by key.
pub type Stats = Map<String, Value>;

/// Prints a message, in browsers in the console. A closed stream is no error.
pub fn say(sentence: &str) {
    #[cfg(target_arch = "wasm32")]
    return crate::page::say(sentence);
    #[cfg(not(target_arch = "wasm32"))]
    let _ = writeln!(io::stderr(), "{}", harmless(sentence));
}

/// Without what a terminal would obey, which names from files may hold.
fn harmless(text: &str) -> String {
    text.chars().map(|c| if c.is_control() && c != '\n' { '\u{fffd}' } else { c }).collect()
}

/// Prints an error on one line.
pub fn error(sentence: &str) {
    let line = sentence.split_whitespace().collect::<Vec<_>>().join(" ");
    say(&format!("error: {line}"));
}

/// Writes data to standard output. A closed pipe is no error.
pub fn data(text: &str) -> Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(harmless(text).as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != IoKind::BrokenPipe => Err(e).context("cannot write to standard output"),
        _ => Ok(()),
    }
}

/// Prints clap's help as it is, and its errors as one sentence.
pub fn command_line_error(problem: &clap::Error) -> ExitCode {
    if matches!(problem.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) {
        let _ = problem.print();
        return ExitCode::SUCCESS;
    }
    error(&format!("{}; see girandole --help", refusal(problem)));
    ExitCode::from(2)
}

/// What is wrong with options, as one sentence without its full stop.
pub fn refusal(problem: &clap::Error) -> String {
    let text = problem.render().to_string();
    let before_usage = text.split("\n\nUsage:").next().unwrap_or_default();
    let before_hint = before_usage.split("\n\nFor more information").next().unwrap_or_default();
    let sentence = before_hint.strip_prefix("error: ").unwrap_or(before_hint).replace("\n\n", "; ");
    sentence.trim().trim_end_matches('.').to_owned()
}

/// Checks before the work whether a file with one of these extensions can be written.
pub fn check_writable(path: &Path, extensions: &[&str]) -> Result<()> {
    let name = path.display();
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    if !extensions.contains(&extension.as_str()) {
        bail!("cannot write {name}: its name must end in .{}", extensions.join(" or ."));
    }
    // What browsers write is a download.
    if cfg!(target_arch = "wasm32") {
        return Ok(());
    }
    if path.is_dir() {
        bail!("cannot write {name}: it is a directory");
    }
    match path.symlink_metadata() {
        Err(e) if e.kind() != IoKind::NotFound && e.kind() != IoKind::NotADirectory => {
            return Err(e).with_context(|| format!("cannot write {name}"));
        }
        _ => {}
    }
    let target = files::destination(path);
    let directory = files::folder_of(&target);
    if !directory.is_dir() {
        bail!("cannot write {name}: there is no directory {}; make it first", directory.display());
    }
    // A read-only directory is reported now, not after minutes of work.
    tempfile::tempfile_in(directory).with_context(|| format!("cannot write {name}"))?;
    Ok(())
}

/// A duration in readable units.
pub fn duration(ms: f64) -> String {
    match ms {
        ms if ms < 100.0 => format!("{ms:.1} ms"),
        ms if ms < 1e4 => format!("{ms:.0} ms"),
        ms if ms < 6e5 => format!("{:.1} s", ms / 1e3),
        ms => format!("{:.1} min", ms / 6e4),
    }
}
