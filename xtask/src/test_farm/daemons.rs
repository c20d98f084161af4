//! A farm of its own: munged, slurmctld and two slurmd of this user, in one folder, no systemd, no cgroups.

use super::processes::{self, Running};
use super::{PATIENCE, Setting, last_lines};
use anyhow::{Context, Result, bail, ensure};
use std::fs::File;
use std::io::Read;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

pub const WORKERS: [&str; 2] = ["worker1", "worker2"];

/// Programs of Slurm that a farm needs.
pub const PROGRAMS: [&str; 6] = ["slurmctld", "slurmd", "munged", "sbatch", "scontrol", "munge"];

/// Where a worker runs.
#[derive(Clone, Copy, PartialEq)]
pub enum Cores {
    /// Wherever the system likes.
    Any,
    /// Each on its own core: the first on 0, the second on 1.
    OneEach,
}

/// What a worker says of its machine.
#[derive(Clone, Copy, PartialEq)]
pub enum Machine {
    /// That it runs as before.
    Same,
    /// That it was started anew, so that nothing of what it did goes on.
    Rebooted,
}

/// Daemons that run; dropping it ends them, and all that they run.
pub struct Farm<'a> {
    setting: &'a Setting,
    folder: PathBuf,
    configuration: PathBuf,
    cores: Cores,
    daemons: Vec<Child>,
    workers: [Option<Child>; 2],
}

impl<'a> Farm<'a> {
    /// A farm with two workers that wait for work.
    pub fn start(setting: &'a Setting, name: &str) -> Result<Self> {
        let mut farm = Self::without_workers(setting, name, Cores::Any)?;
        farm.start_workers()?;
        Ok(farm)
    }

    /// A farm in a folder of this name, that has a controller only.
    pub fn without_workers(setting: &'a Setting, name: &str, cores: Cores) -> Result<Self> {
        let folder = setting.folder.path().join(name);
        let configuration = folder.join("slurm.conf");
        for part in ["state", "spool-worker1", "spool-worker2"] {
            std::fs::create_dir_all(folder.join(part))?;
        }
        std::fs::write(folder.join("plugstack.conf"), "")?;
        std::fs::write(&configuration, text(&folder, free_ports()?)?)?;
        write_key(&folder.join("munge.key"))?;
        let mut farm =
            Self { setting, folder, configuration, cores, daemons: Vec::new(), workers: [None, None] };
        let socket = farm.path("munge.socket");
        let munged = farm.daemon("munged", |c| {
            // By force: nobody else uses it, so that its folder need not be open to others.
            c.args(["--foreground", "--force", "--socket", &socket]);
            for (option, name) in
                [("--key-file", "munge.key"), ("--pid-file", "munged.pid"), ("--seed-file", "munged.seed")]
            {
                c.arg(option).arg(farm.path(name));
            }
        })?;
        farm.daemons.push(munged);
        farm.wait_until("munged answers", |farm| {
            succeeds(farm.command("munge").args(["--no-input", "--socket", &socket]))
        })?;
        let controller = farm.daemon("slurmctld", |c| {
            c.args(["-D", "-i"]);
        })?;
        farm.daemons.push(controller);
        farm.wait_until("slurmctld answers", |farm| {
            let said = farm.command("scontrol").arg("ping").output()?.stdout;
            Ok(String::from_utf8_lossy(&said).contains(" UP"))
        })?;
        Ok(farm)
    }

    /// Starts both workers, and waits until they are there.
    pub fn start_workers(&mut self) -> Result<()> {
        for index in 0..WORKERS.len() {
            self.start_worker(index, Machine::Same)?;
        }
        self.wait_until("two workers are idle", |farm| {
            Ok(farm.ask(&["show", "nodes", "--oneliner"])?.matches(" State=IDLE ").count() == WORKERS.len())
        })
    }

    /// Starts a worker that is not there.
    pub fn start_worker(&mut self, index: usize, machine: Machine) -> Result<()> {
        let name = WORKERS[index];
        let worker = self.daemon(name, |c| {
            c.args(["-D", "-N", name]).args((machine == Machine::Rebooted).then_some("-b"));
        })?;
        self.workers[index] = Some(worker);
        Ok(())
    }

    /// Ends a worker and all that runs on it, as if its machine lost power.
    pub fn kill_worker(&mut self, index: usize) -> Result<()> {
        let mut worker = self.workers[index].take().context("the worker is dead already")?;
        worker.kill()?;
        let all = processes::of_farm(&self.configuration)?;
        let its: Vec<&Running> = all.iter().filter(|p| p.is_task_of(WORKERS[index])).collect();
        processes::kill(&its)?;
        worker.wait()?;
        Ok(())
    }

    /// Waits until the controller knows that a worker is dead.
    pub fn wait_until_down(&mut self, index: usize) -> Result<()> {
        self.wait_until(&format!("slurmctld takes {} for dead", WORKERS[index]), |farm| {
            Ok(farm.ask(&["show", "node", WORKERS[index], "--oneliner"])?.contains(" State=DOWN"))
        })
    }

