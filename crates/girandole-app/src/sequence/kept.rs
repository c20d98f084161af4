//! Frames that are there, and those that other processes make.

use crate::args::{Frames, RenderArgs};
use crate::output::say;
use crate::provenance::{FIRST, Maker, There, there, what_differs};
use anyhow::{Context, Result, bail};
use girandole_core::files::{Claim, Claimed, folder_of};
use girandole_core::scene::Scene;
use girandole_reference::Provenance;
use rayon::prelude::*;
use std::collections::{BTreeSet, VecDeque};
use std::path::{Path, PathBuf};

/// A frame and its file.
pub struct Frame {
    pub number: u32,
    pub path: PathBuf,
    pub made_by: Provenance,
}

impl Frame {
    fn new(number: u32, pattern: &Path, (scene, maker): (&Scene, &Maker)) -> Result<Self> {
        let path = Frames::file(pattern, number).context("the name has no run of # for the number")?;
        Ok(Self { number, path, made_by: maker.frame(scene, number)? })
    }
}

/// The numbers of those frames that have to be rendered, where nothing of the sequence's names is of something else.
pub fn missing(args: &RenderArgs, made: (&Scene, &Maker), frames: Frames) -> Result<Vec<u32>> {
    let is_ours = |number: &u32| args.piece.has(frames, *number);
    let look = |&number: &u32| {
        let frame = Frame::new(number, &args.output, made)?;
        let there = there(&frame.path, &frame.made_by);
        Ok((frame, there))
    };
    let there = numbers_there(&args.output)?;
    let found = there.par_iter().filter(|number| is_ours(number)).map(look).collect::<Result<Vec<_>>>()?;
    let is_asked_for = |frame: &Frame| (frames.first..=frames.last).contains(&frame.number);
    let mut kept = BTreeSet::new();
    let mut others = Vec::new();
    for (frame, there) in &found {
        match there {
            There::Picture => drop(kept.insert(frame.number)),
            There::Folder if is_asked_for(frame) => return refuse_folder(frame),
            There::Other(why) if !(args.motion.overwrite && is_asked_for(frame)) => others.push((frame, why)),
            _ => {}
        }
    }
    if let Some((frame, why)) = others.first() {
        let more = match others.len() - 1 {
            0 => String::new(),
            n => format!(" (and {n} more)"),
        };
        let what = format!("{} is no frame of this sequence: {why}{more}", frame.path.display());
        if !args.motion.overwrite {
            bail!("{what}; give another name, or --overwrite to replace it");
        }
        say(&format!("warning: {what}; it is beyond the frames {frames}, and stays as it is"));
    }
    Ok(frames.iter().filter(|number| is_ours(number) && !kept.contains(number)).collect())
}

/// Whether a frame is there by now; what else is there may be replaced or not.
pub fn is_there(frame: &Frame, overwrite: bool) -> Result<bool> {
    match there(&frame.path, &frame.made_by) {
        There::Picture => Ok(true),
        There::Folder => refuse_folder(frame),
        There::Other(why) if !overwrite => {
            bail!(
                "{} came while this sequence was rendered, and is no frame of it: {why}",
                frame.path.display()
            )
        }
        There::Nothing | There::Other(_) => Ok(false),
    }
}

fn refuse_folder<T>(frame: &Frame) -> Result<T> {
    bail!("{} is a folder; move it away, or give the frames another name", frame.path.display())
}

/// The numbers of all files that are named like frames, in order.
fn numbers_there(pattern: &Path) -> Result<Vec<u32>> {
    let folder = folder_of(pattern);
    let entries =
        std::fs::read_dir(folder).with_context(|| format!("cannot read the folder {}", folder.display()))?;
    let number = |entry: std::io::Result<std::fs::DirEntry>| {
        Frames::number(pattern, entry.ok()?.file_name().to_str()?)
    };
    let mut numbers: Vec<u32> = entries.filter_map(number).collect();
    numbers.sort_unstable();
    Ok(numbers)
}

/// Frames that are claimed one after the other: first those that no other process renders.
pub struct Claims {
    /// And whether it is worth to wait for another process.
    left: VecDeque<(u32, bool)>,
    has_waited: bool,
}

impl Claims {
    /// In their order, where that counts.
    pub fn new(frames: Vec<u32>, in_order: bool) -> Self {
        Self { left: frames.into_iter().map(|frame| (frame, in_order)).collect(), has_waited: false }
    }

    /// The next frame, which no other process makes as long as the claim is held.
    pub fn next(&mut self, pattern: &Path, made: (&Scene, &Maker)) -> Result<Option<(Frame, Claim)>> {
        while let Some((number, waits)) = self.left.pop_front() {
            let frame = Frame::new(number, pattern, made)?;
            let by = frame.made_by.to_json();
            let others = match Claim::take(&frame.path, &by)? {
                Claimed::Mine(claim) => return Ok(Some((frame, claim))),
                Claimed::Others(others) => Provenance::from_json(&others),
            };
            if let Some(difference) = others.and_then(|others| frame.made_by.difference(&others, &FIRST)) {
                bail!(
                    "another process renders something else to {}: {}; give another name",
                    frame.path.display(),
                    what_differs(&difference)
                );
            }
            if !waits {
                self.left.push_back((number, true));
                continue;
            }
            if !std::mem::replace(&mut self.has_waited, true) {
                say(&format!("another process renders {}, too", frame.path.display()));
            }
            let claim = Claim::wait(&frame.path, &by)?;
            return Ok(Some((frame, claim)));
        }
        Ok(None)
    }
}
