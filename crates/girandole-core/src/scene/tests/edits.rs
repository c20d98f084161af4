//! Edits: the same scene as by the calls themselves, files without loss, and what is refused.

use super::*;
use crate::Error;
use glam::{DAffine3, DMat3, Quat};
use proptest::prelude::*;
use std::path::Path;

fn no_files(path: &Path) -> Result<Mesh> {
    Err(Error::Invalid(format!("no {} here", path.display())))
}

/// A room with a lamp, a punctual light and an animated box.
fn lit_room() -> Scene {
    let mut scene = room();
    let node = scene.add_node("bulb", Transform::translation(vec3(0.0, 2.0, 0.0)));
    let kind = PunctualKind::Point;
    scene.lights.push(PunctualLight { name: "bulb".into(), node, kind, intensity: Vec3::ONE });
    let channel = Channel {
        node: scene.objects[1].node,
        times: vec![0.0, 2.0],
        keyframes: Keyframes::Translation(vec![vec3(0.5, 1.0, 0.0), vec3(-0.5, 1.0, 0.7)]),
        interpolation: Interpolation::Linear,
    };
    scene.animations.push(Animation { name: "sway".into(), channels: vec![channel] });
    scene
}

fn turned(x: f32) -> Transform {
    let rotation = Quat::from_rotation_y(0.3 + x);
    Transform::Parts { translation: vec3(x, 0.7, 0.1), rotation, scale: Vec3::splat(0.3) }
}

/// Edits of all kinds, in the scene of [`lit_room`].
fn edits() -> Edits {
    let named = |index, name: &str| NamedIndex { index, name: name.into() };
    let skewed = DMat3::from_cols_array(&[0.2, 0.1, 0.0, 0.0, 0.3, 1.0 / 3.0, 0.0, 0.0, 0.25]);
    Edits(vec![
        Edit::SetTime { seconds: 1.3 },
        Edit::SetTransform { node: named(1, "box"), transform: turned(0.1) },
        Edit::SetEmission { material: named(1, "lamp"), emission: vec3(0.1, 2.0, 1e-7) },
        Edit::SetIntensity { light: named(0, "bulb"), intensity: Vec3::splat(1.0 / 3.0) },
        Edit::InsertObject {
            name: "ring \"1\"\n".into(),
            shape: Shape::Torus,
            material: None,
            transform: Transform::Affine(DAffine3 { matrix3: skewed, translation: DVec3::splat(0.1) }),
            dynamic: true,
        },
        Edit::InsertObject {
            name: "pot".into(),
            shape: Shape::Teapot,
            material: Some(named(0, "")),
            transform: turned(-1.0),
            dynamic: false,
        },
        Edit::SetEmission { material: named(2, "ring \"1\"\n"), emission: Vec3::X },
        Edit::RemoveObject { object: named(1, "box") },
    ])
}

