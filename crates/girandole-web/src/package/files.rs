//! Files of a build: copied, filled in, and put in place.

use anyhow::{Context, Result, bail};
use std::io::ErrorKind;
use std::path::Path;

/// What stands for the version in a package's description.
const NO_VERSION: &str = "\"version\": \"0.0.0\"";

/// Copies all files in and below a folder to another, which is made.
pub fn copy(from: &Path, to: &Path) -> Result<()> {
    std::fs::create_dir_all(to).with_context(|| format!("cannot make the folder {}", to.display()))?;
    let entries = from.read_dir().with_context(|| format!("cannot read the folder {}", from.display()))?;
    for entry in entries {
        let (path, target) = entry.map(|entry| (entry.path(), to.join(entry.file_name())))?;
        if path.is_dir() {
            copy(&path, &target)?;
        } else {
            std::fs::copy(&path, &target).with_context(|| format!("cannot copy {}", path.display()))?;
        }
    }
    Ok(())
}

/// Writes the version into a package's description.
pub fn fill_in_version(file: &Path, version: &str) -> Result<()> {
    let text = std::fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))?;
    if text.matches(NO_VERSION).count() != 1 {
        bail!("{} must have {NO_VERSION} once, for the version to be filled in", file.display());
    }
    let text = text.replace(NO_VERSION, &format!("\"version\": \"{version}\""));
    std::fs::write(file, text).with_context(|| format!("cannot write {}", file.display()))
}

/// Moves what is in a folder to another, where it replaces what has its name.
pub fn put_in_place(from: &Path, to: &Path) -> Result<()> {
    for entry in from.read_dir().with_context(|| format!("cannot read the folder {}", from.display()))? {
        let entry = entry?;
        let target = to.join(entry.file_name());
        if target.is_dir() {
            std::fs::remove_dir_all(&target)
                .with_context(|| format!("cannot replace the folder {}", target.display()))?;
        }
        std::fs::rename(entry.path(), &target)
            .with_context(|| format!("cannot write {}", target.display()))?;
    }
    Ok(())
}

/// Removes a file that need not be there.
pub fn remove_if_there(file: &Path) -> Result<()> {
    match std::fs::remove_file(file) {
        Err(error) if error.kind() != ErrorKind::NotFound => {
            Err(error).with_context(|| format!("cannot remove {}", file.display()))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_version_is_filled_in_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("package.json");
        std::fs::write(&file, "{ \"name\": \"girandole\", \"version\": \"0.0.0\" }").expect("a file");
        fill_in_version(&file, "1.2.3").expect("a version");
        let text = std::fs::read_to_string(&file).expect("a file");
        assert_eq!(text, "{ \"name\": \"girandole\", \"version\": \"1.2.3\" }");
        assert!(fill_in_version(&file, "1.2.4").is_err());
    }

    #[test]
    fn new_files_replace_old_ones_and_leave_others() {
        let [old, new] = [(); 2].map(|()| tempfile::tempdir().expect("a folder"));
        let write = |path: std::path::PathBuf, text: &str| {
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            std::fs::write(path, text).expect("a file");
        };
        write(old.path().join("page.js"), "old");
        write(old.path().join("other"), "other");
        write(old.path().join("package/stale"), "stale");
        write(new.path().join("page.js"), "new");
        write(new.path().join("package/girandole.js"), "new");
        put_in_place(new.path(), old.path()).expect("moved");
        let read = |name: &str| std::fs::read_to_string(old.path().join(name)).ok();
        assert_eq!(read("page.js").as_deref(), Some("new"));
        assert_eq!(read("other").as_deref(), Some("other"));
        assert_eq!(read("package/girandole.js").as_deref(), Some("new"));
        assert_eq!(read("package/stale"), None);
    }

    #[test]
    fn folders_are_copied_whole() {
        let [from, to] = [(); 2].map(|()| tempfile::tempdir().expect("a folder"));
        std::fs::create_dir(from.path().join("a")).expect("a folder");
        std::fs::write(from.path().join("a/b"), "b").expect("a file");
        copy(from.path(), &to.path().join("new")).expect("copied");
        assert_eq!(std::fs::read_to_string(to.path().join("new/a/b")).expect("a file"), "b");
        assert!(copy(&from.path().join("none"), to.path()).is_err());
        remove_if_there(&to.path().join("new/a/b")).expect("removed");
        remove_if_there(&to.path().join("new/a/b")).expect("gone already");
    }
}
