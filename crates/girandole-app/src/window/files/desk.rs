//! What is done with files that were chosen.

use super::chooser::Done;
use super::dialog::Dialog;
use super::recent::Recent;
use super::{Ask, Purpose};
use crate::window::clock::Instant;
use crate::window::opening::Opener;
use crate::window::session::Session;
use crate::window::tools::Tools;
use crate::window::waits::{Wait, What};
use egui::Ui;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use winit::window::Window;

/// The dialog that is open, and where things were last.
#[derive(Default)]
pub struct Files {
    dialog: Option<Dialog>,
    /// When that was opened.
    asked: Option<Instant>,
    recent: Recent,
    /// Where the edits of the scene that is shown were saved or loaded.
    edits: Option<PathBuf>,
    /// Whether dialogs are always our own.
    own_dialogs: bool,
}

impl Files {
    pub fn new(edits: Option<PathBuf>, own_dialogs: bool) -> Self {
        Self { dialog: None, asked: None, recent: Recent::load(), edits, own_dialogs }
    }

    /// Scenes that were opened last.
    pub fn recent(&self) -> &[PathBuf] {
        self.recent.scenes()
    }

    /// Whether a dialog of the system's is open, and has to be looked for.
    pub fn is_waiting(&self) -> bool {
        self.dialog.as_ref().is_some_and(Dialog::is_the_systems)
    }

    /// Whether a dialog of our own is open.
    pub fn has_own_dialog(&self) -> bool {
        self.dialog.as_ref().is_some_and(|dialog| !dialog.is_the_systems())
    }

    /// What is being waited for.
    pub fn wait(&self) -> Option<Wait> {
        let dialog = self.dialog.as_ref().filter(|dialog| dialog.is_the_systems())?;
        let text = format!("{}: choose a file", dialog.purpose.title());
        Some(Wait { what: What::Choosing, text, since: self.asked?, share: None })
    }

    /// Another scene is shown, with these edits.
    pub fn shows(&mut self, scene: &Path, edits: Option<PathBuf>) {
        self.edits = edits;
        if scene.is_file() {
            self.recent.add(scene);
        }
    }

    /// Does what was asked for, and shows the dialog that is open.
    pub fn act(
        &mut self,
        (ui, window): (&Ui, &Arc<Window>),
        (session, tools): (&mut Session, &mut Tools),
        opener: &mut Opener,
    ) {
        match tools.asks.take() {
            None => {}
            // One at a time.
            Some(Ask::Choose(_)) if self.dialog.is_some() => {}
            Some(Ask::Choose(purpose)) => {
                let start = self.start(purpose, session);
                self.asked = Some(Instant::now());
                self.dialog = Some(Dialog::open(purpose, start, window, self.own_dialogs));
            }
            Some(Ask::Open(path)) => opener.open(&path),
            Some(Ask::SaveEdits) => match self.edits.clone() {
                Some(path) => self.save_edits(&path, session),
                None => tools.asks = Some(Ask::Choose(Purpose::SaveEdits)),
            },
            Some(Ask::TypeInstead) => self.dialog.iter_mut().for_each(Dialog::type_instead),
        }
        let Some(dialog) = &mut self.dialog else { return };
        let purpose = dialog.purpose;
        let Some(done) = dialog.show(ui) else { return };
        self.dialog = None;
        ui.ctx().request_repaint();
        if let Done::Chosen(path) = done {
            self.take(purpose, &path, session, opener);
        }
    }

    fn take(&mut self, purpose: Purpose, path: &Path, session: &mut Session, opener: &mut Opener) {
        if session.is_blank && purpose != Purpose::OpenScene {
            session.notice = Some("The scene is not open yet: do that again once it is.".into());
            return;
        }
        match purpose {
            Purpose::OpenScene => opener.open(path),
            Purpose::AddModel => opener.add(path),
            Purpose::LoadEdits => opener.load_edits(path, session),
            Purpose::SaveEdits => self.save_edits(path, session),
            Purpose::ExportScene => opener.export(path, session),
        }
    }

    fn save_edits(&mut self, path: &Path, session: &mut Session) {
        session.attempt(|session| {
            crate::output::check_writable(path, Purpose::SaveEdits.kind().1)?;
            girandole_core::files::write(path, session.edits.to_json()?.as_bytes())?;
            session.notice = Some(format!("wrote {}: --edits makes them again", path.display()));
            Ok(())
        });
        self.edits = Some(path.into());
    }

    /// Where a dialog begins.
    fn start(&self, purpose: Purpose, session: &Session) -> PathBuf {
        let scene = Path::new(&session.source.scene);
        let beside = if scene.is_file() { scene.to_owned() } else { PathBuf::from(&session.scene.name) };
        match (purpose, &self.edits) {
            (Purpose::OpenScene | Purpose::AddModel, _) => beside,
            (Purpose::LoadEdits | Purpose::SaveEdits, Some(edits)) => edits.clone(),
            (Purpose::LoadEdits | Purpose::SaveEdits, None) => beside.with_extension("edits.json"),
            (Purpose::ExportScene, _) => {
                let stem = beside.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                beside.with_file_name(format!("{stem}-edited.glb"))
            }
        }
    }
}
