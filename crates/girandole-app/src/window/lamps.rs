//! What shines: how strong it is in the units of lamps, and how one is added.

use super::camera::moved;
use super::selection::Selected;
use super::session::Session;
use super::tools::Tools;
use girandole_core::Generation;
use girandole_core::glam::{Quat, Vec3};
use girandole_core::image::luminance;
use girandole_core::scene::{
    Edit, Geometry, LightId, MaterialId, NamedIndex, PunctualKind, Scene, Shape, Transform, load_model,
};
use std::collections::BTreeSet;
use std::f64::consts::PI;

/// Luminous flux of one watt of light that the eye sees best, lm/W: what radiance is in units of.
pub const LUMEN_PER_WATT: f64 = 683.0;

/// How far in front of the camera a lamp is put, and how wide a panel is, in the scene's size.
const DISTANCE: f32 = 0.2;
const SIZE: f32 = 0.08;

/// Flux of a new lamp where nothing else shines, lm, and its share of the strongest lamp's elsewhere.
const FLUX: f64 = 1000.0;
const SHARE: f64 = 0.25;

/// Half-angles of a new spot, radians.
const CONE: [f32; 2] = [0.35, 0.55];

/// Something that shines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lamp {
    /// All surfaces of a material.
    Material(MaterialId),
    /// A punctual light.
    Light(LightId),
}

/// How the strength of a lamp is said.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Unit {
    /// Luminous flux (of parallel light: illuminance).
    #[default]
    Lumen,
    /// Radiant flux (of parallel light: irradiance), weighted as the eye does.
    Watt,
    /// Radiance, or intensity, of the brightest channel.
    Radiance,
}

/// Areas of materials' surfaces.
#[derive(Default)]
pub struct Areas {
    of: Option<Generation>,
    /// m².
    areas: Vec<f64>,
}

impl Areas {
    /// Of a material, as it was last drawn, m².
    fn get(&mut self, session: &Session, material: MaterialId) -> Option<f64> {
        let geometry = session.illumination()?.geometry();
        if self.of != Some(geometry.generation()) {
            self.of = Some(geometry.generation());
            self.areas = areas(geometry, session.scene.materials.len());
        }
        self.areas.get(material.index()).copied().filter(|area| *area > 0.0)
    }
}

fn areas(geometry: &Geometry, materials: usize) -> Vec<f64> {
    let mut areas = vec![0.0; materials];
    for (index, triangle) in geometry.triangles.iter().enumerate() {
        let [a, b, c] = geometry.corners(index as u32).map(|p| p.as_dvec3());
        if let Some(area) = areas.get_mut(triangle.material.index()) {
            *area += (b - a).cross(c - a).length() * 0.5;
        }
    }
    areas
}

impl Lamp {
    /// All of them: what shines, and what was switched off.
    pub fn all(session: &Session) -> Vec<Self> {
        let scene = &session.scene;
        let dimmed = session.edits.0.iter().filter_map(|edit| match edit {
            Edit::SetEmission { material, .. } => Some(material.index),
            _ => None,
        });
        let dimmed: BTreeSet<usize> = dimmed.collect();
        let shines = |&index: &usize| scene.materials[index].emits() || dimmed.contains(&index);
        let materials = (0..scene.materials.len()).filter(shines).map(|index| Self::Material(index.into()));
        materials.chain(scene.placed_lights().map(|(id, _)| Self::Light(id))).collect()
    }

    /// Whether it is what is picked, or what that is made of.
    pub fn is_of(self, session: &Session, selected: Selected) -> bool {
        match (selected, self) {
            (Selected::Light(index), Self::Light(light)) => index == light,
            (Selected::Object(_), Self::Material(material)) => {
                selected.object(session).is_some_and(|object| {
                    session.scene.meshes[object.mesh].triangles.iter().any(|t| t.material == material)
                })
            }
            _ => false,
        }
    }

    pub fn name(self, scene: &Scene) -> String {
        let (kind, index, name) = match self {
            Self::Material(index) => ("material", index.index(), &scene.materials[index].name),
            Self::Light(id) => ("light", id.index(), &scene.lights[id].name),
        };
        if name.is_empty() { format!("{kind} {index}") } else { name.clone() }
    }