/// Edits of the kinds that came later, after [`edits`].
fn furnishings() -> Edits {
    let named = |index, name: &str| NamedIndex { index, name: name.into() };
    let down = Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    let kind = PunctualKind::Spot { inner: 0.25, outer: 0.5 };
    let viewpoint = Viewpoint {
        eye: DVec3::new(0.1, 1.7, 1.5),
        target: DVec3::new(0.0, 1.0, 1.0 / 3.0),
        up: DVec3::Y,
        field: FieldOfView::Perspective { degrees: 55.5 },
        clip: ClipPlanes::NONE,
    };
    let cut = ClipPlanes { near: 1.2, far: 50.0 };
    let field = FieldOfView::Orthographic { height: 2.5 };
    let base_color = vec3(0.9, 0.1, 1.0 / 3.0);
    let shades = Shades { base_color, metallic: 0.0, roughness: 0.25, specular: 1.0 };
    Edits(vec![
        Edit::DuplicateObject {
            object: named(2, "ring \"1\"\n"),
            name: "ring 2".into(),
            transform: turned(0.4),
        },
        Edit::SetShades { material: named(0, ""), shades },
        Edit::InsertLight {
            name: "spot".into(),
            kind,
            intensity: Vec3::splat(7.0),
            transform: Transform::rigid(down, vec3(0.0, 2.5, 0.0)),
        },
        Edit::SetCone { light: named(1, "spot"), inner: 0.2, outer: 0.6 },
        Edit::InsertLight {
            name: "bulb 2".into(),
            kind: PunctualKind::Point,
            intensity: Vec3::ONE,
            transform: Transform::IDENTITY,
        },
        Edit::RemoveLight { light: named(0, "bulb") },
        Edit::InsertObject {
            name: "panel".into(),
            shape: Shape::Panel,
            material: None,
            transform: Transform::rigid(down, vec3(0.0, 2.0, 0.0)),
            dynamic: true,
        },
        Edit::SetCamera { name: "bookmark 1".into(), viewpoint },
        Edit::SetCamera { name: "bookmark 2".into(), viewpoint: Viewpoint { field, ..viewpoint } },
        Edit::SetCamera {
            name: "bookmark 1".into(),
            viewpoint: Viewpoint { eye: DVec3::Y, clip: cut, ..viewpoint },
        },
    ])
}

fn all_edits() -> Edits {
    Edits([edits().0, furnishings().0].concat())
}

/// All that pictures depend on.
fn bits(scene: &Scene) -> String {
    let geometry = Geometry::new(scene);
    let positions: Vec<u32> =
        geometry.positions.iter().flat_map(|p| p.to_array()).map(f32::to_bits).collect();
    format!(
        "{:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?} {positions:?}",
        scene.frame_of_reference(),
        scene.cameras,
        scene.nodes,
        scene.objects,
        scene.materials,
        scene.lights,
        geometry.origin,
        geometry.triangles,
    )
}

fn applied(edits: &Edits, mut scene: Scene) -> Scene {
    edits.apply(&mut scene, &no_files).expect("edits of this scene");
    scene
}

#[test]
fn edits_are_the_scene_s_own_calls() {
    let by_edits = applied(&edits(), lit_room());
    let mut scene = lit_room();
    scene.set_time(1.3).expect("a time");
    scene.set_transform(NodeId(1), turned(0.1)).expect("a node");
    scene.set_emission(MaterialId(1), vec3(0.1, 2.0, 1e-7)).expect("a material");
    scene.set_intensity(LightId(0), Vec3::splat(1.0 / 3.0)).expect("a light");
    let Edit::InsertObject { transform, .. } = &edits().0[4] else { unreachable!() };
    let own = scene.add_material(Material { name: "ring \"1\"\n".into(), ..Material::default() });
    scene.insert_object("ring \"1\"\n", shapes::thesis_torus(own), *transform, true).expect("fits");
    scene.insert_object("pot", builtin::teapot(6, MaterialId(0)), turned(-1.0), false).expect("fits");
    scene.set_emission(own, Vec3::X).expect("a material");
    scene.remove_object(ObjectId(1)).expect("an object");
    assert_eq!(bits(&by_edits), bits(&scene));
    scene.set_time(1.30001).expect("a time");
    assert_ne!(bits(&by_edits), bits(&scene), "the control");
}

