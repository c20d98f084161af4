//! The scene as Girandole has it, kept in step with Bevy's world.

mod assets;
mod lamps;

pub(crate) use lamps::{Kind, Surroundings};

use crate::materials::{self, Wanted};
use crate::notices::Notices;
use crate::{meshes, textures, units};
use bevy::asset::{AssetId, Assets};
use bevy::ecs::entity::Entity;
use bevy::ecs::resource::Resource;
use bevy::image::Image;
use bevy::math::Affine3A;
use bevy::mesh::Mesh;
use bevy::pbr::StandardMaterial;
use girandole_core::glam::DAffine3;
use girandole_core::scene::{Material, MaterialId, NodeId, Object, ObjectId, Scene, Transform};
use lamps::Lamp;
use std::collections::{HashMap, HashSet};

/// The scene that Girandole lights: everything of Bevy's world that it takes. It is a resource of the render world.
#[derive(Resource, Default)]
pub struct SceneMirror {
    pub(crate) scene: Scene,
    pub(crate) notices: Notices,
    meshes: HashMap<(AssetId<Mesh>, MaterialId), usize>,
    materials: HashMap<(AssetId<StandardMaterial>, bool), MaterialId>,
    textures: HashMap<Wanted, u32>,
    /// What all meshes in the world look like, taken or not.
    known: HashMap<Entity, (AssetId<Mesh>, AssetId<StandardMaterial>)>,
    objects: HashMap<Entity, ObjectId>,
    /// What waits for an asset.
    pending: HashSet<Entity>,
    lamps: HashMap<(Entity, Kind), Lamp>,
    surroundings: Option<Surroundings>,
    /// By which unexposed light is judged.
    exposure: f32,
    /// Whether public fields were changed by hand.
    is_touched: bool,
}

/// Where assets are looked up.
#[derive(Clone, Copy)]
pub(crate) struct Stores<'a> {
    pub meshes: &'a Assets<Mesh>,
    pub materials: &'a Assets<StandardMaterial>,
    pub images: &'a Assets<Image>,
}

/// A mesh in the world.
pub(crate) struct Placed {
    pub mesh: AssetId<Mesh>,
    pub material: AssetId<StandardMaterial>,
    pub place: Affine3A,
    pub is_visible: bool,
    /// Whether joints or morph targets bend it.
    pub is_deformed: bool,
}

/// Why a thing is not in the scene.
enum Missing {
    /// An asset is not loaded.
    Yet,
    /// It is left to Bevy.
    ForGood,
}

