//! What the glTF importer reads.

use crate::builder::{File, some_of_everything};
use girandole_core::glam::{Quat, Vec2, Vec3, Vec4};
use girandole_core::scene::{
    ClipPlanes, ColorSpace, Filter, Geometry, Interpolation, Keyframes, LoadOptions, NodeId, Projection,
    PunctualKind, Scene, Transform, Wrap, load_gltf_slice,
};
use serde_json::{Value, json};

fn load(file: &File) -> Scene {
    load_gltf_slice(&file.glb(), None).expect("a scene")
}

/// How often the warnings speak of something.
fn mentions(scene: &Scene, what: &str) -> usize {
    scene.warnings.iter().filter(|w| w.contains(what)).count()
}

#[test]
fn nodes_objects_cameras_and_lights() {
    let scene = load(&some_of_everything());
    assert_eq!(scene.warnings, Vec::<String>::new());
    let names: Vec<&str> = scene.nodes.iter().map(|n| n.name.as_str()).collect();
    assert_eq!(names, ["root", "child", "", "", "lamp", ""]);
    assert!(scene.nodes.iter().enumerate().all(|(i, n)| n.parent.is_none_or(|p| p < i.into())));
    assert_eq!(scene.nodes[1].parent, Some(NodeId(0)));
    assert_eq!(scene.meshes.len(), 1, "instances share their mesh");
    let objects: Vec<_> = scene.objects.iter().map(|o| (o.node.0, o.mesh, o.dynamic)).collect();
    assert_eq!(objects, [(0, 0, true), (1, 0, true), (5, 0, false)], "what hangs on a mover moves");
    let marked: Vec<bool> = scene.nodes.iter().map(|n| n.transfer).collect();
    assert_eq!(marked, [true, false, false, false, false, false], "extras mark nodes for transfer");
    assert_eq!(scene.nodes[0].local, Transform::translation(Vec3::Y), "rotations are normalised");
    assert_eq!(
        scene.world_from_node(NodeId(1)).transform_point3(Vec3::ONE.as_dvec3()).as_vec3(),
        Vec3::new(2.0, 3.0, -2.0)
    );
    assert_eq!(scene.world_from_node(NodeId(5)).translation.as_vec3(), Vec3::new(5.0, 6.0, 7.0));
    assert_eq!(scene.cameras[0].name, "eye");
    assert_eq!(scene.cameras[0].projection, Projection::Perspective { yfov: 0.75 });
    assert_eq!(scene.cameras[1].projection, Projection::Orthographic { ymag: 1.5 });
    assert_eq!(scene.cameras[0].clip, ClipPlanes { near: 0.1, far: f32::INFINITY });
    assert_eq!(scene.cameras[1].clip, ClipPlanes { near: 0.1, far: 10.0 });
    let lights: Vec<_> = scene.lights.iter().map(|l| (l.node.0, l.kind, l.intensity)).collect();
    assert_eq!(
        lights,
        [
            (2, PunctualKind::Point, Vec3::new(4.0, 2.0, 1.0)),
            (3, PunctualKind::Spot { inner: 0.25, outer: 0.5 }, Vec3::ONE),
            (4, PunctualKind::Directional, Vec3::splat(2.0)),
        ]
    );
    assert_eq!((scene.lights[0].name.as_str(), scene.lights[2].name.as_str()), ("bulb", "lamp"));
}

