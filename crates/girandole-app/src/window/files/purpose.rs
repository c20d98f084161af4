//! What files are chosen for.

use std::path::PathBuf;

/// What is to be done with files.
#[derive(Clone, Debug, PartialEq)]
pub enum Ask {
    /// A file is to be chosen.
    Choose(Purpose),
    /// A scene is to be shown.
    Open(PathBuf),
    /// Edits are to be saved where they were last.
    SaveEdits,
    /// The system's dialog is to be left for our own.
    TypeInstead,
}

/// What a file is chosen for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    OpenScene,
    AddModel,
    LoadEdits,
    SaveEdits,
    ExportScene,
}

impl Purpose {
    /// What the dialog is called.
    pub fn title(self) -> &'static str {
        match self {
            Self::OpenScene => "Open a scene",
            Self::AddModel => "Add a model",
            Self::LoadEdits => "Load edits",
            Self::SaveEdits => "Save edits",
            Self::ExportScene => "Export the scene",
        }
    }

    /// Whether the file is written.
    pub fn saves(self) -> bool {
        matches!(self, Self::SaveEdits | Self::ExportScene)
    }

    /// What files these are, and how their names end.
    pub fn kind(self) -> (&'static str, &'static [&'static str]) {
        match self {
            Self::OpenScene | Self::AddModel => ("Scenes and models", &["glb", "gltf", "obj", "ply"]),
            Self::LoadEdits | Self::SaveEdits => ("Edits", &["json"]),
            Self::ExportScene => ("glTF", &["glb"]),
        }
    }

    /// The first of some files that is of that kind, else the first of all.
    #[cfg(any(test, target_arch = "wasm32"))]
    pub fn first(self, files: &[PathBuf]) -> Option<PathBuf> {
        let is_kind = |path: &&PathBuf| {
            path.extension().is_some_and(|e| self.kind().1.iter().any(|kind| e.eq_ignore_ascii_case(kind)))
        };
        files.iter().find(is_kind).or(files.first()).cloned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scene_is_found_among_the_files_that_it_refers_to() {
        let files = ["wood.png", "room.bin", "Room.GLTF"].map(PathBuf::from);
        assert_eq!(Purpose::OpenScene.first(&files), Some(files[2].clone()));
        assert_eq!(Purpose::LoadEdits.first(&files), Some(files[0].clone()), "to be told that it is not one");
        assert_eq!(Purpose::OpenScene.first(&[]), None);
    }
}
