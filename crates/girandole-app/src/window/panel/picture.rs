//! How the picture is made and shown.

use super::widgets::{choice, optional, row};
use crate::window::presets::PRESETS;
use crate::window::session::Session;
use crate::window::tools::Tools;
use egui::{ComboBox, DragValue, Slider, TextEdit, Ui};
use girandole::{DebugView, Mode, RenderSettings, Shading};
use girandole_core::lights::Clamp;
use girandole_core::tonemap::{Exposure, Tonemap};

/// Stops either way that the panel offers.
const STOPS: f32 = 16.0;
/// The bound on the geometric factor that the panel starts with, m⁻².
const FIRST_BOUND: f32 = 10.0;

/// Settings that go together.
pub fn preset(ui: &mut Ui, session: &mut Session, size: [u32; 2]) {
    let now = PRESETS.iter().find(|preset| preset.matches(session, size)).map_or("own", |p| p.name);
    row(
        ui,
        "Preset",
        "Settings of light, shadow maps and picture at once; all can be changed afterwards. own: none of these.",
        |ui| {
            let list = ComboBox::from_id_salt("preset").selected_text(now).width(150.0);
            list.show_ui(ui, |ui| {
                for preset in &PRESETS {
                    let label = ui.selectable_label(preset.name == now, preset.name);
                    if label.on_hover_text(preset.explanation).clicked() {
                        preset.apply(session, size);
                    }
                }
            })
            .response
        },
    );
}

/// [`RenderSettings`], all but debug views and updates of shadow maps.
pub fn show(ui: &mut Ui, settings: &mut RenderSettings) {
    row(
        ui,
        "Exposure",
        "Scale before the tone curve, in stops: each doubles the brightness. auto: the mean becomes middle grey.",
        |ui| exposure(ui, &mut settings.exposure),
    );
    row(
        ui,
        "Tone curve",
        "AgX is soft and keeps bright colours from turning garish; ACES has more contrast; none cuts off at 1.",
        |ui| {
            let curves = [(Tonemap::Agx, "AgX"), (Tonemap::Aces, "ACES"), (Tonemap::None, "none")];
            choice(ui, "curve", &mut settings.tonemap, &curves)
        },
    );
    row(
        ui,
        "Mode",
        "How much work is avoided. full: visibility, light maps, low resolution where that is enough; naive: every light \
         with its shadow map at every pixel, which is right and slow.",
        |ui| mode(ui, settings),
    );
    ui.add_enabled_ui(settings.mode != Mode::Naive, |ui| {
        row(
            ui,
            "Shading",
            "fused: each point walks its receiver's lights. multipass: a few lights a pass, added by blending, as in \
             Barczak's thesis; slower, the same picture.",
            |ui| shading(ui, &mut settings.shading),
        );
        row(
            ui,
            "Light maps",
            "Sums of unblocked light, from which what is blocked is subtracted. auto: in mode full only.",
            |ui| {
                let states = [(None, "auto"), (Some(true), "on"), (Some(false), "off")];
                choice(ui, "light maps", &mut settings.light_maps, &states)
            },
        );
    });
    ui.add_enabled_ui(settings.mode.has_low_resolution(), |ui| {
        row(
            ui,
            "Tolerance",
            "How much the light of neighbouring points may differ for pixels between them to be interpolated, as a share. \
             Lower shades more points and takes longer; above 0.2 shadows blur visibly; 0 shades every pixel.",
            |ui| ui.add(Slider::new(&mut settings.tolerance, 0.0..=0.5)),
        );
    });
    row(
        ui,
        "Anti-aliasing",
        "Samples along each axis of a pixel. More smooth edges; time grows with the square, in mode full by much less.",
        |ui| {
            let samples = [(1, "off"), (2, "2 × 2"), (4, "4 × 4")];
            choice(ui, "samples", &mut settings.samples_per_axis, &samples)
        },
    );
    row(
        ui,
        "Clamp",
        "Close to light samples. own: the mean over the surface that a sample stands for. bound: at most so much, in 1/m²; \
         lower is smoother and loses light in corners. off: exact for points, with bright spots.",
        |ui| clamp(ui, &mut settings.clamp),
    );
    ui.add_enabled_ui(settings.clamp == Clamp::Own, |ui| {
        row(
            ui,
            "Mirrors",
            "How many rays follow one another from what is smooth. 0: blurs of what is about it. More show mirrors in mirrors; \
             time grows with what they cover of the picture.",
            |ui| ui.add(Slider::new(&mut settings.mirrors, 0..=8)),
        );
    });
}

/// What goes on at rest.
pub fn refinement(ui: &mut Ui, session: &mut Session) {
    row(
        ui,
        "Refine",
        "While everything is at rest, pictures of further light sets are averaged in, every pixel of them shaded: the picture \
         converges to a path tracer's. It begins anew where something changes.",
        |ui| ui.checkbox(&mut session.refinement.on, ""),
    );
    if session.refinement.on {
        let sets = session.refined_sets();
        let error = session.refinement.estimate(sets);
        let error = error.map_or(String::new(), |error| format!(", estimated relMSE {error:.1e}"));
        ui.label(format!("{sets} light sets{error}"));
    }
}