#[test]
fn materials_and_textures() {
    let scene = load(&some_of_everything());
    let m = &scene.materials[0];
    assert_eq!(
        (m.base_color, m.alpha, m.metallic, m.roughness),
        (Vec3::new(0.5, 0.25, 1.0), 0.75, 0.25, 0.5)
    );
    assert_eq!((m.specular, m.specular_color), (0.5, Vec3::new(1.0, 0.5, 0.25)));
    assert_eq!(m.emission, Vec3::new(4.0, 8.0, 0.0));
    assert_eq!((m.alpha_cutoff, m.double_sided), (Some(0.25), true));
    let base = m.base_color_texture.expect("a base colour texture");
    assert_eq!(base.uv_set, 1, "the transform's set wins");
    // Offset · rotation · scale: (1, 0) grows to (2, 0), turns to (0, −2), and moves.
    let moved = base.transform.transform_point2(Vec2::X);
    assert!((moved - Vec2::new(0.25, -1.5)).length() < 1e-6, "{moved}");
    let normal = m.normal_texture.expect("a normal map");
    assert_eq!((normal.scale, normal.texture.uv_set), (0.5, 0));
    let spaces: Vec<ColorSpace> = scene.textures.iter().map(|t| t.color_space).collect();
    assert_eq!(spaces, [ColorSpace::Srgb, ColorSpace::Linear], "one for colours, one for data");
    assert_eq!(m.emission_texture.map(|t| t.texture), Some(base.texture));
    assert_eq!(m.metallic_roughness_texture.map(|t| t.texture), Some(normal.texture.texture));
    let texture = &scene.textures[0];
    assert_eq!((texture.width, texture.height), (2, 2));
    assert_eq!(texture.texels, [[255, 0, 0, 255], [255, 200, 0, 0], [255, 0, 100, 0], [255, 200, 100, 255]]);
    assert_eq!((texture.wrap, texture.filter), ([Wrap::Clamp, Wrap::Mirror], Filter::Nearest));
    assert_eq!(scene.meshes[0].uvs[1], [Vec2::ONE, Vec2::splat(0.5)]);
}

#[test]
fn animations() {
    let scene = load(&some_of_everything());
    let channels = &scene.animations[0].channels;
    assert_eq!(scene.animations[0].name, "turn");
    assert_eq!(channels[0].times, [0.0, 1.0, 2.5]);
    assert_eq!((channels[0].node.0, channels[0].interpolation), (0, Interpolation::Step));
    let Keyframes::Rotation(turns) = &channels[0].keyframes else { panic!("{:?}", channels[0]) };
    assert_eq!(turns[1], Quat::from_xyzw(0.0, 0.0, 1.0, 0.0));
    assert_eq!(channels[1].interpolation, Interpolation::CubicSpline);
    assert_eq!(channels[1].keyframes, Keyframes::Translation(vec![Vec3::splat(0.5); 9]));
    assert_eq!(channels[2].keyframes, Keyframes::Scale(vec![Vec3::ONE; 3]));
}

#[test]
fn specular_is_on_unless_the_file_switches_it_off() {
    let mut file = File::with_square();
    file.push("materials", json!({}));
    file.push("materials", json!({"extensions": {"KHR_materials_specular": {"specularFactor": 0.0}}}));
    let scene = load(&file);
    assert_eq!([scene.materials[0].specular, scene.materials[1].specular], [1.0, 0.0]);
    // Primitives without a material have glTF's default one.
    let default = &scene.materials[scene.meshes[0].triangles[0].material];
    assert_eq!((default.specular, default.metallic, default.roughness), (1.0, 1.0, 1.0));
    assert_eq!(default.base_color, Vec3::ONE);
}

#[test]
fn strips_and_fans_are_the_same_triangles() {
    let square = load(&File::with_square());
    let area = |scene: &Scene| {
        let g = Geometry::new(scene);
        (0..g.triangles.len() as u32).map(|t| g.normal(t) * g.area(t)).sum::<Vec3>()
    };
    for (mode, indices) in [(5, [0_u16, 1, 3, 2]), (6, [0, 1, 2, 3])] {
        let mut file = File::new();
        let mut primitive = file.square();
        primitive["mode"] = json!(mode);
        primitive["indices"] = json!(file.shorts(&indices, "SCALAR"));
        let mesh = file.mesh(primitive);
        file.node(json!({"mesh": mesh}));
        let scene = load(&file);
        assert_eq!(scene.meshes[0].triangles.len(), 2);
        assert!((area(&scene) - area(&square)).length() < 1e-6, "mode {mode}: all face +Z");
    }
    // Without indices, a strip's corners are the vertices as they come.
    let mut file = File::new();
    let mut primitive = file.square();
    primitive["mode"] = json!(5);
    primitive.as_object_mut().expect("a primitive").remove("indices");
    let mesh = file.mesh(primitive);
    file.node(json!({"mesh": mesh}));
    assert_eq!(load(&file).meshes[0].triangles.len(), 2);
}

