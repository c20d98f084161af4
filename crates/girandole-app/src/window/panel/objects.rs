//! What is picked, and what can be put into the scene.

use super::material;
use crate::window::gizmo::grid;
use crate::window::insert::insert;
use crate::window::panel::widgets::{choice, optional, row};
use crate::window::selection::{Selected, delete, duplicate, redo, undo};
use crate::window::session::Session;
use crate::window::tools::Tools;
use egui::{Button, DragValue, TextEdit, Ui};
use girandole_core::scene::{ObjectId, Shape, load_model};
use girandole_core::transfer::Gathering;
use std::path::Path;

/// Takes steps back, and makes them again.
pub fn history(ui: &mut Ui, session: &mut Session, tools: &mut Tools) {
    let [can_undo, can_redo] = session.can_undo_and_redo();
    ui.horizontal(|ui| {
        let back = ui.add_enabled(can_undo, Button::new("Undo"));
        if back.on_hover_text("Takes the last change of the scene back (Ctrl Z)").clicked() {
            undo(session, tools);
        }
        let again = ui.add_enabled(can_redo, Button::new("Redo"));
        if again.on_hover_text("Makes it again (Ctrl Y or Ctrl Shift Z)").clicked() {
            redo(session, tools);
        }
    });
}

/// What is picked, how it is moved, and what can be added.
pub fn show(ui: &mut Ui, session: &mut Session, tools: &mut Tools) {
    picked(ui, session, tools);
    snapping(ui, session, tools);
    add(ui, session, tools);
}

fn picked(ui: &mut Ui, session: &mut Session, tools: &mut Tools) {
    let Some(selected) = tools.selected.filter(|selected| selected.is_there(session)) else {
        ui.weak("Click an object or a lamp in the picture to pick it, then drag its handles.");
        return;
    };
    let name = selected.name(session);
    ui.add(egui::Label::new(egui::RichText::new(format!("Picked: {name}")).strong()).truncate());
    ui.horizontal(|ui| {
        if tools.is_locked {
            let explanation =
                "It is part of the room, and stays where it is until it is asked for: by this, or by a double click.";
            if ui.button("Let it move").on_hover_text(explanation).clicked() {
                tools.is_locked = false;
            }
        } else if ui.button("Delete").on_hover_text("Takes it away (Delete)").clicked() {
            delete(session, tools);
        }
        if ui.button("Duplicate").on_hover_text("Puts a copy beside it (Ctrl D)").clicked() {
            duplicate(session, tools);
        }
    });
    if let Selected::Object(id) = selected {
        transfer(ui, session, id);
        material::show(ui, session, id);
    }
}

fn transfer(ui: &mut Ui, session: &mut Session, id: ObjectId) {
    let before = session.transfers.gathering(id);
    let mut chosen = before.map(|gathering| gathering == Gathering::Center);
    let ways = [(None, "shadow maps"), (Some(true), "transfer, centre"), (Some(false), "transfer, grid")];
    let explanation = "How the object is lit: by shadow maps, or by precomputed radiance transfer with the light at its centre, or on a \
                       grid about it. Transfer is simulated when it is first chosen, which takes seconds for large objects; until then shadow maps light it.";
    row(ui, "Lit by", explanation, |ui| choice(ui, "transfer", &mut chosen, &ways));
    let is_center = |gathering| gathering == Gathering::Center;
    if chosen != before.map(is_center) {
        let gathering = |center| if center { Gathering::Center } else { Gathering::GRID };
        session.set_transfer(id, chosen.map(gathering));
    }
}

fn snapping(ui: &mut Ui, session: &Session, tools: &mut Tools) {
    let explanation = "Drags go by steps: moves by the grid's, turns by 15°, scales by a tenth. Ctrl does so while it is down.";
    row(ui, "Snap", explanation, |ui| ui.checkbox(&mut tools.snaps, "always"));
    let suitable = grid(session, tools);
    row(ui, "Grid", "Step of moves that snap. auto: about a fiftieth of the scene's size.", |ui| {
        optional(ui, (&mut tools.grid, suitable), "auto", |ui, step| {
            ui.add(DragValue::new(step).range(1e-6..=1e6).speed(suitable * 0.02).suffix(" m").max_decimals(6))
        })
    });
}

/// Puts a built-in object, or one from a file, in front of the camera.
fn add(ui: &mut Ui, session: &mut Session, tools: &mut Tools) {
    ui.horizontal(|ui| {
        ui.label("Add");
        for (name, shape) in [("torus", Shape::Torus), ("teapot", Shape::Teapot)] {
            if ui.button(name).on_hover_text("Puts it in front of the camera").clicked() {
                insert(session, tools, name, shape, &load_model);
            }
        }
    });
    ui.horizontal(|ui| {
        let field = TextEdit::singleline(&mut tools.model).hint_text("model.ply").desired_width(200.0);
        ui.add(field).on_hover_text("A .ply, .obj, .glb or .gltf file: all of it becomes one object.");
        let button = ui.add_enabled(!tools.model.is_empty(), Button::new("Add"));
        let explanation = "Puts the file's model in front of the camera. A .ply or .obj file can be dropped on the window as \
                           well, a .glb with Shift.";
        if button.on_hover_text(explanation).clicked() {
            let path = Path::new(&tools.model);
            let path = std::path::absolute(path).unwrap_or_else(|_| path.into());
            let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            insert(session, tools, &name, Shape::File(path), &load_model);
        }
    });
}
