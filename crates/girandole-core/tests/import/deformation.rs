//! Skinned and morphed meshes, against the same meshes baked at each moment.

use crate::bending::{Bending, DURATION, morph_weights};
use crate::builder::File;
use girandole_core::glam::{Vec3, vec3};
use girandole_core::illumination::{Illumination, IlluminationSettings, Rewalk};
use girandole_core::lights::{LightSample, LightSettings};
use girandole_core::scene::{FrameOfReference, Geometry, NONE, ObjectId, Scene, Transform, load_gltf_slice};
use girandole_core::trace::SceneTracer;
use serde_json::json;

/// The object that bends.
const BENT: usize = 2;
const MOMENTS: [f64; 6] = [0.0, 0.3, 0.5, 1.0, 1.4, 1.9];

fn load(file: &File) -> Scene {
    let scene = load_gltf_slice(&file.glb(), None).expect("a scene");
    assert_eq!(scene.warnings, Vec::<String>::new());
    scene
}

/// Positions in the world, normals and triangles of what bends.
fn surface(scene: &Scene) -> (Vec<Vec3>, Vec<Vec3>, Vec<[u32; 3]>) {
    let geometry = Geometry::new(scene);
    let range = geometry.objects[BENT].clone();
    let vertices = range.vertices.start as usize..range.vertices.end as usize;
    let triangles = range.triangles.start as usize..range.triangles.end as usize;
    let world = |p: &Vec3| (p.as_dvec3() + geometry.origin).as_vec3();
    (
        geometry.positions[vertices.clone()].iter().map(world).collect(),
        geometry.normals[vertices].to_vec(),
        geometry.triangles[triangles].iter().map(|t| t.vertices.map(|v| v - range.vertices.start)).collect(),
    )
}

/// The triangles of a mesh may come in another order where it has patches; they are compared by their corners.
fn differs(a: &Scene, b: &Scene) -> Option<String> {
    let corners = |scene: &Scene| {
        let (positions, normals, triangles) = surface(scene);
        triangles.iter().map(|t| t.map(|v| (positions[v as usize], normals[v as usize]))).collect::<Vec<_>>()
    };
    let (a, b) = (corners(a), corners(b));
    assert_eq!(a.len(), b.len());
    let near = |a: &[(Vec3, Vec3); 3], b: &[(Vec3, Vec3); 3]| {
        a.iter().zip(b).all(|(a, b)| a.0.distance(b.0) < 2e-6 && a.1.distance(b.1) < 2e-5)
    };
    a.iter().find(|a| !b.iter().any(|b| near(a, b))).map(|t| format!("{t:?}"))
}

#[test]
fn deformed_meshes_are_the_baked_ones_at_each_moment() {
    for (which, bending) in Bending::all().iter().enumerate() {
        let mut scene = load(&bending.file());
        assert!(scene.objects[BENT].dynamic && scene.is_deformed(&scene.objects[BENT]));
        assert!(!scene.objects[0].dynamic && !scene.is_deformed(&scene.objects[0]));
        let at_rest = Geometry::new(&scene);
        assert!(at_rest.objects[BENT].patches.is_empty() && at_rest.dropped == 0);
        for t in MOMENTS {
            scene.set_time(t).expect("a moment");
            let baked = load(&bending.baked_file(t));
            assert_eq!(differs(&scene, &baked), None, "{which} at {t}");
            let geometry = Geometry::new(&scene);
            assert_eq!((&geometry.objects, &geometry.triangles), (&at_rest.objects, &at_rest.triangles));
            // The controls: another moment, and the mesh at rest.
            let other = load(&bending.baked_file(t + 0.07));
            assert!(differs(&scene, &other).is_some(), "{which} at {t}");
            let mut plain = bending.file();
            let node = plain.json["nodes"].as_array_mut().expect("nodes").iter_mut();
            for node in node.filter(|n| n["name"] == "bent") {
                for key in ["skin", "weights", "translation", "scale"] {
                    node.as_object_mut().expect("a node").remove(key);
                }
            }
            for mesh in plain.json["meshes"].as_array_mut().expect("meshes") {
                mesh.as_object_mut().expect("a mesh").remove("weights");
            }
            let plain = load(&plain);
            assert!(differs(&plain, &baked).is_some(), "{which} at {t}");
        }
        // It comes back to the bit.
        scene.set_time(0.0).expect("a moment");
        assert_eq!(Geometry::new(&scene).positions, at_rest.positions);
    }
}