#[test]
fn scenes_are_furnished_by_their_own_calls() {
    let by_edits = applied(&all_edits(), lit_room());
    let mut scene = applied(&edits(), lit_room());
    scene.duplicate_object(ObjectId(2), "ring 2", turned(0.4)).expect("an object");
    let Edit::SetShades { shades, .. } = furnishings().0[1] else { unreachable!() };
    scene.set_shades(MaterialId(0), shades).expect("a material");
    let Edit::InsertLight { kind, intensity, transform, .. } = furnishings().0[2] else { unreachable!() };
    let spot = scene.insert_light("spot", kind, intensity, transform).expect("a light");
    scene.set_cone(spot, 0.2, 0.6).expect("a spot");
    scene.insert_light("bulb 2", PunctualKind::Point, Vec3::ONE, Transform::IDENTITY).expect("a light");
    scene.remove_light(LightId(0)).expect("a light");
    let own = scene.add_material(Material { name: "panel".into(), ..Material::default() });
    let Edit::InsertObject { transform, .. } = furnishings().0[6] else { unreachable!() };
    scene.insert_object("panel", shapes::panel(own), transform, true).expect("fits");
    let viewpoints = furnishings().0.into_iter().filter_map(|edit| match edit {
        Edit::SetCamera { name, viewpoint } => Some((name, viewpoint)),
        _ => None,
    });
    let viewpoints: Vec<_> = viewpoints.collect();
    for (name, viewpoint) in [&viewpoints[2], &viewpoints[1]] {
        scene.set_camera(name, viewpoint).expect("a view");
    }
    assert_eq!(bits(&by_edits), bits(&scene));
    assert!(scene.is_light_removed(LightId(0)) && !scene.is_light_removed(LightId(1)));
    assert_eq!(scene.objects[4].mesh, scene.objects[2].mesh, "copies share their mesh");
    // A camera sees what the viewpoint does.
    for (camera, viewpoint) in [(0, viewpoints[2].1), (1, viewpoints[1].1)] {
        let (seen, asked) =
            (View::new(&scene, &scene.cameras[camera], 1.5), viewpoint.view(1.5).expect("a view"));
        assert!(seen.eye == asked.eye && seen.forward.abs_diff_eq(asked.forward, 1e-6), "{seen:?} {asked:?}");
        assert!(
            seen.up.abs_diff_eq(asked.up, 1e-6) && (seen.half_extent - asked.half_extent).length() < 1e-6
        );
    }
    let moved = applied(&Edits(furnishings().0[..9].to_vec()), applied(&edits(), lit_room()));
    assert_ne!(bits(&moved), bits(&scene), "the control");
}

#[test]
fn steps_are_taken_back_and_made_again_to_the_bit() {
    let (mut scene, mut edits) = (lit_room(), Edits::default());
    scene.open();
    let mut history: Vec<(String, Edits, Step)> = Vec::new();
    let far =
        Edit::SetTransform { node: NamedIndex { index: 0, name: "room".into() }, transform: turned(90.0) };
    for edit in [all_edits().0, vec![far]].concat() {
        let (before, list) = (bits(&scene), edits.clone());
        let snapshot = Snapshot::of(&scene, &edits);
        edits.record(edit, &mut scene, &no_files).expect("possible");
        let step = snapshot.step(&scene, &edits).expect("something changed");
        history.push((before, list, step));
    }
    assert!(Snapshot::of(&scene, &edits).step(&scene, &edits).is_none());
    let (last, all) = (bits(&scene), edits.clone());
    for (before, list, step) in history.iter_mut().rev() {
        step.exchange(&mut scene, &mut edits);
        assert_eq!((&bits(&scene), &edits), (&*before, &*list));
    }
    assert_eq!(edits, Edits::default());
    for (.., step) in &mut history {
        step.exchange(&mut scene, &mut edits);
    }
    assert_eq!((bits(&scene), edits), (last, all));
}

#[test]
fn a_step_back_changes_no_more_than_it_must() {
    let (mut scene, mut edits) = (lit_room(), Edits::default());
    scene.open();
    let mut back = |edit: Edit| {
        let snapshot = Snapshot::of(&scene, &edits);
        edits.record(edit, &mut scene, &no_files).expect("possible");
        let mut step = snapshot.step(&scene, &edits).expect("something changed");
        scene.take_changes();
        step.exchange(&mut scene, &mut edits);
        scene.take_changes()
    };
    let named = |index, name: &str| NamedIndex { index, name: name.into() };
    let moved = back(Edit::SetTransform { node: named(1, "box"), transform: turned(0.1) });
    assert_eq!((moved.moved.as_slice(), moved.is_motion()), ([ObjectId(1)].as_slice(), true));
    let bulb = back(Edit::SetTransform { node: named(2, "bulb"), transform: turned(0.1) });
    assert_eq!((bulb.lights.as_slice(), bulb.is_motion()), ([LightId(0)].as_slice(), true));
    let lamp = back(Edit::SetEmission { material: named(1, "lamp"), emission: Vec3::ZERO });
    assert_eq!((lamp.materials.as_slice(), lamp.is_motion()), ([MaterialId(1)].as_slice(), true));
    // What stood still is no longer dynamic, and what came goes.
    let wall = back(Edit::SetTransform { node: named(0, "room"), transform: turned(0.1) });
    assert!(wall.everything && !back(Edit::RemoveObject { object: named(1, "box") }).is_motion());
    // Cameras make no other version of the scene.
    let Edit::SetCamera { name, viewpoint } = furnishings().0[7].clone() else { unreachable!() };
    assert!(back(Edit::SetCamera { name, viewpoint }).is_empty());
}

