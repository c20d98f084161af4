//! How much faster two workers are than one.

use super::daemons::{Cores, Farm};
use super::{FRAME_NAMES, Setting, frame_name, jobs, same_bytes};
use anyhow::{Context, Result, ensure};
use std::time::Instant;

/// Two workers are so many times as fast as one, at least.
const BOUND: f64 = 1.8;

/// Times a sequence by one process and by two workers, their start included, each with a core of its own.
pub fn run(setting: &Setting, frames: u32) -> Result<String> {
    let numbers = format!("0..{}", frames - 1);
    let options = ["pillars", "--size", "640x480", "--frames", &numbers, "-o", FRAME_NAMES];
    let alone = setting.work("alone")?;
    let start = Instant::now();
    let mut command = setting.command("taskset");
    command.args(["-c", "0"]).arg(&setting.program).arg("render").args(options).current_dir(&alone);
    let status = command.status().context("taskset does not start; install util-linux")?;
    ensure!(status.success(), "one worker failed");
    let one = start.elapsed().as_secs_f64();

    let together = setting.work("together")?;
    let mut farm = Farm::without_workers(setting, "third-farm", Cores::OneEach)?;
    let start = Instant::now();
    farm.start_workers()?;
    let options = [&options[..], &["--pieces", "2", "--estimate"]].concat();
    for job in jobs::submit(&farm, setting, &together, &options)? {
        jobs::wait(&farm, &job, &together.join("girandole-farm"))?;
    }
    let two = start.elapsed().as_secs_f64();

    for frame in 0..frames {
        let name = frame_name(frame);
        let is_same = same_bytes(&alone.join(&name), &together.join(&name))?;
        ensure!(is_same, "{name} is not what one worker makes");
    }
    let ratio = one / two;
    let said =
        format!("{frames} frames take one worker {one:.1} s and two {two:.1} s: {ratio:.2} times as fast");
    ensure!(ratio >= BOUND, "{said}, and at least {BOUND} is asked");
    Ok(said)
}
