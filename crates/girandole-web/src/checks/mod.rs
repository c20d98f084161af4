//! What must be so in a browser.

mod board;
mod driver;
mod hands;
mod package;
mod page;
mod settings;
mod shaders;
mod time;

use crate::serve::Site;
use crate::test::{Bench, Check};
use anyhow::{Context, Result, ensure};
use std::process::Command;

/// All of them, in the order in which they run.
pub fn all() -> impl Iterator<Item = &'static Check> {
    [
        driver::CHECKS,
        shaders::CHECKS,
        package::CHECKS,
        page::CHECKS,
        settings::CHECKS,
        hands::CHECKS,
        time::CHECKS,
    ]
    .into_iter()
    .flatten()
}

/// The site with the pages that checks bring along.
pub fn pages(site: Site) -> Result<Site> {
    let (path, text) = package::PAGE;
    Ok(board::pages(time::pages(driver::pages(site)))?.with(path, text))
}

/// The picture that the program renders by these options.
fn native(bench: &Bench, options: &[&str], [width, height]: [u32; 2]) -> Result<Vec<u8>> {
    let path = bench.folder.path().join("native.png");
    let (size, file) = (format!("{width}x{height}"), path.to_string_lossy());
    called(bench, &[&["render"], options, &["--size", &size, "-o", &file]].concat())?;
    std::fs::read(&path).context("there is no native picture")
}

/// Has the program do something; what it prints.
fn called(bench: &Bench, arguments: &[&str]) -> Result<Vec<u8>> {
    let mut command = Command::new(&bench.program);
    let output = command.args(arguments).output();
    let output = output.with_context(|| format!("{} does not start", bench.program.display()))?;
    ensure!(output.status.success(), "{command:?} fails: {}", String::from_utf8_lossy(&output.stderr));
    Ok(output.stdout)
}
