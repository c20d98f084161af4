//! `cargo xtask test-web`: builds for browsers, and runs checks in one.

use crate::browser::{self, Browser, Options, Tab, View, WebGpu};
use crate::checks;
use crate::package::{self, Part, Speed};
use crate::serve::{Server, Site};
use crate::toolchain::Toolchain;
use anyhow::{Context, Result, bail};
use std::cell::OnceCell;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;
use tempfile::TempDir;

/// What the command line says.
#[derive(clap::Args)]
pub struct Arguments {
    /// Runs only checks whose names contain one of these
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    /// Builds in a shorter time what is larger and slower
    #[arg(long)]
    quick: bool,
    /// Tests what the last build left in the folder
    #[arg(long)]
    no_build: bool,
    /// Folder of the build
    #[arg(short, long, value_name = "FOLDER", default_value = "target/web-test")]
    output: PathBuf,
    /// Says so and passes where there is no browser, or no compiler for browsers
    #[arg(long)]
    if_possible: bool,
    /// Lists the checks, and runs none
    #[arg(long)]
    list: bool,
}

/// Something that must be so in a browser.
pub struct Check {
    /// What must be so, in words joined by `-` below a room's name: `driver/keys-arrive`.
    pub name: &'static str,
    /// What must have been built.
    pub needs: &'static [Part],
    /// Finds out. Trouble that it leaves in a tab's console fails it.
    pub run: fn(&Bench) -> Result<()>,
}

/// What checks work with: a server, and browsers that are started when they are needed.
pub struct Bench {
    /// Of the built files, and of the checks' own.
    pub server: Server,
    /// For files, of this run alone.
    pub folder: TempDir,
    /// The native program, which pictures are compared with.
    pub program: PathBuf,
    /// Where pictures are left to be looked at.
    pictures: PathBuf,
    browser: OnceCell<Browser>,
    dense: OnceCell<Browser>,
    no_adapter: OnceCell<Browser>,
    no_webgpu: OnceCell<Browser>,
}

impl Bench {
    /// On a folder that was built.
    pub fn new(built: &Path) -> Result<Self> {
        let site = checks::pages(Site::folder(built))?;
        Ok(Self {
            server: Server::start(site, 0)?,
            folder: tempfile::tempdir().context("there is no temporary folder")?,
            program: std::env::current_exe()?
                .with_file_name(format!("girandole{}", std::env::consts::EXE_SUFFIX)),
            pictures: built.join("pictures"),
            browser: OnceCell::new(),
            dense: OnceCell::new(),
            no_adapter: OnceCell::new(),
            no_webgpu: OnceCell::new(),
        })
    }

    /// A tab at a path of the server, in a browser with WebGPU.
    pub fn open(&self, path: &str, view: &View) -> Result<Tab<'_>> {
        self.open_with(WebGpu::Software, path, view)
    }

    /// A tab at a path of the server, in a browser with so much of WebGPU.
    pub fn open_with(&self, webgpu: WebGpu, path: &str, view: &View) -> Result<Tab<'_>> {
        let cell = match webgpu {
            WebGpu::Software => &self.browser,
            WebGpu::NoAdapter => &self.no_adapter,
            WebGpu::Missing => &self.no_webgpu,
        };
        let options = Options { webgpu, ..Options::default() };
        started(cell, &options)?.open(&format!("{}{path}", self.server.address()), view)
    }

    /// A tab at a path of the server, on a screen of the view's density.
    pub fn open_dense(&self, path: &str, view: &View) -> Result<Tab<'_>> {
        let options = Options { pixel_ratio: Some(view.pixel_ratio), ..Options::default() };
        started(&self.dense, &options)?.open(&format!("{}{path}", self.server.address()), view)
    }

    fn browsers(&self) -> [&OnceCell<Browser>; 4] {
        [&self.browser, &self.dense, &self.no_adapter, &self.no_webgpu]
    }

    /// Writes a file for a check; its path.
    pub fn file(&self, name: &str, bytes: impl AsRef<[u8]>) -> Result<PathBuf> {
        let path = self.folder.path().join(name);
        std::fs::write(&path, bytes).with_context(|| format!("cannot write {}", path.display()))?;
        Ok(path)
    }

    /// Leaves a picture to be looked at; the same bytes.
    pub fn keep(&self, name: &str, png: Vec<u8>) -> Result<Vec<u8>> {
        let path = self.pictures.join(name);
        std::fs::create_dir_all(&self.pictures)
            .and_then(|()| std::fs::write(&path, &png))
            .with_context(|| format!("cannot write {}", path.display()))?;
        Ok(png)
    }

    /// Trouble in all tabs since the last time.
    fn take_troubles(&self) -> Result<Vec<String>> {
        let mut troubles = Vec::new();
        for browser in self.browsers().into_iter().filter_map(OnceCell::get) {
            troubles.extend(browser.take_troubles()?);
        }
        Ok(troubles)
    }

    /// Ends the browsers, of which a check may have left nothing good.
    fn restart(&mut self) {
        self.browser.take();
        self.dense.take();
        self.no_adapter.take();
        self.no_webgpu.take();
    }
}

