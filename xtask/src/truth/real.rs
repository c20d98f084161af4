//! Rooms that people made, at 256 × 192, with as many bounces as their truth has.
//!
//! Prints relMSE (less the noise of the truth), energy, FLIP and outliers in the mean of some seeds, with smooth metal, without it and of
//! it alone; the same of many light sets averaged, which is what all that is not sampling leaves; and those that miss their bounds.

use super::{Bench, number};
use anyhow::{Context, Result, bail};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Numbers of light samples.
const LIGHTS: [u32; 2] = [300, 1024];
/// Of the truth: bounce limit, picture, width and height.
const BOUNCES: &str = "4";
const AGAINST: &str = "d6";
const SIZE: &str = "256x192";
/// What a bound is at least, as a multiple of what many light sets reach.
const ABOVE_THE_FLOOR: f64 = 1.3;

/// The best that is asked for, for either number of light samples.
struct Bounds {
    scene: &'static str,
    /// Which pixels count.
    part: Part,
    rel_mse: [f64; 2],
    flip: [f64; 2],
    /// Largest distance of the energy ratio from 1.
    energy: f64,
}

const BOUNDS: [Bounds; 3] = [
    Bounds { scene: "classroom", part: Part::All, rel_mse: [0.15, 0.05], flip: [0.17, 0.12], energy: 0.03 },
    Bounds {
        scene: "bathroom",
        part: Part::Matte,
        rel_mse: [0.015, 0.006],
        flip: [0.11, 0.08],
        energy: f64::INFINITY,
    },
    Bounds { scene: "staircase", part: Part::All, rel_mse: [0.01, 0.004], flip: [0.13, 0.09], energy: 0.02 },
];

/// Pixels that count, by whether they show smooth metal.
#[derive(Clone, Copy, PartialEq)]
enum Part {
    All,
    Matte,
    Mirrors,
}

const PARTS: [(Part, &str); 3] =
    [(Part::All, "all"), (Part::Matte, "without mirrors"), (Part::Mirrors, "mirrors")];

/// Error of a part of a picture.
#[derive(Clone, Copy, Default)]
struct Found {
    rel_mse: f64,
    energy: f64,
    flip: f64,
    outliers: f64,
}

impl Found {
    fn mean(all: &[Self]) -> Self {
        let mean = |value: fn(&Self) -> f64| all.iter().map(value).sum::<f64>() / all.len() as f64;
        Self {
            rel_mse: mean(|f| f.rel_mse),
            energy: mean(|f| f.energy),
            flip: mean(|f| f.flip),
            outliers: mean(|f| f.outliers),
        }
    }
}

/// A room and where its files are.
struct Room {
    name: String,
    folder: PathBuf,
    scene: PathBuf,
    /// Leave out what is no smooth metal, and what is.
    mirrors: PathBuf,
    matte: PathBuf,
    /// relMSE that the noise of the truth alone makes.
    noise: f64,
}

