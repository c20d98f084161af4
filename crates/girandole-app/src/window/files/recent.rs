//! Scenes that were opened last, in a file in the user's folder for settings.

use girandole_core::files;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// How many are remembered.
const MOST: usize = 10;
/// Of the file; others are taken for none.
const VERSION: u64 = 1;

/// The scenes, the last one first.
#[derive(Default)]
pub struct Recent {
    /// Where they are remembered; nowhere where the system has no such folder.
    file: Option<PathBuf>,
    scenes: Vec<PathBuf>,
}

impl Recent {
    /// Those of this user.
    pub fn load() -> Self {
        #[cfg(target_arch = "wasm32")]
        let folder: Option<PathBuf> = None;
        #[cfg(not(target_arch = "wasm32"))]
        let folder = dirs::config_dir();
        Self::at(folder.map(|folder| folder.join("girandole/recent.json")))
    }

    fn at(file: Option<PathBuf>) -> Self {
        let mut recent = Self { file, scenes: Vec::new() };
        recent.read();
        recent
    }

    /// Those whose files are still there.
    pub fn scenes(&self) -> &[PathBuf] {
        &self.scenes
    }

    /// Reads the file again, in which other windows may have written by now.
    pub fn read(&mut self) {
        let bytes = self.file.as_ref().and_then(|file| files::read(file).ok()).unwrap_or_default();
        let value: Value = serde_json::from_slice(&bytes).unwrap_or_default();
        let is_known = value["version"].as_u64() == Some(VERSION);
        let scenes = value["scenes"].as_array().filter(|_| is_known).into_iter().flatten();
        let scenes = scenes.filter_map(|scene| scene.as_str().map(PathBuf::from));
        self.scenes = scenes.filter(|path| path.is_absolute() && path.is_file()).take(MOST).collect();
    }

    /// Puts a scene first. That it cannot be remembered is no reason not to show it.
    pub fn add(&mut self, scene: &Path) {
        let Some(file) = self.file.clone() else { return };
        let Ok(scene) = std::path::absolute(scene) else { return };
        // A name that is no Unicode cannot be written down.
        if !scene.is_file() || scene.to_str().is_none() {
            return;
        }
        self.read();
        self.scenes.retain(|other| *other != scene);
        self.scenes.insert(0, scene);
        self.scenes.truncate(MOST);
        let text = json!({"version": VERSION, "scenes": self.scenes});
        let folder = file.parent().map(std::fs::create_dir_all);
        if folder.is_some_and(|made| made.is_ok()) {
            let _ = files::write(&file, format!("{text:#}\n").as_bytes());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_ones_are_remembered_and_missing_ones_dropped() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("girandole/recent.json");
        let scene = |i: usize| folder.path().join(format!("scene {i}.glb"));
        let mut recent = Recent::at(Some(file.clone()));
        assert!(recent.scenes().is_empty());
        for i in 0..12 {
            std::fs::write(scene(i), b"").expect("written");
            recent.add(&scene(i));
        }
        let expected: Vec<PathBuf> = (2..12).rev().map(scene).collect();
        assert_eq!(recent.scenes(), expected);
        // Another window opens one again.
        Recent::at(Some(file.clone())).add(&scene(5));
        recent.add(&scene(3));
        assert_eq!(recent.scenes()[..3], [3, 5, 11].map(scene));
        std::fs::remove_file(scene(5)).expect("removed");
        assert_eq!(Recent::at(Some(file.clone())).scenes()[..2], [3, 11].map(scene));
        recent.add(&folder.path().join("nowhere.glb"));
        assert_eq!(recent.scenes()[0], scene(3));
    }

    #[test]
    fn a_broken_file_is_written_anew() {
        let folder = tempfile::tempdir().expect("a folder");
        let (file, scene) = (folder.path().join("recent.json"), folder.path().join("a.glb"));
        std::fs::write(&scene, b"").expect("written");
        for broken in ["", "{", "[]", r#"{"version": 1, "scenes": 3}"#, r#"{"version": 2, "scenes": ["/a"]}"#]
        {
            std::fs::write(&file, broken).expect("written");
            let mut recent = Recent::at(Some(file.clone()));
            assert!(recent.scenes().is_empty(), "{broken}");
            recent.add(&scene);
            assert_eq!(Recent::at(Some(file.clone())).scenes(), [scene.as_path()], "{broken}");
        }
        Recent::at(None).add(&scene);
    }
}
