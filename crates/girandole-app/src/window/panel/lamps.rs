//! What shines: colour, strength, on and off, and new lamps.

use super::widgets::{choice, row};
use crate::window::lamps::{Lamp, NewLamp, Unit, add, switch};
use crate::window::selection::Selected;
use crate::window::session::Session;
use crate::window::tools::Tools;
use egui::{DragValue, ScrollArea, Slider, Ui};
use girandole_core::glam::Vec3;
use girandole_core::scene::{Edit, LightId, NamedIndex, PunctualKind};

/// What is offered as the brightest channel.
const STRONGEST: f32 = 1e6;
/// More of them are in a list of their own height, points.
const MANY: usize = 12;
const HEIGHT: f32 = 280.0;

/// How a lamp shines.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Shine {
    light: Vec3,
    /// What the brightest channel is multiplied by for the number that is shown.
    factor: f64,
}

/// All lamps, the one that is picked first, and new ones.
pub fn show(ui: &mut Ui, session: &mut Session, tools: &mut Tools) {
    ui.horizontal(|ui| {
        ui.label("Add");
        for (name, lamp, explanation) in [
            ("point", NewLamp::Point, "Shines in all directions from a point"),
            ("spot", NewLamp::Spot, "Shines in a cone, downwards at first"),
            ("panel", NewLamp::Panel, "A square that shines to one side, downwards at first"),
        ] {
            let explanation = format!("{explanation}. It is put in front of the camera.");
            if ui.button(name).on_hover_text(explanation).clicked() {
                add(session, tools, lamp);
            }
        }
    });
    let units = [(Unit::Lumen, "lumen"), (Unit::Watt, "watt"), (Unit::Radiance, "radiance")];
    let explanation = "Of the strength: luminous flux, at 683 lumen a watt; radiant flux, weighted as the eye does; or \
                       radiance and intensity of the brightest channel. Parallel light has illuminance or irradiance.";
    row(ui, "Unit", explanation, |ui| choice(ui, "unit", &mut tools.unit, &units));
    if let Some(Selected::Light(index)) = tools.selected.filter(|selected| selected.is_there(session)) {
        cone(ui, session, index);
    }
    let mut lamps = Lamp::all(session);
    let picked = |lamp: &Lamp| tools.selected.is_some_and(|selected| lamp.is_of(session, selected));
    lamps.sort_by_key(|lamp| !picked(lamp));
    if lamps.is_empty() {
        ui.weak("Nothing here shines but what is around it.");
    }
    let mut list = |ui: &mut Ui| lamps.iter().for_each(|lamp| one(ui, session, tools, *lamp));
    if lamps.len() > MANY {
        ScrollArea::vertical().id_salt("lamps").max_height(HEIGHT).show(ui, list);
    } else {
        list(ui);
    }
}

fn cone(ui: &mut Ui, session: &mut Session, index: LightId) {
    let PunctualKind::Spot { inner, outer } = session.scene.lights[index].kind else { return };
    let (mut inside, mut outside) = (inner.to_degrees(), outer.to_degrees());
    row(ui, "Cone", "Half-angle at which the spot's light ends.", |ui| {
        ui.add(Slider::new(&mut outside, 1.0..=90.0).suffix("°").max_decimals(1))
    });
    row(
        ui,
        "Full within",
        "Half-angle within which its light is full. Close to the other one: a sharp edge.",
        |ui| ui.add(Slider::new(&mut inside, 0.0..=89.0).suffix("°").max_decimals(1)),
    );
    if (inside, outside) != (inner.to_degrees(), outer.to_degrees()) {
        let outer = outside.to_radians().min(std::f32::consts::FRAC_PI_2);
        let inner = inside.min(outside - 0.5).max(0.0).to_radians();
        let light = NamedIndex::light(&session.scene, index);
        session.edit(Edit::SetCone { light, inner, outer });
    }
}

