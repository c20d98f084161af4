//! `cargo xtask truth`: the program's pictures beside those of an independent renderer.
//!
//! 1. Renders `cornell`, `table` and `punctual` with 256, 1024 and 4096 light samples and five seeds, with bounce limits that
//!    match the pictures `d2`, `d3` and `d6` (a random walk of B bounces has paths of at most B + 2 segments).
//! 2. Renders the same with the path tracer.
//! 3. Prints energy ratio and relMSE of each, and those that miss their bounds.
//!
//! With `--real`, rooms that people made: [`real`].

mod real;

use crate::{built, cargo, root};
use anyhow::{Context, Result, bail};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

/// Bounce limit and the picture it is compared with.
const LIMITS: [(u32, &str); 3] = [(4, "d6"), (0, "d2"), (1, "d3")];
const SCENES: [&str; 3] = ["cornell", "table", "punctual"];
const LIGHTS: [u32; 3] = [256, 1024, 4096];
/// Largest distance of the energy ratio from 1 at the largest number of lights: of the mean of all seeds, of each.
const ENERGY_BOUNDS: [f64; 2] = [0.01, 0.02];
/// relMSE below which the resolution of shadow maps and the reference's noise dominate, not the number of lights.
const FLOOR: f64 = 1e-4;
/// The scene whose relMSE is only printed: its lights are all punctual, so only energy is checked.
const UNBOUNDED: &str = "punctual";
/// Largest relMSE there.
const REL_MSE_BOUND: f64 = 0.005;
/// Largest distance of the path tracer's energy from 1, in standard errors.
const Z_BOUND: f64 = 4.0;

/// Options of `cargo xtask truth`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Folder with a folder for each scene: scene.glb, and pictures by size
    #[arg(long, value_name = "FOLDER", required_unless_present = "real")]
    truth: Option<PathBuf>,
    /// Folder with a folder for each room that people made: its scene (.glb or .glb.xz, which needs xz), a picture, a mask and its mirrors
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["truth", "size", "paths", "engine", "mode"])]
    real: Option<PathBuf>,
    /// Scenes [default: cornell,table,punctual; all of --real]
    #[arg(long, value_delimiter = ',')]
    scenes: Vec<String>,
    /// Pixels
    #[arg(long, default_value = "512x384")]
    size: String,
    /// How many seeds [default: 5; 3 with --real]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    seeds: Option<u32>,
    /// Light sets that are averaged for what --real's rooms cannot be better than; 0 leaves it out
    #[arg(long, default_value_t = 64, conflicts_with = "truth")]
    floor: u32,
    /// Paths a pixel of the path tracer; 0 leaves it out
    #[arg(long, default_value_t = 64)]
    paths: u32,
    /// As in `girandole render`: gpu or cpu
    #[arg(long, default_value = "gpu")]
    engine: String,
    /// As in `girandole render`: full, vd-lp, vd or naive
    #[arg(long, default_value = "full")]
    mode: String,
}

struct Bench<'a> {
    arguments: &'a Arguments,
    program: PathBuf,
    truth: PathBuf,
    scratch: tempfile::TempDir,
}

/// Error of a picture against the truth.
struct Outcome {
    energy: f64,
    rel_mse: f64,
    /// Standard error of the energy, if the engine estimates it.
    energy_error: f64,
}