impl SceneMirror {
    /// The scene as it stands.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Entities whose meshes are in it: Bevy does not draw them.
    pub fn taken(&self) -> impl Iterator<Item = Entity> + '_ {
        self.objects.keys().copied()
    }

    /// Adds, moves, changes or takes away what an entity shows.
    pub(crate) fn place(&mut self, entity: Entity, placed: &Placed, stores: Stores) {
        self.known.insert(entity, (placed.mesh, placed.material));
        let place = units::affine(&placed.place);
        let wanted = self.wanted(placed, stores).and_then(|mesh| {
            let is_possible = place.is_finite() && place.matrix3.determinant() != 0.0;
            if is_possible { Ok(mesh) } else { Err(Missing::ForGood) }
        });
        self.pending.remove(&entity);
        match (self.objects.get(&entity).copied(), wanted) {
            (Some(object), Ok(mesh)) if self.scene.objects[object].mesh == mesh => {
                self.put(self.scene.objects[object].node, place);
            }
            (_, Ok(mesh)) => {
                self.take_away(entity);
                let node = self.scene.add_node("", Transform::Affine(place));
                let object = self.push_object(node, mesh);
                self.objects.insert(entity, object);
            }
            (_, Err(missing)) => {
                self.take_away(entity);
                if matches!(missing, Missing::Yet) {
                    self.pending.insert(entity);
                }
            }
        }
    }

    /// An entity shows nothing any more.
    pub(crate) fn forget(&mut self, entity: Entity) {
        self.known.remove(&entity);
        self.pending.remove(&entity);
        self.take_away(entity);
    }

    fn take_away(&mut self, entity: Entity) {
        if let Some(object) = self.objects.remove(&entity) {
            self.remove_object(object);
        }
    }

    /// The index of the mesh that it is to have.
    fn wanted(&mut self, placed: &Placed, stores: Stores) -> Result<usize, Missing> {
        if !placed.is_visible {
            return Err(Missing::ForGood);
        }
        if placed.is_deformed {
            self.notices.say("skinned and morphed meshes are lit by Bevy and cast no shadow on what Girandole lights; bake their poses into meshes");
            return Err(Missing::ForGood);
        }
        let material = stores.materials.get(placed.material).ok_or(Missing::Yet)?;
        if !materials::is_taken(material) {
            return Err(Missing::ForGood);
        }
        let mesh = stores.meshes.get(placed.mesh).ok_or(Missing::Yet)?;
        let has_tangents = meshes::has_tangents(mesh);
        if material.normal_map_texture.is_some() && !has_tangents {
            self.notices.say("a normal map is left out on a mesh without tangents, as Bevy does; call Mesh::generate_tangents on it");
        }
        let material = self.material((placed.material, has_tangents), material, stores)?;
        if let Some(&index) = self.meshes.get(&(placed.mesh, material)) {
            return Ok(index);
        }
        match meshes::convert(mesh, material) {
            Ok(converted) => {
                self.scene.meshes.push(converted);
                let index = self.scene.meshes.len() - 1;
                self.meshes.insert((placed.mesh, material), index);
                Ok(index)
            }
            Err(what) => {
                self.notices.say(format!("a mesh is left to Bevy: it {what}"));
                Err(Missing::ForGood)
            }
        }
    }

    /// The material that was taken for one of Bevy's, or is now.
    fn material(
        &mut self,
        key: (AssetId<StandardMaterial>, bool),
        material: &StandardMaterial,
        stores: Stores,
    ) -> Result<MaterialId, Missing> {
        if let Some(&id) = self.materials.get(&key) {
            return Ok(id);
        }
        let converted = self.converted(material, key.1, stores)?;
        materials::left_out(material).for_each(|sentence| self.notices.say(sentence));
        let id = self.scene.add_material(converted);
        self.materials.insert(key, id);
        Ok(id)
    }

    fn converted(
        &mut self,
        material: &StandardMaterial,
        has_tangents: bool,
        stores: Stores,
    ) -> Result<Material, Missing> {
        let exposure = self.exposure;
        materials::convert(material, has_tangents, exposure, |wanted| self.texture(wanted, stores))
    }

    fn texture(&mut self, wanted: Wanted, stores: Stores) -> Result<u32, Missing> {
        if let Some(&index) = self.textures.get(&wanted) {
            return Ok(index);
        }
        let image = stores.images.get(wanted.image).ok_or(Missing::Yet)?;
        match textures::convert(image, wanted.flips_green) {
            Ok(texture) => {
                self.scene.textures.push(texture);
                let index = u32::try_from(self.scene.textures.len() - 1).unwrap_or(u32::MAX);
                self.textures.insert(wanted, index);
                Ok(index)
            }
            Err(what) => {
                self.notices.say(format!("a mesh with a texture is left to Bevy: the image {what}"));
                Err(Missing::ForGood)
            }
        }
    }

    /// Makes what was changed by hand known; to be called once after all changes of a frame.
    pub(crate) fn finish(&mut self) {
        if std::mem::take(&mut self.is_touched) && self.scene.is_open() {
            self.scene.touch();
        }
    }

    fn put(&mut self, node: NodeId, place: DAffine3) {
        if self.scene.is_open() {
            let done = self.scene.set_transform(node, Transform::Affine(place));
            self.report(done);
        } else {
            self.scene.nodes[node].local = Transform::Affine(place);
        }
    }

    fn push_object(&mut self, node: NodeId, mesh: usize) -> ObjectId {
        let name = String::new();
        self.scene.objects.push(Object { name, node, mesh, skin: None, dynamic: false, removed: false });
        self.is_touched = true;
        (self.scene.objects.len() - 1).into()
    }

    fn remove_object(&mut self, object: ObjectId) {
        let done = self.scene.remove_object(object);
        self.report(done);
    }

    fn report(&mut self, result: girandole_core::Result<()>) {
        if let Err(error) = result {
            self.notices.say(format!("Girandole's scene keeps what it had: {error}"));
        }
    }
}

#[cfg(test)]
mod tests;
