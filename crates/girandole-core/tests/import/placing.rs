//! Meshes that are shown many times, and nodes that are not shown.

use crate::builder::{File, some_of_everything};
use girandole_core::glam::{Quat, Vec3};
use girandole_core::scene::{NodeId, Scene, Transform, load_gltf_slice};
use serde_json::{Value, json};

const INSTANCING: &str = "EXT_mesh_gpu_instancing";

fn load(file: &File) -> Scene {
    load_gltf_slice(&file.glb(), None).expect("a scene")
}

/// Attributes of instances of the square of a file, which stands at (0, 1, 0).
fn instanced(attributes: impl FnOnce(&mut File) -> Value) -> File {
    let mut file = File::with_square();
    let attributes = attributes(&mut file);
    file.json["nodes"][0]["name"] = json!("lamp");
    file.json["nodes"][0]["translation"] = json!([0, 1, 0]);
    file.json["nodes"][0]["extensions"] = json!({INSTANCING: {"attributes": attributes}});
    file.json["extensionsRequired"] = json!([INSTANCING]);
    file
}

fn normalized(file: &mut File, data: &[u16], component: u32) -> usize {
    let accessor = file.shorts(data, "VEC4");
    file.json["accessors"][accessor]["normalized"] = json!(true);
    file.json["accessors"][accessor]["componentType"] = json!(component);
    accessor
}

#[test]
fn instances_share_their_mesh() {
    let half = (0.5_f32.sqrt() * 32767.0).round() as u16;
    let file = instanced(|file| {
        let places = file.floats(&[1., 2., 3., -1., 0., 0.], "VEC3");
        let turns = normalized(file, &[0, half, 0, half, 0, 0, 0, 32767], 5122);
        let sizes = file.floats(&[1., 1., 1., 2., 3., -4.], "VEC3");
        json!({"TRANSLATION": places, "ROTATION": turns, "SCALE": sizes, "_ID": 0})
    });
    let scene = load(&file);
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    assert_eq!((scene.meshes.len(), scene.objects.len()), (1, 2));
    let names: Vec<&str> = scene.objects.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(names, ["lamp 0", "lamp 1"]);
    assert!(scene.objects.iter().all(|o| scene.nodes[o.node].parent == Some(NodeId(0)) && o.mesh == 0));
    let at = |object: usize, p: Vec3| {
        scene.world_from_node(scene.objects[object].node).transform_point3(p.as_dvec3()).as_vec3()
    };
    // Turned by 90° about y, +x becomes −z.
    assert!(at(0, Vec3::X).abs_diff_eq(Vec3::new(1.0, 3.0, 2.0), 1e-4), "{}", at(0, Vec3::X));
    assert_eq!(at(1, Vec3::ONE), Vec3::new(1.0, 4.0, -4.0));
}

#[test]
fn instances_follow_their_node_and_nothing_else_is_repeated() {
    let mut file = instanced(|file| {
        let turns = file.floats(&[0., 0., 0., 1., 0., 0., 2., 0., 0., 1., 0., 0.], "VEC4");
        json!({"ROTATION": turns})
    });
    let lights = json!({"lights": [{"type": "point", "intensity": 3.0}]});
    file.json["extensions"] = json!({"KHR_lights_punctual": lights});
    file.json["nodes"][0]["extensions"]["KHR_lights_punctual"] = json!({"light": 0});
    let child = file.push("nodes", json!({"mesh": 0, "name": "below"}));
    file.json["nodes"][0]["children"] = json!([child]);
    let (times, places) = (file.floats(&[0., 1.], "SCALAR"), file.floats(&[0., 0., 0., 5., 0., 0.], "VEC3"));
    file.push(
        "animations",
        json!({
            "samplers": [{"input": times, "output": places}],
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
        }),
    );
    let mut scene = load(&file);
    assert_eq!((scene.objects.len(), scene.lights.len()), (4, 1));
    assert!(scene.objects.iter().all(|o| o.dynamic));
    scene.set_time(1.0).expect("a moment");
    assert!(scene.objects.iter().all(|o| scene.world_from_node(o.node).translation.x == 5.0));
    let Transform::Parts { rotation, .. } = scene.nodes[scene.objects[1].node].local else { panic!("parts") };
    assert_eq!(rotation, Quat::from_xyzw(0.0, 0.0, 1.0, 0.0), "rotations are normalised");
}

#[test]
fn broken_instances_are_left_out() {
    let places = |file: &mut File| file.floats(&[1., 2., 3., f32::NAN, 0., 0., 4., 0., 0.], "VEC3");
    let scene = load(&instanced(|file| json!({"TRANSLATION": places(file)})));
    assert_eq!(scene.objects.len(), 2);
    assert!(scene.warnings[0].starts_with("instance 1 of `lamp` is left out"), "{:?}", scene.warnings);
    type Change = fn(&mut File) -> Value;
    let changes: [(Change, &str); 5] = [
        (|_| json!({"TRANSLATION": 99}), "accessor 99"),
        (|_| json!({"TRANSLATION": "x"}), "is no accessor"),
        (|_| json!({}), "places no instance"),
        (|file| json!({"TRANSLATION": file.floats(&[0.; 4], "VEC4")}), "of type"),
        (
            |file| json!({"TRANSLATION": file.floats(&[0.; 6], "VEC3"), "SCALE": file.floats(&[1.; 3], "VEC3")}),
            "2 and 1",
        ),
    ];
    for (change, words) in changes {
        let scene = load(&instanced(change));
        assert_eq!((scene.objects.len(), scene.warnings.len()), (1, 1), "{:?}", scene.warnings);
        assert!(scene.warnings[0].contains(words), "{:?}", scene.warnings);
    }
    let empty = |file: &mut File| {
        let places = file.floats(&[], "VEC3");
        json!({"TRANSLATION": places})
    };
    assert!(load_gltf_slice(&instanced(empty).glb(), None).is_err());
}

#[test]
fn hidden_nodes_are_not_shown_with_all_below_them() {
    let whole = load(&some_of_everything());
    let hidden = |node: usize, visible: Value| {
        let mut file = some_of_everything();
        let visibility = json!({"visible": visible});
        file.json["nodes"][node]["extensions"]["KHR_node_visibility"] = visibility;
        file.json["extensionsRequired"] = json!(["KHR_node_visibility"]);
        let scene = load(&file);
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        assert_eq!((scene.nodes.len(), scene.cameras.len()), (whole.nodes.len(), whole.cameras.len()));
        [scene.objects.len(), scene.lights.len()]
    };
    let all = [whole.objects.len(), whole.lights.len()];
    assert_eq!(all, [3, 3]);
    for visible in [json!(true), json!(null), json!("no")] {
        assert_eq!(hidden(1, visible), all);
    }
    // The child, the root above it, a camera with a light, a lamp.
    assert_eq!([0, 1, 2, 4].map(|node| hidden(node, json!(false))), [[2, 3], [1, 3], [3, 2], [3, 2]]);
}
