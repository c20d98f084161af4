//! How large the files are, as they are and compressed.

use anyhow::{Context, Result};
use flate2::Compression;
use flate2::write::GzEncoder;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// A file's name below its folder, and its bytes as they are and as servers send them.
#[derive(Debug, PartialEq, Eq)]
pub struct Size {
    /// With `/` between folders.
    pub name: String,
    /// As it is.
    pub raw: u64,
    /// By gzip at its best.
    pub gzip: u64,
}

/// Of all files in and below a folder, by name.
pub fn of_folder(folder: &Path) -> Result<Vec<Size>> {
    let mut sizes = Vec::new();
    for file in files_below(folder)? {
        let bytes = std::fs::read(&file).with_context(|| format!("cannot read {}", file.display()))?;
        let name = file.strip_prefix(folder).unwrap_or(&file).components();
        let name: Vec<_> = name.map(|part| part.as_os_str().to_string_lossy()).collect();
        sizes.push(Size { name: name.join("/"), raw: bytes.len() as u64, gzip: compressed(&bytes)? });
    }
    sizes.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(sizes)
}

/// A line a file.
pub fn table(sizes: &[Size]) -> String {
    let width = sizes.iter().map(|size| size.name.chars().count()).max().unwrap_or(0).max(4);
    let mut text = format!("{:width$}  {:>12}  {:>12}\n", "file", "bytes", "by gzip");
    for Size { name, raw, gzip } in sizes {
        // Writing to a string does not fail.
        let _ = writeln!(text, "{name:width$}  {:>12}  {:>12}", grouped(*raw), grouped(*gzip));
    }
    text
}

fn files_below(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    let entries =
        folder.read_dir().with_context(|| format!("cannot read the folder {}", folder.display()))?;
    for entry in entries {
        let path = entry?.path();
        if path.is_dir() {
            files.extend(files_below(&path)?);
        } else {
            files.push(path);
        }
    }
    Ok(files)
}

fn compressed(bytes: &[u8]) -> Result<u64> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes)?;
    Ok(encoder.finish()?.len() as u64)
}

/// With a space between thousands.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let groups: Vec<&str> = digits
        .as_bytes()
        .rchunks(3)
        .rev()
        .map(|group| std::str::from_utf8(group).unwrap_or_default())
        .collect();
    groups.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_grouped() {
        assert_eq!(grouped(0), "0");
        assert_eq!(grouped(999), "999");
        assert_eq!(grouped(1_234_567), "1 234 567");
    }

    #[test]
    fn files_of_all_folders_are_listed_by_name() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::create_dir(folder.path().join("b")).expect("a folder");
        std::fs::write(folder.path().join("b/zeros"), [0; 10_000]).expect("a file");
        std::fs::write(folder.path().join("a"), b"a").expect("a file");
        let sizes = of_folder(folder.path()).expect("sizes");
        assert_eq!(
            sizes.iter().map(|s| (s.name.as_str(), s.raw)).collect::<Vec<_>>(),
            [("a", 1), ("b/zeros", 10_000)]
        );
        assert!(sizes[1].gzip < 100 && sizes[0].gzip > 1, "{sizes:?}");
        let table = table(&sizes);
        assert_eq!(table.lines().count(), 3);
        assert!(table.contains("10 000"), "{table}");
    }
}
