//! What the window itself remembers: of the scene and its settings, nothing.

use super::camera::Eye;
use super::files::Ask;
use super::gizmo::Drag;
use super::lamps::{Areas, Lamp, Unit};
use super::messages::Messages;
use super::outline::Outline;
use super::picking::Picker;
use super::selection::Selected;
use super::truth::Truth;
use super::waits::{Wait, What};
use girandole_core::glam::{DVec3, Vec3};
use std::path::PathBuf;

/// State of the panel and of what hands do to the picture.
pub struct Tools {
    /// Whether the panel is wanted; `None` = where there is room.
    pub panel: Option<bool>,
    /// Whether it is there.
    pub shows_panel: bool,
    /// Whether the sheet of all keys is shown.
    pub shows_keys: bool,
    /// Whether a dialog of the window's own is open.
    pub has_dialog: bool,
    /// What is to be known.
    pub messages: Messages,
    /// What is being waited for.
    pub waits: Vec<Wait>,
    /// A wait that is to end.
    pub cancels: Option<What>,
    /// What is to be done with files.
    pub asks: Option<Ask>,
    /// Scenes that were opened last.
    pub recent: Vec<PathBuf>,
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
    pub selected: Option<Selected>,
    /// Whether what is picked is not to be moved by accident.
    pub is_locked: bool,
    pub picker: Picker,
    /// Of what is picked.
    pub drag: Option<Drag>,
    /// Whether the drag at hand was given up, until the button is let go.
    pub is_cancelled: bool,
    /// Where one looked from when the drag at hand began.
    pub eye_before: Option<Eye>,
    /// Whether drags go by steps; Ctrl does the opposite.
    pub snaps: bool,
    /// Of a snapped move, metres; `None` = a round share of the scene's size.
    pub grid: Option<f64>,
    /// How the panel says the strength of lights.
    pub unit: Unit,
    /// What was switched off, and how it shone.
    pub switched_off: Vec<(Lamp, Vec3)>,
    pub areas: Areas,
    pub outline: Outline,
    /// What the picture is compared with.
    pub truth: Truth,
}

impl Tools {
    pub fn new(file: PathBuf, picture_size: [u32; 2], adapter: Option<String>) -> Self {
        Self {
            panel: None,
            shows_panel: true,
            shows_keys: false,
            has_dialog: false,
            messages: Messages::default(),
            waits: Vec::new(),
            cancels: None,
            asks: None,
            recent: Vec::new(),
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
            is_locked: false,
            picker: Picker::default(),
            drag: None,
            is_cancelled: false,
            eye_before: None,
            snaps: false,
            grid: None,
            unit: Unit::default(),
            switched_off: Vec::new(),
            areas: Areas::default(),
            outline: Outline::default(),
            truth: Truth::default(),
        }
    }

    /// Picks something, or nothing.
    pub fn select(&mut self, selected: Option<Selected>) {
        (self.selected, self.is_locked, self.drag) = (selected, false, None);
    }
}
