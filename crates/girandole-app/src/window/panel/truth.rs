//! The picture against the truth.

use super::widgets::{choice, row};
use crate::window::tools::Tools;
use crate::window::truth::Against;
use egui::{Grid, Ui};

/// What it is compared with, and how far it is from that.
pub fn show(ui: &mut Ui, tools: &mut Tools) {
    let truth = &mut tools.truth;
    row(
        ui,
        "Right half",
        "path tracer: a picture without light samples, by as many bounces, that gets better for as long as nothing moves. naive: \
         every light with its shadow map at every pixel, once nothing moves; slow. Drag the line between the two.",
        |ui| {
            let kinds = [
                (Against::Nothing, "the picture"),
                (Against::PathTracer, "path tracer"),
                (Against::Naive, "naive"),
            ];
            choice(ui, "against", &mut truth.against, &kinds)
        },
    );
    if truth.against == Against::Nothing {
        return;
    }
    if let Some(paths) = truth.paths() {
        ui.label(format!("{paths} paths a pixel"));
    }
    let Some(comparison) = &truth.comparison else {
        ui.weak("Compared once nothing moves.");
        return;
    };
    Grid::new("comparison").num_columns(2).striped(true).show(ui, |ui| {
        for (name, value, explanation) in [
            (
                "relMSE",
                format!("{:.5}", comparison.rel_mse),
                "Mean of (t − r)² / (r² + 0.01); noise of the path tracer is part of it.",
            ),
            (
                "energy",
                format!("{:.4}", comparison.energy_ratio),
                "Light in the picture over light in the truth.",
            ),
            #[cfg(not(target_arch = "wasm32"))]
            ("FLIP", format!("{:.4}", comparison.flip), "Mean visible difference, 0 to 1."),
        ] {
            ui.label(name).on_hover_text(explanation);
            ui.label(value).on_hover_text(explanation);
            ui.end_row();
        }
    });
}
