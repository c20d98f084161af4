//! `cargo xtask test-bevy`: the tests of bevy_girandole, and the picture of its example against `girandole render`'s of the same scene.

use crate::release_check::cargo_of;
use crate::{built, cargo, root};
use anyhow::{Context, Result, ensure};
use std::process::{Command, ExitCode};

/// Pixels of the picture.
const SIZE: &str = "480x270";
/// Largest relMSE between the two.
const REL_MSE: &str = "0.005";

/// Runs it, and says what was done; where no toolchain is new enough, that it was not run.
pub fn run() -> Result<ExitCode> {
    let Some(toolchain) = toolchain() else {
        println!("not run: bevy_girandole, as Bevy 0.20 needs Rust 1.97; rustup toolchain install nightly");
        return Ok(ExitCode::SUCCESS);
    };
    let folder = root().join("bevy_girandole");
    let bevys = |arguments: &[&str]| -> Result<()> {
        let mut command = cargo_of(toolchain).context("the toolchain is gone")?;
        command.current_dir(&folder).args(arguments);
        succeeds(command)
    };
    bevys(&["test", "--locked", "--ignore-rust-version"])?;
    let pictures = tempfile::tempdir()?;
    let file = |name: &str| pictures.path().join(name).to_string_lossy().into_owned();
    let [scene, ours, theirs] = ["hall.glb", "render.exr", "bevy.exr"].map(file);
    let example = ["run", "--locked", "--ignore-rust-version", "--example", "lamps", "--"];
    let shown = ["--hdr", &theirs, "--export", &scene, "--size", SIZE, "--anew", "--frames", "1"];
    bevys(&[&example[..], &shown].concat())?;
    let mut build = cargo();
    build.args(["build", "--release", "--locked", "-p", "girandole-app"]);
    succeeds(build)?;
    let girandole = |arguments: &[&str]| -> Result<()> {
        let mut command = Command::new(built("release", "girandole")?);
        command.args(arguments);
        succeeds(command)
    };
    let camera = ["--camera", "camera", "--size", SIZE];
    let light = ["--lights", "1024", "--light", "none", "--aa", "off", "-o", &ours];
    girandole(&[&["render", &scene][..], &camera, &light].concat())?;
    girandole(&["compare", &ours, &theirs, "--max-rel-mse", REL_MSE])?;
    println!(
        "bevy_girandole passed its tests, and its example has the picture of `girandole render` (relMSE ≤ {REL_MSE})"
    );
    Ok(ExitCode::SUCCESS)
}

/// One that is new enough for Bevy.
fn toolchain() -> Option<&'static str> {
    let is_new = |name: &&str| {
        let version = Command::new("rustup").args(["run", name, "rustc", "--version"]).output();
        version.is_ok_and(|version| minor(&String::from_utf8_lossy(&version.stdout)) >= Some(97))
    };
    ["stable", "nightly"].into_iter().find(is_new)
}

/// Of `rustc 1.97.0-nightly (…)` 97.
fn minor(version: &str) -> Option<u32> {
    version.strip_prefix("rustc 1.")?.split('.').next()?.parse().ok()
}

fn succeeds(mut command: Command) -> Result<()> {
    let status =
        command.status().with_context(|| format!("cannot run {}", command.get_program().display()))?;
    ensure!(status.success(), "this fails: {command:?}");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::minor;

    #[test]
    fn versions_are_read() {
        assert_eq!(minor("rustc 1.97.0-nightly (4d1f98451 2026-05-15)"), Some(97));
        assert_eq!(minor("rustc 1.95.0 (59807616e 2026-04-14)"), Some(95));
        assert!(minor("error: toolchain 'nightly' is not installed") < Some(97));
    }
}
