//! Punctual lights (`KHR_lights_punctual`).

use super::document::lookup;
use super::{Importer, NodeId, Parsed};
use crate::scene::{PunctualKind, PunctualLight};
use glam::Vec3;
use gltf::json;
use gltf::json::extensions::scene::khr_lights_punctual::{Light, Type};
use gltf::json::validation::Checked;
use std::f32::consts::FRAC_PI_2;

impl Importer<'_> {
    /// The light on a node, if there is one; one that is broken is left out.
    pub(super) fn read_light(&mut self, json: &json::Node, node: NodeId) -> Parsed<()> {
        let extension = json.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        let Some(index) = extension.map(|e| e.light.value()) else { return Ok(()) };
        let lights = self.document.root.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        let light = lookup(lights.map_or(&[][..], |l| &l.lights), index, "light");
        let named = light.as_ref().ok().and_then(|light| light.name.clone()).filter(|n| !n.is_empty());
        let name = named.unwrap_or_else(|| self.scene.nodes[node].name.clone());
        let read = light.and_then(|light| self.light(light, name.clone(), node));
        let shown = || if name.is_empty() { index.to_string() } else { format!("`{name}`") };
        if let Some(light) = self.or_without("light", shown, read)? {
            self.scene.lights.push(light);
        }
        Ok(())
    }

    fn light(&mut self, json: &Light, name: String, node: NodeId) -> Parsed<PunctualLight> {
        let intensity = Vec3::from(json.color) * json.intensity;
        if !(intensity.is_finite() && intensity.min_element() >= 0.0) {
            return Err(format!("it has an intensity of {intensity}; correct it"));
        }
        let kind = match json.type_ {
            Checked::Valid(Type::Point) => PunctualKind::Point,
            Checked::Valid(Type::Directional) => PunctualKind::Directional,
            Checked::Valid(Type::Spot) => {
                let spot = json.spot.clone().unwrap_or_default();
                if spot.outer_cone_angle.is_nan() || spot.inner_cone_angle.is_nan() {
                    return Err("its cone has no angle; correct it".into());
                }
                // A cone needs some width, and glTF's falloff a difference of cosines.
                let outer = spot.outer_cone_angle.clamp(1e-3, FRAC_PI_2);
                let inner = spot.inner_cone_angle.clamp(0.0, outer * 0.999);
                PunctualKind::Spot { inner, outer }
            }
            Checked::Invalid => {
                return Err("it is of an unknown type; make it a point, spot or directional light, or a panel that emits".into());
            }
        };
        if json.range.is_some() {
            self.scene
                .warn("ranges of lights are left out: light falls off by the inverse square alone".into());
        }
        Ok(PunctualLight { name, node, kind, intensity })
    }
}
