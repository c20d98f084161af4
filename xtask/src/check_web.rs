//! `cargo xtask check-web`: the window's code compiles for browsers.

use crate::cargo;
use anyhow::{Result, bail};
use std::path::Path;
use std::process::{Command, ExitCode};

const TARGET: &str = "wasm32-unknown-unknown";

/// Checks the program for browsers, where it is the window alone.
pub fn run() -> Result<ExitCode> {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let printed = Command::new(rustc).args(["--print", "target-libdir", "--target", TARGET]).output()?;
    let libraries = String::from_utf8_lossy(&printed.stdout);
    if !Path::new(libraries.trim()).is_dir() {
        bail!("the compiler has no target {TARGET}; add it with `rustup target add {TARGET}`");
    }
    let status = cargo()
        .args(["check", "--locked", "--package", "girandole-app", "--target", TARGET])
        .env("RUSTFLAGS", "-D warnings")
        .status()?;
    Ok(if status.success() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
