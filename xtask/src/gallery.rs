//! `cargo xtask gallery`: builds the program, and the example of it that renders a folder of files.

use crate::cargo;
use anyhow::{Result, bail};
use std::ffi::OsString;
use std::process::ExitCode;

/// Runs it with these arguments, relative to the folder where the task was called.
pub fn run(arguments: &[OsString]) -> Result<ExitCode> {
    let here = std::env::current_dir()?;
    if !cargo().args(["build", "--release", "--locked", "--bin", "girandole"]).status()?.success() {
        bail!("the program does not build");
    }
    let run =
        ["run", "--quiet", "--release", "--locked", "--package", "girandole-app", "--example", "gallery"];
    let manifest = crate::root().join("Cargo.toml");
    let status = cargo()
        .current_dir(here)
        .args(run)
        .arg("--manifest-path")
        .arg(manifest)
        .arg("--")
        .args(arguments)
        .status()?;
    Ok(if status.success() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
