//! Files that several processes make together, each of them one process.

use super::{folder_of, unfinished};
use crate::{Error, Result};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

/// The right to make a file. It is a lock that goes with the process, on a file beside the one to be made, so
/// that no claim outlives whoever made it.
#[derive(Debug)]
pub struct Claim {
    path: PathBuf,
    _lock: File,
}

/// Whose a file is to make.
#[derive(Debug)]
pub enum Claimed {
    /// Ours.
    Mine(Claim),
    /// Another process's, and what it makes it by; empty where that cannot be read.
    Others(String),
}

impl Claim {
    /// Claims a file, unless another process has. `by` is told to other processes.
    ///
    /// # Errors
    /// [`Error::Write`] where nothing can be written beside the file.
    pub fn take(target: &Path, by: &str) -> Result<Claimed> {
        let path = claim_of(target);
        let taken = || loop {
            let mut file = open(&path)?;
            match file.try_lock() {
                Err(TryLockError::WouldBlock) => {
                    let mut text = String::new();
                    // Where locks are mandatory it cannot be read.
                    let _ = file.read_to_string(&mut text);
                    return Ok(Claimed::Others(text));
                }
                // Where there are no locks nothing is shared, and whatever is made twice is the same.
                Err(TryLockError::Error(_)) | Ok(()) => {}
            }
            // Whoever had it may have removed it after it was opened here.
            if path.exists() {
                return held(path.clone(), file, by).map(Claimed::Mine);
            }
        };
        taken().map_err(|source| Error::Write { path: path.clone(), source })
    }

    /// Claims a file as soon as no other process does.
    ///
    /// # Errors
    /// As [`Claim::take`].
    pub fn wait(target: &Path, by: &str) -> Result<Self> {
        let path = claim_of(target);
        let taken = || loop {
            let file = open(&path)?;
            let _ = file.lock();
            if path.exists() {
                return held(path.clone(), file, by);
            }
        };
        taken().map_err(|source| Error::Write { path: path.clone(), source })
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        let mut unfinished = unfinished();
        // Best effort: what stays is claimed by nobody, and taken over by the next.
        let _ = std::fs::remove_file(&self.path);
        unfinished.retain(|path| *path != self.path);
    }
}

fn open(path: &Path) -> std::io::Result<File> {
    OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)
}

fn held(path: PathBuf, mut file: File, by: &str) -> std::io::Result<Claim> {
    unfinished().push(path.clone());
    file.set_len(0)?;
    file.write_all(by.as_bytes())?;
    Ok(Claim { path, _lock: file })
}

fn claim_of(target: &Path) -> PathBuf {
    let name = target.file_name().unwrap_or_default().to_string_lossy();
    folder_of(target).join(format!(".{name}.claim"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_one_claim_at_a_time() {
        let folder = tempfile::tempdir().expect("a folder");
        let target = folder.path().join("f.png");
        // What a process left that is no longer there is nobody's.
        std::fs::write(claim_of(&target), "an old one, and longer than the next").expect("written");
        let Claimed::Mine(claim) = Claim::take(&target, "this").expect("a folder") else {
            panic!("it is free")
        };
        let Claimed::Others(by) = Claim::take(&target, "that").expect("a folder") else {
            panic!("it is taken")
        };
        assert!(by == "this" || by.is_empty() && cfg!(windows), "{by}");
        let other = std::thread::spawn({
            let target = target.clone();
            move || Claim::wait(&target, "that").map(drop)
        });
        std::thread::sleep(std::time::Duration::from_millis(50));
        assert!(!other.is_finished(), "it did not wait");
        drop(claim);
        other.join().expect("no panic").expect("claimed");
        assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 0);
        assert!(Claim::take(&folder.path().join("none/f.png"), "").is_err());
    }
}
