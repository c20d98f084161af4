//! Shadow maps: how large they are, and how many a frame draws anew.

use super::widgets::{choice, optional, row};
use crate::window::session::Session;
use egui::{DragValue, Ui};
use girandole::{MapUpdates, RendererOptions, ShadowMap};

/// [`RendererOptions`], and [`MapUpdates`].
pub fn show(ui: &mut Ui, session: &mut Session) {
    options(ui, &mut session.options);
    updates(ui, &mut session.settings.updates);
}

fn options(ui: &mut Ui, options: &mut RendererOptions) {
    row(
        ui,
        "Shape",
        "Parameterisation. octahedral: straight edges stay straight, no leaks. parabolic: bends edges, light leaks. cube: a \
         quarter of the texels lies idle.",
        |ui| {
            let shapes = [
                (ShadowMap::Octahedral, "octahedral"),
                (ShadowMap::Parabolic, "parabolic"),
                (ShadowMap::Cube, "cube"),
            ];
            choice(ui, "shape", &mut options.shadow_map, &shapes)
        },
    );
    row(
        ui,
        "Size",
        "Texels across a map. Larger: sharper edges of shadows, longer to draw. auto: what the memory holds.",
        |ui| {
            optional(ui, (&mut options.map_size, 256), "auto", |ui, size| {
                ui.add(DragValue::new(size).range(16..=8192).suffix(" texels"))
            })
        },
    );
    row(ui, "Memory", "Budget of all maps. More holds larger maps, or maps of more lights.", |ui| {
        ui.add(DragValue::new(&mut options.memory_mib).range(1..=1_048_576).suffix(" MiB"))
    });
    row(
        ui,
        "Filter",
        "Width of percentage-closer filtering in texels, 0 = off. Wider: softer edges; N takes (N + 1)² look-ups.",
        |ui| ui.add(DragValue::new(&mut options.pcf).range(0..=16).suffix(" texels")),
    );
}

fn updates(ui: &mut Ui, updates: &mut MapUpdates) {
    row(
        ui,
        "Updates a frame",
        "How many of the maps that show what moved a frame draws anew. Fewer are faster, and shadows of what moves lag behind.",
        |ui| {
            optional(ui, (&mut updates.most, 100), "all", |ui, most| {
                ui.add(DragValue::new(most).range(1..=100_000).suffix(" maps"))
            })
        },
    );
    row(
        ui,
        "Oldest map",
        "No map is shown that has been out of date for more frames, whatever the number of updates. Lower: less lag, more work.",
        |ui| {
            optional(ui, (&mut updates.oldest, 30), "any", |ui, oldest| {
                ui.add(DragValue::new(oldest).range(0..=10_000).suffix(" frames"))
            })
        },
    );
}
