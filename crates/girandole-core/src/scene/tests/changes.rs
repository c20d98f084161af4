//! Changes of an open scene.

use super::*;
use crate::Result;

fn refused<T: std::fmt::Debug>(result: Result<T>, about: &str) {
    let sentence = result.expect_err("it is refused").to_string();
    assert!(sentence.contains(about) && !sentence.contains('\n'), "{sentence}");
}

fn ids(indices: &[usize]) -> Vec<ObjectId> {
    indices.iter().map(|&i| i.into()).collect()
}

#[test]
fn each_change_is_a_version_and_is_written_down_once() {
    let mut scene = room();
    let node = scene.objects[1].node;
    let first = scene.generation();
    assert!(scene.take_changes().is_empty() && !scene.is_open());
    let frame = scene.frame_of_reference();
    // The same thing twice, and what changes nothing.
    scene.set_transform(node, Transform::translation(vec3(0.0, 1.0, 0.0))).unwrap();
    let second = scene.generation();
    scene.set_transform(node, Transform::translation(vec3(0.0, 2.0, 0.0))).unwrap();
    scene.set_transform(node, Transform::translation(vec3(0.0, 2.0, 0.0))).unwrap();
    scene.set_emission(MaterialId(1), Vec3::splat(3.0)).unwrap();
    assert!(first != second && second != scene.generation() && scene.is_open());
    assert_eq!((place(&scene, 1).y, scene.materials[1].emission.x), (2.0, 3.0));
    let copy = scene.clone();
    let changes = scene.take_changes();
    assert_eq!((changes.from, changes.to), (first, scene.generation()));
    assert_eq!((changes.moved, changes.materials), (ids(&[1]), vec![MaterialId(1)]));
    assert!(changes.added.is_empty() && changes.removed.is_empty() && changes.lights.is_empty());
    assert!(!changes.reopened && !changes.everything);
    assert!(scene.take_changes().is_empty());
    assert_eq!(scene.frame_of_reference(), frame);
    // A copy is the same version until either changes.
    assert_eq!(copy.generation(), scene.generation());
    scene.set_emission(MaterialId(1), Vec3::ZERO).unwrap();
    assert_ne!(copy.generation(), scene.generation());
    assert!(Geometry::new(&copy).belongs_to(&copy).is_ok());
    refused(Geometry::new(&copy).belongs_to(&scene), "earlier version");
}

#[test]
fn what_stood_still_and_is_moved_is_dynamic_from_then_on() {
    let mut scene = room();
    let still = scene.insert_object("still", cube(MaterialId(0)), Transform::IDENTITY, false).unwrap();
    scene.take_changes();
    for (step, made_dynamic) in [(1.0, vec![still]), (2.0, vec![])] {
        let node = scene.objects[still.index()].node;
        scene.set_transform(node, Transform::translation(Vec3::Y * step)).unwrap();
        let changes = scene.take_changes();
        assert_eq!((&changes.moved, &changes.made_dynamic), (&vec![still], &made_dynamic));
        assert_eq!(changes.is_motion(), made_dynamic.is_empty());
        assert!(scene.objects[still.index()].dynamic);
    }
}

#[test]
fn nodes_take_what_is_below_them_along() {
    let mut scene = room();
    let parent = scene.add_node("parent", Transform::IDENTITY);
    let child = scene.add_node("child", Transform::translation(vec3(0.0, 1.0, 0.0)));
    scene.nodes[child].parent = Some(parent);
    scene.objects.push(Object {
        name: String::new(),
        node: child,
        mesh: 1,
        dynamic: false,
        removed: false,
        skin: None,
    });
    let light =
        PunctualLight { name: String::new(), node: child, kind: PunctualKind::Point, intensity: Vec3::ONE };
    scene.lights.push(light);
    let eye = scene.add_node("eye", Transform::IDENTITY);
    scene.cameras.push(Camera {
        name: String::new(),
        node: eye,
        projection: Projection::Orthographic { ymag: 1.0 },
        clip: Default::default(),
    });
    scene.set_transform(parent, Transform::translation(vec3(1.0, 0.0, 0.0))).unwrap();
    let changes = scene.take_changes();
    assert_eq!((changes.moved, changes.lights), (ids(&[2]), vec![LightId(0)]));
    scene.set_intensity(LightId(0), Vec3::splat(2.0)).unwrap();
    let changes = scene.take_changes();
    assert_eq!((changes.moved, changes.lights), (vec![], vec![LightId(0)]));
    // Nothing is derived from a camera.
    scene.set_transform(eye, Transform::translation(vec3(0.0, 9.0, 0.0))).unwrap();
    assert!(scene.take_changes().is_empty());
    assert_eq!(scene.world_from_node(eye).translation.y, 9.0);
}