#[test]
fn bounds_have_room_for_all_moments() {
    for (which, bending) in Bending::all().iter().enumerate() {
        let mut scene = load(&bending.file());
        let frame = FrameOfReference::of(&scene);
        for step in 0..=100 {
            scene.set_time(f64::from(step) * 0.01 * DURATION).expect("a moment");
            assert!(!scene.take_changes().reopened, "{which} at {step}");
            let geometry = Geometry::new(&scene);
            let (low, high) = geometry.bounds;
            assert!(geometry.positions.iter().all(|p| p.cmpge(low).all() && p.cmple(high).all()));
            assert_eq!(geometry.frame_of_reference(), frame);
        }
    }
    // The control: nobody said that it would get there.
    let mut scene = load(&Bending::skinned().file());
    let animations = std::mem::take(&mut scene.animations);
    scene.open();
    scene.animations = animations;
    scene.set_time(1.0).expect("a moment");
    assert!(scene.take_changes().reopened);
}

fn settings(rewalk: Rewalk) -> IlluminationSettings {
    let lights = LightSettings { count: 48, candidates: 2, ..LightSettings::default() };
    IlluminationSettings { lights, rewalk, ..IlluminationSettings::default() }
}

/// Everything that follows from a scene, in terms that can be compared.
fn contents(of: &Illumination) -> String {
    let (geometry, lights) = (of.geometry(), of.lights());
    let database = of.visibility().expect("it was asked for");
    let states: Vec<_> =
        (0..database.receivers().leaves.len() as u32).map(|leaf| database.leaf_states(leaf)).collect();
    format!(
        "{:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?}",
        geometry.frame_of_reference(),
        geometry.positions,
        geometry.normals,
        geometry.triangles,
        lights.samples(),
        lights.ids(),
        database.receivers(),
        states
    )
}

#[test]
fn updates_are_what_the_moment_gives_from_scratch() {
    for bending in [Bending::both(), Bending::morphed()] {
        let mut scene = load(&bending.file());
        let settings = settings(Rewalk::All);
        let mut held = Illumination::new(&scene, &settings).expect("there is light");
        for t in [0.4, 1.0, 1.05, 1.8] {
            scene.set_time(t).expect("a moment");
            let changes = scene.take_changes();
            assert_eq!(changes.moved, [ObjectId::from(BENT)]);
            let before = contents(&held);
            held.update(&scene, &changes).expect("it follows");
            let fresh = contents(&Illumination::new(&scene, &settings).expect("there is light"));
            assert!(contents(&held) == fresh, "at {t}");
            assert!(before != fresh, "the control at {t}");
        }
    }
}