impl Bench<'_> {
    /// Measures and prints; returns what is beyond its bound.
    pub(super) fn real_rooms(&self) -> Result<Vec<String>> {
        let mut misses = Vec::new();
        println!("| room | lights | pixels | relMSE | energy | FLIP | outliers |");
        println!("|---|---|---|---|---|---|---|");
        for name in self.rooms()? {
            let room = self.room(&name)?;
            let floor = match self.arguments.floor {
                0 => None,
                sets => Some(self.row(
                    &room,
                    LIGHTS[0],
                    &format!("{} × {sets}", LIGHTS[0]),
                    &["--refine", &sets.to_string()],
                    1,
                )?),
            };
            for (index, lights) in LIGHTS.into_iter().enumerate() {
                let found =
                    self.row(&room, lights, &lights.to_string(), &[], self.arguments.seeds.unwrap_or(3))?;
                misses.extend(beyond(&name, index, &found, floor.as_ref()));
            }
        }
        Ok(misses)
    }

    fn rooms(&self) -> Result<Vec<String>> {
        if !self.arguments.scenes.is_empty() {
            return Ok(self.arguments.scenes.clone());
        }
        let mut names = Vec::new();
        for entry in fs::read_dir(&self.truth)? {
            let entry = entry?;
            if entry.path().join("mask.exr").is_file() {
                names.push(entry.file_name().to_string_lossy().into_owned());
            }
        }
        names.sort();
        if names.is_empty() {
            bail!("{} has no folder with a mask.exr", self.truth.display());
        }
        Ok(names)
    }

    fn room(&self, name: &str) -> Result<Room> {
        let folder = self.truth.join(name);
        let stats: Value = serde_json::from_slice(
            &fs::read(folder.join("stats.json"))
                .with_context(|| format!("cannot read {}", folder.join("stats.json").display()))?,
        )?;
        let noise = number(&stats["images"][AGAINST], "relmse_floor")?;
        let scratch = |file: &str| self.scratch.path().join(format!("{name}-{file}"));
        let mut scene = folder.join(format!("{name}.glb"));
        if !scene.is_file() {
            let packed = folder.join(format!("{name}.glb.xz"));
            scene = scratch("scene.glb");
            let output = Command::new("xz").arg("-dkc").arg(&packed).output().context("cannot run xz")?;
            if !output.status.success() {
                bail!("xz cannot unpack {}", packed.display());
            }
            fs::write(&scene, output.stdout)?;
        }
        let (width, height, is_mirror) = read_booleans(&folder.join("mirror.npy"))?;
        let [mirrors, matte] = [scratch("mirrors.png"), scratch("matte.png")];
        let left_out: Vec<bool> = is_mirror.iter().map(|is| !is).collect();
        write_mask(&mirrors, (width, height), &left_out)?;
        write_mask(&matte, (width, height), &is_mirror)?;
        Ok(Room { name: name.into(), folder, scene, mirrors, matte, noise })
    }

    /// Renders with these options and some seeds, prints the rows of all parts, and returns them.
    fn row(&self, room: &Room, lights: u32, what: &str, options: &[&str], seeds: u32) -> Result<[Found; 3]> {
        let mut found = [const { Vec::new() }; 3];
        for seed in 0..seeds {
            let picture = self.scratch.path().join("picture.exr");
            self.girandole(|c| {
                c.arg("render").arg(&room.scene).arg("-o").arg(&picture);
                c.args(["--size", SIZE, "--bounces", BOUNCES, "--lights", &lights.to_string()]);
                c.args(["--seed", &seed.to_string()]).args(options);
                let sky = room.folder.join("sky.exr");
                if sky.is_file() {
                    c.arg("--environment").arg(sky);
                }
            })?;
            for (index, (part, _)) in PARTS.iter().enumerate() {
                found[index].extend(self.compare(room, *part, &picture)?);
            }
        }
        let count = found.each_ref().map(Vec::len);
        let found = found.map(|all| Found::mean(&all));
        for ((f, (_, name)), _) in found.iter().zip(PARTS).zip(count).filter(|(_, count)| *count > 0) {
            println!(
                "| {} | {what} | {name} | {:.4} | {:.3} | {:.3} | {:.1} |",
                room.name, f.rel_mse, f.energy, f.flip, f.outliers
            );
        }
        Ok(found)
    }

    /// `None` where all mirrors are masked.
    fn compare(&self, room: &Room, part: Part, picture: &Path) -> Result<Option<Found>> {
        let compared = self.girandole(|c| {
            c.arg("compare").arg(room.folder.join(format!("{AGAINST}.exr"))).arg(picture).arg("--json");
            c.arg("--mask").arg(room.folder.join("mask.exr"));
            match part {
                Part::All => {}
                Part::Matte => drop(c.arg("--mask").arg(&room.matte)),
                Part::Mirrors => drop(c.arg("--mask").arg(&room.mirrors)),
            }
        });
        let compared = match compared {
            Err(error) if part == Part::Mirrors && error.to_string().contains("no pixel is left") => {
                return Ok(None);
            }
            compared => serde_json::from_slice::<Value>(&compared?)?,
        };
        Ok(Some(Found {
            rel_mse: number(&compared, "rel_mse")? - room.noise,
            energy: number(&compared, "energy_ratio")?,
            flip: number(&compared, "flip")?,
            outliers: number(&compared, "outliers")?,
        }))
    }
}

/// What is found beyond the bounds of a room.
fn beyond(name: &str, index: usize, found: &[Found; 3], floor: Option<&[Found; 3]>) -> Vec<String> {
    let Some(bounds) = BOUNDS.iter().find(|bounds| bounds.scene == name) else { return Vec::new() };
    let of = |found: &[Found; 3]| found[bounds.part as usize];
    let floor = floor.map(of).unwrap_or_default();
    let found = of(found);
    let checks = [
        ("relMSE", found.rel_mse, bounds.rel_mse[index].max(ABOVE_THE_FLOOR * floor.rel_mse)),
        ("FLIP", found.flip, bounds.flip[index].max(ABOVE_THE_FLOOR * floor.flip)),
        ("energy error", (found.energy - 1.0).abs(), bounds.energy),
        ("outliers", found.outliers, 0.0),
    ];
    let beyond = checks.iter().filter(|(_, value, bound)| value.is_nan() || value > bound);
    let lights = LIGHTS[index];
    beyond
        .map(|(what, value, bound)| format!("{name}, {lights} lights: {what} {value:.4} for {bound:.4}"))
        .collect()
}

/// Width, height and values of a NumPy array of booleans (format 1.0).
fn read_booleans(path: &Path) -> Result<(u32, u32, Vec<bool>)> {
    let bytes = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    let broken = || format!("{} is no NumPy file of booleans in two dimensions", path.display());
    let length = bytes.get(8..10).with_context(broken)?;
    let start = 10 + usize::from(u16::from_le_bytes([length[0], length[1]]));
    let header = std::str::from_utf8(bytes.get(10..start).with_context(broken)?).with_context(broken)?;
    let shape =
        header.split_once("'shape': (").and_then(|(_, rest)| rest.split_once(')')).with_context(broken)?.0;
    let sides: Vec<u32> = shape.split(',').filter_map(|side| side.trim().parse().ok()).collect();
    let values = &bytes[start..];
    match sides[..] {
        [height, width] if header.contains("'|b1'") && values.len() == width as usize * height as usize => {
            Ok((width, height, values.iter().map(|&value| value != 0).collect()))
        }
        _ => bail!(broken()),
    }
}

/// Writes a mask that leaves pixels out.
fn write_mask(path: &Path, (width, height): (u32, u32), left_out: &[bool]) -> Result<()> {
    let file = std::io::BufWriter::new(fs::File::create(path)?);
    let mut encoder = png::Encoder::new(file, width, height);
    encoder.set_color(png::ColorType::Rgb);
    let pixels: Vec<u8> = left_out.iter().flat_map(|&is| [if is { 255 } else { 0 }, 0, 0]).collect();
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&pixels)?;
    Ok(writer.finish()?)
}
