//! `cargo xtask web`, `cargo xtask test-web`: build and run the program that builds, serves and tests the page and the
//! component of browsers.

use crate::{built, cargo};
use anyhow::{Result, bail};
use std::ffi::OsString;
use std::process::{Command, ExitCode};

/// Runs a task of it with these arguments, relative to the folder where the task was called.
pub fn run(task: &str, arguments: &[OsString]) -> Result<ExitCode> {
    if !cargo().args(["build", "--locked", "--package", "girandole-web"]).status()?.success() {
        bail!("the program that builds for browsers does not build");
    }
    let status = Command::new(built("debug", "girandole-web")?).arg(task).args(arguments).status()?;
    Ok(status.code().and_then(|code| u8::try_from(code).ok()).map_or(ExitCode::FAILURE, ExitCode::from))
}
