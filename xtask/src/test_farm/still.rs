//! A still on a farm: light sets of regions of it, joined by a job that waits for them; a worker dies.

use super::daemons::{Farm, Machine, WORKERS};
use super::{Setting, jobs, same_bytes};
use anyhow::{Context, Result, bail, ensure};
use std::path::Path;
use std::time::Duration;

/// Where the scripts, the parts and the logs are.
pub const FOLDER: &str = "its jobs";
/// Of the picture, and of the sets of each.
const PARTS: &str = "2x2";
const CHUNKS: &str = "4";
const TASKS: u32 = 16;
/// After that the program is at work, or about to be.
const AT_WORK: Duration = Duration::from_millis(500);

/// The options that divide the still.
pub fn options() -> Vec<&'static str> {
    [&super::still_options("16")[..], &["--regions", PARTS, "--pieces", CHUNKS, "--folder", FOLDER]].concat()
}

/// Runs it, and says what was seen.
pub fn run(setting: &Setting) -> Result<String> {
    let work = setting.work("a still on slurm")?;
    let logs = work.join(FOLDER);
    let mut farm = Farm::start(setting, "second-farm")?;
    let ids = jobs::submit(&farm, setting, &work, &options())?;
    let [job, join] = &ids[..] else { bail!("a still is two jobs, not {ids:?}") };
    let has_written =
        |task| Ok::<_, anyhow::Error>(jobs::log(&logs, job, task).unwrap_or_default().contains("wrote "));
    let killed = farm.wait_for_task(0, |task, seen| Ok(seen >= AT_WORK && !has_written(task)?))?;
    farm.kill_worker(0)?;
    ensure!(!has_written(killed)?, "task {killed} was killed too late");
    eprintln!("{} died at task {killed}", WORKERS[0]);
    farm.wait_until_down(0)?;
    farm.start_worker(0, Machine::Same)?;
    eprintln!("{} is back", WORKERS[0]);
    let tasks = jobs::wait(&farm, job, &logs)?;
    jobs::check_restarts(&tasks, TASKS as usize, killed)?;
    jobs::wait(&farm, join, &logs)?;
    same_still(&work, setting)?;
    // Each task wrote one part, and the one that was killed wrote none the first time.
    for task in tasks.iter().filter_map(|task| task.number) {
        let log = jobs::log(&logs, job, task)?;
        let parts = log.lines().filter(|line| line.starts_with("wrote ")).count();
        ensure!(parts == 1, "task {task} wrote {parts} parts: {log}");
    }
    let parts = parts(&logs)?;
    ensure!(parts == TASKS as usize, "{parts} parts are there instead of {TASKS}");
    Ok(format!(
        "{TASKS} parts make the still of one process to the byte; task {killed}, \
         during which a worker died, was done again"
    ))
}

/// Compares the still; the control: of fewer sets, it is another one.
pub fn same_still(work: &Path, setting: &Setting) -> Result<()> {
    let ours = work.join(super::STILL);
    ensure!(same_bytes(&ours, &setting.still)?, "the still is not what one process makes");
    ensure!(!same_bytes(&ours, &setting.coarse)?, "the control: fewer sets make the same still");
    Ok(())
}

/// Files `part-NNNN.exr` of a folder.
fn parts(folder: &Path) -> Result<usize> {
    let mut count = 0;
    for entry in std::fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))? {
        let name = entry?.file_name();
        let name = name.to_string_lossy();
        let number = name.strip_prefix("part-").and_then(|name| name.strip_suffix(".exr"));
        count += usize::from(number.is_some_and(|number| number.parse::<u32>().is_ok()));
    }
    Ok(count)
}
