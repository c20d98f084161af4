//! The panel: each control edits the library's own settings, and shows what they are.

mod camera;
mod environment;
mod files;
mod lamps;
mod light;
mod material;
mod motion;
mod objects;
mod picture;
mod shadows;
mod statistics;
mod truth;
mod widgets;

pub use picture::{DEBUG_VIEWS, has_debug_view};

use super::frames::Frames;
use super::session::Session;
use super::tools::Tools;
use egui::{CollapsingHeader, ScrollArea, Ui};

/// All groups, one below the other.
pub fn show(ui: &mut Ui, session: &mut Session, tools: &mut Tools, frames: &mut Frames) {
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        ui.add_space(4.0);
        ui.heading(if session.scene.name.is_empty() { "scene" } else { &session.scene.name });
        statistics::rate(ui, frames);
        files::show(ui, session, tools);
        objects::history(ui, session, tools);
        picture::preset(ui, session, tools.picture_size);
        group(ui, "Picture", true, |ui| {
            picture::show(ui, &mut session.settings);
            picture::refinement(ui, session);
        });
        group(ui, "Light samples", true, |ui| light::show(ui, session, tools.picture_size));
        group(ui, "Environment", false, |ui| environment::show(ui, session));
        group(ui, "Shadow maps", true, |ui| shadows::show(ui, session));
        group(ui, "Camera", true, |ui| camera::show(ui, session, tools));
        group(ui, "Motion", true, |ui| motion::show(ui, session));
        group(ui, "Objects", true, |ui| objects::show(ui, session, tools));
        group(ui, "Lamps", false, |ui| lamps::show(ui, session, tools));
        group(ui, "How it is made", false, |ui| picture::debug(ui, session));
        frames.wants_stats =
            group(ui, "Frame times", true, |ui| statistics::show(ui, session, frames)).is_some();
        group(ui, "Against the truth", false, |ui| truth::show(ui, tools));
        group(ui, "Save", true, |ui| picture::save(ui, tools));
        group(ui, "Messages", false, |ui| messages(ui, session, tools));
        ui.add_space(8.0);
    });
}

/// What was said, the latest first, and what there is to know of the scene.
fn messages(ui: &mut Ui, session: &Session, tools: &Tools) {
    let said = tools.messages.last();
    let warnings = session.scene.warnings.iter().map(String::as_str);
    let mut any = false;
    for sentence in said.chain(warnings.filter(|w| !tools.messages.last().any(|said| said == *w))) {
        ui.label(sentence);
        any = true;
    }
    if !any {
        ui.weak("Nothing so far.");
    }
}

fn group<R>(ui: &mut Ui, name: &str, open: bool, contents: impl FnOnce(&mut Ui) -> R) -> Option<R> {
    let shown = CollapsingHeader::new(egui::RichText::new(name).strong()).default_open(open);
    shown.show_unindented(ui, contents).body_returned
}
