//! Builds what browsers load: the page (the program's window) and the package (the component).

mod files;

use crate::sizes;
use crate::toolchain::{TARGET, Toolchain};
use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::Stdio;
use wasm_bindgen_cli_support::Bindgen;

/// What is built.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// The window as a page
    Page,
    /// The component, in the shape of an npm package
    Package,
}

/// How it is built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Speed {
    /// To be small and fast.
    Full,
    /// In a short time.
    Quick,
}

/// What the page shows where it cannot draw, and its name there.
const PREVIEW: (&str, &str) = ("docs/window.jpg", "preview.jpg");

impl Part {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Page, Self::Package];

    /// The arguments that name it to Cargo.
    fn cargo_arguments(self) -> &'static [&'static str] {
        match self {
            Self::Page => &["--package", "girandole-app", "--bin", "girandole"],
            Self::Package => &["--package", "girandole-js", "--lib"],
        }
    }

    /// The name that Cargo gives its file.
    fn cargo_target(self) -> &'static str {
        match self {
            Self::Page => "girandole",
            Self::Package => "girandole_js",
        }
    }

    /// The name of its files here.
    fn stem(self) -> &'static str {
        match self {
            Self::Page => "page",
            Self::Package => "girandole",
        }
    }

    /// Its folder in the output, and that of its static files in the workspace.
    fn folders(self) -> (&'static str, &'static str) {
        match self {
            Self::Page => ("", "web/page"),
            Self::Package => ("package", "web/package"),
        }
    }
}

impl Speed {
    fn profile(self) -> &'static str {
        match self {
            Self::Full => "web",
            Self::Quick => "web-quick",
        }
    }
}

/// Builds parts into a folder, whose files are replaced only when all of them are made, and says how large they are.
pub fn build(parts: &[Part], speed: Speed, output: &Path) -> Result<()> {
    let toolchain = Toolchain::find()?;
    eprintln!("building with {}", toolchain.describe());
    std::fs::create_dir_all(output)
        .with_context(|| format!("cannot make the folder {}", output.display()))?;
    // In the output: files can be renamed only within a file system.
    let stage = tempfile::Builder::new()
        .prefix(".unfinished-")
        .tempdir_in(output)
        .with_context(|| format!("cannot write to the folder {}", output.display()))?;
    for part in parts {
        let (folder, fixed) = part.folders();
        let folder = stage.path().join(folder);
        let compiled = compile(&toolchain, *part, speed)?;
        files::copy(&crate::root().join(fixed), &folder)?;
        if *part == Part::Page {
            let picture = crate::root().join(PREVIEW.0);
            std::fs::copy(&picture, folder.join(PREVIEW.1))
                .with_context(|| format!("cannot copy {}", picture.display()))?;
        }
        bind(&compiled, *part, &folder)?;
        if *part == Part::Package {
            files::fill_in_version(&folder.join("package.json"), env!("CARGO_PKG_VERSION"))?;
        }
    }
    eprint!("{}", sizes::table(&sizes::of_folder(stage.path())?));
    files::put_in_place(stage.path(), output)?;
    eprintln!("wrote {}", output.display());
    Ok(())
}

/// Compiles a part to WebAssembly; the path of its file.
fn compile(toolchain: &Toolchain, part: Part, speed: Speed) -> Result<PathBuf> {
    let mut build = toolchain
        .cargo()
        .args(["build", "--locked", "--profile", speed.profile()])
        .args(["--message-format", "json-render-diagnostics"])
        .args(toolchain.build_arguments())
        .args(part.cargo_arguments())
        .stdout(Stdio::piped())
        .spawn()
        .context("Cargo does not start")?;
    let mut compiled = None;
    for line in BufReader::new(build.stdout.take().context("Cargo has no output")?).lines() {
        compiled = compiled.or(artifact(&line?, part.cargo_target()));
    }
    if !build.wait()?.success() {
        bail!("{} does not build for {TARGET}; its compiler says why above", part.cargo_target());
    }
    compiled.with_context(|| format!("Cargo made no file of {}", part.cargo_target()))
}

/// The WebAssembly file that a message of Cargo says to be made of a target, if it does.
fn artifact(message: &str, target: &str) -> Option<PathBuf> {
    let message: serde_json::Value = serde_json::from_str(message).ok()?;
    if message["reason"] != "compiler-artifact" || message["target"]["name"] != target {
        return None;
    }
    let mut files = message["filenames"].as_array()?.iter().filter_map(|file| file.as_str());
    files.find(|file| file.ends_with(".wasm")).map(PathBuf::from)
}

/// Makes the JavaScript that calls it, and of a package its types. What Binaryen's `wasm-opt` (108, from `-O2` to `-Oz`) would make of the file
/// is no smaller by gzip, the package 4 to 6 % larger; in the smallest shape the first picture took a quarter longer.
fn bind(compiled: &Path, part: Part, folder: &Path) -> Result<()> {
    Bindgen::new()
        .input_path(compiled)
        .out_name(part.stem())
        .web(true)?
        .typescript(part == Part::Package)
        // The module finds its WebAssembly beside itself.
        .omit_default_module_path(false)
        .remove_name_section(true)
        .remove_producers_section(true)
        .generate(folder)
        .with_context(|| format!("no JavaScript could be made for {}", compiled.display()))?;
    // Types of the WebAssembly file's own functions, which nobody calls.
    files::remove_if_there(&folder.join(format!("{}_bg.wasm.d.ts", part.stem())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_of_a_target_is_found_in_cargos_messages() {
        let message = r#"{"reason":"compiler-artifact","target":{"name":"girandole_js","kind":["cdylib"]},
            "filenames":["/t/libgirandole_js.rlib","/t/girandole_js.wasm"]}"#;
        assert_eq!(artifact(message, "girandole_js"), Some("/t/girandole_js.wasm".into()));
        assert_eq!(artifact(message, "girandole"), None);
        assert_eq!(artifact(r#"{"reason":"build-finished","success":true}"#, "girandole"), None);
        assert_eq!(artifact("a warning", "girandole"), None);
    }

    #[test]
    fn the_library_and_the_tool_of_wasm_bindgen_are_of_one_version() {
        let lock = std::fs::read_to_string(crate::root().join("Cargo.lock")).expect("Cargo.lock");
        let version = |name: &str| {
            let after = lock.split_once(&format!("name = \"{name}\"\n")).expect(name).1;
            after.lines().next().expect("a version").to_string()
        };
        assert_eq!(version("wasm-bindgen"), version("wasm-bindgen-cli-support"));
    }
}