#[test]
fn points_and_lines_are_named_and_left_out() {
    let mut file = File::with_square();
    for mode in [0, 1, 2, 3] {
        let mut primitive = file.square();
        primitive["mode"] = json!(mode);
        file.json["meshes"][0]["primitives"].as_array_mut().expect("primitives").push(primitive);
    }
    let scene = load(&file);
    assert_eq!((scene.meshes[0].triangles.len(), mentions(&scene, "points and lines")), (2, 1));
}

#[test]
fn missing_normals_are_flat() {
    let mut file = File::new();
    // Two triangles that share an edge at a right angle.
    let positions = file.floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.], "VEC3");
    let indices = file.shorts(&[0, 1, 2, 1, 0, 3], "SCALAR");
    let mesh = file.mesh(json!({"attributes": {"POSITION": positions}, "indices": indices}));
    file.node(json!({"mesh": mesh}));
    let scene = load(&file);
    let mesh = &scene.meshes[0];
    let normal = |t: usize| mesh.triangles[t].vertices.map(|v| mesh.normals[v as usize]);
    let mut found = [normal(0), normal(1)];
    found.sort_by(|a, b| a[0].z.total_cmp(&b[0].z));
    assert_eq!(found, [[Vec3::Y; 3], [Vec3::Z; 3]]);
}

#[test]
fn unusable_normals_are_computed_and_named() {
    let mut file = File::with_square();
    let normals = file.floats(&[0., 0., 0., 0., 0., 5., f32::NAN, 0., 0., 0., 0., 1.], "VEC3");
    file.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normals);
    let scene = load(&file);
    assert_eq!(scene.meshes[0].normals, [Vec3::Z; 4]);
    assert_eq!(mentions(&scene, "normals"), 1);
}

/// A square with a normal map, and its texture coordinates.
fn normal_mapped(uvs: &[f32]) -> File {
    let mut file = File::with_square();
    let texture = file.texture(1, 1, |_, _| [128, 128, 255, 255]);
    let material = file.push("materials", json!({"normalTexture": {"index": texture}}));
    let uvs = file.floats(uvs, "VEC2");
    let primitive = &mut file.json["meshes"][0]["primitives"][0];
    primitive["material"] = json!(material);
    primitive["attributes"]["TEXCOORD_0"] = json!(uvs);
    file
}

#[test]
fn generated_tangents_follow_the_texture() {
    // glTF's bitangent points to the picture's top, which is where v falls.
    let upright = load(&normal_mapped(&[0., 1., 1., 1., 1., 0., 0., 0.]));
    assert_eq!(upright.meshes[0].tangents, [Vec4::new(1.0, 0.0, 0.0, 1.0); 4]);
    let mirrored = load(&normal_mapped(&[1., 1., 0., 1., 0., 0., 1., 0.]));
    assert_eq!(mirrored.meshes[0].tangents, [Vec4::new(-1.0, 0.0, 0.0, -1.0); 4]);
    assert!(load(&File::with_square()).meshes[0].tangents.is_empty(), "none where no normal map needs them");
}

#[test]
fn tangents_of_the_file_are_kept() {
    let mut file = normal_mapped(&[0., 1., 1., 1., 1., 0., 0., 0.]);
    let tangents = file.floats(&[0., 2., 0., -1.].repeat(4), "VEC4");
    file.json["meshes"][0]["primitives"][0]["attributes"]["TANGENT"] = json!(tangents);
    assert_eq!(load(&file).meshes[0].tangents, [Vec4::new(0.0, 1.0, 0.0, -1.0); 4]);
}