/// Visibility follows the held samples, which nothing that bends carries.
#[test]
fn visibility_follows_what_bends() {
    let mut scene = load(&Bending::both().file());
    let mut settings = settings(Rewalk::Off);
    settings.lights.walk_dynamic = false;
    let mut held = Illumination::new(&scene, &settings).expect("there is light");
    let sampled = held.lights().samples().to_vec();
    let mut states = Vec::new();
    for t in [0.4, 1.0, 1.5] {
        scene.set_time(t).expect("a moment");
        let changes = scene.take_changes();
        held.update(&scene, &changes).expect("it follows");
        assert_eq!(held.lights().samples(), sampled);
        let visibility = settings.visibility.as_ref().expect("it is asked for");
        let fresh = girandole_core::visibility::VisibilityDatabase::build(
            &scene,
            held.geometry(),
            held.lights(),
            visibility,
        );
        let (database, fresh) = (held.visibility().expect("it is asked for"), fresh.expect("a database"));
        assert_eq!(format!("{:?}", database.receivers()), format!("{:?}", fresh.receivers()));
        let leaves = 0..fresh.receivers().leaves.len() as u32;
        let of: Vec<_> = leaves.clone().map(|leaf| fresh.leaf_states(leaf).to_vec()).collect();
        assert_eq!(leaves.map(|leaf| database.leaf_states(leaf).to_vec()).collect::<Vec<_>>(), of);
        states.push(of);
    }
    assert!(states[0] != states[1] && states[1] != states[2], "the control");
}

/// A cloth that shines, and how much light its samples send.
fn shining() -> File {
    let mut file = Bending::morphed().file();
    let mesh = file.json["meshes"].as_array().expect("meshes").len() - 1;
    file.json["meshes"][mesh]["primitives"][0]["material"] = json!(1);
    file
}

#[test]
fn held_samples_go_with_triangles_that_bend() {
    let mut scene = load(&shining());
    let settings = settings(Rewalk::Off);
    let mut held = Illumination::new(&scene, &settings).expect("there is light");
    let (was, sampled) = (held.geometry().clone(), held.lights().samples().to_vec());
    for t in [1.2, 0.7] {
        scene.set_time(t).expect("a moment");
        let changes = scene.take_changes();
        held.update(&scene, &changes).expect("it follows");
        let geometry = held.geometry();
        let mut moved = 0;
        for (now, then) in held.lights().samples().iter().zip(&sampled) {
            assert_eq!(now.triangle(), then.triangle());
            let is_bent = then.triangle() != NONE
                && geometry.triangles[then.triangle() as usize].object as usize == BENT;
            if !is_bent {
                assert_eq!(now, then);
                continue;
            }
            // The same barycentric coordinates and height.
            let place = |geometry: &Geometry, s: &LightSample| {
                let [a, b, c] = geometry.corners(s.triangle()).map(|p| p.as_dvec3());
                let (normal, p) = (geometry.normal(s.triangle()).as_dvec3(), s.position.as_dvec3() - a);
                let area = (b - a).cross(c - a).dot(normal);
                let u = p.cross(c - a).dot(normal) / area;
                let v = (b - a).cross(p).dot(normal) / area;
                vec3(u as f32, v as f32, (p.dot(normal) * 1e3) as f32)
            };
            let [after, before] = [place(geometry, now), place(&was, then)];
            assert!(after.abs_diff_eq(before, 2e-3), "{after} {before}");
            assert!(now.normal.dot(geometry.normal(now.triangle())) > 0.9999, "{now:?}");
            let ratio = geometry.area(now.triangle()) / was.area(now.triangle());
            let is_emitter = matches!(now.origin, girandole_core::lights::SampleOrigin::Emitter { .. });
            let expected = then.intensity * if is_emitter { ratio } else { 1.0 };
            assert!(now.intensity.abs_diff_eq(expected, 1e-4 * expected.length()), "{now:?} {then:?}");
            moved += usize::from(now.position.distance(then.position) > 0.01 && (ratio - 1.0).abs() > 1e-3);
        }
        assert!(moved > 10, "{moved}");
    }
}

