//! Which crates of the workspace are published, as `cargo metadata` has it.

use crate::cargo;
use anyhow::{Context, Result, bail};
use serde_json::Value;
use std::path::PathBuf;

pub struct Workspace {
    published: Vec<Package>,
    pub target: PathBuf,
}

struct Package {
    name: String,
    rust_version: Option<String>,
    is_library: bool,
}

impl Workspace {
    pub fn read() -> Result<Self> {
        let mut command = cargo();
        let output = command.args(["metadata", "--format-version", "1", "--no-deps", "--locked"]).output()?;
        if !output.status.success() {
            bail!("cargo metadata fails: {}", String::from_utf8_lossy(&output.stderr).trim());
        }
        Self::from_json(&serde_json::from_slice(&output.stdout)?)
            .context("cargo metadata tells of no packages")
    }

    fn from_json(metadata: &Value) -> Option<Self> {
        let packages = metadata["packages"].as_array()?.iter();
        // `publish = false` is an empty list of registries.
        let published = packages.filter(|package| package["publish"].is_null());
        let published: Option<Vec<Package>> = published.map(Package::from_json).collect();
        Some(Self { published: published?, target: metadata["target_directory"].as_str()?.into() })
    }

    /// Arguments of cargo that choose them.
    pub fn published(&self) -> Vec<&str> {
        self.published.iter().flat_map(|package| ["--package", &package.name]).collect()
    }

    /// Those of them that have an interface.
    pub fn published_libraries(&self) -> Vec<&str> {
        let libraries = self.published.iter().filter(|package| package.is_library);
        libraries.flat_map(|package| ["--package", &package.name]).collect()
    }

    /// The one that all of them name.
    pub fn rust_version(&self) -> Result<&str> {
        let mut versions = self.published.iter().map(|package| package.rust_version.as_deref());
        let first = versions.next().flatten().context("no published crate names a rust-version")?;
        if !versions.all(|version| version == Some(first)) {
            bail!("the published crates name different rust-versions");
        }
        Ok(first)
    }
}

impl Package {
    fn from_json(package: &Value) -> Option<Self> {
        let is_library =
            |target: &Value| target["kind"].as_array().is_some_and(|k| k.contains(&"lib".into()));
        Some(Self {
            name: package["name"].as_str()?.to_owned(),
            rust_version: package["rust_version"].as_str().map(str::to_owned),
            is_library: package["targets"].as_array()?.iter().any(is_library),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::Workspace;
    use serde_json::json;

    fn workspace(rust_version: &str) -> Workspace {
        let package = |name: &str, kind: &str, publish| json!({"name": name, "publish": publish, "rust_version": "1.95", "targets": [{"kind": [kind]}]});
        let mut program = package("program", "bin", json!(null));
        program["rust_version"] = rust_version.into();
        let packages = [package("library", "lib", json!(null)), program, package("task", "bin", json!([]))];
        let metadata = json!({"target_directory": "target", "packages": packages});
        Workspace::from_json(&metadata).expect("packages")
    }

    #[test]
    fn what_is_published_is_told_from_what_is_not() {
        let workspace = workspace("1.95");
        assert_eq!(workspace.published(), ["--package", "library", "--package", "program"]);
        assert_eq!(workspace.published_libraries(), ["--package", "library"]);
    }

    #[test]
    fn there_is_one_rust_version() {
        assert_eq!(workspace("1.95").rust_version().ok(), Some("1.95"));
        assert!(workspace("1.96").rust_version().is_err());
    }

    #[test]
    fn this_workspace_publishes_the_libraries_and_the_program() {
        let mut published = Workspace::read().expect("metadata").published;
        published.sort_by(|a, b| a.name.cmp(&b.name));
        let names: Vec<&str> = published.iter().map(|package| package.name.as_str()).collect();
        assert_eq!(names, ["girandole", "girandole-app", "girandole-core", "girandole-reference"]);
    }
}