#[test]
fn vertices_split_where_tangents_disagree() {
    // The left triangle's texture is mirrored against the right one's.
    let mut file = normal_mapped(&[0., 1., 1., 1., 1., 0., 0., 0.]);
    let uvs = file.floats(&[0., 1., 1., 1., 0., 0., 1., 0.], "VEC2");
    file.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uvs);
    let scene = load(&file);
    let mesh = &scene.meshes[0];
    assert!(mesh.positions.len() > 4 && mesh.tangents.len() == mesh.positions.len());
    let signs = |t: usize| mesh.triangles[t].vertices.map(|v| mesh.tangents[v as usize].w);
    assert_ne!(signs(0), signs(1));
}

#[test]
fn quantised_and_sparse_accessors() {
    let mut file = File::with_square();
    file.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    // Bytes with a stride of four for positions, normalised shorts for texture coordinates.
    let view = file.view(&[0, 0, 0, 9, 10, 0, 0, 9, 10, 10, 0, 9, 0, 10, 0, 9]);
    file.json["bufferViews"][view]["byteStride"] = json!(4);
    let bytes = json!({"bufferView": view, "componentType": 5121, "count": 4, "type": "VEC3"});
    let positions = file.push("accessors", bytes);
    let uvs = file.shorts(&[0, 65535, 65535, 65535, 65535, 0, 0, 0], "VEC2");
    file.json["accessors"][uvs]["normalized"] = json!(true);
    let attributes = &mut file.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["POSITION"] = json!(positions);
    attributes["TEXCOORD_0"] = json!(uvs);
    let plain = load(&file);
    assert_eq!(plain.warnings, Vec::<String>::new());
    assert_eq!(plain.meshes[0].positions[2], Vec3::new(10.0, 10.0, 0.0));
    assert_eq!(plain.meshes[0].uvs[0][0], Vec2::Y);
    // The third vertex replaced.
    let (indices, values) = (file.view(&[2]), file.view(&[7, 8, 0]));
    file.json["accessors"][positions]["sparse"] = json!({
        "count": 1, "indices": {"bufferView": indices, "componentType": 5121}, "values": {"bufferView": values},
    });
    let sparse = load(&file);
    assert_eq!(sparse.meshes[0].positions[2], Vec3::new(7.0, 8.0, 0.0));
    assert_eq!(sparse.meshes[0].positions[1], plain.meshes[0].positions[1]);
}

#[test]
fn alpha_is_cut_only_where_it_can_be_seen() {
    let alpha = |mode: &str, alpha: [u8; 2], factor: f32| {
        let mut file = File::with_square();
        let texture = file.texture(2, 1, |x, _| [255, 255, 255, alpha[x as usize]]);
        let pbr = json!({"baseColorTexture": {"index": texture}, "baseColorFactor": [1.0, 1.0, 1.0, factor]});
        file.push("materials", json!({"alphaMode": mode, "pbrMetallicRoughness": pbr}));
        let scene = load(&file);
        assert_eq!(scene.warnings, Vec::<String>::new());
        (scene.materials[0].alpha_cutoff, scene.materials[0].blended)
    };
    assert_eq!(alpha("MASK", [0, 255], 1.0), (Some(0.5), false));
    assert_eq!(alpha("MASK", [200, 255], 1.0), (None, false), "nothing is below the cutoff");
    assert_eq!(alpha("BLEND", [0, 255], 1.0), (Some(0.5), false));
    assert_eq!(alpha("BLEND", [255, 255], 0.25), (None, true), "glass is seen through");
    assert_eq!(alpha("OPAQUE", [0, 255], 0.0), (None, false));
}