#[test]
fn what_is_turned_inside_out_is_sampled_anew() {
    let mut file = Bending::skinned().file();
    file.json["meshes"][BENT]["primitives"][0]["material"] = json!(1);
    for (x, is_anew) in [(0.8, false), (-0.8, true)] {
        let mut scene = load(&file);
        let settings = settings(Rewalk::Off);
        let mut held = Illumination::new(&scene, &settings).expect("there is light");
        let armature = scene.nodes.iter().position(|n| n.name == "armature").expect("a node");
        let _ = scene.take_changes();
        let Transform::Parts { translation, rotation, .. } = scene.nodes[armature].local else { panic!() };
        let scaled = Transform::Parts { translation, rotation, scale: vec3(x, 1.0, 1.0) };
        scene.set_transform(armature.into(), scaled).expect("a place");
        held.update(&scene, &scene.clone().take_changes()).expect("it follows");
        let fresh = Illumination::new(&scene, &settings).expect("there is light");
        assert_eq!(held.lights().samples() == fresh.lights().samples(), is_anew, "{x}");
        let geometry = held.geometry();
        let on_surface = held.lights().samples().iter().filter(|s| s.triangle() != NONE);
        let mut fronts = on_surface.map(|s| geometry.normal(s.triangle()).dot(s.normal));
        assert!(fronts.all(|cosine| cosine > 0.999), "{x}");
    }
}

#[test]
fn triangles_that_collapse_change_nothing_else() {
    // A target that shrinks the first row of cells to a line.
    let bending = Bending::morphed();
    let mut file = shining();
    let mut flat: Vec<f32> = vec![0.0; bending.rest.positions.len() * 3];
    for vertex in 0..5 {
        flat[3 * vertex + 2] = 0.25;
    }
    let flat = file.floats(&flat, "VEC3");
    let mesh = file.json["meshes"].as_array().expect("meshes").len() - 1;
    file.json["meshes"][mesh]["primitives"][0]["targets"] = json!([{"POSITION": flat}]);
    file.json["meshes"][mesh]["weights"] = json!([0.0]);
    file.json["nodes"][BENT].as_object_mut().expect("a node").remove("weights");
    file.json.as_object_mut().expect("a root").remove("animations");
    let mut scene = load(&file);
    let node = scene.objects[BENT].node;
    let whole = Geometry::new(&scene);
    for rewalk in [Rewalk::All, Rewalk::Off] {
        let settings = settings(rewalk);
        scene.set_morph_weights(node, &[0.0]).expect("weights");
        let mut held = Illumination::new(&scene, &settings).expect("there is light");
        let _ = scene.take_changes();
        scene.set_morph_weights(node, &[1.0]).expect("weights");
        let changes = scene.take_changes();
        assert_eq!(changes.moved, [ObjectId::from(BENT)]);
        held.update(&scene, &changes).expect("it follows");
        // Samples were on what collapsed, so all are anew either way.
        assert!(contents(&held) == contents(&Illumination::new(&scene, &settings).expect("there is light")));
    }
    let geometry = Geometry::new(&scene);
    assert_eq!((&geometry.objects, &geometry.triangles), (&whole.objects, &whole.triangles));
    let collapsed: Vec<u32> =
        geometry.objects[BENT].triangles.clone().filter(|&t| geometry.area(t) == 0.0).collect();
    assert_eq!((collapsed.len(), geometry.dropped), (8, 0));
    assert!(collapsed.iter().all(|&t| geometry.normal(t) == Vec3::Y));
    let lights = Illumination::new(&scene, &settings(Rewalk::All)).expect("there is light");
    for sample in lights.lights().samples() {
        assert!(!collapsed.contains(&sample.triangle()) && sample.position.is_finite());
        assert!(sample.normal.is_normalized() && sample.intensity.is_finite());
    }
    // Rays do not see them, and see what is behind.
    let tracer = SceneTracer::new(&scene, &geometry);
    let hit = |at: Vec3| {
        let origin = at - geometry.origin.as_vec3();
        tracer.closest_hit(origin, Vec3::NEG_Y, f32::INFINITY, NONE).expect("the floor at least").triangle
    };
    for i in 0..200 {
        let x = -0.49 + 0.0049 * i as f32;
        for z in [-0.4, -0.25, -0.1] {
            assert!(!collapsed.contains(&hit(vec3(x, 1.0, z))));
        }
        assert_eq!(geometry.triangles[hit(vec3(x, 1.0, -0.4)) as usize].object, 0);
        assert_eq!(geometry.triangles[hit(vec3(x, 1.0, -0.1)) as usize].object as usize, BENT);
    }
}

