//! Jobs in a farm: submitted by the program, waited for and asked about.

use super::daemons::Farm;
use super::{Setting, last_lines};
use anyhow::{Context, Result, bail, ensure};
use std::path::Path;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Until a job is done, workers that die and what waits for them included.
const DEADLINE: Duration = Duration::from_secs(480);
/// Nothing comes after these.
const ENDS: [&str; 7] =
    ["FAILED", "CANCELLED", "TIMEOUT", "OUT_OF_MEMORY", "BOOT_FAIL", "DEADLINE", "PREEMPTED"];

/// A job, or a task of an array; those of an array that were never started are one together.
#[derive(Debug, PartialEq)]
pub struct Task {
    /// In an array.
    pub number: Option<u32>,
    pub state: String,
    pub restarts: u32,
    reason: String,
}

impl Task {
    /// From a line of `scontrol show job --oneliner`.
    fn parse(line: &str) -> Option<Self> {
        let value = |key: &str| {
            line.split_whitespace()
                .find_map(|word| word.strip_prefix(key)?.strip_prefix('='))
                .map(str::to_owned)
        };
        Some(Self {
            number: value("ArrayTaskId").and_then(|number| number.parse().ok()),
            state: value("JobState")?,
            restarts: value("Restarts")?.parse().ok()?,
            reason: value("Reason")?,
        })
    }

    fn is_lost(&self) -> bool {
        ENDS.contains(&self.state.as_str()) || self.reason == "DependencyNeverSatisfied"
    }
}

/// Calls `girandole submit slurm` in a folder, and returns the jobs that it names.
pub fn submit(farm: &Farm, setting: &Setting, folder: &Path, options: &[&str]) -> Result<Vec<String>> {
    let mut command = farm.command(&setting.program.to_string_lossy());
    command.args(["submit", "slurm"]).args(options).current_dir(folder);
    let output = command.output().context("cannot run the program")?;
    let said = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "girandole submit slurm {}: {}", options.join(" "), said.trim());
    let printed = String::from_utf8_lossy(&output.stdout);
    let jobs: Vec<String> = printed.split_whitespace().map(str::to_owned).collect();
    let is_number = |job: &String| job.chars().all(|c| c.is_ascii_digit());
    ensure!(!jobs.is_empty() && jobs.iter().all(is_number), "not the numbers of jobs: {printed}");
    Ok(jobs)
}

/// Tasks of a job.
pub fn tasks(farm: &Farm, job: &str) -> Result<Vec<Task>> {
    let text = farm.ask(&["show", "job", job, "--oneliner"])?;
    let tasks: Vec<Task> = text.lines().filter_map(Task::parse).collect();
    ensure!(!tasks.is_empty(), "Slurm knows no job {job}");
    Ok(tasks)
}

/// Waits until all of a job is COMPLETED, and returns its tasks; says on the way how far it is.
pub fn wait(farm: &Farm, job: &str, logs: &Path) -> Result<Vec<Task>> {
    let start = Instant::now();
    let mut before = String::new();
    loop {
        let tasks = tasks(farm, job)?;
        let count = |state: &str| tasks.iter().filter(|task| task.state == state).count();
        let done = count("COMPLETED");
        let progress = format!("job {job}: {done} completed, {} running", count("RUNNING"));
        if progress != before {
            eprintln!("{progress} after {:.0} s", start.elapsed().as_secs_f64());
            before = progress;
        }
        if done == tasks.len() {
            return Ok(tasks);
        }
        let lost = tasks.iter().find(|task| task.is_lost());
        if lost.is_some() || start.elapsed() > DEADLINE {
            let what = lost.map_or("it takes too long".into(), |task| format!("{task:?}"));
            let nodes = farm.ask(&["show", "nodes", "--oneliner"])?;
            bail!("job {job} does not complete: {what}\n{nodes}\nits logs:\n{}", last_lines(logs, "log")?);
        }
        sleep(Duration::from_millis(500));
    }
}

/// That there are so many tasks, and that this one was started again and no other.
pub fn check_restarts(tasks: &[Task], count: usize, killed: u32) -> Result<()> {
    ensure!(tasks.len() == count, "there are {} tasks instead of {count}", tasks.len());
    for task in tasks {
        let is_killed = task.number == Some(killed);
        let is_well = if is_killed { task.restarts == 1 } else { task.restarts == 0 };
        ensure!(is_well, "task {killed} was killed, and this is one of them: {task:?}");
    }
    ensure!(tasks.iter().any(|task| task.number == Some(killed)), "no task has the number {killed}");
    Ok(())
}

/// What the task of an array said, started again or not.
pub fn log(logs: &Path, job: &str, task: u32) -> Result<String> {
    let path = logs.join(format!("{job}_{task}.log"));
    std::fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::{Task, check_restarts};

    fn task(number: Option<u32>, restarts: u32) -> Task {
        Task { number, state: "COMPLETED".into(), restarts, reason: "None".into() }
    }

    #[test]
    fn tasks_are_what_scontrol_prints() {
        let line = "JobId=3 ArrayJobId=1 ArrayTaskId=1 JobState=COMPLETED Reason=None Requeue=1 Restarts=1";
        assert_eq!(Task::parse(line), Some(task(Some(1), 1)));
        let never_started = line.replace("ArrayTaskId=1", "ArrayTaskId=3-8");
        assert_eq!(Task::parse(&never_started), Some(task(None, 1)));
        assert_eq!(Task::parse(""), None);
    }

    #[test]
    fn only_what_was_killed_starts_again() {
        let tasks = [task(Some(1), 1), task(Some(2), 0)];
        assert!(check_restarts(&tasks, 2, 1).is_ok());
        for (count, killed) in [(2, 2), (3, 1), (2, 3)] {
            assert!(check_restarts(&tasks, count, killed).is_err());
        }
    }
}