#[test]
fn ids_are_never_used_again() {
    let mut scene = room();
    let added = scene.insert_object("a", cube(MaterialId(0)), Transform::IDENTITY, false).unwrap();
    let gone = scene.insert_object("b", cube(MaterialId(0)), Transform::IDENTITY, true).unwrap();
    scene.set_transform(scene.objects[added.index()].node, Transform::translation(Vec3::Y)).unwrap();
    scene.remove_object(gone).unwrap();
    scene.set_transform(scene.objects[1].node, Transform::translation(Vec3::Y)).unwrap();
    scene.remove_object(ObjectId(1)).unwrap();
    refused(scene.remove_object(ObjectId(1)), "no object 1");
    let changes = scene.take_changes();
    assert_eq!((changes.added, changes.removed, changes.moved), (vec![added], ids(&[1]), vec![]));
    assert_eq!(
        scene.insert_object("c", cube(MaterialId(0)), Transform::IDENTITY, false).unwrap(),
        ObjectId(4)
    );
    let geometry = Geometry::new(&scene);
    assert_eq!((geometry.objects.len(), scene.placed_objects().count()), (5, 3));
    for (range, object) in geometry.objects.iter().zip(&scene.objects) {
        assert_eq!(
            object.removed,
            range.triangles.is_empty() && range.vertices.is_empty(),
            "{}",
            object.name
        );
    }
    assert!(geometry.triangles.iter().all(|t| !scene.objects[t.object as usize].removed));
    assert_eq!(geometry.triangles.len(), 36);
}

#[test]
fn what_leaves_the_bounds_opens_the_scene_anew() {
    let mut scene = room();
    scene.open();
    let before = scene.frame_of_reference();
    let node = scene.objects[1].node;
    let y = |y: f32| Transform::translation(vec3(0.0, y, 0.0));
    scene.set_transform(node, y(2.8)).unwrap();
    assert!(!scene.take_changes().reopened && scene.warnings.is_empty());
    scene.set_transform(node, y(2.9)).unwrap();
    let changes = scene.take_changes();
    let after = scene.frame_of_reference();
    assert!(changes.reopened && scene.warnings.len() == 1, "{changes:?} {:?}", scene.warnings);
    assert!(scene.warnings[0].contains("`box` left the bounds"));
    assert!(after.bounds.1.y + after.origin.y as f32 > before.bounds.1.y + before.origin.y as f32 + 0.5);
    // There is room now, and what comes back changes nothing again.
    for at in [3.0, 3.2, 1.0] {
        scene.set_transform(node, y(at)).unwrap();
        assert!(!scene.take_changes().reopened);
        assert_eq!(scene.frame_of_reference(), after);
    }
    let geometry = Geometry::new(&scene);
    assert_eq!((geometry.origin, geometry.diagonal()), (after.origin, after.scale));
    assert_ne!(after, FrameOfReference::of(&scene), "the control: it is not the frame of the moment");
    // Something new far away.
    scene
        .insert_object("far", cube(MaterialId(0)), Transform::translation(vec3(500.0, 0.0, 0.0)), false)
        .unwrap();
    assert!(scene.take_changes().reopened);
    assert!(
        scene
            .frame_of_reference()
            .holds(scene.world_bounds(&scene.objects[2], &|node| scene.world_from_node(node)))
    );
}

