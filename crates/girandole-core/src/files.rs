//! Files, read whole and written whole or not at all.

mod claim;
#[cfg(any(test, target_family = "wasm"))]
mod held;
#[cfg(any(test, target_family = "wasm"))]
pub(crate) mod pictures;

pub use claim::{Claim, Claimed};
#[cfg(target_family = "wasm")]
pub use held::{gather, hold, release, take_written};
#[cfg(target_family = "wasm")]
pub use pictures::Decoded;

use crate::{Error, Result};
#[cfg(not(target_family = "wasm"))]
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
#[cfg(not(target_family = "wasm"))]
use tempfile::NamedTempFile;

/// Files that are there under their temporary names, and claims. Who holds it may make such files, name them, and
/// take them away.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Reads a file. Pipes and devices, which may have no end, are refused. In browsers it is one that is held.
///
/// # Errors
/// [`Error::Read`].
pub fn read(path: &Path) -> Result<Vec<u8>> {
    bytes(path).map_err(|source| Error::Read { path: path.into(), source })
}

#[cfg(not(target_family = "wasm"))]
pub(crate) fn bytes(path: &Path) -> std::io::Result<Vec<u8>> {
    let kind = std::fs::metadata(path)?;
    if !kind.is_file() && !kind.is_dir() {
        return Err(std::io::Error::other("it is a pipe or a device, not a file"));
    }
    std::fs::read(path)
}

#[cfg(target_family = "wasm")]
pub(crate) fn bytes(path: &Path) -> std::io::Result<Vec<u8>> {
    held::read(path)
}

/// Whether there is such a file.
#[cfg(any(feature = "import", test))]
pub(crate) fn is_file(path: &Path) -> bool {
    #[cfg(target_family = "wasm")]
    return held::is_file(path);
    #[cfg(not(target_family = "wasm"))]
    path.is_file()
}

/// Writes a file under another name in its folder, then gives it its name. If anything goes wrong, what was there
/// stays. A link stays one: what it leads to is written; and a file that was there keeps its permissions. In browsers it waits to be
/// taken by the page.
///
/// # Errors
/// [`Error::Write`].
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    #[cfg(target_family = "wasm")]
    held::write(path, bytes);
    #[cfg(not(target_family = "wasm"))]
    write_whole(path, bytes)?;
    Ok(())
}

#[cfg(not(target_family = "wasm"))]
fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let target = destination(path);
    let write = || {
        let mut file = temporary(folder_of(&target))?;
        let name = file.path().to_path_buf();
        let written = fill(&mut file, &target, bytes);
        let mut unfinished = unfinished();
        let written = written.and_then(|()| file.persist(&target).map_err(|error| error.error));
        unfinished.retain(|path| *path != name);
        written.map(|_| ())
    };
    write().map_err(|source| Error::Write { path: path.into(), source })
}

/// A file with a name of its own, which is removed unless it gets another one.
#[cfg(not(target_family = "wasm"))]
fn temporary(folder: &Path) -> std::io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".girandole.").suffix(".part");
    // As those of other files, not for this user alone.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut unfinished = unfinished();
    let file = builder.tempfile_in(folder)?;
    unfinished.push(file.path().into());
    Ok(file)
}

#[cfg(not(target_family = "wasm"))]
fn fill(file: &mut NamedTempFile, target: &Path, bytes: &[u8]) -> std::io::Result<()> {
    if let Ok(replaced) = std::fs::metadata(target) {
        file.as_file().set_permissions(replaced.permissions())?;
    }
    file.write_all(bytes)?;
    file.as_file().sync_all()
}

/// The folder that a file lies in.
pub fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Removes what is not written to its end, and lets nothing else be written: whoever tries waits. For programs
/// that were interrupted and end now.
pub fn abandon() {
    let unfinished = unfinished();
    for temporary in unfinished.iter() {
        // Best effort: there is nobody left to tell.
        let _ = std::fs::remove_file(temporary);
    }
    std::mem::forget(unfinished);
}

/// Where a file of this name is written: what it leads to, if it is a link.
pub fn destination(path: &Path) -> PathBuf {
    if !path.is_symlink() {
        return path.into();
    }
    std::fs::canonicalize(path).unwrap_or_else(|_| {
        // It leads to what is not there yet.
        let to = std::fs::read_link(path).unwrap_or_else(|_| path.into());
        path.parent().unwrap_or(Path::new("")).join(to)
    })
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::fs::{PermissionsExt, symlink};

    /// What lies in a folder.
    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).expect("a folder");
        let mut names: Vec<String> =
            entries.map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn links_are_followed_and_permissions_stay() {
        let folder = tempfile::tempdir().expect("a folder");
        let folder = folder.path();
        let [file, link, dangling] = ["file", "link", "dangling"].map(|name| folder.join(name));
        std::fs::write(&file, b"old").expect("written");
        std::fs::set_permissions(&file, PermissionsExt::from_mode(0o600)).expect("permissions");
        symlink("file", &link).expect("a link");
        symlink("later", &dangling).expect("a link");
        write(&link, b"new").expect("written");
        write(&dangling, b"first").expect("written");
        assert!(link.is_symlink() && dangling.is_symlink());
        assert_eq!(read(&file).expect("read"), b"new");
        assert_eq!(std::fs::metadata(&file).expect("there").permissions().mode() & 0o777, 0o600);
        assert_eq!(read(&folder.join("later")).expect("read"), b"first");
        assert_eq!(names(folder), ["dangling", "file", "later", "link"]);
    }

    #[test]
    fn what_cannot_be_written_leaves_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        let folder = folder.path();
        std::fs::create_dir(folder.join("folder")).expect("a folder");
        std::fs::write(folder.join("folder/inside"), b"").expect("written");
        for name in ["folder".to_owned(), "nowhere/file".into(), "n".repeat(300)] {
            assert!(matches!(write(&folder.join(&name), b"bytes"), Err(Error::Write { .. })), "{name}");
        }
        assert_eq!(names(folder), ["folder"]);
    }

    #[test]
    fn devices_are_not_read() {
        let error = read(Path::new("/dev/zero")).expect_err("it has no end");
        assert!(error.to_string().contains("device"), "{error}");
        assert!(read(Path::new("/nowhere")).is_err());
    }
}
