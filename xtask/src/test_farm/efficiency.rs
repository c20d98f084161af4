//! How much faster two workers are than one.

use super::daemons::{Cores, Farm};
use super::{FRAME_NAMES, Setting, frame_name, jobs, same_bytes};
use anyhow::{Context, Result, ensure};
use std::path::PathBuf;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Two workers are so many times as fast as one, at least.
const BOUND: f64 = 1.8;
/// Until the frames are there.
const DEADLINE: Duration = Duration::from_secs(400);

/// Times a sequence by one process and by two workers, their start included, each with a core of its own. One process does it
/// before and after, as a machine that others work on is not as fast all the time.
pub fn run(setting: &Setting, frames: u32) -> Result<String> {
    let numbers = format!("0..{}", frames - 1);
    let options = ["pillars", "--size", "640x480", "--frames", &numbers, "-o", FRAME_NAMES];
    let (alone, before) = by_one(setting, "alone", &options)?;
    let together = setting.work("together")?;
    let mut farm = Farm::without_workers(setting, "third-farm", Cores::OneEach)?;
    let start = Instant::now();
    farm.start_workers()?;
    let in_pieces = [&options[..], &["--pieces", "2", "--estimate"]].concat();
    let jobs = jobs::submit(&farm, setting, &together, &in_pieces)?;
    // Asking Slurm takes a share of a core, looking for files does not.
    while !(0..frames).all(|frame| together.join(frame_name(frame)).is_file()) && start.elapsed() < DEADLINE {
        sleep(Duration::from_millis(100));
    }
    for job in jobs {
        jobs::wait(&farm, &job, &together.join("girandole-farm"))?;
    }
    let two = start.elapsed().as_secs_f64();
    drop(farm);
    let (_, after) = by_one(setting, "alone again", &options)?;

    for frame in 0..frames {
        let name = frame_name(frame);
        let is_same = same_bytes(&alone.join(&name), &together.join(&name))?;
        ensure!(is_same, "{name} is not what one worker makes");
    }
    let ratio = (before + after) / 2.0 / two;
    let said = format!(
        "{frames} frames take one worker {before:.1} s before and {after:.1} s after, and two {two:.1} s: {ratio:.2} times as fast"
    );
    ensure!(ratio >= BOUND, "{said}, and at least {BOUND} is asked");
    Ok(said)
}

/// The sequence by one process on one core: its folder, and seconds.
fn by_one(setting: &Setting, name: &str, options: &[&str]) -> Result<(PathBuf, f64)> {
    let folder = setting.work(name)?;
    let start = Instant::now();
    let mut command = setting.command("taskset");
    command.args(["-c", "0"]).arg(&setting.program).arg("render").args(options).current_dir(&folder);
    let status = command.status().context("taskset does not start; install util-linux")?;
    ensure!(status.success(), "one worker failed");
    Ok((folder, start.elapsed().as_secs_f64()))
}
