//! What shines, and what is picked.

use crate::window::insert::insert;
use crate::window::panel::widgets::{choice, row};
use crate::window::session::Session;
use crate::window::tools::Tools;
use egui::{Button, DragValue, TextEdit, Ui};
use girandole_core::glam::Vec3;
use girandole_core::scene::{Edit, NamedIndex, ObjectId, PunctualKind, Shape, load_model};
use girandole_core::transfer::Gathering;
use std::path::Path;

/// Strengths that the panel offers: never 0, which has no colour.
const STRENGTHS: std::ops::RangeInclusive<f32> = 1e-4..=1e6;

/// Emitters' strength and colour, and the name of what is picked.
pub fn show(ui: &mut Ui, session: &mut Session, tools: &mut Tools) {
    picked(ui, session, tools);
    add(ui, session, tools);
    for index in 0..session.scene.materials.len() {
        let material = &session.scene.materials[index];
        if material.emits()
            && let Some(emission) = emitter(ui, &material.name, material.emission, " W/(sr·m²)")
        {
            let material = NamedIndex::material(&session.scene, index as u32);
            session.edit(Edit::SetEmission { material, emission });
        }
    }
    for index in 0..session.scene.lights.len() {
        let light = &session.scene.lights[index];
        let unit = if light.kind == PunctualKind::Directional { " W/m²" } else { " W/sr" };
        if let Some(intensity) = emitter(ui, &light.name, light.intensity, unit) {
            let light = NamedIndex::light(&session.scene, index);
            session.edit(Edit::SetIntensity { light, intensity });
        }
    }
}

fn picked(ui: &mut Ui, session: &mut Session, tools: &mut Tools) {
    let found = |id: ObjectId| session.scene.objects.get(id.index()).filter(|o| !o.removed);
    let Some((id, name)) = tools.selected.and_then(|id| Some((id, found(id)?.name.clone()))) else {
        ui.weak("Click an object in the picture to pick it, then drag its handles.");
        return;
    };
    ui.horizontal(|ui| {
        ui.label(format!("Picked: {name}"));
        if ui.button("Remove").on_hover_text("Takes the object away").clicked() {
            tools.selected = None;
            let object = NamedIndex::object(&session.scene, id);
            session.edit(Edit::RemoveObject { object });
        }
    });
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

/// The light that an emitter is to have, if it was changed: its colour has 1 as its brightest channel, strength is the rest.
fn emitter(ui: &mut Ui, name: &str, light: Vec3, unit: &str) -> Option<Vec3> {
    let strength = light.max_element();
    let mut color = if strength > 0.0 { (light / strength).to_array() } else { [1.0; 3] };
    let mut next = strength;
    let changed = ui.horizontal(|ui| {
        let picked = ui.color_edit_button_rgb(&mut color).on_hover_text("Colour, in linear light").changed();
        let speed = f64::from(strength.max(1e-3)) * 0.01;
        let drag = DragValue::new(&mut next).range(STRENGTHS).speed(speed).suffix(unit);
        let dragged = ui.add(drag).on_hover_text("Strength of the brightest channel").changed();
        ui.add(egui::Label::new(name).truncate());
        picked || dragged
    });
    let color = Vec3::from(color);
    changed.inner.then(|| color / color.max_element().max(1e-6) * next)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_emitter_that_nobody_touches_stays_as_it_is() {
        let mut result = Some(Vec3::ONE);
        let context = egui::Context::default();
        let output = context
            .run_ui(Default::default(), |ui| result = emitter(ui, "lamp", Vec3::new(4.0, 2.0, 0.0), ""));
        output.drop_without_applying_deltas();
        assert_eq!(result, None);
    }
}
