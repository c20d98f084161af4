//! What is around the scene.

use super::widgets::{choice, row};
use crate::args::{BackgroundArg, EnvironmentArg, LoadArgs};
use crate::window::session::Session;
use egui::{DragValue, Slider, Ui};
use girandole_core::scene::Sky;

/// Kinds of environments.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Own,
    Sky,
    Color,
    File,
}

/// [`LoadArgs`], as far as they are about the environment.
pub fn show(ui: &mut Ui, session: &mut Session) {
    let mut load = session.source.load.clone();
    kind(ui, &mut load);
    match &mut load.environment {
        None | Some(EnvironmentArg::File(_)) => {}
        Some(EnvironmentArg::Color(radiance)) => {
            row(ui, "Radiance", "From everywhere alike, W/(sr·m²).", |ui| {
                let edits = radiance.iter_mut().map(|channel| {
                    ui.add(DragValue::new(channel).range(0.0..=1e6).speed(0.02).max_decimals(3))
                });
                edits.reduce(|a, b| a.union(b)).unwrap_or_else(|| ui.label(""))
            });
        }
        Some(EnvironmentArg::Sky([elevation, azimuth, turbidity])) => {
            row(
                ui,
                "Elevation",
                "How high the sun stands above the horizon. Low: long shadows, red light.",
                |ui| ui.add(Slider::new(elevation, 0.0..=90.0).suffix("°").max_decimals(1)),
            );
            row(ui, "Azimuth", "Where the sun is, clockwise from −Z.", |ui| {
                ui.add(Slider::new(azimuth, 0.0..=360.0).suffix("°").max_decimals(1))
            });
            row(ui, "Turbidity", "How hazy the air is. 2: very clear; 3: clear; 10: hazy.", |ui| {
                ui.add(Slider::new(turbidity, 1.0..=10.0).max_decimals(2))
            });
        }
    }
    if load.environment.is_some() {
        let mut strength = load.environment_strength.unwrap_or(1.0);
        row(ui, "Strength", "What its light is multiplied by.", |ui| {
            ui.add(DragValue::new(&mut strength).range(0.0..=1e6).speed(0.01).max_decimals(3))
        });
        let mut rotation = load.environment_rotation.unwrap_or(0.0);
        row(ui, "Rotation", "How far it is turned, counter-clockwise seen from above.", |ui| {
            ui.add(DragValue::new(&mut rotation).range(-360.0..=360.0).suffix("°").max_decimals(1))
        });
        (load.environment_strength, load.environment_rotation) = (Some(strength), Some(rotation));
        // What is not given is 1 and 0.
        load.environment_strength = load.environment_strength.filter(|x| *x != 1.0);
        load.environment_rotation = load.environment_rotation.filter(|x| *x != 0.0);
    }
    row(
        ui,
        "Background",
        "Whether it is seen behind the scene. Off: saved pictures have no alpha, girandole render's do.",
        |ui| {
            let mut is_seen = load.background == BackgroundArg::Environment;
            let response = ui.checkbox(&mut is_seen, "is seen");
            load.background = if is_seen { BackgroundArg::Environment } else { BackgroundArg::Transparent };
            response
        },
    );
    if load != session.source.load {
        session.surround(load);
    }
}

fn kind(ui: &mut Ui, load: &mut LoadArgs) {
    let before = match &load.environment {
        None => Kind::Own,
        Some(EnvironmentArg::Sky(_)) => Kind::Sky,
        Some(EnvironmentArg::Color(_)) => Kind::Color,
        Some(EnvironmentArg::File(_)) => Kind::File,
    };
    let mut kinds =
        vec![(Kind::Own, "the scene's own"), (Kind::Sky, "clear sky"), (Kind::Color, "one colour")];
    if before == Kind::File {
        kinds.push((Kind::File, "a picture"));
    }
    let mut kind = before;
    let explanation = "Light from infinitely far away. The scene's own: what its file brings, or a studio where that is too little.";
    row(ui, "Around it", explanation, |ui| choice(ui, "environment", &mut kind, &kinds));
    if kind == before {
        return;
    }
    let Sky { elevation, azimuth, turbidity } = Sky::default();
    load.environment = match kind {
        Kind::Own | Kind::File => None,
        Kind::Sky => Some(EnvironmentArg::Sky([
            elevation.to_degrees().round(),
            azimuth.to_degrees().round(),
            turbidity,
        ])),
        Kind::Color => Some(EnvironmentArg::Color([1.0; 3])),
    };
    (load.environment_strength, load.environment_rotation) = (None, None);
    if load.environment.is_some() {
        // The two exclude each other.
        load.light = crate::args::LightArg::Auto;
    }
}