#[test]
fn what_is_not_supported_is_named_once() {
    let mut file = File::with_square();
    file.json["extensionsUsed"] = json!(["KHR_materials_volume", "EXT_structural_metadata"]);
    file.json["extensionsRequired"] = json!(["EXT_structural_metadata"]);
    for _ in 0..2 {
        let mut primitive = file.square();
        let colors = file.floats(&[1.0; 12], "VEC3");
        primitive["attributes"]["COLOR_1"] = json!(colors);
        let texture = file.texture(1, 1, |_, _| [255; 4]);
        let material = file.push(
            "materials",
            json!({
                "extensions": {"KHR_materials_volume": {}, "KHR_materials_iridescence": {}},
                "occlusionTexture": {"index": texture},
                "pbrMetallicRoughness": {"baseColorTexture": {"index": texture, "texCoord": 3}},
            }),
        );
        primitive["material"] = json!(material);
        let mesh = file.mesh(primitive);
        file.node(json!({"mesh": mesh, "translation": [0.0, 0.0, 1.0]}));
    }
    file.push("scenes", json!({"nodes": []}));
    file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "point", "range": 5.0}]}});
    for _ in 0..2 {
        file.node(json!({"extensions": {"KHR_lights_punctual": {"light": 0}}}));
    }
    let scene = load(&file);
    for what in [
        "KHR_materials_volume",
        "requires EXT_structural_metadata",
        "KHR_materials_iridescence",
        "vertex colours beyond set 0",
        "occlusion textures",
        "texture coordinates beyond set 1",
        "2 scenes",
        "ranges of lights",
    ] {
        assert_eq!(mentions(&scene, what), 1, "{what}: {:#?}", scene.warnings);
    }
    assert_eq!(scene.warnings.len(), 8, "{:#?}", scene.warnings);
}

#[test]
fn what_is_valid_and_not_needed_is_left_out() {
    let whole = load(&some_of_everything());
    // A scene without nodes, as the specification allows.
    let mut file = some_of_everything();
    file.push("scenes", json!({"name": "empty"}));
    let scene = load(&file);
    assert_eq!((scene.objects.len(), mentions(&scene, "2 scenes")), (whole.objects.len(), 1));
    // A channel that moves what is no node; the others stay.
    let mut file = some_of_everything();
    let pointer = json!({"pointer": "/materials/0/emissiveFactor"});
    let target = json!({"path": "pointer", "extensions": {"KHR_animation_pointer": pointer}});
    let channels = file.json["animations"][0]["channels"].as_array_mut().expect("channels");
    channels.push(json!({"sampler": 0, "target": target}));
    let scene = load(&file);
    assert_eq!(scene.animations, whole.animations);
    assert_eq!(mentions(&scene, "animations of anything but nodes"), 1, "{:?}", scene.warnings);
    // Pictures that are not there, however many materials name them.
    let mut file = some_of_everything();
    let image = file.push("images", json!({"uri": "nowhere.png"}));
    for i in 0..1000 {
        let texture = file.push("textures", json!({"source": image, "name": format!("texture {i}")}));
        let color = json!({"baseColorTexture": {"index": texture}});
        file.push("materials", json!({"pbrMetallicRoughness": color}));
    }
    let scene = load(&file);
    assert_eq!(scene.textures.len(), whole.textures.len());
    let [sentence] = &scene.warnings[..] else { panic!("{:?}", scene.warnings) };
    assert!(sentence.contains("1000 times (`texture 0`, `texture 1`, `texture 2`, …)"), "{sentence}");
    assert!(sentence.contains("nowhere.png") && sentence.len() < 400, "{sentence}");
    // A texture without a picture.
    let mut file = some_of_everything();
    file.json["textures"][0] = json!({});
    let scene = load(&file);
    assert!(scene.materials[0].base_color_texture.is_none());
    assert_eq!(mentions(&scene, "textures without images"), 1, "{:?}", scene.warnings);
    // A camera that sees nothing.
    let mut file = some_of_everything();
    let camera =
        file.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}));
    file.node(json!({"name": "blind", "camera": camera, "scale": [0.0, 0.0, 0.0]}));
    let scene = load(&file);
    assert_eq!((scene.cameras.len(), mentions(&scene, "camera `blind`")), (whole.cameras.len(), 1));
}