/// The browser of a cell, started at the first time.
fn started<'a>(cell: &'a OnceCell<Browser>, options: &Options) -> Result<&'a Browser> {
    if let Some(browser) = cell.get() {
        return Ok(browser);
    }
    let browser = Browser::start(options)?;
    Ok(cell.get_or_init(|| browser))
}

/// Builds what the chosen checks need, and runs them.
pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let chosen = chosen(&arguments.names)?;
    if arguments.list {
        for check in chosen {
            println!("{}", check.name);
        }
        return Ok(ExitCode::SUCCESS);
    }
    if arguments.if_possible
        && let Err(missing) = Toolchain::find().and_then(|_| browser::find())
    {
        let names: Vec<&str> = chosen.iter().map(|check| check.name).collect();
        eprintln!("not run: {}, as {missing:#}", names.join(", "));
        return Ok(ExitCode::SUCCESS);
    }
    let needed = |part: &Part| chosen.iter().any(|check| check.needs.contains(part));
    let parts: Vec<Part> = Part::ALL.into_iter().filter(needed).collect();
    if !parts.is_empty() && !arguments.no_build {
        let speed = if arguments.quick { Speed::Quick } else { Speed::Full };
        package::build(&parts, speed, &arguments.output)?;
    }
    let mut bench = Bench::new(&arguments.output)?;
    let failed = chosen.iter().filter(|check| !passes(check, &mut bench)).count();
    println!("{} checks passed, {failed} failed", chosen.len() - failed);
    Ok(if failed == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Runs a check, and prints how it went.
fn passes(check: &Check, bench: &mut Bench) -> bool {
    print!("test {} ... ", check.name);
    // A terminal that does not take it will not take the rest either.
    let _ = std::io::Write::flush(&mut std::io::stdout());
    let start = Instant::now();
    let result = (check.run)(bench);
    let troubles = bench.take_troubles();
    let outcome = outcome(result, troubles);
    let seconds = start.elapsed().as_secs_f64();
    match &outcome {
        Ok(()) => println!("ok ({seconds:.1} s)"),
        Err(error) => {
            println!("FAILED ({seconds:.1} s)");
            eprintln!("  {error:#}");
            bench.restart();
        }
    }
    outcome.is_ok()
}

/// Of a check that ended like this and left that trouble.
fn outcome(result: Result<()>, troubles: Result<Vec<String>>) -> Result<()> {
    let troubles = troubles.unwrap_or_else(|error| vec![format!("{error:#}")]).join("\n  ");
    match result {
        Ok(()) if troubles.is_empty() => Ok(()),
        Ok(()) => bail!("the console has trouble:\n  {troubles}"),
        Err(error) if troubles.is_empty() => Err(error),
        Err(error) => bail!("{error:#}\n  and the console has trouble:\n  {troubles}"),
    }
}

fn chosen(names: &[String]) -> Result<Vec<&'static Check>> {
    for name in names {
        if !checks::all().any(|check| check.name.contains(name)) {
            bail!("no check's name contains `{name}`; --list lists them");
        }
    }
    let is_chosen = |check: &&Check| names.is_empty() || names.iter().any(|name| check.name.contains(name));
    Ok(checks::all().filter(is_chosen).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::anyhow;

    #[test]
    fn checks_are_chosen_by_parts_of_their_names() {
        let names = |parts: &[&str]| -> Vec<&str> {
            let parts: Vec<String> = parts.iter().map(ToString::to_string).collect();
            chosen(&parts).expect("checks").iter().map(|check| check.name).collect()
        };
        assert_eq!(names(&[]).len(), checks::all().count());
        assert!(names(&["driver/"]).iter().all(|name| name.starts_with("driver/")));
        assert!(!names(&["driver/"]).is_empty());
        assert!(chosen(&["no such check".into()]).is_err());
    }

    #[test]
    fn names_of_checks_differ() {
        let names: std::collections::BTreeSet<_> = checks::all().map(|check| check.name).collect();
        assert_eq!(names.len(), checks::all().count());
    }

    #[test]
    fn trouble_fails_a_check_that_passes_otherwise() {
        let trouble = || Ok(vec!["error: bad".to_string()]);
        assert!(outcome(Ok(()), Ok(Vec::new())).is_ok());
        assert!(outcome(Ok(()), trouble()).expect_err("trouble").to_string().contains("error: bad"));
        let both = outcome(Err(anyhow!("wrong")), trouble()).expect_err("both").to_string();
        assert!(both.contains("wrong") && both.contains("error: bad"), "{both}");
        assert!(outcome(Ok(()), Err(anyhow!("gone"))).is_err());
    }
}