fn exposure(ui: &mut Ui, exposure: &mut Exposure) -> egui::Response {
    let mut stops = match *exposure {
        Exposure::Auto => None,
        Exposure::Ev(ev) => Some(ev),
    };
    let response = optional(ui, (&mut stops, 0.0), "auto", |ui, ev| {
        ui.add(DragValue::new(ev).range(-STOPS..=STOPS).speed(0.05).suffix(" stops"))
    });
    *exposure = stops.map_or(Exposure::Auto, Exposure::Ev);
    response
}

fn mode(ui: &mut Ui, settings: &mut RenderSettings) -> egui::Response {
    let modes = [
        (Mode::Full, "full"),
        (Mode::LowResolution, "vd-lp"),
        (Mode::Visibility, "vd"),
        (Mode::Naive, "naive"),
    ];
    let response = choice(ui, "mode", &mut settings.mode, &modes);
    if settings.mode == Mode::Naive {
        // It has none of these, and would be refused.
        settings.shading = Shading::Fused;
        settings.light_maps = settings.light_maps.filter(|&used| !used);
        settings.debug = settings.debug.filter(|view| needs_no_receivers(*view));
    }
    response
}

fn shading(ui: &mut Ui, shading: &mut Shading) -> egui::Response {
    let mut lights = match *shading {
        Shading::Fused => None,
        Shading::Multipass { lights_per_pass } => Some(lights_per_pass),
    };
    let response = optional(ui, (&mut lights, 7), "fused", |ui, lights| {
        ui.add(DragValue::new(lights).range(1..=32).suffix(" lights a pass"))
    });
    *shading = lights.map_or(Shading::Fused, |lights_per_pass| Shading::Multipass { lights_per_pass });
    response
}

fn clamp(ui: &mut Ui, clamp: &mut Clamp) -> egui::Response {
    let bound = if let Clamp::At(bound) = *clamp { bound } else { FIRST_BOUND };
    let kinds = [(Clamp::Own, "own"), (Clamp::At(bound), "bound"), (Clamp::Off, "off")];
    ui.vertical(|ui| {
        let response = choice(ui, "clamp", clamp, &kinds);
        match clamp {
            Clamp::At(bound) => {
                let value = DragValue::new(bound).range(1e-3..=1e6).speed(0.1).suffix(" /m²");
                response.union(ui.add(value))
            }
            _ => response,
        }
    })
    .inner
}

/// Whether a mode has a debug view.
pub fn has_debug_view(mode: Mode, view: Option<DebugView>) -> bool {
    mode != Mode::Naive || view.is_none_or(needs_no_receivers)
}

fn needs_no_receivers(view: DebugView) -> bool {
    matches!(view, DebugView::LightPositions | DebugView::Atlas)
}

/// Debug views, with their names and what they show.
pub const DEBUG_VIEWS: [(Option<DebugView>, &str, &str); 7] = [
    (None, "the picture", "What is rendered."),
    (
        Some(DebugView::LightPositions),
        "light samples",
        "A dot at each light sample; a ring where it is hidden.",
    ),
    (
        Some(DebugView::Atlas),
        "shadow maps",
        "The map of each light, in rows: near blockers bright, dark blue where there are none.",
    ),
    (Some(DebugView::Receivers), "receivers", "Leaf receivers, each in a colour of its own."),
    (Some(DebugView::States(None)), "states", "How many lights need a shadow map: white where all do."),
    (Some(DebugView::LightMaps), "light maps", "The sums that light maps hold."),
    (
        Some(DebugView::Levels),
        "levels",
        "Where points were shaded: blue every 8 pixels, green 4, yellow 2, red each.",
    ),
];

/// The choice of a debug view.
pub fn debug(ui: &mut Ui, session: &mut Session) {
    let lights =
        session.shown_by().and_then(|(r, _)| r.illumination()).map_or(0, |i| i.lights().len() as u32);
    let settings = &mut session.settings;
    for (view, name, explanation) in DEBUG_VIEWS {
        let possible = has_debug_view(settings.mode, view);
        ui.add_enabled_ui(possible, |ui| {
            ui.radio_value(&mut settings.debug, view, name).on_hover_text(explanation);
        });
    }
    if let Some(DebugView::States(light)) = &mut settings.debug {
        row(
            ui,
            "Of light",
            "The states of one light: green where nothing blocks it, yellow where something may, dark red where all is blocked.",
            |ui| {
                optional(ui, (light, 0), "all", |ui, light| {
                    ui.add(DragValue::new(light).range(0..=lights.saturating_sub(1)))
                })
            },
        );
    }
}

/// The file of the next picture.
pub fn save(ui: &mut Ui, tools: &mut Tools) {
    ui.horizontal(|ui| {
        ui.add(TextEdit::singleline(&mut tools.file).desired_width(200.0)).on_hover_text(
            "A .png as it is shown, or an .exr with linear radiance. Where the file is there, a number is added.",
        );
        tools.saves |= ui.button("Save").on_hover_text("Saves the picture (F12)").clicked();
    });
    if cfg!(target_arch = "wasm32") {
        let link = ui
            .button("Copy link")
            .on_hover_text("Copies the address of a page that shows this picture (F9).");
        tools.copies |= link.clicked();
        return;
    }
    tools.copies |= ui
        .button("Copy command line")
        .on_hover_text(
            "Copies the call of girandole render that gives this picture, to the byte, and says it in the terminal (F9). What \
             was changed in the scene is written to a file beside the picture's. Samples that follow paths have another grain.",
        )
        .clicked();
}
