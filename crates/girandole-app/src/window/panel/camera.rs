//! Cameras of the scene, and walking.

use super::widgets::row;
use crate::window::bookmarks;
use crate::window::camera::Eye;
use crate::window::session::Session;
use crate::window::tools::Tools;
use egui::{Button, ComboBox, Response, RichText, Slider, Ui, Vec2};

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
    bookmarks(ui, session, tools);
    ui.weak("W A S D walk, E Q up and down · drag looks, right button orbits, middle pans, wheel moves · H hides this");
}

/// Views to come back to.
fn bookmarks(ui: &mut Ui, session: &mut Session, tools: &Tools) {
    let explanation = "Views to come back to: cameras of the scene, which are saved with its edits. Ctrl 1 to Ctrl 9 keep \
                       the view, 1 to 9 come back to it; a click on a free number keeps it, too.";
    row(ui, "Bookmarks", explanation, |ui| {
        // All nine beside each other, within the panel.
        ui.spacing_mut().item_spacing.x = 2.0;
        ui.spacing_mut().button_padding.x = 2.0;
        let buttons = bookmarks::numbers().map(|number| {
            let camera = bookmarks::bookmark(session, number);
            let is_here = camera.is_some_and(|camera| session.eye == Eye::Camera(camera));
            let text = RichText::new(number.to_string());
            let text = if camera.is_some() { text.strong() } else { text.weak() };
            let button = ui.add(Button::new(text).selected(is_here).min_size(Vec2::splat(16.0)));
            if button.clicked() && camera.is_some() {
                bookmarks::recall(session, number);
            } else if button.clicked() {
                bookmarks::store(session, tools, number);
            }
            button
        });
        let all: Vec<Response> = buttons.collect();
        all.into_iter().reduce(|a, b| a | b).unwrap_or_else(|| ui.label(""))
    });
}