    /// Its radiance or intensity.
    pub fn light(self, scene: &Scene) -> Vec3 {
        match self {
            Self::Material(index) => scene.materials[index].emission,
            Self::Light(index) => scene.lights[index].intensity,
        }
    }

    /// Makes it shine so.
    pub fn shine(self, scene: &Scene, light: Vec3) -> Edit {
        match self {
            Self::Material(index) => {
                Edit::SetEmission { material: NamedIndex::material(scene, index), emission: light }
            }
            Self::Light(index) => {
                Edit::SetIntensity { light: NamedIndex::light(scene, index), intensity: light }
            }
        }
    }

    /// What its brightest channel is multiplied by for the number in this unit, where its colour has 1 there; and
    /// the unit's name.
    pub fn measure(self, session: &Session, tools: &mut Tools, color: Vec3) -> (f64, &'static str) {
        let (extent, names) = match self {
            Self::Light(index) => match session.scene.lights[index].kind.solid_angle() {
                Some(solid_angle) => (Some(solid_angle), [" lm", " W", " W/sr"]),
                None => (Some(1.0), [" lx", " W/m²", " W/m²"]),
            },
            Self::Material(index) => {
                let material = &session.scene.materials[index];
                let is_even = material.emission_texture.is_none();
                let sides = if material.double_sided { 2.0 } else { 1.0 };
                let area = tools.areas.get(session, index).filter(|_| is_even);
                (area.map(|area| PI * area * sides), [" lm", " W", " W/(sr·m²)"])
            }
        };
        let seen = f64::from(luminance(color));
        match (tools.unit, extent.filter(|_| seen > 0.0)) {
            (Unit::Lumen, Some(extent)) => (seen * extent * LUMEN_PER_WATT, names[0]),
            (Unit::Watt, Some(extent)) => (seen * extent, names[1]),
            _ => (1.0, names[2]),
        }
    }
}

/// Switches a lamp off, or on again as it was.
pub fn switch(session: &mut Session, tools: &mut Tools, lamp: Lamp, on: bool) {
    let light = lamp.light(&session.scene);
    let kept = tools.switched_off.iter().position(|(other, _)| *other == lamp);
    let kept = kept.map(|kept| tools.switched_off.swap_remove(kept).1);
    let next = if on { kept.unwrap_or(Vec3::ONE) } else { Vec3::ZERO };
    if !on {
        tools.switched_off.extend((light != Vec3::ZERO).then_some((lamp, light)));
    }
    let edit = lamp.shine(&session.scene, next);
    session.edit(edit);
}

/// Switches what is picked off, or on again: a lamp, or what an object is made of.
pub fn switch_picked(session: &mut Session, tools: &mut Tools) {
    let Some(selected) = tools.selected.filter(|selected| selected.is_there(session)) else { return };
    let picked = Lamp::all(session).into_iter().find(|lamp| lamp.is_of(session, selected));
    if let Some(lamp) = picked {
        let is_on = lamp.light(&session.scene).max_element() > 0.0;
        switch(session, tools, lamp, !is_on);
        session.end_step();
    }
}

/// What can be added.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NewLamp {
    Point,
    Spot,
    Panel,
}

/// Puts a lamp in front of the camera, as bright as suits the scene, and picks it.
pub fn add(session: &mut Session, tools: &mut Tools, lamp: NewLamp) {
    let size = session.scene.frame_of_reference().scale;
    let view = session.view(tools.picture_size);
    let place = moved(&view, Vec3::Z * size * DISTANCE).eye.as_vec3();
    let down = Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    let transform = Transform::rigid(down, place);
    let watts = flux(session, tools) / LUMEN_PER_WATT;
    let (objects, lights) = (session.scene.objects.len(), session.scene.lights.len().into());
    let punctual = |name: &str, kind: PunctualKind| {
        let watts_per_steradian = watts / kind.solid_angle().unwrap_or(1.0);
        let intensity = Vec3::splat(watts_per_steradian as f32);
        vec![Edit::InsertLight { name: name.into(), kind, intensity, transform }]
    };
    let (edits, selected) = match lamp {
        NewLamp::Point => (punctual("point lamp", PunctualKind::Point), Selected::Light(lights)),
        NewLamp::Spot => {
            let [inner, outer] = CONE;
            (punctual("spot lamp", PunctualKind::Spot { inner, outer }), Selected::Light(lights))
        }
        NewLamp::Panel => {
            let side = size * SIZE;
            let name = "panel".to_owned();
            let transform =
                Transform::Parts { translation: place, rotation: down, scale: Vec3::new(side, side, 1.0) };
            let radiance = watts / (PI * f64::from(side * side));
            let material = NamedIndex { index: session.scene.materials.len(), name: name.clone() };
            let edits = vec![
                Edit::InsertObject { name, shape: Shape::Panel, material: None, transform, dynamic: true },
                Edit::SetEmission { material, emission: Vec3::splat(radiance as f32) },
            ];
            (edits, Selected::Object(objects.into()))
        }
    };
    session.edit_all(edits, &load_model);
    session.end_step();
    if selected.is_there(session) {
        tools.select(Some(selected));
    }
}