/// Measures, prints and checks the bounds.
pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let folder =
        arguments.real.as_ref().or(arguments.truth.as_ref()).context("name a folder with --truth")?;
    let truth = root().join(folder);
    if !truth.is_dir() {
        bail!("there is no folder {}; name one with --truth or --real", truth.display());
    }
    if !cargo().args(["build", "--release", "--locked", "--bin", "girandole"]).status()?.success() {
        bail!("the program does not build");
    }
    let bench =
        Bench { arguments, program: built("release", "girandole")?, truth, scratch: tempfile::tempdir()? };
    let misses = if arguments.real.is_some() { bench.real_rooms()? } else { bench.own_scenes()? };
    for miss in &misses {
        println!("beyond its bound: {miss}");
    }
    Ok(if misses.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

impl Bench<'_> {
    fn own_scenes(&self) -> Result<Vec<String>> {
        let mut misses = Vec::new();
        println!(
            "| scene | bounces | against | rendered by | energy, mean | energy, each | relMSE, mean | relMSE, worst |"
        );
        println!("|---|---|---|---|---|---|---|---|");
        let scenes = self.arguments.scenes.iter().map(String::as_str);
        let scenes: Vec<&str> =
            if self.arguments.scenes.is_empty() { SCENES.to_vec() } else { scenes.collect() };
        for scene in scenes {
            for (bounces, against) in LIMITS {
                self.light_samples(scene, bounces, against, &mut misses)?;
            }
            for (bounces, against) in LIMITS.into_iter().filter(|_| self.arguments.paths > 0) {
                self.paths(scene, bounces, against, &mut misses)?;
            }
        }
        Ok(misses)
    }

    fn light_samples(
        &self,
        scene: &str,
        bounces: u32,
        against: &str,
        misses: &mut Vec<String>,
    ) -> Result<()> {
        let mut last_error = f64::INFINITY;
        for lights in LIGHTS {
            let outcomes = (0..self.arguments.seeds.unwrap_or(5))
                .map(|seed| {
                    let count = lights.to_string();
                    self.picture(
                        scene,
                        bounces,
                        against,
                        seed,
                        &[
                            "--engine",
                            &self.arguments.engine,
                            "--mode",
                            &self.arguments.mode,
                            "--lights",
                            &count,
                            "--clamp",
                            "off",
                            "--aa",
                            "off",
                        ],
                    )
                })
                .collect::<Result<Vec<_>>>()?;
            let row = format!("{scene}, {bounces} bounces, {lights} lights");
            let (energy, rel_mse) = print(scene, bounces, against, &format!("{lights} lights"), &outcomes);
            if rel_mse > last_error.max(FLOOR) {
                misses.push(format!("{row}: relMSE {rel_mse:.4} is more than with fewer lights"));
            }
            last_error = rel_mse;
            if Some(&lights) != LIGHTS.last() {
                continue;
            }
            if (energy - 1.0).abs() > ENERGY_BOUNDS[0] {
                misses.push(format!("{row}: mean energy {energy:.4}"));
            }
            for (seed, o) in outcomes.iter().enumerate() {
                if (o.energy - 1.0).abs() > ENERGY_BOUNDS[1] {
                    misses.push(format!("{row}: energy {:.4} of seed {seed}", o.energy));
                }
                if o.rel_mse > REL_MSE_BOUND && scene != UNBOUNDED {
                    misses.push(format!("{row}: relMSE {:.4} of seed {seed}", o.rel_mse));
                }
            }
        }
        Ok(())
    }

    fn paths(&self, scene: &str, bounces: u32, against: &str, misses: &mut Vec<String>) -> Result<()> {
        let paths = self.arguments.paths.to_string();
        let o = self.picture(scene, bounces, against, 0, &["--engine", "path", "--paths", &paths])?;
        let z = (o.energy - 1.0) / o.energy_error;
        print(scene, bounces, against, &format!("{paths} paths (z = {z:.2})"), &[o]);
        if z.is_nan() || z.abs() > Z_BOUND {
            misses.push(format!(
                "{scene}, {bounces} bounces, {paths} paths: energy is {z:.2} standard errors off"
            ));
        }
        Ok(())
    }

    /// Renders one picture and compares it.
    fn picture(
        &self,
        scene: &str,
        bounces: u32,
        against: &str,
        seed: u32,
        options: &[&str],
    ) -> Result<Outcome> {
        let (picture, stats) =
            (self.scratch.path().join("picture.exr"), self.scratch.path().join("stats.json"));
        let folder = self.truth.join(scene);
        let pictures = folder.join(&self.arguments.size);
        self.girandole(|c| {
            c.arg("render").arg(folder.join("scene.glb")).arg("-o").arg(&picture).arg("--stats").arg(&stats);
            c.args(["--size", &self.arguments.size, "--bounces", &bounces.to_string()]);
            c.args(["--seed", &seed.to_string()]).args(options);
        })?;
        let is_path = options.contains(&"path");
        let compared = self.girandole(|c| {
            c.arg("compare").arg(pictures.join(format!("{against}.exr"))).arg(&picture).arg("--json");
            c.arg("--mask").arg(pictures.join("mask.exr")).args(["--trim", "0.001"]);
            // Path tracer and truth use the same pixel filter.
            if is_path {
                c.arg("--edges");
            }
        })?;
        let compared: Value = serde_json::from_slice(&compared)?;
        let energy_error =
            if is_path { relative_noise(&stats, &pictures.join("stats.json"), against)? } else { 0.0 };
        Ok(Outcome {
            energy: number(&compared, "energy_ratio")?,
            rel_mse: number(&compared, "rel_mse")?,
            energy_error,
        })
    }

    fn girandole(&self, arguments: impl FnOnce(&mut Command)) -> Result<Vec<u8>> {
        let mut command = Command::new(&self.program);
        arguments(&mut command);
        let output = command.output().with_context(|| format!("cannot run {}", self.program.display()))?;
        if !output.status.success() {
            bail!("{command:?} failed: {}", String::from_utf8_lossy(&output.stderr).trim());
        }
        Ok(output.stdout)
    }
}

/// Standard error of the energy ratio: our noise and the truth's.
fn relative_noise(ours: &Path, truth: &Path, against: &str) -> Result<f64> {
    let ours: Value = serde_json::from_slice(&std::fs::read(ours)?)?;
    let truth: Value = serde_json::from_slice(&std::fs::read(truth)?)?;
    let truth = &truth["images"][against];
    Ok((number(&ours, "mean_standard_error")?.hypot(number(truth, "noise_mean")?))
        / number(truth, "mean_valid")?)
}

fn number(object: &Value, key: &str) -> Result<f64> {
    object[key].as_f64().with_context(|| format!("there is no number called {key}"))
}

/// Prints a row and returns the mean energy and relMSE.
fn print(scene: &str, bounces: u32, against: &str, what: &str, outcomes: &[Outcome]) -> (f64, f64) {
    let mean = |value: fn(&Outcome) -> f64| outcomes.iter().map(value).sum::<f64>() / outcomes.len() as f64;
    let (energy, rel_mse) = (mean(|o| o.energy), mean(|o| o.rel_mse));
    let each: Vec<String> = outcomes.iter().map(|o| format!("{:.3}", o.energy)).collect();
    let worst = outcomes.iter().map(|o| o.rel_mse).fold(0.0, f64::max);
    println!(
        "| {scene} | {bounces} | {against} | {what} | {energy:.4} | {} | {rel_mse:.5} | {worst:.5} |",
        each.join(" ")
    );
    (energy, rel_mse)
}
