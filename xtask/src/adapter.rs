//! Makes sure that there is an adapter: Mesa's software Vulkan device where there is no GPU.

use anyhow::{Context, Result, bail};
use std::path::Path;
use std::process::{Command, Stdio};

const PACKAGE: &str = "mesa-vulkan-drivers";

/// Finds an adapter, or installs the software one if that needs no password.
pub fn ensure(girandole: &Path) -> Result<()> {
    if exists(girandole)? {
        return Ok(());
    }
    let Some(prefix) = apt_prefix() else { bail!("{}", advice()) };
    eprintln!("no graphics adapter found: installing {PACKAGE}");
    apt(&prefix, &["update"])?;
    apt(&prefix, &["install", "-y", PACKAGE])?;
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

/// The prefix with which apt-get may install; `None` if there is no apt or a password would be needed.
fn apt_prefix() -> Option<Vec<&'static str>> {
    if !succeeds("apt-get", &["--version"]) {
        return None;
    }
    let user = Command::new("id").arg("-u").output().ok()?;
    if user.stdout.trim_ascii() == b"0" {
        Some(vec![])
    } else {
        succeeds("sudo", &["-n", "true"]).then(|| vec!["sudo", "-n"])
    }
}

fn succeeds(program: &str, arguments: &[&str]) -> bool {
    Command::new(program)
        .args(arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|s| s.success())
}

fn apt(prefix: &[&str], arguments: &[&str]) -> Result<()> {
    let words: Vec<&str> = prefix
        .iter()
        .copied()
        .chain(["env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "-q"])
        .chain(arguments.iter().copied())
        .collect();
    let status = Command::new(words[0]).args(&words[1..]).status().context("cannot run apt-get")?;
    if !status.success() {
        bail!("apt-get {} failed; {}", arguments.join(" "), advice());
    }
    Ok(())
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
