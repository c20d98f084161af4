use super::*;
use crate::lights::{Shape, Source};
use bevy::asset::RenderAssetUsages;
use bevy::math::Vec3 as BevyVec3;
use bevy::prelude::Cuboid;
use girandole_core::glam::Vec3;
use girandole_core::scene::{LightId, PunctualKind};

struct World {
    meshes: Assets<Mesh>,
    materials: Assets<StandardMaterial>,
    images: Assets<Image>,
}

impl World {
    fn new() -> Self {
        Self { meshes: Assets::default(), materials: Assets::default(), images: Assets::default() }
    }

    fn stores(&self) -> Stores<'_> {
        Stores { meshes: &self.meshes, materials: &self.materials, images: &self.images }
    }
}

fn entity(number: u32) -> Entity {
    Entity::from_raw_u32(number).unwrap()
}

fn at(x: f32, mesh: AssetId<Mesh>, material: AssetId<StandardMaterial>) -> Placed {
    let place = Affine3A::from_translation(BevyVec3::new(x, 0.0, 0.0));
    Placed { mesh, material, place, is_visible: true, is_deformed: false }
}

fn cube(world: &mut World) -> (AssetId<Mesh>, AssetId<StandardMaterial>) {
    let mesh = world.meshes.add(Mesh::from(Cuboid::default()));
    let material = world.materials.add(StandardMaterial::default());
    let ids = (mesh.id(), material.id());
    // Kept for the test.
    std::mem::forget((mesh, material));
    ids
}

fn count(mirror: &SceneMirror) -> usize {
    mirror.scene.placed_objects().count()
}

#[test]
fn objects_come_move_hide_and_go() {
    let mut world = World::new();
    let (mesh, material) = cube(&mut world);
    let mut mirror = SceneMirror::default();
    for number in 1..=3 {
        mirror.place(entity(number), &at(number as f32, mesh, material), world.stores());
    }
    mirror.finish();
    assert_eq!((count(&mirror), mirror.scene.meshes.len(), mirror.scene.materials.len()), (3, 1, 1));
    mirror.scene.open();
    mirror.scene.take_changes();

    mirror.place(entity(2), &at(5.0, mesh, material), world.stores());
    mirror.finish();
    let changes = mirror.scene.take_changes();
    assert_eq!((changes.moved.len(), changes.everything), (1, false));
    let moved = &mirror.scene.objects[changes.moved[0]];
    assert_eq!(mirror.scene.world_from_node(moved.node).translation.x, 5.0);

    mirror.place(entity(2), &Placed { is_visible: false, ..at(5.0, mesh, material) }, world.stores());
    mirror.forget(entity(3));
    mirror.finish();
    assert_eq!(count(&mirror), 1);
    assert_eq!(mirror.taken().collect::<Vec<_>>(), [entity(1)]);
    mirror.place(entity(2), &at(5.0, mesh, material), world.stores());
    mirror.finish();
    assert_eq!(count(&mirror), 2);
    assert!(mirror.scene.take_changes().everything);
}

#[test]
fn what_is_not_loaded_waits() {
    let mut world = World::new();
    let (mesh, material) = cube(&mut world);
    let missing = world.images.reserve_handle();
    world.materials.get_mut(material).unwrap().base_color_texture = Some(missing.clone());
    let mut mirror = SceneMirror::default();
    mirror.place(entity(1), &at(0.0, mesh, material), world.stores());
    assert_eq!(count(&mirror), 0);
    world.images.insert(missing.id(), Image::default()).unwrap();
    assert_eq!(mirror.take_pending(), [entity(1)]);
    mirror.place(entity(1), &at(0.0, mesh, material), world.stores());
    assert_eq!((count(&mirror), mirror.scene.textures.len()), (1, 1));
    assert!(mirror.take_pending().is_empty());
}

#[test]
fn colours_and_emission_are_followed_without_a_new_beginning() {
    let mut world = World::new();
    let (mesh, material) = cube(&mut world);
    let mut mirror = SceneMirror::default();
    mirror.expose(1.0, world.stores());
    mirror.place(entity(1), &at(0.0, mesh, material), world.stores());
    mirror.finish();
    mirror.scene.open();
    mirror.scene.take_changes();

    let changed = world.materials.get_mut(material).unwrap().into_inner();
    changed.base_color = bevy::color::Color::linear_rgb(0.1, 0.2, 0.3);
    changed.emissive = bevy::color::LinearRgba::rgb(4.0, 0.0, 0.0);
    assert_eq!(mirror.material_changed(material, world.stores()), [entity(1)]);
    mirror.finish();
    let changes = mirror.scene.take_changes();
    assert!(changes.materials.len() == 1 && !changes.everything);
    assert_eq!(mirror.scene.materials[0].emission, Vec3::X * 4.0);

    // Half the exposure: what is not exposed has to shine twice as bright.
    mirror.expose(0.5, world.stores());
    assert_eq!(mirror.scene.materials[0].emission, Vec3::X * 8.0);

    // What is blended is Bevy's.
    world.materials.get_mut(material).unwrap().alpha_mode = bevy::material::AlphaMode::Blend;
    for entity in mirror.material_changed(material, world.stores()) {
        mirror.place(entity, &at(0.0, mesh, material), world.stores());
    }
    assert_eq!(count(&mirror), 0);
}

#[test]
fn lights_come_change_and_go() {
    let mut mirror = SceneMirror::default();
    let key = (entity(7), Kind::Point);
    let shape = Shape::Punctual(PunctualKind::Point);
    let lamp = Source { shape, light: Vec3::ONE, place: DAffine3::IDENTITY };
    mirror.shine(key, Some(lamp));
    mirror.finish();
    mirror.scene.open();
    mirror.scene.take_changes();
    mirror.shine(key, Some(Source { light: Vec3::X, ..lamp }));
    mirror.finish();
    let changes = mirror.scene.take_changes();
    assert!(changes.lights == [LightId(0)] && !changes.everything);
    mirror.shine(key, None);
    assert_eq!(mirror.scene.lights[0].intensity, Vec3::ZERO);
    mirror.put_out(key);
    assert!(mirror.scene.is_light_removed(LightId(0)));

    let key = (entity(7), Kind::Rectangle);
    let sheet = Source { shape: Shape::Rectangle, ..lamp };
    mirror.shine(key, Some(sheet));
    assert_eq!(count(&mirror), 1);
    mirror.shine(key, None);
    assert_eq!(count(&mirror), 0);
    mirror.shine(key, Some(sheet));
    assert_eq!(count(&mirror), 1);
    mirror.put_out(key);
    assert_eq!(count(&mirror), 0);
}

#[test]
fn what_is_left_to_bevy_is_said_once() {
    let mut world = World::new();
    let (mesh, material) = cube(&mut world);
    let mut mirror = SceneMirror::default();
    mirror.place(entity(1), &Placed { is_deformed: true, ..at(0.0, mesh, material) }, world.stores());
    assert!(count(&mirror) == 0 && mirror.notices.has("skinned"));
    let bare = Mesh::new(bevy::mesh::PrimitiveTopology::TriangleList, RenderAssetUsages::default());
    let bare = world.meshes.add(bare);
    mirror.place(entity(2), &at(0.0, bare.id(), material), world.stores());
    assert!(count(&mirror) == 0 && mirror.notices.has("positions"));
}
