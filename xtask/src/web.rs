//! `cargo xtask web`, `cargo xtask test-web`: build and run the program that builds, serves and tests the page and the
//! component of browsers.

use crate::{adapter, built, cargo, root};
use anyhow::{Result, bail};
use std::ffi::OsString;
use std::process::{Command, ExitCode};

/// What of the checks belongs to all tests: the component alone draws a picture.
const SMALLEST: [&str; 4] = ["package/naive-is-the-native-picture", "--quick", "--if-possible", "--output"];

/// Builds for browsers, with these arguments, relative to the folder where the task was called.
pub fn build(arguments: &[OsString]) -> Result<ExitCode> {
    compile(&["girandole-web"])?;
    call("web", arguments)
}

/// Tests in a browser, against pictures of the program.
pub fn test(arguments: &[OsString]) -> Result<ExitCode> {
    compile(&["girandole-web", "girandole-app"])?;
    adapter::ensure(&built("debug", "girandole")?)?;
    call("test-web", arguments)
}

/// Runs the smallest check by the programs that all tests have built; says so where it cannot be run.
pub fn test_smallest() -> Result<()> {
    let mut arguments = SMALLEST.map(OsString::from).to_vec();
    arguments.push(root().join("target/web-small").into());
    if call("test-web", &arguments)? != ExitCode::SUCCESS {
        bail!("the component draws another picture in a browser, or none; it says why above");
    }
    Ok(())
}

fn compile(packages: &[&str]) -> Result<()> {
    let packages = packages.iter().flat_map(|package| ["--package", package]);
    if !cargo().args(["build", "--locked", "--bins"]).args(packages).status()?.success() {
        bail!("the programs that build for browsers, or are compared with them, do not build");
    }
    Ok(())
}

fn call(task: &str, arguments: &[OsString]) -> Result<ExitCode> {
    let status = Command::new(built("debug", "girandole-web")?).arg(task).args(arguments).status()?;
    Ok(status.code().and_then(|code| u8::try_from(code).ok()).map_or(ExitCode::FAILURE, ExitCode::from))
}