    /// Number of the array task that runs on a worker, once `is_midway` says so of it and its age.
    pub fn wait_for_task(
        &self,
        index: usize,
        mut is_midway: impl FnMut(u32, Duration) -> Result<bool>,
    ) -> Result<u32> {
        let start = Instant::now();
        let mut seen: Option<(u32, Instant)> = None;
        while start.elapsed() < PATIENCE {
            let all = processes::of_farm(&self.configuration)?;
            let task = all
                .iter()
                .filter(|process| process.is_task_of(WORKERS[index]))
                .find_map(|process| process.variable("SLURM_ARRAY_TASK_ID")?.parse().ok());
            seen = task.map(|task| match seen {
                Some((before, since)) if before == task => (task, since),
                _ => (task, Instant::now()),
            });
            if let Some((task, since)) = seen
                && is_midway(task, since.elapsed())?
            {
                return Ok(task);
            }
            sleep(Duration::from_millis(10));
        }
        bail!("no task on {} was seen at work", WORKERS[index])
    }

    /// A command that finds this farm and the program under test, and no other farm.
    pub fn command(&self, program: &str) -> Command {
        let mut command = self.setting.command(program);
        command.env("SLURM_CONF", &self.configuration);
        command
    }

    /// What `scontrol` prints; asked again for a while, as a busy machine may answer late.
    pub fn ask(&self, words: &[&str]) -> Result<String> {
        let start = Instant::now();
        loop {
            let output = self.command("scontrol").args(words).output().context("cannot run scontrol")?;
            if output.status.success() {
                return Ok(String::from_utf8_lossy(&output.stdout).into_owned());
            }
            let said = String::from_utf8_lossy(&output.stderr);
            ensure!(start.elapsed() < PATIENCE, "scontrol {} failed: {}", words.join(" "), said.trim());
            sleep(Duration::from_secs(1));
        }
    }

    fn daemon(&self, name: &str, arguments: impl FnOnce(&mut Command)) -> Result<Child> {
        let worker = WORKERS.iter().position(|worker| *worker == name);
        let mut command = match (self.cores, worker) {
            (Cores::OneEach, Some(core)) => {
                let mut command = self.command("taskset");
                command.args(["-c", &core.to_string(), "slurmd"]);
                command
            }
            (_, Some(_)) => self.command("slurmd"),
            (_, None) => self.command(name),
        };
        arguments(&mut command);
        let said = File::options().create(true).append(true).open(self.folder.join(format!("{name}.out")))?;
        command
            .stdin(Stdio::null())
            .stdout(said.try_clone()?)
            .stderr(said)
            .current_dir(&self.folder)
            .spawn()
            .with_context(|| format!("{name} does not start"))
    }

    /// Waits; a daemon that ends meanwhile is an error.
    fn wait_until(&mut self, what: &str, is_so: impl Fn(&Self) -> Result<bool>) -> Result<()> {
        let start = Instant::now();
        while !is_so(self)? {
            let ended = |daemon: &mut Child| daemon.try_wait().is_ok_and(|status| status.is_some());
            let mut all = self.daemons.iter_mut().chain(self.workers.iter_mut().flatten());
            let has_ended = all.any(ended);
            if has_ended || start.elapsed() > PATIENCE {
                bail!("waited in vain until {what}; the daemons say:\n{}", last_lines(&self.folder, "out")?);
            }
            sleep(Duration::from_millis(100));
        }
        Ok(())
    }

    fn path(&self, name: &str) -> String {
        self.folder.join(name).to_string_lossy().into_owned()
    }
}

impl Drop for Farm<'_> {
    fn drop(&mut self) {
        // Workers first, so that nothing is started again.
        let all = self.workers.iter_mut().filter_map(Option::take).chain(self.daemons.drain(..).rev());
        for mut daemon in all.collect::<Vec<_>>() {
            let _ = daemon.kill();
            let _ = daemon.wait();
        }
        if let Ok(rest) = processes::of_farm(&self.configuration) {
            let _ = processes::kill(&rest.iter().collect::<Vec<_>>());
        }
    }
}

fn succeeds(command: &mut Command) -> Result<bool> {
    Ok(command.stdout(Stdio::null()).stderr(Stdio::null()).status()?.success())
}

/// Ports that nothing listens at: of the controller and the two workers.
fn free_ports() -> Result<[u16; 3]> {
    let listeners = [(); 3].map(|()| TcpListener::bind("127.0.0.1:0"));
    let mut ports = [0; 3];
    for (port, listener) in ports.iter_mut().zip(&listeners) {
        let listener = listener.as_ref().ok().context("no port is free")?;
        *port = listener.local_addr()?.port();
    }
    Ok(ports)
}

/// A key that only this user can read.
fn write_key(path: &Path) -> Result<()> {
    let mut key = [0; 128];
    File::open("/dev/urandom")?.read_exact(&mut key)?;
    std::fs::write(path, "")?;
    for (mode, is_last) in [("0600", false), ("0400", true)] {
        if is_last {
            std::fs::write(path, key)?;
        }
        let done = Command::new("chmod").arg(mode).arg(path).status()?.success();
        ensure!(done, "cannot change the mode of {}", path.display());
    }
    Ok(())
}

/// The configuration.
fn text(folder: &Path, [controller, first, second]: [u16; 3]) -> Result<String> {
    let host = std::fs::read_to_string("/proc/sys/kernel/hostname").context("this machine has no name")?;
    let host = host.trim().split('.').next().unwrap_or_default();
    let user = Command::new("id").arg("-un").output()?.stdout;
    let user = String::from_utf8_lossy(&user);
    Ok(include_str!("slurm.conf")
        .replace("@HOST@", host)
        .replace("@USER@", user.trim())
        .replace("@FOLDER@", &folder.to_string_lossy())
        .replace("@PORT@", &controller.to_string())
        .replace("@PORT1@", &first.to_string())
        .replace("@PORT2@", &second.to_string()))
}
