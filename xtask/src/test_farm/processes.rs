//! What runs in a farm: the environment of its processes names the farm's configuration and the worker.

use anyhow::{Context, Result};
use std::path::Path;
use std::process::{Command, Stdio};

/// Of Slurm, beside each task; it hides its environment.
const STEP: &str = "slurmstepd";

/// A process of a farm.
pub struct Running {
    pub pid: u32,
    parent: u32,
    environment: Vec<String>,
}

impl Running {
    /// Value of a variable of its environment.
    pub fn variable(&self, name: &str) -> Option<&str> {
        self.environment.iter().find_map(|line| line.strip_prefix(name)?.strip_prefix('='))
    }

    /// Whether it belongs to a task that runs on this worker.
    pub fn is_task_of(&self, worker: &str) -> bool {
        self.variable("SLURMD_NODENAME") == Some(worker) && self.variable("SLURM_JOB_ID").is_some()
    }
}

/// All processes with this configuration.
pub fn of_farm(configuration: &Path) -> Result<Vec<Running>> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir("/proc").context("cannot read /proc")? {
        let entry = entry?;
        let Some(pid) = entry.file_name().to_str().and_then(|name| name.parse().ok()) else { continue };
        // Processes of others, and those that ended meanwhile, cannot be read.
        let read = |name: &str| std::fs::read(entry.path().join(name)).ok();
        let (Some(environment), Some(status)) = (read("environ"), read("status")) else { continue };
        let environment: Vec<String> =
            environment.split(|b| *b == 0).map(|line| String::from_utf8_lossy(line).into_owned()).collect();
        let Some(parent) = parent(&String::from_utf8_lossy(&status)) else { continue };
        let process = Running { pid, parent, environment };
        if process.variable("SLURM_CONF").is_some_and(|value| Path::new(value) == configuration) {
            found.push(process);
        }
    }
    Ok(found)
}

/// Ends processes at once, and the Slurm steps that they are of.
pub fn kill(processes: &[&Running]) -> Result<()> {
    let steps = processes.iter().map(|process| process.parent).filter(|&pid| is_step(pid));
    let mut pids: Vec<u32> = steps.chain(processes.iter().map(|process| process.pid)).collect();
    pids.dedup();
    if pids.is_empty() {
        return Ok(());
    }
    // Some may have ended by themselves.
    Command::new("sh")
        .args(["-c", "kill -KILL \"$@\"", "sh"])
        .args(pids.iter().map(u32::to_string))
        .stderr(Stdio::null())
        .status()
        .context("cannot run sh")?;
    Ok(())
}

fn is_step(pid: u32) -> bool {
    std::fs::read_to_string(format!("/proc/{pid}/comm")).is_ok_and(|name| name.trim() == STEP)
}

/// The parent that a `/proc/PID/status` names.
fn parent(status: &str) -> Option<u32> {
    status.lines().find_map(|line| line.strip_prefix("PPid:"))?.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::parent;

    #[test]
    fn the_parent_of_a_process_is_found() {
        assert_eq!(parent("Name:\tgirandole\nPid:\t17\nPPid:\t12\n"), Some(12));
        assert_eq!(parent("Name:\tgirandole\n"), None);
    }
}