#[test]
fn triangles_listed_twice_count_once() {
    let mut file = File::with_square();
    let primitive: Value = file.json["meshes"][0]["primitives"][0].clone();
    file.json["meshes"][0]["primitives"].as_array_mut().expect("primitives").push(primitive);
    let scene = load(&file);
    assert_eq!((scene.meshes[0].triangles.len(), mentions(&scene, "twice")), (2, 1));
}

#[test]
fn mirrored_instances_keep_their_front() {
    let front = |scale: [f32; 3]| {
        let mut file = File::with_square();
        file.json["nodes"][0]["scale"] = json!(scale);
        let geometry = Geometry::new(&load(&file));
        assert_eq!((geometry.triangles.len(), geometry.patches.len()), (2, 1));
        let patch = &geometry.patches[0];
        assert!((0..2).all(|t| geometry.normal(t) == patch.normal));
        let agree = geometry.normals.iter().all(|n| n.dot(patch.normal) > 0.999);
        (patch.normal, agree)
    };
    assert_eq!(front([1.0, 1.0, 1.0]), (Vec3::Z, true));
    // A mirror in the square's own plane leaves it facing +Z; one across turns it with its normals.
    assert_eq!(front([-1.0, 1.0, 1.0]), (Vec3::Z, true));
    assert_eq!(front([1.0, 1.0, -1.0]), (Vec3::NEG_Z, true));
    assert_eq!(front([-1.0, -1.0, -1.0]), (Vec3::NEG_Z, true));
}

#[test]
fn planes_that_cut_off_all_are_left_out() {
    // A square 2 m in front of a camera with these planes, loaded as a file with this scale.
    let load = |near: f32, far: f32, scale: f64| {
        let mut file = File::with_square();
        let camera = json!({"type": "perspective", "name": "eye",
            "perspective": {"yfov": 1.0, "znear": near, "zfar": far}});
        let camera = file.push("cameras", camera);
        file.node(json!({"camera": camera, "translation": [0.5, 0.5, 2.0]}));
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("square.glb");
        std::fs::write(&path, file.glb()).expect("it is written");
        let options = LoadOptions { scale: Some(scale), ..LoadOptions::default() };
        Scene::load_with(&path, options).expect("it loads")
    };
    for (near, far, scale) in [(0.1, 50.0, 1.0), (1.5, 50.0, 1.0), (0.1, 2.5, 1.0), (1.5, 2.5, 0.01)] {
        let scene = load(near, far, scale);
        let expected = [near * scale as f32, far * scale as f32];
        assert_eq!([scene.cameras[0].clip.near, scene.cameras[0].clip.far], expected);
        assert!(!scene.warnings.iter().any(|w| w.contains("plane")), "{:?}", scene.warnings);
    }
    for (near, far) in [(2.5, 50.0), (0.1, 1.5)] {
        let scene = load(near, far, 1.0);
        assert_eq!(scene.cameras[0].clip, ClipPlanes::NONE);
        assert!(
            scene.warnings.iter().any(|w| w.contains("camera `eye` sees nothing between")),
            "{near} {far}"
        );
    }
    for (near, far) in [(-1.0, 5.0), (3.0, 3.0), (5.0, 1.0)] {
        let scene = load(near, far, 1.0);
        assert_eq!(scene.cameras[0].clip, ClipPlanes::NONE);
        assert!(scene.warnings.iter().any(|w| w.contains("impossible near plane")), "{near} {far}");
    }
}

#[test]
fn normals_that_point_away_from_fronts_are_turned() {
    let load = |normal: f32| {
        let mut file = File::new();
        let mut primitive = file.square();
        let normals = file.floats(&[0.0, 0.0, normal].repeat(4), "VEC3");
        primitive["attributes"]["NORMAL"] = json!(normals);
        let mesh = file.mesh(primitive);
        file.node(json!({"mesh": mesh}));
        load(&file)
    };
    for normal in [1.0, -1.0] {
        let scene = load(normal);
        assert!(scene.meshes[0].normals.iter().all(|n| *n == Vec3::Z), "{normal}");
        assert_eq!(mentions(&scene, "turned around"), usize::from(normal < 0.0));
    }
}
