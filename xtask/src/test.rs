//! `cargo xtask test`: every test of the workspace, on a GPU or on the software one.

use crate::{adapter, cargo, girandole};
use anyhow::{Result, bail};
use std::process::ExitCode;

/// Builds, makes sure of an adapter, tests. The test runner's summary is the last line that is printed.
pub fn run(arguments: &[String]) -> Result<ExitCode> {
    if !cargo().args(["test", "--workspace", "--locked", "--no-run"]).status()?.success() {
        bail!("the workspace does not build");
    }
    adapter::ensure(&girandole("debug")?)?;
    let status = cargo().args(["test", "--workspace", "--locked"]).args(arguments).status()?;
    Ok(if status.success() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
