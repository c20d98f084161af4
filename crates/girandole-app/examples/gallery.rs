//! Every glTF file below a folder, beside the path tracer, on one HTML page.

use anyhow::{Context, Result, bail};
use clap::Parser;
use girandole_core::image::Image;
use girandole_core::tonemap::{Exposure, Tonemap, to_srgb8};
use girandole_reference::image_file::{read_exr, write_png};
use girandole_reference::metrics::{CompareOptions, Comparison, compare};
use std::fmt::Write as _;
use std::io::{Read, Seek};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Renders every glTF file below a folder beside the path tracer, to one HTML page
#[derive(Parser)]
#[command(name = "gallery", bin_name = "cargo xtask gallery")]
struct Arguments {
    /// Folder with `.gltf` and `.glb` files, also in folders below it
    folder: PathBuf,
    /// Where `index.html` and its pictures go
    #[arg(long, default_value = "target/gallery")]
    out: PathBuf,
    /// Pixels
    #[arg(long, default_value = "320x240")]
    size: String,
    /// Paths a pixel of the path tracer
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..))]
    paths: u32,
    /// Seconds that a picture may take
    #[arg(long, default_value_t = 300)]
    timeout: u64,
    /// Further options of `girandole render`, for both pictures
    #[arg(last = true)]
    options: Vec<String>,
}

/// What became of a file.
enum Outcome {
    Shown {
        comparison: Comparison,
        seconds: [f64; 2],
        said: String,
    },
    /// Refused, with the sentence that says why.
    Refused(String),
    /// Anything else.
    Failed(String),
}

fn main() -> ExitCode {
    run(&Arguments::parse()).unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        ExitCode::from(2)
    })
}

fn run(arguments: &Arguments) -> Result<ExitCode> {
    let folder = &arguments.folder;
    let mut files = Vec::new();
    collect(folder, &mut files).with_context(|| format!("cannot read the folder {}", folder.display()))?;
    if files.is_empty() {
        bail!("there is no .gltf or .glb file below {}", folder.display());
    }
    files.sort();
    let gallery = Gallery { arguments, program: program()?, out: arguments.out.clone() };
    std::fs::create_dir_all(&gallery.out)?;
    let mut rows = String::new();
    let mut failures = 0;
    for (number, file) in files.iter().enumerate() {
        let name = file.strip_prefix(folder).unwrap_or(file).display().to_string();
        eprintln!("{} of {}: {name}", number + 1, files.len());
        let outcome = gallery.file(file, number).unwrap_or_else(|e| Outcome::Failed(format!("{e:#}")));
        failures += usize::from(matches!(outcome, Outcome::Failed(_)));
        rows.push_str(&row(&name, number, &outcome));
        // Looked at while others are rendered.
        let page = gallery.out.join("index.html");
        girandole_core::files::write(&page, document(&rows).as_bytes())?;
    }
    eprintln!("{} files, {failures} failures: {}", files.len(), gallery.out.join("index.html").display());
    Ok(if failures == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

struct Gallery<'a> {
    arguments: &'a Arguments,
    program: PathBuf,
    out: PathBuf,
}

impl Gallery<'_> {
    fn file(&self, file: &Path, number: usize) -> Result<Outcome> {
        let scratch = tempfile::tempdir()?;
        let pictures = ["gpu", "path"].map(|engine| scratch.path().join(engine).with_extension("exr"));
        let mut said = String::new();
        let mut seconds = [0.0; 2];
        let engines: [&[&str]; 2] =
            [&[], &["--engine", "path", "--paths", &self.arguments.paths.to_string()]];
        for ((picture, options), seconds) in pictures.iter().zip(engines).zip(&mut seconds) {
            let mut command = Command::new(&self.program);
            command.arg("render").arg(file).arg("-o").arg(picture).args(["--size", &self.arguments.size]);
            command.args(options).args(&self.arguments.options);
            let start = Instant::now();
            let Some((status, lines)) = output(&mut command, Duration::from_secs(self.arguments.timeout))?
            else {
                return Ok(Outcome::Failed(format!("no picture after {} s", self.arguments.timeout)));
            };
            *seconds = start.elapsed().as_secs_f64();
            match status.code() {
                Some(0) => {}
                Some(2) => return Ok(Outcome::Refused(lines.trim().to_owned())),
                _ => return Ok(Outcome::Failed(format!("{status}: {}", lines.trim()))),
            }
            if said.is_empty() {
                said =
                    lines.lines().filter(|line| line.starts_with("warning")).collect::<Vec<_>>().join("\n");
            }
        }
        let [picture, truth] = [read_exr(&pictures[0])?, read_exr(&pictures[1])?];
        let ev = Exposure::Auto.ev(&truth);
        self.save(&picture, ev, number, "girandole")?;
        self.save(&truth, ev, number, "path")?;
        let options = CompareOptions { keep_edges: true, ..CompareOptions::default() };
        Ok(Outcome::Shown { comparison: compare(&truth, &picture, &options)?, seconds, said })
    }

    fn save(&self, image: &Image, ev: f32, number: usize, by: &str) -> Result<()> {
        let path = self.out.join(picture_name(number, by));
        Ok(write_png(&path, image.width, image.height, &to_srgb8(image, ev, Tonemap::default()))?)
    }
}

