//! Open Job Description: its command-line tool runs what `girandole submit openjd` writes.

use super::{Setting, sequence, still};
use anyhow::{Context, Result, bail, ensure};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Of Python's package index; brings `openjd`.
const PACKAGE: &str = "openjd-cli";
const TEMPLATE: &str = "girandole.openjd.json";

/// A sequence.
pub fn sequence(setting: &Setting) -> Result<String> {
    let work = setting.work("a sequence by openjd")?;
    let options = [&super::sequence_options()[..], &["--pieces", "8"]].concat();
    run(setting, &work, &options, "girandole-farm")?;
    sequence::same_frames(&work, &setting.frames)?;
    Ok("the frames are those of one process".into())
}

/// A still.
pub fn still(setting: &Setting) -> Result<String> {
    let work = setting.work("a still by openjd")?;
    run(setting, &work, &still::options(), still::FOLDER)?;
    still::same_still(&work, setting)?;
    Ok("the still is that of one process".into())
}

/// Writes a template and runs all of it.
fn run(setting: &Setting, work: &Path, options: &[&str], folder: &str) -> Result<()> {
    let openjd = tool(setting)?;
    let mut command = setting.command(&setting.program.to_string_lossy());
    command.args(["submit", "openjd"]).args(options).current_dir(work);
    let output = command.output().context("cannot run the program")?;
    let said = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "girandole submit openjd {}: {}", options.join(" "), said.trim());
    let template = work.join(folder).join(TEMPLATE);
    ensure!(template.is_file(), "girandole submit openjd wrote no {folder}/{TEMPLATE}");
    // Where the program was called is not where the job runs, nor are its own files those of other users.
    let elsewhere = setting.folder.path();
    let mut command = setting.command(&openjd.to_string_lossy());
    command.arg("run").arg(&template).current_dir(elsewhere).env("TMPDIR", elsewhere);
    let output = command.output().context("cannot run openjd")?;
    if !output.status.success() {
        let said = [output.stdout, output.stderr].concat();
        let said = String::from_utf8_lossy(&said);
        let lines: Vec<&str> = said.lines().collect();
        bail!("openjd run failed: {}", lines[lines.len().saturating_sub(30)..].join("\n"));
    }
    Ok(())
}

/// The tool, installed into the temporary folder where there is none.
fn tool(setting: &Setting) -> Result<PathBuf> {
    if setting.command("openjd").arg("--version").output().is_ok_and(|output| output.status.success()) {
        return Ok("openjd".into());
    }
    let folder = setting.folder.path().join("python");
    let tool = folder.join("bin/openjd");
    if !tool.is_file() {
        eprintln!("installing {PACKAGE}");
        let done = quietly(setting.command("python3").args(["-m", "venv"]).arg(&folder))
            && quietly(setting.command(&folder.join("bin/pip").to_string_lossy()).args(["install", PACKAGE]));
        ensure!(
            done && tool.is_file(),
            "this was not run: openjd is not there and could not be installed; pip install {PACKAGE}"
        );
    }
    Ok(tool)
}

fn quietly(command: &mut Command) -> bool {
    command.stdout(Stdio::null()).stderr(Stdio::inherit()).status().is_ok_and(|status| status.success())
}