#[test]
fn what_is_not_possible_is_refused_and_changes_nothing() {
    let mut scene = room();
    scene.open();
    let (generation, frame) = (scene.generation(), scene.frame_of_reference());
    let node = scene.objects[1].node;
    let parts = |translation: Vec3, scale: f32| Transform::Parts {
        translation,
        rotation: glam::Quat::IDENTITY,
        scale: Vec3::splat(scale),
    };
    refused(scene.set_transform(NodeId(99), Transform::IDENTITY), "no node 99");
    refused(scene.set_transform(node, parts(vec3(f32::NAN, 0.0, 0.0), 1.0)), "not finite");
    refused(scene.set_transform(node, parts(Vec3::ZERO, f32::INFINITY)), "not finite");
    let unturned = Transform::Parts {
        translation: Vec3::ZERO,
        rotation: glam::Quat::from_xyzw(0., 0., 0., 0.),
        scale: Vec3::ONE,
    };
    refused(scene.set_transform(node, unturned), "not finite");
    refused(scene.set_transform(node, parts(vec3(1e30, 0.0, 0.0), 1.0)), "scale it to metres");
    refused(scene.set_transform(node, parts(Vec3::ZERO, 1e30)), "scale it to metres");
    refused(scene.set_emission(MaterialId(7), Vec3::ONE), "no material 7");
    for light in [vec3(0.0, -0.1, 0.0), Vec3::NAN, vec3(0.0, 0.0, f32::INFINITY)] {
        refused(scene.set_emission(MaterialId(1), light), "0 up");
    }
    refused(scene.set_intensity(LightId(0), Vec3::ONE), "no light 0");
    refused(scene.remove_object(ObjectId(2)), "no object 2");
    refused(
        scene.insert_object("", cube(MaterialId(2)), Transform::IDENTITY, false),
        "material that does not exist",
    );
    let mut broken = cube(MaterialId(0));
    broken.triangles[3].vertices[1] = 1000;
    refused(scene.insert_object("", broken, Transform::IDENTITY, false), "vertex that does not exist");
    let mut bare = cube(MaterialId(0));
    bare.normals.pop();
    refused(scene.insert_object("", bare, Transform::IDENTITY, false), "normal");
    refused(scene.insert_object("", cube(MaterialId(0)), parts(Vec3::NAN, 1.0), false), "not finite");
    refused(
        scene.insert_object("", cube(MaterialId(0)), parts(vec3(0.0, 1e30, 0.0), 1.0), false),
        "scale it to metres",
    );
    assert_eq!((scene.generation(), scene.frame_of_reference()), (generation, frame));
    assert_eq!((scene.objects.len(), scene.meshes.len(), scene.nodes.len()), (2, 2, 2));
    assert!(scene.take_changes().is_empty() && place(&scene, 1) == DVec3::new(0.5, 1.0, 0.0));
    // The control: what has no extent for a while is possible.
    scene.set_transform(node, parts(Vec3::Y, 0.0)).unwrap();
    assert_eq!(Geometry::new(&scene).dropped, 12);
}

#[test]
fn what_is_changed_by_hand_counts_as_everything() {
    let mut scene = room();
    let built = scene.generation();
    scene.add_object("building", cube(MaterialId(0)), Transform::IDENTITY);
    scene.add_material(Material::default());
    assert!(scene.generation() == built && scene.take_changes().is_empty(), "building is no change");
    scene.open();
    assert_eq!(scene.generation(), built);
    scene.materials[0].base_color = Vec3::ZERO;
    scene.touch();
    assert!(scene.take_changes().everything && scene.generation() != built);
    // Builders are seen in an open scene too.
    let material = scene.add_material(Material::default());
    assert_eq!(scene.take_changes().materials, [material]);
    scene.add_object("late", cube(MaterialId(0)), Transform::translation(vec3(9.0, 0.0, 0.0)));
    let changes = scene.take_changes();
    assert!(changes.everything && changes.reopened);
}

#[test]
fn changes_add_up_in_order() {
    let mut scene = room();
    let added = scene.insert_object("a", cube(MaterialId(0)), Transform::IDENTITY, false).unwrap();
    let mut all = scene.take_changes();
    scene.set_transform(scene.objects[added.index()].node, Transform::translation(Vec3::Y)).unwrap();
    scene.remove_object(ObjectId(1)).unwrap();
    let second = scene.take_changes();
    scene.remove_object(added).unwrap();
    let third = scene.take_changes();
    refused(all.clone().then(&third), "in the order");
    all.then(&second).unwrap();
    assert_eq!((&all.added, &all.moved, &all.removed), (&vec![added], &vec![], &ids(&[1])));
    all.then(&third).unwrap();
    assert_eq!((&all.added, &all.removed, all.to), (&vec![], &ids(&[1]), scene.generation()));
}
