//! Cameras of the scene, and walking.

use super::widgets::row;
use crate::window::camera::Eye;
use crate::window::session::Session;
use crate::window::tools::Tools;
use egui::{ComboBox, Slider, Ui};

/// The camera list, and how fast one walks.
pub fn show(ui: &mut Ui, session: &mut Session, tools: &mut Tools) {
    row(ui, "From", "Looks from a camera of the scene; walking leaves it where it is.", |ui| {
        let name = |index: usize| match session.scene.cameras[index].name.as_str() {
            "" => format!("camera {index}"),
            name => name.into(),
        };
        let now = match session.eye {
            Eye::Camera(index) => name(index),
            Eye::Free(_) => "where I walked".into(),
        };
        let list = ComboBox::from_id_salt("camera").selected_text(now).width(150.0);
        list.show_ui(ui, |ui| {
            for index in 0..session.scene.cameras.len() {
                ui.selectable_value(&mut session.eye, Eye::Camera(index), name(index));
            }
        })
        .response
    });
    row(ui, "Pace", "Of a walk, in the scene's size a second. Shift is four times as fast.", |ui| {
        ui.add(Slider::new(&mut tools.pace, 0.005..=1.0).logarithmic(true))
    });
    ui.weak("W A S D walk, E Q up and down · drag looks, right button orbits, middle pans, wheel moves · H hides this");
}
