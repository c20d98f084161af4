//! Installs packages of Debian and Ubuntu, if that needs no password.

use anyhow::{Context, Result, bail};
use std::process::{Command, Stdio};

/// Installs a package and says why; `false` if there is no apt or a password would be needed.
pub fn install(package: &str, why: &str) -> Result<bool> {
    let Some(prefix) = prefix() else { return Ok(false) };
    eprintln!("{why}: installing {package}");
    apt(&prefix, &["update"])?;
    apt(&prefix, &["install", "-y", package])?;
    Ok(true)
}

/// The prefix with which apt-get may install.
fn prefix() -> Option<Vec<&'static str>> {
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
        bail!("apt-get {} failed", arguments.join(" "));
    }
    Ok(())
}
