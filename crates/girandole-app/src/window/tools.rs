//! What the window itself remembers: of the scene and its settings, nothing.

use super::gizmo::Drag;
use super::truth::Truth;
use girandole_core::glam::DVec3;
use girandole_core::scene::ObjectId;
use std::path::PathBuf;

/// State of the panel and of what hands do to the picture.
pub struct Tools {
    pub shows_panel: bool,
    /// Pixels in x and y that the window has for the picture.
    pub picture_size: [u32; 2],
    /// Where the next picture is saved.
    pub file: String,
    /// A file of an object to add.
    pub model: String,
    /// Whether it is to be saved now.
    pub saves: bool,
    /// Whether the call that renders the picture is to be copied.
    pub copies: bool,
    /// The adapter that the command line names.
    pub adapter: Option<String>,
    /// Whether the window is to be closed.
    pub quits: bool,
    /// Keys that are down, and are not a shortcut's: one walks by some of them.
    pub walk: Vec<egui::Key>,
    /// Of a walk: in scenes a second.
    pub pace: f32,
    /// What the drag at hand goes round.
    pub pivot: Option<DVec3>,
    pub selected: Option<ObjectId>,
    /// Of what is picked.
    pub drag: Option<Drag>,
    /// What the picture is compared with.
    pub truth: Truth,
}

impl Tools {
    pub fn new(file: PathBuf, picture_size: [u32; 2], adapter: Option<String>) -> Self {
        Self {
            shows_panel: true,
            picture_size,
            file: file.to_string_lossy().into_owned(),
            model: String::new(),
            saves: false,
            copies: false,
            adapter,
            quits: false,
            walk: Vec::new(),
            pace: 0.1,
            pivot: None,
            selected: None,
            drag: None,
            truth: Truth::default(),
        }
    }
}