#[test]
fn only_a_lobe_that_comes_or_goes_changes_everything() {
    let mut scene = lit_room();
    scene.open();
    let shades = scene.materials[0].shades();
    let mut set = |shades| {
        scene.set_shades(MaterialId(0), shades).expect("possible");
        scene.take_changes()
    };
    let painted = set(Shades { base_color: Vec3::X, ..shades });
    assert!(painted.is_motion() && painted.reflectance && painted.materials == [MaterialId(0)]);
    assert!(set(Shades { base_color: Vec3::X, specular: 1.0, ..shades }).everything);
    assert!(set(Shades { base_color: Vec3::X, specular: 1.0, roughness: 0.2, ..shades }).is_motion());
    assert!(set(Shades { base_color: Vec3::X, specular: 1.0, roughness: 0.2, ..shades }).is_empty());
    for wrong in [
        Shades { roughness: 1.1, ..shades },
        Shades { metallic: -0.1, ..shades },
        Shades { base_color: Vec3::NAN, ..shades },
    ] {
        assert!(scene.set_shades(MaterialId(0), wrong).is_err() && scene.take_changes().is_empty());
    }
    assert!(scene.set_shades(MaterialId(9), shades).is_err());
}

#[test]
fn files_say_the_lowest_version_that_has_what_is_in_them() {
    for (edits, version) in [(edits(), 1), (furnishings(), 2), (Edits::default(), 1)] {
        let text = edits.to_json().expect("finite");
        assert!(text.contains(&format!("\"version\": {version},")), "{text}");
        assert_eq!(Edits::from_json(&text).expect("just written"), edits);
    }
}

#[test]
fn files_hold_all_of_it() {
    let edits = all_edits();
    let text = edits.to_json().expect("finite");
    assert_eq!(Edits::from_json(&text).expect("just written"), edits);
    assert_eq!(text.lines().count(), edits.0.len() + 5, "{text}");
    let none = Edits::default().to_json().expect("finite");
    assert_eq!(Edits::from_json(&none).expect("just written"), Edits::default());
    let short = r#"{"edits": [{"insert_object": {"name": "a", "shape": {"file": "b/c.ply"}}},
        {"set_transform": {"node": {"index": 0, "name": ""}, "transform": {"parts": {}}}}], "version": 1}"#;
    let Edits(read) = Edits::from_json(short).expect("what may be left out");
    for edit in &read {
        let (Edit::InsertObject { transform, .. } | Edit::SetTransform { transform, .. }) = edit else {
            panic!("{edit:?}");
        };
        assert_eq!(*transform, Transform::IDENTITY);
    }
}

proptest! {
    #[test]
    fn no_bit_of_a_number_is_lost(
        single in prop::array::uniform3(any::<u32>().prop_map(f32::from_bits)),
        double in prop::array::uniform4(any::<u64>().prop_map(f64::from_bits)),
    ) {
        prop_assume!(single.iter().all(|x| x.is_finite()) && double.iter().all(|x| x.is_finite()));
        let node = NamedIndex { index: 3, name: "a".into() };
        let translation = DVec3::from_slice(&double);
        let transform = Transform::Affine(DAffine3 { matrix3: DMat3::IDENTITY, translation });
        let light = Edit::SetIntensity { light: node.clone(), intensity: single.into() };
        let moved = Edit::SetTransform { node, transform };
        let edits = Edits(vec![moved, light, Edit::SetTime { seconds: double[3] }]);
        let text = edits.to_json().expect("finite");
        let read = Edits::from_json(&text).expect("just written");
        // Debug tells the zeros apart.
        prop_assert_eq!(format!("{edits:?}"), format!("{read:?}"));
    }
}

