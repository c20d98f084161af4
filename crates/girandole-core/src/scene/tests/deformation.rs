//! Skins and morph targets that are made by hand.

use super::*;
use crate::trace::SceneTracer;
use glam::{DAffine3, DQuat, Quat, Vec4, vec4};
use std::f64::consts::FRAC_PI_2;

/// A square in the XY plane that faces +Z, held by two joints, one for each half.
fn flag() -> Scene {
    let mut scene = Scene::default();
    let material = scene.add_material(Material::default());
    let mut mesh = Mesh::default();
    mesh.add_polygon(&[Vec3::ZERO, Vec3::X, vec3(1.0, 1.0, 0.0), Vec3::Y], material);
    mesh.tangents = vec![vec4(1.0, 0.0, 0.0, 1.0); 4];
    mesh.joint_weights = [0, 1, 1, 0].map(|joint| JointWeight { joint, weight: 0.5 }).to_vec();
    scene.add_object("flag", mesh, Transform::translation(vec3(0.0, 0.0, 9.0)));
    let joints = [0, 1].map(|_| Joint {
        node: scene.add_node("joint", Transform::IDENTITY),
        inverse_bind: DAffine3::IDENTITY,
    });
    scene.skins.push(Skin { name: "skin".into(), joints: joints.to_vec() });
    scene.objects[0].skin = Some(0);
    scene
}

fn set_both(scene: &mut Scene, local: Transform) {
    for joint in scene.skins[0].joints.clone() {
        scene.set_transform(joint.node, local).expect("a place");
    }
}

#[test]
fn rigid_joints_move_all_as_nodes_do() {
    let mut scene = flag();
    let turn = DQuat::from_rotation_x(-FRAC_PI_2);
    set_both(&mut scene, Transform::rigid(turn.as_quat(), vec3(0.0, 2.0, 0.0)));
    let geometry = Geometry::new(&scene);
    assert_eq!((geometry.patches.len(), geometry.triangles.len()), (0, 2), "what may bend has no patches");
    let mut plain = flag();
    plain.objects[0].skin = None;
    plain.nodes[plain.objects[0].node].local = scene.nodes[scene.skins[0].joints[0].node].local;
    let rigid = Geometry::new(&plain);
    assert_eq!((rigid.patches.len(), rigid.triangles.len()), (1, 2), "the control");
    // Relative to other origins, as the one scene was opened before.
    let shift = (geometry.origin - rigid.origin).as_vec3();
    let near =
        |a: &[Vec3], b: &[Vec3], shift: Vec3| a.iter().zip(b).all(|(a, b)| (*a + shift).distance(*b) < 1e-6);
    assert!(near(&geometry.positions, &rigid.positions, shift));
    assert!(near(&geometry.normals, &rigid.normals, Vec3::ZERO));
    assert!(geometry.tangents.iter().all(|t| t.distance(vec4(1.0, 0.0, 0.0, 1.0)) < 1e-6));
    assert_eq!(geometry.uvs, rigid.uvs);
    assert!(geometry.normals.iter().all(|n| n.distance(Vec3::Y) < 1e-6));
}

#[test]
fn mirrored_joints_keep_the_front() {
    for (scale, front) in [(vec3(-1.0, 1.0, 1.0), Vec3::Z), (vec3(1.0, 1.0, -1.0), Vec3::NEG_Z)] {
        let mut scene = flag();
        let mirrored = Transform::Parts { translation: Vec3::Y, rotation: Quat::IDENTITY, scale };
        set_both(&mut scene, mirrored);
        let geometry = Geometry::new(&scene);
        assert!((0..2).all(|t| geometry.normal(t) == front) && geometry.normals == [front; 4], "{scale}");
        assert!(geometry.tangents.iter().all(|t: &Vec4| t.w == -1.0));
        let tracer = SceneTracer::new(&scene, &geometry);
        let middle = geometry.positions.iter().sum::<Vec3>() / 4.0 + vec3(0.01, 0.02, 0.0);
        assert!(tracer.closest_visible(middle + front, -front).is_some());
        assert!(tracer.closest_visible(middle - front, front).is_none(), "the control");
    }
}

#[test]
fn joints_that_flatten_leave_normals() {
    let mut scene = flag();
    let flat =
        Transform::Parts { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale: vec3(1.0, 1.0, 0.0) };
    set_both(&mut scene, flat);
    assert_eq!(Geometry::new(&scene).normals, [Vec3::Z; 4]);
    set_both(&mut scene, Transform::Affine(DAffine3::from_scale(DVec3::ZERO)));
    let geometry = Geometry::new(&scene);
    assert_eq!((geometry.triangles.len(), geometry.dropped), (2, 0));
    assert!(geometry.positions.iter().chain(&geometry.normals).all(|v| v.is_finite()));
    assert!((0..2).all(|t| geometry.area(t) == 0.0 && geometry.normal(t).is_normalized()));
}

#[test]
fn joints_that_lead_too_far_are_refused() {
    let mut scene = flag();
    scene.open();
    let (generation, joint) = (scene.generation(), scene.skins[0].joints[1].node);
    let far = Transform::translation(vec3(1e30, 0.0, 0.0));
    let sentence = scene.set_transform(joint, far).expect_err("too far").to_string();
    assert!(sentence.contains("object `flag`") && sentence.contains("scale it to metres"), "{sentence}");
    assert_eq!((scene.generation(), scene.nodes[joint].local), (generation, Transform::IDENTITY));
    // The control: the mesh's own node does not move it.
    scene.set_transform(scene.objects[0].node, far).expect("nothing is there");
}

#[test]
fn meshes_say_what_of_their_deformation_is_missing() {
    let refused = |change: &dyn Fn(&mut Mesh), words: &str| {
        let mut scene = flag();
        let mut mesh = scene.meshes[0].clone();
        assert!(mesh.check(1).is_ok());
        change(&mut mesh);
        let result = scene.insert_object("", mesh, Transform::IDENTITY, true);
        assert!(result.expect_err("it lacks something").to_string().contains(words));
    };
    refused(&|mesh| mesh.joint_weights.truncate(3), "joint weights");
    let target = |positions, normals| MorphTarget {
        positions: vec![Vec3::X; positions],
        normals: vec![Vec3::X; normals],
    };
    refused(&|mesh| mesh.morph_targets.push(target(3, 0)), "morph target");
    refused(&|mesh| mesh.morph_targets.extend([target(4, 4), target(0, 5)]), "morph target");
}
