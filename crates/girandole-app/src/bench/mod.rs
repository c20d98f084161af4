//! `girandole bench`: times the modes against each other.

mod moving;

use crate::args::{BenchArgs, SceneArgs};
use crate::engine::gpu::{Device, Trial};
use crate::output::Stats;
use crate::output::{self, Progress, say};
use crate::scene;
use anyhow::{Result, bail};
use girandole_core::lights::{LightSet, LightSettings};
use girandole_core::scene::{Geometry, Scene};
use serde_json::Value;
use std::fmt::Write;
use std::process::ExitCode;

/// Columns of the table: heading, key, factor, decimal places.
const COLUMNS: [Column; 9] = [
    ("frame ms", "frame_ms", 1.0, 1),
    ("ratio", "ratio", 1.0, 2),
    ("pairs/px", "pairs_per_pixel", 1.0, 2),
    ("lookups/px", "look_ups_per_pixel", 1.0, 2),
    ("shaded %", "share_shaded", 100.0, 1),
    ("maps ms", "shadow_maps_ms", 1.0, 0),
    ("vis ms", "visibility_ms", 1.0, 0),
    ("leaves", "leaves", 1.0, 0),
    ("record ms", "record_ms", 1.0, 1),
];

/// Times the modes on the scenes of the command line.
pub fn run(args: &BenchArgs) -> Result<ExitCode> {
    for (path, extension) in [(&args.csv, "csv"), (&args.json, "json")] {
        if let Some(path) = path {
            output::check_writable(path, &[extension])?;
        }
    }
    if args.modes.iter().enumerate().any(|(i, mode)| args.modes[..i].contains(mode)) {
        bail!("--modes names a mode twice; name each once");
    }
    if args.scenes.len() > 1 && args.seen != SceneArgs::default() {
        bail!("--view, --edits and --environment belong to one scene; name it");
    }
    // All scenes are loaded first, so that a misspelt name is reported before any is timed.
    let mut scenes = Vec::new();
    for name in &args.scenes {
        let builtin = girandole_core::scene::builtin::NAMES.contains(&name.as_str());
        let object = args.object.as_deref().filter(|_| builtin);
        scenes.push((name, scene::load_edited(name, object, &args.seen)?.0));
    }
    let device = Device::open(args.adapter.as_deref())?;
    say(&format!("timing {} rounds on {}", args.repeat, device.name()));
    let (rows, columns) = if args.moving {
        (moving::rows(args, &scenes, &device)?, &moving::COLUMNS[..])
    } else {
        (rows(args, &scenes, &device)?, &COLUMNS[..])
    };
    output::data(&table(&rows, columns))?;
    if let Some(path) = &args.csv {
        girandole_core::files::write(path, csv(&rows, columns).as_bytes())?;
    }
    if let Some(path) = &args.json {
        girandole_core::files::write(path, format!("{}\n", serde_json::to_string_pretty(&rows)?).as_bytes())?;
    }
    Ok(ExitCode::SUCCESS)
}

/// A row for each scene, number of lights and mode.
fn rows(args: &BenchArgs, scenes: &[(&String, Scene)], device: &Device) -> Result<Vec<Stats>> {
    let mut rows: Vec<Stats> = Vec::new();
    for (name, scene) in scenes {
        let geometry = Geometry::new(scene);
        let view = scene::view(scene, &args.seen, None, args.size)?;
        for &count in &args.lights {
            let settings = LightSettings { count, seed: args.seed, ..LightSettings::default() };
            let lights = LightSet::sample_for(scene, &geometry, &settings, &[view])?;
            let progress = Progress::bar(&format!("{name} with {count} lights"));
            let trial = Trial { scene, geometry: &geometry, lights: &lights, view, args };
            let mut results = device.time(&trial, &|done| progress.set(done))?;
            let base = number(&results[0], "frame_ms");
            for row in &mut results {
                let shaded = ["1", "2", "4", "8"].map(|s| number(row, &format!("share_shaded_at_step_{s}")));
                for (key, value) in [
                    ("scene", Value::from(name.as_str())),
                    ("adapter", device.name().into()),
                    ("lights", lights.len().into()),
                    ("width", args.size[0].into()),
                    ("height", args.size[1].into()),
                    ("samples_per_axis", args.aa.samples_per_axis().into()),
                    ("ratio", (base / number(row, "frame_ms")).into()),
                    ("share_shaded", shaded.iter().sum::<f64>().into()),
                ] {
                    row.insert(key.into(), value);
                }
            }
            drop(progress);
            rows.extend(results);
        }
    }
    Ok(rows)
}

fn number(row: &Stats, key: &str) -> f64 {
    row.get(key).and_then(Value::as_f64).unwrap_or(0.0)
}

fn text<'a>(row: &'a Stats, key: &str) -> &'a str {
    row.get(key).and_then(Value::as_str).unwrap_or_default()
}

/// A column: heading, key, factor, decimal places.
type Column = (&'static str, &'static str, f64, usize);

fn table(rows: &[Stats], columns: &[Column]) -> String {
    let width = rows.iter().map(|r| text(r, "scene").chars().count()).max().unwrap_or(0).max(5);
    let words = words(rows);
    let mut out = format!("{:width$} {:>6} {:>6}", "scene", "lights", "mode");
    for word in &words {
        let _ = write!(out, " {word:>7}");
    }
    for (heading, ..) in columns {
        let _ = write!(out, " {heading:>10}");
    }
    out.push('\n');
    for row in rows {
        let (lights, mode) = (number(row, "lights"), text(row, "mode"));
        let _ = write!(out, "{:width$} {lights:>6} {mode:>6}", text(row, "scene"));
        for word in &words {
            let _ = write!(out, " {:>7}", text(row, word));
        }
        for (_, key, factor, digits) in columns {
            let _ = write!(out, " {:>10.digits$}", number(row, key) * factor);
        }
        out.push('\n');
    }
    out
}

/// Keys of columns that are no numbers, where there are any.
fn words(rows: &[Stats]) -> Vec<&'static str> {
    ["updates", "rewalk"].into_iter().filter(|key| rows.iter().any(|row| row.contains_key(*key))).collect()
}

/// The table's columns under the keys of the JSON file.
fn csv(rows: &[Stats], columns: &[Column]) -> String {
    let words = words(rows);
    let sizes = ["width", "height"];
    let keys = words.iter().chain(&sizes).chain(columns.iter().map(|(_, key, ..)| key));
    let mut out = keys.fold(String::from("scene,lights,mode"), |out, key| out + "," + key);
    out.push('\n');
    for row in rows {
        // A path may hold commas and quotes.
        let scene = format!("\"{}\"", text(row, "scene").replace('"', "\"\""));
        let _ = write!(out, "{scene},{},{}", number(row, "lights"), text(row, "mode"));
        for word in &words {
            let _ = write!(out, ",{}", text(row, word));
        }
        for key in sizes.iter().chain(columns.iter().map(|(_, key, ..)| key)) {
            let _ = write!(out, ",{}", number(row, key));
        }
        out.push('\n');
    }
    out
}
