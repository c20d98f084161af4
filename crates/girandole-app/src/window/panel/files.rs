//! Scenes and edits in files.

use crate::window::files::{Ask, Purpose};
use crate::window::session::Session;
use crate::window::tools::Tools;
use egui::{Button, Ui};

/// Opens scenes, and saves and loads what was changed.
pub fn show(ui: &mut Ui, session: &Session, tools: &mut Tools) {
    ui.horizontal_wrapped(|ui| {
        if ui.button("Open…").on_hover_text("Shows another scene (Ctrl O)").clicked() {
            tools.asks = Some(Ask::Choose(Purpose::OpenScene));
        }
        ui.add_enabled_ui(!tools.recent.is_empty(), |ui| {
            ui.menu_button("Recent", |ui| {
                for path in &tools.recent {
                    let name = path.file_name().unwrap_or_default().to_string_lossy();
                    if ui.button(name).on_hover_text(path.to_string_lossy()).clicked() {
                        tools.asks = Some(Ask::Open(path.clone()));
                        ui.close();
                    }
                }
            });
        });
        if ui.button("Add model…").on_hover_text("Puts a file's model in front of the camera").clicked() {
            tools.asks = Some(Ask::Choose(Purpose::AddModel));
        }
        let save = ui.add_enabled(!session.edits.0.is_empty(), Button::new("Save edits"));
        let explanation =
            "Writes what was changed in the scene to a file (Ctrl S); Ctrl Shift S writes to another one.";
        if save.on_hover_text(explanation).clicked() {
            tools.asks = Some(Ask::SaveEdits);
        }
        if ui
            .button("Load edits…")
            .on_hover_text("The scene of the file, with other changes (Ctrl L)")
            .clicked()
        {
            tools.asks = Some(Ask::Choose(Purpose::LoadEdits));
        }
        if ui
            .button("Export…")
            .on_hover_text("Writes the scene as it stands to a .glb file (Ctrl E)")
            .clicked()
        {
            tools.asks = Some(Ask::Choose(Purpose::ExportScene));
        }
    });
}
