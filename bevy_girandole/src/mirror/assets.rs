//! Assets that change.

use super::{SceneMirror, Stores};
use crate::{materials, meshes, textures};
use bevy::asset::AssetId;
use bevy::ecs::entity::Entity;
use bevy::image::Image;
use bevy::mesh::Mesh;
use bevy::pbr::StandardMaterial;
use girandole_core::scene::{Material, MaterialId};

impl SceneMirror {
    /// The exposure that shows what is not exposed; materials follow it.
    pub(crate) fn expose(&mut self, exposure: f32, stores: Stores) {
        if self.exposure != exposure {
            self.exposure = exposure;
            let all: Vec<_> = self.materials.keys().map(|key| key.0).collect();
            all.into_iter().for_each(|id| self.refresh_material(id, stores));
        }
    }

    /// A material changed: what has it, to be placed again.
    pub(crate) fn material_changed(&mut self, id: AssetId<StandardMaterial>, stores: Stores) -> Vec<Entity> {
        self.refresh_material(id, stores);
        self.known.iter().filter(|(_, known)| known.1 == id).map(|(entity, _)| *entity).collect()
    }

    fn refresh_material(&mut self, id: AssetId<StandardMaterial>, stores: Stores) {
        let Some(material) = stores.materials.get(id) else { return };
        for has_tangents in [false, true] {
            let Some(&taken) = self.materials.get(&(id, has_tangents)) else { continue };
            match self.converted(material, has_tangents, stores) {
                Ok(next) => self.change_material(taken, next),
                // Those who have it ask again.
                Err(_) => {
                    self.materials.remove(&(id, has_tangents));
                }
            }
        }
        materials::left_out(material).for_each(|sentence| self.notices.say(sentence));
    }

    fn change_material(&mut self, id: MaterialId, next: Material) {
        let before = &self.scene.materials[id];
        if *before == next {
            return;
        }
        // What an open scene follows without a new beginning.
        let mut same = before.clone();
        (same.base_color, same.metallic, same.roughness) = (next.base_color, next.metallic, next.roughness);
        (same.specular, same.emission) = (next.specular, next.emission);
        if same == next && !next.unlit && self.scene.is_open() {
            let shades = self.scene.set_shades(id, next.shades());
            if shades.and_then(|()| self.scene.set_emission(id, next.emission)).is_ok() {
                return;
            }
        }
        self.scene.materials[id] = next;
        self.is_touched = true;
    }

    /// A mesh changed: what has it, to be placed again.
    pub(crate) fn mesh_changed(&mut self, id: AssetId<Mesh>, stores: Stores) -> Vec<Entity> {
        let Some(mesh) = stores.meshes.get(id) else { return Vec::new() };
        for ((_, material), index) in self.meshes.iter().filter(|((mesh, _), _)| *mesh == id) {
            match meshes::convert(mesh, *material) {
                Ok(converted) => {
                    self.scene.meshes[*index] = converted;
                    self.is_touched = true;
                }
                Err(what) => self.notices.say(format!("a mesh stays as it was: its new shape {what}")),
            }
        }
        self.known.iter().filter(|(_, known)| known.0 == id).map(|(entity, _)| *entity).collect()
    }

    /// An image changed.
    pub(crate) fn image_changed(&mut self, id: AssetId<Image>, stores: Stores) {
        let Some(image) = stores.images.get(id) else { return };
        for (wanted, index) in self.textures.iter().filter(|(wanted, _)| wanted.image == id) {
            if let Ok(texture) = textures::convert(image, wanted.flips_green) {
                self.scene.textures[*index as usize] = texture;
                self.is_touched = true;
            }
        }
        if self.surroundings.is_some_and(|s| s.image == id) {
            self.surroundings = None;
        }
    }

    /// Nobody holds a mesh any more: its memory is free for others.
    pub(crate) fn mesh_unused(&mut self, id: AssetId<Mesh>) {
        let scene = &mut self.scene;
        self.meshes.retain(|(mesh, _), index| {
            if *mesh == id && !scene.placed_objects().any(|(_, object)| object.mesh == *index) {
                scene.meshes[*index] = Default::default();
            }
            *mesh != id
        });
    }

    /// What waits for an asset, to be placed again.
    pub(crate) fn take_pending(&mut self) -> Vec<Entity> {
        self.pending.drain().collect()
    }
}
