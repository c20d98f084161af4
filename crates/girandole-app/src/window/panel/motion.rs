//! The scene's animations.

use super::widgets::{choice, optional, row};
use crate::window::session::Session;
use egui::{DragValue, Slider, Ui};

/// What frames may take while things move; plays and scrubs.
pub fn show(ui: &mut Ui, session: &mut Session) {
    row(
        ui,
        "Frame budget",
        "What a frame may take while things move. Lower: pictures with fewer pixels, down to a quarter, and fewer shadow maps drawn \
         anew, so shadows lag; a moment after all is at rest the picture is as it was asked for. any: full quality always.",
        |ui| {
            optional(ui, (&mut session.budget.milliseconds, 100.0), "any", |ui, ms| {
                ui.add(DragValue::new(ms).range(1.0..=10_000.0).suffix(" ms"))
            })
        },
    );
    clips(ui, session);
    let duration = session.scene.duration();
    if duration == 0.0 {
        ui.weak("Nothing here is animated.");
        return;
    }
    ui.horizontal(|ui| {
        let label = if session.playback.playing { "Stop" } else { "Play" };
        if ui.button(label).on_hover_text("Plays or stops (Space)").clicked() {
            session.playback.playing = !session.playback.playing;
        }
        let mut seconds = session.playback.seconds;
        ui.spacing_mut().slider_width = 170.0;
        let slider = Slider::new(&mut seconds, 0.0..=duration).suffix(" s").fixed_decimals(2);
        if ui.add(slider).on_hover_text("The moment of the scene's animations; they repeat.").changed() {
            session.seek(seconds);
        }
    });
}

/// Which animation plays, where there are several.
fn clips(ui: &mut Ui, session: &mut Session) {
    let animations = &session.scene.animations;
    if animations.len() < 2 {
        return;
    }
    let names = animations.iter().enumerate().map(|(i, a)| match a.name.as_str() {
        "" => format!("animation {i}"),
        name => name.to_owned(),
    });
    let names: Vec<String> = names.collect();
    let mut options: Vec<(Option<usize>, &str)> = vec![(None, "by default")];
    options.extend(names.iter().enumerate().map(|(i, name)| (Some(i), name.as_str())));
    let mut clip = session.scene.clip();
    row(
        ui,
        "Animation",
        "Which animation plays. By default the first, and with it those that drive other things.",
        |ui| choice(ui, "clip", &mut clip, &options),
    );
    if clip != session.scene.clip() {
        session.choose_clip(clip);
    }
}
