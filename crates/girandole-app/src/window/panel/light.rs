//! How light is sampled.

use super::widgets::{choice, optional, row};
use crate::window::session::Session;
use egui::{DragValue, Slider, Ui};
use girandole_core::illumination::Rewalk;
use girandole_core::lights::{LightSettings, MAX_BOUNCES, Pace, Termination};
use girandole_core::visibility::MOST_LIGHTS;

/// [`girandole_core::illumination::IlluminationSettings`].
pub fn show(ui: &mut Ui, session: &mut Session, picture_size: [u32; 2]) {
    samples(ui, &mut session.light.lights);
    placement(ui, session, picture_size);
    row(
        ui,
        "Follow motion",
        "Which samples follow what moves. held: none, but for those on what moves; nothing flickers, and motion is fastest. \
         paths: so many paths of light a frame are walked again. all: all are sampled anew at each change, which is slow.",
        |ui| rewalk(ui, &mut session.light.rewalk),
    );
    row(
        ui,
        "At rest",
        "Once nothing moves any more, light is sampled anew for what is seen: the picture is that of girandole render. Off: \
         samples stay as they are.",
        |ui| ui.checkbox(&mut session.fresh_at_rest, "sample anew"),
    );
    row(
        ui,
        "Movers reflect",
        "Whether paths of light see movable objects when light is sampled. Off suits held samples of objects that move much.",
        |ui| ui.checkbox(&mut session.light.lights.walk_dynamic, ""),
    );
}

fn samples(ui: &mut Ui, lights: &mut LightSettings) {
    row(
        ui,
        "Light samples",
        "How many. The error falls about as their number grows; time and memory rise with it.",
        |ui| {
            let range = 1..=MOST_LIGHTS as u32;
            ui.add(Slider::new(&mut lights.count, range).logarithmic(true))
        },
    );
    row(
        ui,
        "On emitters",
        "Share of the samples that lie on emitters; the others are left by random walks. Higher: smoother direct light; \
         lower: smoother indirect light. auto: as the light demands.",
        |ui| {
            optional(ui, (&mut lights.direct_share, 0.5), "auto", |ui, share| {
                ui.add(DragValue::new(share).range(0.0..=1.0).speed(0.01))
            })
        },
    );
    row(
        ui,
        "Bounces",
        "Most bounces of indirect light. More: brighter corners, up to what the walls' colour lets through; 0: direct light only.",
        |ui| ui.add(DragValue::new(&mut lights.bounces).range(0..=MAX_BOUNCES)),
    );
    row(ui, "Seed", "Same seed, same samples. Another one shows how much of the picture is chance.", |ui| {
        ui.add(DragValue::new(&mut lights.seed))
    });
    row(
        ui,
        "Walks end",
        "albedo: by chance at each hit, which leaves samples of even strength. throughput: at the last bounce only, which leaves \
         weaker samples with each.",
        |ui| {
            let kinds = [(Termination::Albedo, "albedo"), (Termination::Throughput, "throughput")];
            choice(ui, "termination", &mut lights.termination, &kinds)
        },
    );
}

fn placement(ui: &mut Ui, session: &mut Session, picture_size: [u32; 2]) {
    let view = session.view(picture_size);
    row(
        ui,
        "Placed for",
        "Where samples are: where they matter to what the camera saw when they were sampled, or by power alone.",
        |ui| {
            let mut for_view = !session.light.views.is_empty();
            let response = choice(ui, "placement", &mut for_view, &[(true, "a view"), (false, "the scene")]);
            if for_view == session.light.views.is_empty() {
                session.light.views = if for_view { vec![view] } else { Vec::new() };
            }
            response
        },
    );
    if session.is_placed_elsewhere(picture_size) && !matches!(session.light.rewalk, Rewalk::Paths(_)) {
        let button = ui.button("Place them for this view");
        let button = button.on_hover_text(
            "The samples were placed for another view: the picture is right in the mean, but grainier than it could be here.",
        );
        if button.clicked() {
            session.light.views = vec![view];
        }
    }
}

fn rewalk(ui: &mut Ui, rewalk: &mut Rewalk) -> egui::Response {
    let pace = if let Rewalk::Paths(pace) = *rewalk { pace } else { Pace::default() };
    let kinds = [(Rewalk::Off, "held"), (Rewalk::Paths(pace), "paths"), (Rewalk::All, "all")];
    ui.vertical(|ui| {
        let response = choice(ui, "rewalk", rewalk, &kinds);
        let Rewalk::Paths(pace) = rewalk else { return response };
        let paths = DragValue::new(&mut pace.paths).range(1..=100_000).suffix(" paths a frame");
        let paths = ui.add(paths).on_hover_text("More follow faster and take more time a frame.");
        let fade = DragValue::new(&mut pace.fade).range(0..=1000).prefix("fade in ").suffix(" frames");
        let fade =
            ui.add(fade).on_hover_text("Frames in which a sample comes or goes. More: calmer; 0: at once.");
        response.union(paths).union(fade)
    })
    .inner
}