#[test]
fn what_bends_is_moved_by_joints_and_weights_alone() {
    let mut scene = load(&Bending::both().file());
    let by_name = |name: &str| scene.nodes.iter().position(|n| n.name == name).expect("a node");
    let (bent, elbow, armature) = (by_name("bent"), by_name("elbow"), by_name("armature"));
    scene.open();
    let _ = scene.take_changes();
    let before = Geometry::new(&scene);
    scene.set_transform(bent.into(), Transform::translation(Vec3::splat(3.0))).expect("a place");
    assert!(scene.take_changes().is_empty() && Geometry::new(&scene).positions == before.positions);
    for node in [elbow, armature] {
        scene.set_transform(node.into(), Transform::translation(vec3(0.0, 0.5, 0.1))).expect("a place");
        assert_eq!(scene.take_changes().moved, [ObjectId::from(BENT)]);
    }
    let before = Geometry::new(&scene);
    scene.set_morph_weights(bent.into(), &[0.3, -0.2]).expect("weights");
    assert_eq!(scene.take_changes().moved, [ObjectId::from(BENT)]);
    assert_ne!(Geometry::new(&scene).positions, before.positions);
    let generation = scene.generation();
    scene.set_morph_weights(bent.into(), &[0.3, -0.2]).expect("weights");
    assert_eq!(scene.generation(), generation, "nothing changed");
    let mut refused = |node: usize, weights: &[f32], words: &str| {
        let sentence = scene.set_morph_weights(node.into(), weights).expect_err("not possible").to_string();
        assert!(sentence.contains(words) && !sentence.contains('\n'), "{sentence}");
    };
    refused(99, &[], "no node 99");
    refused(bent, &[1.0], "2 morph targets");
    refused(bent, &[f32::NAN, 0.0], "not finite");
    refused(bent, &[1e30, 0.0], "scale it to metres");
    refused(0, &[1.0], "0 morph targets");
    assert_eq!(scene.generation(), generation);
    assert_eq!(scene.nodes[bent].morph_weights, [0.3, -0.2]);
}

#[test]
fn skins_and_targets_are_read() {
    let scene = load(&Bending::both().file());
    let skin = &scene.skins[scene.objects[BENT].skin.expect("a skin")];
    assert_eq!((skin.name.as_str(), skin.joints.len()), ("arm", 2));
    assert_eq!(scene.nodes[skin.joints[1].node].name, "elbow");
    assert_eq!(skin.joints[1].inverse_bind.translation.y, -1.0);
    let mesh = &scene.meshes[scene.objects[BENT].mesh];
    assert_eq!(mesh.joint_weights.len(), 4 * mesh.positions.len());
    assert_eq!((mesh.morph_targets.len(), mesh.morph_targets[1].normals.len()), (2, 0));
    let weights = morph_weights(0.0).map(|w| w as f32);
    assert_eq!(scene.nodes[scene.objects[BENT].node].morph_weights, weights, "the node's, not the mesh's");
    assert!(mesh.patches.is_empty());
    // Without weights of its own a node has the mesh's; without any, none count.
    let mut file = Bending::morphed().file();
    file.json["nodes"][BENT].as_object_mut().expect("a node").remove("weights");
    assert_eq!(load(&file).nodes[BENT].morph_weights, [9.0, 9.0]);
    file.json["meshes"][BENT].as_object_mut().expect("a mesh").remove("weights");
    assert_eq!(load(&file).nodes[BENT].morph_weights, [0.0, 0.0]);
    // Without inverse bind matrices they are identities.
    let mut file = Bending::skinned().file();
    file.json["skins"][0].as_object_mut().expect("a skin").remove("inverseBindMatrices");
    assert!(load(&file).skins[0].joints.iter().all(|j| j.inverse_bind.translation == Vec3::ZERO.as_dvec3()));
}