#[test]
fn what_is_recorded_leads_to_the_same_scene() {
    let mut scene = lit_room();
    let mut edits = Edits::default();
    let mut record = |edit| edits.record(edit, &mut scene, &no_files).expect("possible");
    let node = NamedIndex { index: 1, name: "box".into() };
    let wall = NamedIndex { index: 0, name: "room".into() };
    let still = lit_room().nodes[0].local;
    // A static object that comes back to where it was is dynamic; and one that is not moved is not.
    record(Edit::SetTransform { node: wall.clone(), transform: still });
    for x in [0.1, 0.2, 0.0] {
        let transform = if x == 0.0 { still } else { Transform::translation(vec3(x, 0.0, 0.0)) };
        record(Edit::SetTransform { node: wall.clone(), transform });
    }
    // Far out, by which the scene gets another frame, and back.
    for x in [0.5, 1.0, 40.0, 90.0, 80.0, 0.3, 0.2, 0.1] {
        record(Edit::SetTransform { node: node.clone(), transform: turned(x) });
    }
    for seconds in [0.1, 0.2, 0.3] {
        record(Edit::SetTime { seconds });
    }
    let lamp = NamedIndex { index: 1, name: "lamp".into() };
    for strength in [3.0, 2.0, 5.0] {
        record(Edit::SetEmission { material: lamp.clone(), emission: Vec3::splat(strength) });
    }
    let again = applied(&edits, lit_room());
    assert_eq!(bits(&again), bits(&scene));
    assert!(edits.0.len() < 12, "{}", edits.0.len());
    assert!(scene.objects[0].dynamic && scene.frame_of_reference() != lit_room().frame_of_reference());
    // Without what is kept it is another scene.
    let last = |edit: &&Edit| !matches!(edit, Edit::SetTransform { node, .. } if *node == wall);
    let fewer = Edits(edits.0.iter().filter(last).cloned().collect());
    assert_ne!(bits(&applied(&fewer, lit_room())), bits(&scene), "the control");
}

#[test]
fn what_is_refused_changes_nothing_and_is_not_recorded() {
    let object = |shape, material, scale| Edit::InsertObject {
        name: "thing".into(),
        shape,
        material,
        transform: Transform::Parts { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale },
        dynamic: false,
    };
    let node = |index, name: &str| NamedIndex { index, name: name.into() };
    let moved = |node, transform| Edit::SetTransform { node, transform };
    for (edit, fragment) in [
        (moved(node(1, "cube"), Transform::IDENTITY), "called `box` and not `cube`"),
        (moved(node(7, "box"), Transform::IDENTITY), "no node 7"),
        (moved(node(1, "box"), Transform::translation(Vec3::NAN)), "not finite"),
        (Edit::SetEmission { material: node(1, "lamp"), emission: Vec3::NEG_ONE }, "from 0 up"),
        (Edit::SetEmission { material: node(9, "lamp"), emission: Vec3::ONE }, "no material 9"),
        (Edit::SetIntensity { light: node(0, "sun"), intensity: Vec3::ONE }, "called `bulb`"),
        (Edit::RemoveObject { object: node(2, "box") }, "no object 2"),
        (Edit::RemoveLight { light: node(1, "bulb") }, "no light 1"),
        (Edit::SetCone { light: node(0, "bulb"), inner: 0.1, outer: 0.2 }, "no spot"),
        (
            Edit::InsertLight {
                name: "a".into(),
                kind: PunctualKind::Spot { inner: 0.4, outer: 0.2 },
                intensity: Vec3::ONE,
                transform: Transform::IDENTITY,
            },
            "cone",
        ),
        (
            Edit::DuplicateObject {
                object: node(1, "box"),
                name: "b".into(),
                transform: Transform::translation(Vec3::splat(1e20)),
            },
            "farther",
        ),
        (Edit::SetTime { seconds: f64::NAN }, "no time"),
        (object(Shape::File("chair.obj".into()), None, Vec3::ONE), "no chair.obj here"),
        (object(Shape::Torus, Some(node(0, "clay")), Vec3::ONE), "material 0 is called"),
        (object(Shape::Torus, None, Vec3::splat(1e20)), "as large or as far away"),
    ] {
        let (mut scene, mut edits) = (lit_room(), Edits::default());
        let before = bits(&scene);
        let refused = edits.record(edit.clone(), &mut scene, &no_files).expect_err("refused").to_string();
        assert!(refused.contains(fragment), "{edit:?}: {refused}");
        assert!(edits == Edits::default() && bits(&scene) == before, "{edit:?}");
        let both = Edits(vec![Edit::SetTime { seconds: 0.5 }, edit]);
        let said = both.apply(&mut scene, &no_files).expect_err("refused").to_string();
        assert!(said.starts_with("edit 2 cannot be made: ") && said.contains(fragment), "{said}");
    }
}

