//! Rows of the panel.

use egui::{ComboBox, Response, Ui, Vec2};

/// Width of the names, points.
const NAME: f32 = 112.0;

/// A control behind its name, both with the same explanation.
pub fn row(
    ui: &mut Ui,
    name: &str,
    explanation: &str,
    control: impl FnOnce(&mut Ui) -> Response,
) -> Response {
    ui.horizontal(|ui| {
        let height = ui.spacing().interact_size.y;
        let label = egui::Label::new(name).truncate();
        let left = egui::Layout::left_to_right(egui::Align::Center);
        ui.allocate_ui_with_layout(Vec2::new(NAME, height), left, |ui| {
            ui.set_min_width(NAME);
            ui.add(label).on_hover_text(explanation);
        });
        control(ui).on_hover_text(explanation)
    })
    .inner
}

/// One of several values.
pub fn choice<T: Copy + PartialEq>(ui: &mut Ui, id: &str, value: &mut T, options: &[(T, &str)]) -> Response {
    let name = options.iter().find(|(option, _)| option == value).map_or("", |(_, name)| name);
    let list = ComboBox::from_id_salt(id).selected_text(name).width(150.0);
    list.show_ui(ui, |ui| {
        for (option, name) in options {
            ui.selectable_value(value, *option, *name);
        }
    })
    .response
}

/// A value that may be left to the library; `first` is what it is when it no longer is.
pub fn optional<T: Copy>(
    ui: &mut Ui,
    (value, first): (&mut Option<T>, T),
    nothing: &str,
    edit: impl FnOnce(&mut Ui, &mut T) -> Response,
) -> Response {
    let mut leave = value.is_none();
    let response = ui.checkbox(&mut leave, nothing);
    if response.changed() {
        *value = (!leave).then_some(first);
    }
    match value {
        Some(value) => response.union(edit(ui, value)),
        None => response,
    }
}
