//! Lights, and what is all around.

use super::{SceneMirror, Stores};
use crate::environment;
use crate::lights::{self, Shape, Source};
use bevy::asset::AssetId;
use bevy::ecs::entity::Entity;
use bevy::image::Image;
use bevy::math::Quat;
use girandole_core::glam::Vec3;
use girandole_core::scene::{LightId, Material, MaterialId, NodeId, ObjectId, PunctualLight, Transform};

/// Which component a light is of: an entity may have several.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Kind {
    Point,
    Spot,
    Directional,
    Rectangle,
}

/// A light that was taken.
#[derive(Clone, Copy)]
pub(super) enum Lamp {
    Punctual(LightId),
    Rectangle { material: MaterialId, node: NodeId, mesh: usize, shown: Option<ObjectId> },
}

/// Where a cube map's light comes from.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Surroundings {
    pub image: AssetId<Image>,
    pub nits: f32,
    pub rotation: Quat,
}

impl SceneMirror {
    /// A light came, or is another one by now; without a source it is dark.
    pub(crate) fn shine(&mut self, key: (Entity, Kind), source: Option<Source>) {
        match (self.lamps.get(&key).copied(), source) {
            (None, None) => {}
            (None, Some(source)) => {
                let lamp = self.add_lamp(source);
                self.lamps.insert(key, lamp);
            }
            (Some(Lamp::Punctual(light)), source) => {
                let found = self.scene.lights[light].clone();
                if let Some(Source { shape, place, .. }) = source {
                    self.put(found.node, place);
                    if let Shape::Punctual(kind) = shape
                        && kind != found.kind
                    {
                        self.scene.lights[light].kind = kind;
                        self.is_touched = true;
                    }
                }
                let intensity = source.map_or(Vec3::ZERO, |source| source.light);
                let done = self.scene.set_intensity(light, intensity);
                self.report(done);
            }
            (Some(Lamp::Rectangle { material, node, mesh, shown }), source) => {
                let shown = match (shown, source) {
                    (Some(object), None) => {
                        self.remove_object(object);
                        None
                    }
                    (None, Some(_)) => Some(self.push_object(node, mesh)),
                    (shown, _) => shown,
                };
                if let Some(source) = source {
                    self.put(node, source.place);
                    let done = self.scene.set_emission(material, source.light);
                    self.report(done);
                }
                self.lamps.insert(key, Lamp::Rectangle { material, node, mesh, shown });
            }
        }
    }

    /// A light is gone.
    pub(crate) fn put_out(&mut self, key: (Entity, Kind)) {
        match self.lamps.remove(&key) {
            Some(Lamp::Punctual(light)) => {
                let done = self.scene.remove_light(light);
                self.report(done);
            }
            Some(Lamp::Rectangle { shown: Some(object), .. }) => self.remove_object(object),
            _ => {}
        }
    }

    fn add_lamp(&mut self, Source { shape, light, place }: Source) -> Lamp {
        self.is_touched = true;
        let node = self.scene.add_node("", Transform::Affine(place));
        match shape {
            Shape::Punctual(kind) => {
                let lamp = PunctualLight { name: String::new(), node, kind, intensity: light };
                self.scene.lights.push(lamp);
                Lamp::Punctual((self.scene.lights.len() - 1).into())
            }
            Shape::Rectangle => {
                let material = self.scene.add_material(Material::emitter("", light));
                self.scene.meshes.push(lights::rectangle(material));
                let mesh = self.scene.meshes.len() - 1;
                let shown = Some(self.push_object(node, mesh));
                Lamp::Rectangle { material, node, mesh, shown }
            }
        }
    }

    /// What is all around; nothing without a cube map. One that is not loaded is asked for again.
    pub(crate) fn surround(&mut self, surroundings: Option<Surroundings>, stores: Stores) {
        if self.surroundings == surroundings {
            return;
        }
        let environment = match surroundings {
            None => None,
            Some(Surroundings { image, nits, rotation }) => {
                let Some(image) = stores.images.get(image) else { return };
                match environment::convert(image, nits, rotation) {
                    Ok(environment) => Some(environment),
                    Err(what) => {
                        self.notices.say(format!("an environment map lights nothing: its image {what}"));
                        None
                    }
                }
            }
        };
        self.scene.environment = environment;
        self.surroundings = surroundings;
        self.is_touched = true;
    }
}