/// Of a new lamp, lm: two digits.
fn flux(session: &Session, tools: &mut Tools) -> f64 {
    let before = std::mem::replace(&mut tools.unit, Unit::Lumen);
    let strongest = Lamp::all(session).into_iter().filter_map(|lamp| {
        let light = lamp.light(&session.scene);
        let brightest = light.max_element();
        let (factor, unit) = lamp.measure(session, tools, light / brightest.max(1e-12));
        (unit == " lm").then_some(factor * f64::from(brightest))
    });
    let strongest = strongest.fold(0.0, f64::max);
    tools.unit = before;
    if strongest > 0.0 { rounded(strongest * SHARE) } else { FLUX }
}

/// A number of two digits.
fn rounded(x: f64) -> f64 {
    let step = 10f64.powf(x.log10().floor() - 1.0);
    (x / step).round() * step
}

#[cfg(test)]
mod tests {
    use super::super::session::tests::{SIZE, drawn};
    use super::*;

    fn tools() -> Tools {
        Tools::new("shot.png".into(), SIZE, None)
    }

    #[test]
    fn numbers_are_rounded_to_two_digits() {
        for (x, y) in [(1234.0, 1200.0), (0.0567, 0.057), (99.6, 100.0)] {
            assert!((rounded(x) - y).abs() < 1e-9, "{x}");
        }
    }

    #[test]
    fn a_lamp_of_so_many_lumens_has_the_intensity_of_its_solid_angle() {
        let drawn = drawn();
        let (mut session, mut tools) = (drawn.session, tools());
        let wanted = flux(&session, &mut tools);
        assert!(wanted > 0.0 && wanted != FLUX);
        for (lamp, kind) in
            [(NewLamp::Point, " W/sr"), (NewLamp::Spot, " W/sr"), (NewLamp::Panel, " W/(sr·m²)")]
        {
            add(&mut session, &mut tools, lamp);
            assert_eq!(session.notice, None);
            session.follow(SIZE);
            let added = match tools.selected {
                Some(Selected::Light(index)) => Lamp::Light(index),
                _ => Lamp::Material((session.scene.materials.len() - 1).into()),
            };
            let brightest = f64::from(added.light(&session.scene).max_element());
            let mut measured = |unit| {
                tools.unit = unit;
                let (factor, name) = added.measure(&session, &mut tools, Vec3::ONE);
                (factor * brightest, name)
            };
            let (lumens, watts) = (measured(Unit::Lumen).0, measured(Unit::Watt).0);
            assert!((lumens / wanted - 1.0).abs() < 1e-3, "{lamp:?}: {lumens} lm of {wanted}");
            assert!((watts * LUMEN_PER_WATT / wanted - 1.0).abs() < 1e-3, "{lamp:?}: {watts} W");
            assert_eq!(measured(Unit::Radiance), (brightest, kind));
        }
        // A point light of 1 W/sr is 4π W.
        let point = Lamp::Light((session.scene.lights.len() - 2).into());
        tools.unit = Unit::Watt;
        assert!((point.measure(&session, &mut tools, Vec3::ONE).0 - 4.0 * PI).abs() < 1e-6);
        // What is switched off is still listed.
        let all = Lamp::all(&session).len();
        session.edit(point.shine(&session.scene, Vec3::ZERO));
        let material = session.scene.materials.len() - 1;
        session.edit(Lamp::Material(material.into()).shine(&session.scene, Vec3::ZERO));
        assert_eq!(Lamp::all(&session).len(), all);
    }
}
