//! What the picked object is made of.

use super::widgets::row;
use crate::window::lamps::Lamp;
use crate::window::session::Session;
use egui::{Slider, Ui};
use girandole_core::glam::Vec3;
use girandole_core::scene::{Edit, MaterialId, NamedIndex, ObjectId, Shades};

/// Of an object with more of them, the others are not shown.
const MOST: usize = 8;

/// The factors of each of an object's materials.
pub fn show(ui: &mut Ui, session: &mut Session, id: ObjectId) {
    let of_object = |id: ObjectId| Some(&session.scene.meshes[session.scene.objects.get(id.index())?.mesh]);
    let Some(mesh) = of_object(id) else { return };
    let mut materials: Vec<MaterialId> = Vec::new();
    // Triangles of one material lie side by side as a rule.
    for run in mesh.triangles.chunk_by(|a, b| a.material == b.material) {
        if !materials.contains(&run[0].material) && materials.len() <= MOST {
            materials.push(run[0].material);
        }
    }
    for &material in materials.iter().take(MOST) {
        ui.push_id(material.0, |ui| one(ui, session, material));
    }
    if materials.len() > MOST {
        ui.weak("It has more materials.");
    }
}

fn one(ui: &mut Ui, session: &mut Session, index: MaterialId) {
    let material = &session.scene.materials[index];
    let mut shades = material.shades();
    let is_textured = material.base_color_texture.is_some();
    let name = Lamp::Material(index).name(&session.scene);
    ui.add(egui::Label::new(egui::RichText::new(name).weak()).truncate())
        .on_hover_text("What it is made of; other objects of this material change with it.");
    let explanation = if is_textured {
        "What its texture is multiplied by."
    } else {
        "Share of the light that it reflects, in linear light; of metals, the colour of what they mirror."
    };
    row(ui, "Albedo", explanation, |ui| {
        let mut color = shades.base_color.to_array();
        let response = ui.color_edit_button_rgb(&mut color);
        // The button rounds colours that nobody touches.
        if response.changed() {
            shades.base_color = Vec3::from(color).clamp(Vec3::ZERO, Vec3::ONE);
        }
        response
    });
    row(
        ui,
        "Gloss",
        "Strength of what it mirrors, if it is no metal: 0 is matt, 1 as plastic or varnish.",
        |ui| ui.add(share(&mut shades.specular)),
    );
    row(ui, "Roughness", "How blurred that is: 0 is a mirror. Matt materials have none.", |ui| {
        let is_specular = shades.specular > 0.0 || shades.metallic > 0.0;
        ui.add_enabled(is_specular, share(&mut shades.roughness))
    });
    row(ui, "Metal", "0: reflects by its surface and from within; 1: mirrors in its own colour.", |ui| {
        ui.add(share(&mut shades.metallic))
    });
    if shades != session.scene.materials[index].shades() {
        let Shades { metallic, roughness, specular, .. } = shades;
        let [metallic, roughness, specular] = [metallic, roughness, specular].map(|x| x.clamp(0.0, 1.0));
        let material = NamedIndex::material(&session.scene, index);
        session
            .edit(Edit::SetShades { material, shades: Shades { metallic, roughness, specular, ..shades } });
    }
}

fn share(value: &mut f32) -> Slider<'_> {
    Slider::new(value, 0.0..=1.0).max_decimals(3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::window::session::tests::session;

    #[test]
    fn a_material_that_nobody_touches_stays_as_it_is() {
        let mut session = session();
        let context = egui::Context::default();
        for object in 0..session.scene.objects.len() {
            for _ in 0..2 {
                let output = context.run_ui(Default::default(), |ui| show(ui, &mut session, object.into()));
                output.drop_without_applying_deltas();
            }
        }
        assert!(session.edits.0.is_empty(), "{:?}", session.edits);
    }
}
