//! What must be so in a browser.

mod driver;
mod package;
mod page;

use crate::serve::Site;
use crate::test::{Bench, Check};
use anyhow::{Context, Result, ensure};
use std::process::Command;

/// All of them, in the order in which they run.
pub fn all() -> impl Iterator<Item = &'static Check> {
    [driver::CHECKS, package::CHECKS, page::CHECKS].into_iter().flatten()
}

/// The site with the pages that checks bring along.
pub fn pages(site: Site) -> Site {
    let (path, text) = package::PAGE;
    driver::pages(site).with(path, text)
}

/// The picture that the program renders by these options.
fn native(bench: &Bench, options: &[&str], [width, height]: [u32; 2]) -> Result<Vec<u8>> {
    let path = bench.folder.path().join("native.png");
    let mut command = Command::new(&bench.program);
    command.arg("render").args(options).args(["--size", &format!("{width}x{height}"), "-o"]).arg(&path);
    let output = command.output().with_context(|| format!("{} does not start", bench.program.display()))?;
    ensure!(output.status.success(), "{command:?} fails: {}", String::from_utf8_lossy(&output.stderr));
    std::fs::read(&path).context("there is no native picture")
}