fn one(ui: &mut Ui, session: &mut Session, tools: &mut Tools, lamp: Lamp) {
    let light = lamp.light(&session.scene);
    let brightest = light.max_element();
    let kept = tools.switched_off.iter().position(|(other, _)| *other == lamp);
    // Its colour while it is off.
    let color = match (brightest > 0.0, kept) {
        (true, _) => light / brightest,
        (false, Some(kept)) => tools.switched_off[kept].1 / tools.switched_off[kept].1.max_element(),
        (false, None) => Vec3::ONE,
    };
    let name = lamp.name(&session.scene);
    let measured = |color: Vec3, tools: &mut Tools| lamp.measure(session, tools, color);
    let (factor, unit) = measured(color, tools);
    let (mut is_on, mut switched, mut next) = (brightest > 0.0, None, None);
    let row = ui.horizontal(|ui| {
        if ui.checkbox(&mut is_on, "").on_hover_text("On or off; of what is picked: O").changed() {
            switched = Some(is_on);
        }
        if let Some(changed) = emitter(ui, Shine { light, factor }, color, unit) {
            next = Some(changed.light(|color| measured(color, tools).0));
        }
        ui.add(egui::Label::new(&name).truncate().sense(egui::Sense::click()))
    });
    if let (true, Lamp::Light(index)) = (row.inner.clicked(), lamp) {
        tools.select(Some(Selected::Light(index)));
    }
    match (switched, next) {
        (Some(on), _) => switch(session, tools, lamp, on),
        (None, Some(Vec3::ZERO)) => switch(session, tools, lamp, false),
        (None, Some(next)) => {
            let edit = lamp.shine(&session.scene, next);
            session.edit(edit);
        }
        (None, None) => {}
    }
}

/// What was changed about a lamp: its colour has 1 as its brightest channel.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Changed {
    color: Vec3,
    /// As it was shown.
    strength: f64,
}

impl Changed {
    /// The light that it is to have, by what the brightest channel of a colour is multiplied by for the number shown.
    fn light(self, factor: impl FnOnce(Vec3) -> f64) -> Vec3 {
        let brightest = (self.strength / factor(self.color)) as f32;
        self.color * brightest.clamp(0.0, STRONGEST)
    }
}

/// What a lamp is changed to, if it was: its colour, and its strength in the unit that is shown. 0 is off.
fn emitter(ui: &mut Ui, shine: Shine, color: Vec3, unit: &str) -> Option<Changed> {
    let strength = f64::from(shine.light.max_element()) * shine.factor;
    let (mut shown, mut next) = (color.to_array(), strength);
    let picked = ui.color_edit_button_rgb(&mut shown).on_hover_text("Colour, in linear light").changed();
    let speed = strength.max(1e-3 * shine.factor) * 0.01;
    let range = 0.0..=f64::from(STRONGEST) * shine.factor;
    let drag = DragValue::new(&mut next).range(range).speed(speed).suffix(unit).max_decimals(4);
    let dragged = ui.add(drag).on_hover_text("Strength; 0 is off").changed();
    let shown = Vec3::from(shown);
    let color = if shown.max_element() > 0.0 { shown / shown.max_element() } else { color };
    (picked || dragged).then_some(Changed { color, strength: next })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_emitter_that_nobody_touches_stays_as_it_is() {
        let shine = Shine { light: Vec3::new(4.0, 2.0, 0.0), factor: 683.0 };
        let mut result = Some(Changed { color: Vec3::ONE, strength: 1.0 });
        let context = egui::Context::default();
        let output = context.run_ui(Default::default(), |ui| {
            result = ui.horizontal(|ui| emitter(ui, shine, Vec3::new(1.0, 0.5, 0.0), "")).inner;
        });
        output.drop_without_applying_deltas();
        assert_eq!(result, None);
    }

    #[test]
    fn nothing_is_nothing_and_another_colour_has_the_same_flux() {
        let factor = |color: Vec3| f64::from(color.y) * 683.0;
        let off = Changed { color: Vec3::ONE, strength: 0.0 };
        assert_eq!(off.light(factor), Vec3::ZERO);
        let green = Changed { color: Vec3::new(0.2, 1.0, 0.2), strength: 683.0 };
        assert!((green.light(factor).y - 1.0).abs() < 1e-6);
        let purple = Changed { color: Vec3::new(1.0, 0.5, 1.0), strength: 683.0 };
        assert!(purple.light(factor).abs_diff_eq(Vec3::new(2.0, 1.0, 2.0), 1e-6));
    }
}