/// The program, of the same profile as this.
fn program() -> Result<PathBuf> {
    // Examples lie in a folder beside it.
    let examples = std::env::current_exe()?;
    let profile = examples.ancestors().nth(2).context("this program lies nowhere")?;
    let program = profile.join(format!("girandole{}", std::env::consts::EXE_SUFFIX));
    if !program.is_file() {
        bail!(
            "there is no program {}; build it in this profile, or run `cargo xtask gallery`",
            program.display()
        );
    }
    Ok(program)
}

/// What a command wrote; `None` where it took too long.
fn output(command: &mut Command, timeout: Duration) -> Result<Option<(ExitStatus, String)>> {
    let mut said = tempfile::tempfile()?;
    let mut child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(said.try_clone()?).spawn()?;
    let start = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break status;
        }
        if start.elapsed() > timeout {
            child.kill()?;
            child.wait()?;
            return Ok(None);
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    let mut bytes = Vec::new();
    said.rewind()?;
    said.read_to_end(&mut bytes)?;
    Ok(Some((status, String::from_utf8_lossy(&bytes).into_owned())))
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> std::io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            collect(&path, files)?;
        } else if path.extension().is_some_and(|e| e == "gltf" || e == "glb") {
            files.push(path);
        }
    }
    Ok(())
}

fn picture_name(number: usize, by: &str) -> String {
    format!("{number:04}-{by}.png")
}

fn row(name: &str, number: usize, outcome: &Outcome) -> String {
    let mut row = format!("<tr><th>{}</th>", escaped(name));
    match outcome {
        Outcome::Shown { comparison: c, seconds, said } => {
            for by in ["girandole", "path"] {
                let file = picture_name(number, by);
                let _ = write!(row, "<td><a href=\"{file}\"><img src=\"{file}\" alt=\"{by}\"></a></td>");
            }
            let _ = write!(
                row,
                "<td>FLIP {:.3}<br>relMSE {:.4}<br>energy {:.3}<br>{:.1} s and {:.1} s<pre>{}</pre></td>",
                c.flip,
                c.rel_mse,
                c.energy_ratio,
                seconds[0],
                seconds[1],
                escaped(said)
            );
        }
        Outcome::Refused(sentence) => {
            let _ = write!(row, "<td colspan=3><pre>{}</pre></td>", escaped(sentence));
        }
        Outcome::Failed(what) => {
            let _ = write!(row, "<td colspan=3 class=failed><pre>{}</pre></td>", escaped(what));
        }
    }
    row + "</tr>\n"
}

fn document(rows: &str) -> String {
    format!(
        "<!doctype html><meta charset=utf-8><title>Girandole: gallery</title>\n\
         <style>body{{font:14px sans-serif;background:#222;color:#ddd}}th{{max-width:16em;overflow-wrap:anywhere}}\
         pre{{white-space:pre-wrap;max-width:40em}}.failed{{background:#622}}</style>\n\
         <table>\n<tr><th>File<th>Girandole<th>Path tracer<th>Error, times, what was said</tr>\n{rows}</table>\n"
    )
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
