//! `cargo xtask figures`: builds and runs the program that makes the figures' report.

use crate::{adapter, built, cargo};
use anyhow::{Result, bail};
use std::ffi::OsString;
use std::process::{Command, ExitCode};

/// Runs it with these arguments, relative to the folder where the task was called.
pub fn run(arguments: &[OsString]) -> Result<ExitCode> {
    let build = ["build", "--release", "--locked", "--bin", "girandole", "--bin", "girandole-figures"];
    if !cargo()
        .args(build)
        .args(["--package", "girandole-app", "--package", "girandole-figures"])
        .status()?
        .success()
    {
        bail!("the programs do not build");
    }
    adapter::ensure(&built("release", "girandole")?)?;
    let status = Command::new(built("release", "girandole-figures")?).args(arguments).status()?;
    Ok(status.code().and_then(|code| u8::try_from(code).ok()).map_or(ExitCode::FAILURE, ExitCode::from))
}
