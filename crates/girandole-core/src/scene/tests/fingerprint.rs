use crate::scene::builtin::{self, MovingObject};
use crate::scene::{Environment, Material, MaterialId, Scene, Transform};
use glam::{Vec3, vec3};

fn table() -> Scene {
    builtin::build("table", MovingObject::Torus).expect("it is built in")
}

#[test]
fn contents_count_and_names_do_not() {
    let content = table().content();
    let changed = |change: fn(&mut Scene)| {
        let mut scene = table();
        change(&mut scene);
        scene.content() != content
    };
    assert!(!changed(|_| {}));
    assert!(!changed(|scene| {
        scene.name = "other".into();
        scene.materials.iter_mut().for_each(|m| m.name.clear());
        scene.objects.iter_mut().for_each(|o| o.name.clear());
    }));
    // What nothing is made of.
    assert!(!changed(|scene| scene.materials.push(Material::default())));
    assert!(changed(|scene| scene.meshes[3].positions[0].x += 1e-6));
    assert!(changed(|scene| scene.meshes[3].normals[0].x += 1e-6));
    assert!(changed(|scene| scene.meshes[3].triangles[0].material.0 += 1));
    assert!(changed(|scene| scene.materials[0].roughness = 0.5));
    assert!(changed(|scene| scene.environment = Environment::constant(Vec3::ONE).ok()));
    assert!(changed(|scene| scene.animations.clear()));
    assert!(changed(|scene| scene.objects[4].removed = true));
    // Where things are at the moment is another matter.
    assert!(!changed(|scene| scene.set_time(1.5).expect("a moment")));
}

#[test]
fn what_was_added_and_removed_again_leaves_nothing() {
    let mut scene = table();
    let mesh = builtin::shapes::torus(0.2, 0.1, 8, 6, MaterialId(0));
    let before = (scene.content(), scene.placement(None));
    let id = scene.insert_object("ring", mesh, Transform::IDENTITY, true).expect("inserted");
    assert!(scene.content() != before.0 && scene.placement(None) != before.1);
    scene.remove_object(id).expect("removed");
    assert_eq!((scene.content(), scene.placement(None)), before);
}

#[test]
fn placement_is_that_of_a_moment() {
    let scene = table();
    assert_eq!(scene.placement(None), scene.placement(Some(0.0)));
    assert_eq!(scene.placement(Some(2.5)), scene.placement(Some(10.5)));
    let mut posed = scene.clone();
    posed.set_time(2.5).expect("a moment");
    assert_eq!(posed.placement(None), scene.placement(Some(2.5)));
    assert!(posed.placement(None) != scene.placement(None));
    let node = scene.objects[2].node;
    let mut moved = scene.clone();
    moved.set_transform(node, Transform::translation(vec3(0.0, 1e-3, 0.0))).expect("moved");
    assert!(moved.placement(None) != scene.placement(None));
    let [first, second] = [0, 1].map(|i| scene.camera_placement(&scene.cameras[i], None));
    assert!(first != second && first == scene.camera_placement(&scene.cameras[0], Some(3.0)));
    assert_eq!(first.to_string().len(), 32);
}

#[test]
fn ids_are_printed_as_the_indices_that_they_are() {
    let node = crate::scene::Node { parent: Some(7.into()), ..Default::default() };
    assert!(format!("{node:?}").contains("parent: Some(7)"), "or fingerprints of scenes would change");
}
