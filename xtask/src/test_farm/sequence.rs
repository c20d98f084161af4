//! A sequence on a farm: a worker dies in the middle of a piece, and no frame is made twice.

use super::daemons::{Farm, Machine, WORKERS};
use super::{FRAMES, Setting, frame_name, jobs, same_bytes};
use anyhow::{Result, bail, ensure};
use std::collections::BTreeMap;
use std::path::Path;
use std::thread::sleep;
use std::time::{Duration, SystemTime};

const PIECES: u32 = 8;
/// Less than Slurm takes to see that a worker is dead (10 s), more than a task may take to start (6 s).
const AWAY: Duration = Duration::from_secs(7);

/// Runs it, and says what was seen.
pub fn run(setting: &Setting) -> Result<String> {
    let work = setting.work("a sequence on slurm")?;
    let logs = work.join("girandole-farm");
    let mut farm = Farm::start(setting, "first-farm")?;
    let pieces = PIECES.to_string();
    let mut options = super::sequence_options();
    options.extend(["--pieces", &pieces]);
    let ids = jobs::submit(&farm, setting, &work, &options)?;
    let [job] = &ids[..] else { bail!("a sequence is one job, not {ids:?}") };
    // At least one frame is there, and at least two are missing.
    let killed = farm.wait_for_task(0, |piece, _| {
        let there = present(&work, piece)?.len();
        Ok(there > 0 && there + 2 <= (FRAMES / PIECES) as usize)
    })?;
    farm.kill_worker(0)?;
    let there = present_of(&work, 0..FRAMES)?;
    let of_killed = present(&work, killed)?.len();
    let all = FRAMES / PIECES;
    eprintln!("{} died when {of_killed} of {all} frames of piece {killed} were there", WORKERS[0]);
    sleep(AWAY);
    farm.start_worker(0, Machine::Rebooted)?;
    eprintln!("{} is back", WORKERS[0]);
    let tasks = jobs::wait(&farm, job, &logs)?;
    jobs::check_restarts(&tasks, PIECES as usize, killed)?;
    same_frames(&work, &setting.frames)?;
    // Frames that were there when the worker died are those files still.
    let after = present_of(&work, 0..FRAMES)?;
    for (frame, when) in &there {
        ensure!(after.get(frame) == Some(when), "frame {frame} was made again");
    }
    let written = written(&logs, job)?;
    ensure!(
        written as usize + of_killed == FRAMES as usize,
        "the tasks wrote {written} frames, and {of_killed} were of the one that died: that is not {FRAMES}"
    );
    Ok(format!(
        "{FRAMES} frames in {PIECES} pieces are those of one process; a worker died in the middle of piece \
         {killed}, of which {of_killed} of {all} were there and were kept, and none was written twice"
    ))
}

/// Compares all frames; the control: another frame is another picture.
pub fn same_frames(ours: &Path, theirs: &Path) -> Result<()> {
    for frame in 0..FRAMES {
        let name = frame_name(frame);
        ensure!(same_bytes(&ours.join(&name), &theirs.join(&name))?, "{name} is not what one process makes");
    }
    let is_same = same_bytes(&ours.join(frame_name(1)), &theirs.join(frame_name(0)))?;
    ensure!(!is_same, "the control: two frames are the same");
    Ok(())
}

/// Frames of a piece that are there, and when they were written.
fn present(work: &Path, piece: u32) -> Result<BTreeMap<u32, SystemTime>> {
    ensure!((1..=PIECES).contains(&piece), "there is no piece {piece}");
    present_of(work, (piece - 1..FRAMES).step_by(PIECES as usize))
}

fn present_of(work: &Path, frames: impl Iterator<Item = u32>) -> Result<BTreeMap<u32, SystemTime>> {
    let mut there = BTreeMap::new();
    for frame in frames {
        if let Ok(file) = work.join(frame_name(frame)).metadata() {
            there.insert(frame, file.modified()?);
        }
    }
    Ok(there)
}

/// How many frames the tasks that came to their end say that they wrote.
fn written(logs: &Path, job: &str) -> Result<u32> {
    let mut sum = 0;
    for piece in 1..=PIECES {
        let log = jobs::log(logs, job, piece)?;
        let counts: Vec<[u32; 2]> = log.lines().filter_map(counts).collect();
        let [[written, all]] = counts[..] else {
            bail!("the log of piece {piece} does not say once how many frames were written: {log}")
        };
        ensure!(all == FRAMES / PIECES, "piece {piece} has {all} frames");
        sum += written;
    }
    Ok(sum)
}

/// N and M of `wrote N of M frames`.
fn counts(line: &str) -> Option<[u32; 2]> {
    let (written, rest) = line.strip_prefix("wrote ")?.split_once(" of ")?;
    let (all, _) = rest.split_once(" frames")?;
    Some([written.parse().ok()?, all.parse().ok()?])
}

#[cfg(test)]
mod tests {
    use super::counts;

    #[test]
    fn frames_that_were_written_are_counted() {
        assert_eq!(
            counts("wrote 3 of 5 frames, 2 were there to f.####.exr (160×120): pillars"),
            Some([3, 5])
        );
        assert_eq!(counts("wrote part.exr (160×120): 4 of 5 frames"), None);
    }
}
