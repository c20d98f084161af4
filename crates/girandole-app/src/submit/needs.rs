//! What a worker needs: measured where a piece is rendered here first, else estimated.

use super::pieces::Pieces;
use crate::args::RenderArgs;
use crate::output::{Progress, say};
use crate::transfer::CACHE;
use anyhow::{Context, Result, bail};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// What is asked for beyond what was measured.
const ROOM: f64 = 1.3;
/// MiB, without pictures and shadow maps.
const BASE: f64 = 1024.0;
/// Bytes of a pixel: targets of a frame, sums of light sets.
const PIXEL: f64 = 160.0;
/// How often a child is asked how large it is.
const PAUSE: Duration = Duration::from_millis(20);

/// Of one worker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Needs {
    pub memory_mib: u64,
    pub cores: u32,
}

impl Needs {
    /// By the options alone.
    pub fn estimated(render: &RenderArgs) -> Self {
        let pixels = f64::from(render.size[0]) * f64::from(render.size[1]);
        let mib = BASE + f64::from(render.quality.memory) + pixels * PIXEL / f64::from(1 << 20);
        Self { memory_mib: (mib * ROOM) as u64, cores: 1 }
    }

    /// By the first frame, which is rendered here and stays, or by the first light set of the first region. What is kept for all is
    /// kept in the folder.
    ///
    /// # Errors
    /// Where that cannot be rendered.
    pub fn measured(render: &RenderArgs, pieces: &Pieces, folder: &Path) -> Result<Self> {
        let mut first = pieces.first(render);
        let trial = tempfile::tempdir().context("there is no temporary folder")?;
        if matches!(pieces, Pieces::Still { .. }) {
            first.output = trial.path().join("first.exr");
        }
        let words = shlex::split(&first.command_line()?).context("the options cannot be written down")?;
        let _progress = Progress::spinner("rendering a first piece, to see what workers need");
        let start = Instant::now();
        let mut command = Command::new(super::program()?);
        let child = command
            .args(&words[1..])
            .env(CACHE, folder.join("cache"))
            .stdin(Stdio::null())
            .stderr(Stdio::piped())
            .spawn();
        let (used, said) = watch(child.context("this program cannot be run")?)?;
        let seconds = start.elapsed().as_secs_f64();
        let Some(Used { peak_mib, busy_seconds }) = used else { return Ok(Self::estimated(render)) };
        let cores = (busy_seconds / seconds.max(1e-3)).round().max(1.0) as u32;
        let memory_mib = ((peak_mib * ROOM / 64.0).ceil() * 64.0) as u64;
        if !said.is_empty() {
            say(said.trim_end());
        }
        say(&format!(
            "the first piece took {seconds:.1} s, {peak_mib:.0} MiB and {busy_seconds:.1} s of processor time: workers ask for \
             {memory_mib} MiB and {cores} cores"
        ));
        Ok(Self { memory_mib, cores })
    }
}

/// What a process used.
struct Used {
    peak_mib: f64,
    busy_seconds: f64,
}

/// Waits for a child, and looks at what it uses where the system tells; and what it said.
fn watch(mut child: Child) -> Result<(Option<Used>, String)> {
    let stderr = child.stderr.take();
    let reader = std::thread::spawn(move || {
        stderr.and_then(|stderr| std::io::read_to_string(stderr).ok()).unwrap_or_default()
    });
    let mut used = None;
    let status = loop {
        used = usage(child.id()).or(used);
        match child.try_wait().context("the first piece is lost")? {
            Some(status) => break status,
            None => std::thread::sleep(PAUSE),
        }
    };
    let said = reader.join().unwrap_or_default();
    if !status.success() {
        bail!("the first piece cannot be rendered here: {}", said.trim().trim_start_matches("error: "));
    }
    Ok((used, said))
}

/// By Linux's /proc; `None` where there is none.
fn usage(process: u32) -> Option<Used> {
    let read = |file: &str| std::fs::read_to_string(format!("/proc/{process}/{file}")).ok();
    let status = read("status")?;
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: f64 = peak.split_whitespace().next()?.parse().ok()?;
    // After the program's name, which may hold anything, in parentheses: the state, and of what follows the eleventh and twelfth.
    let stat = read("stat")?;
    let fields: Vec<&str> = stat.rsplit(')').next()?.split_whitespace().collect();
    let ticks = |index: usize| fields.get(index)?.parse::<f64>().ok();
    // Linux counts in hundredths of seconds for whoever reads this.
    Some(Used { peak_mib: kib / 1024.0, busy_seconds: (ticks(11)? + ticks(12)?) / 100.0 })
}