#[test]
fn further_sets_of_joints_count() {
    // Each weight in two halves, the second ones in a second set of normalised shorts.
    let bending = Bending::skinned();
    let mut file = bending.file();
    let attributes = &file.json["meshes"][BENT]["primitives"][0]["attributes"];
    let joints = attributes["JOINTS_0"].clone();
    let elbow = bending.rest.positions.iter().map(|p| (p.y as f32 - 0.5).clamp(0.0, 1.0));
    let halves: Vec<[f32; 2]> = elbow.map(|w| [w * 0.5, (1.0 - w) * 0.5]).collect();
    let shorts: Vec<u16> = halves
        .iter()
        .flat_map(|w| [(w[0] * 65535.0).round() as u16, (w[1] * 65535.0).round() as u16, 0, 0])
        .collect();
    let floats: Vec<f32> = halves.iter().flat_map(|w| [w[0], w[1], 0.0, 0.0]).collect();
    let (first, second) = (file.floats(&floats, "VEC4"), file.shorts(&shorts, "VEC4"));
    file.json["accessors"][second]["normalized"] = json!(true);
    let attributes = &mut file.json["meshes"][BENT]["primitives"][0]["attributes"];
    attributes["WEIGHTS_0"] = json!(first);
    attributes["JOINTS_1"] = joints;
    attributes["WEIGHTS_1"] = json!(second);
    let (mut one, mut two) = (load(&bending.file()), load(&file));
    one.set_time(1.0).expect("a moment");
    two.set_time(1.0).expect("a moment");
    let (a, b) = (surface(&one).0, surface(&two).0);
    assert!(a.iter().zip(&b).all(|(a, b)| a.distance(*b) < 5e-5));
    // The control: the first set alone, of which the sum is a half, is the same shape; the second with other joints is not.
    let swapped = [0_u16, 1, 0, 0].repeat(halves.len());
    let swapped = file.shorts(&swapped, "VEC4");
    file.json["meshes"][BENT]["primitives"][0]["attributes"]["JOINTS_1"] = json!(swapped);
    let mut other = load(&file);
    other.set_time(1.0).expect("a moment");
    assert!(a.iter().zip(&surface(&other).0).any(|(a, b)| a.distance(*b) > 0.1));
}

#[test]
fn triangles_that_part_are_kept() {
    // Both primitives have the same triangles; the second one's targets differ, or not.
    let listed_twice = |is_other: bool| {
        let mut file = Bending::morphed().file();
        let mut again = file.json["meshes"][BENT]["primitives"][0].clone();
        if is_other {
            again["targets"].as_array_mut().expect("targets").swap(0, 1);
        }
        file.json["meshes"][BENT]["primitives"].as_array_mut().expect("primitives").push(again);
        let scene = load_gltf_slice(&file.glb(), None).expect("a scene");
        (scene.meshes[BENT].triangles.len(), scene.warnings.len())
    };
    assert_eq!([listed_twice(true), listed_twice(false)], [(64, 0), (32, 1)]);
}

#[test]
fn steps_hold_weights_and_lines_join_them() {
    for (interpolation, expected) in [("STEP", [0.0, 1.0]), ("LINEAR", [0.5, 0.25])] {
        let mut file = Bending::morphed().file();
        let (times, keys) =
            (file.floats(&[0.0, 1.0], "SCALAR"), file.floats(&[0.0, 1.0, 2.0, -2.0], "SCALAR"));
        file.json["animations"][0]["samplers"][0] =
            json!({"input": times, "output": keys, "interpolation": interpolation});
        let mut scene = load(&file);
        scene.set_time(0.25).expect("a moment");
        assert_eq!(scene.nodes[BENT].morph_weights, expected);
        scene.set_time(1.0).expect("a moment");
        assert_eq!(scene.nodes[BENT].morph_weights, [2.0, -2.0]);
    }
}
