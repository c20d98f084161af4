//! `cargo xtask test`: every test of the workspace, on a GPU or on the software one.

use crate::{adapter, built, cargo, swiftshader, web};
use anyhow::{Result, bail};
use std::process::ExitCode;

/// Devices on which a few tests run that are not in the default run.
#[derive(Clone, Copy, clap::ValueEnum)]
pub enum Adapter {
    Swiftshader,
}

/// Builds, makes sure of an adapter, tests; of browsers a little, if there is one. The test runner's summary is the last line that is
/// printed.
pub fn run(arguments: &[String]) -> Result<ExitCode> {
    if !cargo().args(["test", "--workspace", "--locked", "--no-run"]).status()?.success() {
        bail!("the workspace does not build");
    }
    adapter::ensure(&built("debug", "girandole")?)?;
    if arguments.is_empty() {
        web::test_smallest()?;
    }
    let status = cargo().args(["test", "--workspace", "--locked"]).args(arguments).status()?;
    Ok(if status.success() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Runs a few tests of pictures on a device, with the kernels that are chosen for it.
pub fn run_on(adapter: Adapter, arguments: &[String]) -> Result<ExitCode> {
    let Adapter::Swiftshader = adapter;
    let driver = swiftshader::driver()?;
    for name in swiftshader::TESTS {
        // Of the loader's two variables the older one is known everywhere.
        let status = cargo()
            .args(["test", "--workspace", "--locked", "--test", "gpu", "--", "--exact", name])
            .args(arguments)
            .env("VK_DRIVER_FILES", &driver)
            .env("VK_ICD_FILENAMES", &driver)
            .env("GIRANDOLE_TEST_DEVICE", "SwiftShader")
            .status()?;
        if !status.success() {
            bail!("{name} fails on SwiftShader");
        }
    }
    println!("{} tests passed on SwiftShader", swiftshader::TESTS.len());
    Ok(ExitCode::SUCCESS)
}
