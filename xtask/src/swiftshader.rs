//! SwiftShader, a second software device: Debian's chromium brings it.

use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};

/// Where distributions put what tells the Vulkan loader of it.
const PLACES: [&str; 5] = [
    "/usr/lib/chromium/vk_swiftshader_icd.json",
    "/usr/lib/chromium-browser/vk_swiftshader_icd.json",
    "/usr/lib64/chromium-browser/vk_swiftshader_icd.json",
    "/opt/google/chrome/vk_swiftshader_icd.json",
    "/snap/chromium/current/usr/lib/chromium-browser/vk_swiftshader_icd.json",
];

/// The smallest set of tests of pictures that covers its kernels: all modes, edges, what is let through, and pairs of pixel and light one by
/// one.
pub const TESTS: [&str; 5] = [
    "device::oracle_pair_by_pair",
    "device::oracle_punctual_lights",
    "device::full_is_close_to_naive",
    "device::same_bytes_twice_and_in_any_batch",
    "device::what_is_seen_through_is_the_oracles",
];

/// The file that tells the Vulkan loader of it: the one that `GIRANDOLE_SWIFTSHADER` names, or the first that is there.
pub fn driver() -> Result<PathBuf> {
    if let Some(named) = std::env::var_os("GIRANDOLE_SWIFTSHADER") {
        let named = PathBuf::from(named);
        return checked(&named).with_context(|| format!("GIRANDOLE_SWIFTSHADER={}", named.display()));
    }
    match PLACES.iter().find(|place| Path::new(place).is_file()) {
        Some(place) => checked(Path::new(place)),
        None => bail!(
            "SwiftShader is not there; install chromium (Debian, Ubuntu, Fedora), or name its vk_swiftshader_icd.json by \
             GIRANDOLE_SWIFTSHADER"
        ),
    }
}

/// Whether the file names a library that is there: paths in it are relative to it.
fn checked(file: &Path) -> Result<PathBuf> {
    let text = std::fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))?;
    let library = library(&text).with_context(|| format!("{} names no library_path", file.display()))?;
    let library = file.parent().unwrap_or(Path::new("/")).join(library);
    if !library.is_file() {
        bail!("{} is missing, which {} names; install chromium anew", library.display(), file.display());
    }
    Ok(file.to_owned())
}

/// What follows `"library_path":` in quotes.
fn library(text: &str) -> Option<&str> {
    let (_, rest) = text.split_once("\"library_path\"")?;
    rest.split('"').nth(1)
}

#[cfg(test)]
mod tests {
    use super::library;

    #[test]
    fn the_library_of_a_driver_is_found() {
        let text = r#"{"file_format_version": "1.0.0", "ICD": {"library_path": "./libvk_swiftshader.so", "api_version": "1.0.5"}}"#;
        assert_eq!(library(text), Some("./libvk_swiftshader.so"));
        assert_eq!(library("{}"), None);
    }
}
