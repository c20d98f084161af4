//! Choosing a file: by the system's dialog, or where there is none by one of our own.

use super::chooser::{Chooser, Done};
use super::purpose::Purpose;
use crate::window::clock::{Duration, Instant};
use crate::window::pending::{self, Pending};
use egui::Ui;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use winit::window::Window;

/// Nobody closes a dialog as quickly as that: there was none.
const AT_ONCE: Duration = Duration::from_millis(500);

/// A dialog that is open.
pub struct Dialog {
    pub purpose: Purpose,
    start: PathBuf,
    kind: Kind,
}

enum Kind {
    System { asked: Instant, chosen: Option<Pending<Option<PathBuf>>> },
    Own(Chooser),
}

impl Dialog {
    /// Asks for a file, first for this one; by a dialog of our own where that is wanted.
    pub fn open(purpose: Purpose, start: PathBuf, window: &Arc<Window>, own: bool) -> Self {
        let kind = if own && cfg!(not(target_arch = "wasm32")) {
            Kind::Own(Chooser::new(purpose, &start))
        } else {
            Kind::System { asked: Instant::now(), chosen: Some(ask_system(purpose, &start, window)) }
        };
        Self { purpose, start, kind }
    }

    /// Whether the system has a dialog open.
    pub fn is_the_systems(&self) -> bool {
        matches!(self.kind, Kind::System { .. })
    }

    /// Leaves the system's dialog for our own.
    pub fn type_instead(&mut self) {
        self.kind = Kind::Own(Chooser::new(self.purpose, &self.start));
    }

    /// Shows it where it is our own, and looks for what the system's says. Returns what came of it, once.
    pub fn show(&mut self, ui: &Ui) -> Option<Done> {
        match &mut self.kind {
            Kind::Own(chooser) => chooser.show(ui),
            Kind::System { asked, chosen } => match pending::take(chosen)? {
                Some(path) => Some(Done::Chosen(path)),
                None if asked.elapsed() < AT_ONCE && cfg!(not(target_arch = "wasm32")) => {
                    self.type_instead();
                    ui.ctx().request_repaint();
                    None
                }
                None => Some(Done::Cancelled),
            },
        }
    }
}

/// The browser's dialog: what a scene refers to is chosen together with it. What is written goes where the browser puts downloads.
#[cfg(target_arch = "wasm32")]
fn ask_system(purpose: Purpose, start: &Path, _: &Arc<Window>) -> Pending<Option<PathBuf>> {
    if purpose.saves() {
        return Pending::new(std::future::ready(start.file_name().map(PathBuf::from)));
    }
    let chosen = rfd::AsyncFileDialog::new().set_title(purpose.title()).pick_files();
    Pending::new(async move {
        let mut names = Vec::new();
        for file in chosen.await? {
            let name = PathBuf::from(file.file_name());
            girandole_core::files::hold(&name, file.read().await);
            names.push(name);
        }
        purpose.first(&names)
    })
}

/// The system's dialog. On Linux that is the desktop's portal by libdbus, which is looked for when the program runs, or zenity.
#[cfg(not(target_arch = "wasm32"))]
fn ask_system(purpose: Purpose, start: &Path, window: &Arc<Window>) -> Pending<Option<PathBuf>> {
    let (kind, extensions) = purpose.kind();
    let mut dialog = rfd::AsyncFileDialog::new()
        .set_title(purpose.title())
        .set_parent(window)
        .add_filter(kind, extensions);
    if let Some(folder) = start.parent().filter(|folder| folder.is_dir()) {
        dialog = dialog.set_directory(folder);
    }
    if let Some(name) = start.file_name().filter(|_| purpose.saves()) {
        dialog = dialog.set_file_name(name.to_string_lossy());
    }
    let path = |file: Option<rfd::FileHandle>| file.map(|file| file.path().to_owned());
    if purpose.saves() {
        let chosen = dialog.save_file();
        Pending::new(async move { path(chosen.await) })
    } else {
        let chosen = dialog.pick_file();
        Pending::new(async move { path(chosen.await) })
    }
}