#[test]
fn broken_files_are_refused() {
    let list = |edits: &str| format!(r#"{{"version": 1, "edits": [{edits}]}}"#);
    let time = |seconds: &str| list(&format!(r#"{{"set_time": {{"seconds": {seconds}}}}}"#));
    assert!(Edits::from_json(&time("2.5")).is_ok());
    let emission = |red: &str| {
        let material = r#"{"index": 0, "name": ""}"#;
        list(&format!(r#"{{"set_emission": {{"material": {material}, "emission": [{red}, 0, 0]}}}}"#))
    };
    assert!(Edits::from_json(&emission("2")).is_ok());
    const TURNED: &str =
        r#"{"set_transform": {"node": {"index": 0, "name": ""}, "transform": {"parts": {"rotation": "#;
    assert!(Edits::from_json(&list(&format!("{TURNED}{}", "[0, 0, 0, 1]}}}}"))).is_ok());
    for (text, fragment) in [
        (String::new(), "EOF"),
        ("[]".into(), "no list of edits"),
        (r#"{"edits": []}"#.into(), "missing field `version`"),
        (r#"{"version": 1}"#.into(), "missing field `edits`"),
        (r#"{"version": 3, "edits": [{"set_mood": "merry"}]}"#.into(), "its version is 3"),
        (r#"{"version": 1, "edits": [], "more": 1}"#.into(), "unknown field `more`"),
        (list(r#"{"set_mood": "merry"}"#), "unknown variant `set_mood`"),
        (list(r#"{"set_time": {"seconds": 1, "speed": 2}}"#), "unknown field `speed`"),
        (list(r#"{"remove_object": {"object": {"index": -1, "name": ""}}}"#), "-1"),
        (list(r#"{"remove_object": {"object": {"index": 1}}}"#), "missing field `name`"),
        (list(r#"{"insert_object": {"name": "a", "shape": "cow"}}"#), "unknown variant `cow`"),
        (time("1e999"), "number out of range"),
        (time("NaN"), "expected"),
        (time("null"), "null"),
        (emission("1e39"), "number out of range"),
        (list(&format!("{TURNED}{}", "[0, 0, 0, 0]}}}}")), "edit 1 has a number that is not finite"),
        (time("1") + "more", "trailing"),
    ] {
        let said = Edits::from_json(&text).expect_err("broken").to_string();
        assert!(
            said.contains(fragment) && said.starts_with("the list of edits is not usable"),
            "{text}: {said}"
        );
    }
    let nan = Edits(vec![Edit::SetTime { seconds: f64::NAN }]);
    assert!(nan.to_json().is_err());
}
