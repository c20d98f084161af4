//! Makes sure that there is an adapter: Mesa's software Vulkan device where there is no GPU.

use crate::apt;
use anyhow::{Context, Result, bail};
use std::path::Path;
use std::process::{Command, Stdio};

const PACKAGE: &str = "mesa-vulkan-drivers";

/// Finds an adapter, or installs the software one if that needs no password.
pub fn ensure(girandole: &Path) -> Result<()> {
    if exists(girandole)? {
        return Ok(());
    }
    if !apt::install(PACKAGE, "no graphics adapter found").with_context(advice)? {
        bail!("{}", advice());
    }
    if !exists(girandole)? {
        bail!("{PACKAGE} is installed, but still no graphics adapter is found; see `girandole info`");
    }
    Ok(())
}

/// Runs `girandole info`: the program decides which adapters meet its requirements.
fn exists(girandole: &Path) -> Result<bool> {
    let status = Command::new(girandole)
        .args(["info", "--require-adapter"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .with_context(|| format!("cannot run {}", girandole.display()))?;
    match status.code() {
        Some(0) => Ok(true),
        Some(1) => Ok(false),
        _ => bail!("{} info failed: {status}", girandole.display()),
    }
}

fn advice() -> String {
    let what = if cfg!(target_os = "linux") {
        "install a GPU driver with Vulkan, or the software one: mesa-vulkan-drivers (Debian, Ubuntu, Fedora), \
         vulkan-swrast (Arch) or mesa-vulkan-swrast (Alpine)"
    } else if cfg!(windows) {
        "install your GPU's driver, or run on a Windows that has the software device WARP (Direct3D 12)"
    } else {
        "run on a machine with Metal"
    };
    format!("no graphics adapter found, and the tests need one: {what}")
}
