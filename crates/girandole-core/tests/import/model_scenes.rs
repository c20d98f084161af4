//! Scenes from OBJ and PLY files: materials, colours, pictures, and which axis points up.

use crate::polygons::{case, obj};
use girandole_core::glam::{DVec3, Vec2, Vec3};
use girandole_core::scene::{
    DefaultLight, Geometry, LIKELY_Z_UP, LoadOptions, MaterialId, Scene, UpAxis, load_model, load_model_slice,
};
use std::path::Path;

fn load(path: &Path) -> Scene {
    let options = LoadOptions { light: DefaultLight::None, ..LoadOptions::default() };
    Scene::load_with(path, options).unwrap_or_else(|error| panic!("{error}"))
}

/// A scene of files in a folder, the first one of which is loaded.
fn folder(files: &[(&str, &[u8])]) -> Scene {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, bytes) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, bytes).expect("written");
    }
    load(&folder.path().join(files[0].0))
}

fn png(pixels: [[u8; 4]; 4]) -> Vec<u8> {
    let image = image::RgbaImage::from_raw(2, 2, pixels.as_flattened().to_vec()).expect("pixels");
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).expect("a PNG");
    bytes.into_inner()
}

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n";

#[test]
fn legal_files_load() {
    for (name, triangles) in [
        ("continuation.obj", 2),
        ("continuation_vn.obj", 2),
        ("usemtl_empty.obj", 1),
        ("comment_after_face.obj", 1),
        ("w_zero.obj", 1),
        ("vertex_colours_on_some.obj", 1),
    ] {
        let scene = load(&case(name));
        assert_eq!(scene.meshes[0].triangles.len(), triangles, "{name}");
        assert_eq!(scene.warnings, [""; 0], "{name}");
    }
    let refused = Scene::load(&case("l_only.obj")).unwrap_err().to_string();
    assert!(refused.contains("no faces"), "{refused}");
}

#[test]
fn every_way_of_writing_is_read() {
    let wanted = obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    for text in [
        "v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 3\r\n",
        "v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3\r",
        "\u{feff}v\t0  0\t0\nv 1. +0 -0.0\n  v 0e3 1e0 .0\nf  1\t2  3",
        "v 0 0 0 1\nv 1 0 0 .5\nv 0 1 0 0\nf -3 -2 -1\n",
        "f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n",
        "g a b\ns 1\no w\u{e4}nde\nmg 1\nlod 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl\nf 1// 2/ 3//\np 1\nl 1 2 3\n",
        "v 0 0 0 # a\nv 1 0 0# b\nv 0 1 0\n#f 1 2 3 \\\nf 1 \\\n 2 \\\r\n 3 # \\\n",
        "vn 0 0 1\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/9/1 2//9 3\n",
    ] {
        let mesh = obj(text);
        assert_eq!(
            (mesh.positions, mesh.normals, mesh.triangles),
            {
                let wanted = wanted.clone();
                (wanted.positions, wanted.normals, wanted.triangles)
            },
            "{text}"
        );
    }
    let refuse = |text: &str| load_model_slice(text.as_bytes(), "obj").unwrap_err().to_string();
    for (text, words) in [
        ("v 0 0 0\nf 1 0 1\n", "`0` is no corner of a face in line 2"),
        ("v 0 0 0\nf 1 -2 1\n", "`-2` is no corner"),
        ("v 0 0 0\nf a b c\n", "`a` is no corner"),
        ("v 0 0 0\nv 1,5 0 0\n", "`1,5` is no number in line 2"),
        ("v 0 0\n", "2 numbers instead of 3"),
        ("v 0 0 0\nv 1 0 0\nf 1 2\n", "no faces"),
        ("v 0 0 0\nf 1 2 3\n", "vertex 1 of 1"),
    ] {
        assert!(refuse(text).contains(words), "{}", refuse(text));
    }
}

#[test]
fn what_is_left_out_is_named_once() {
    let text = format!(
        "{TRIANGLE}l 1 2\nl 2 3\ncurv 0 1 1 2\nxyz 1\nxyz 2\nf 1 2\nf 1 2 3\nusemtl brick\nf 1 3 2\n"
    );
    let scene = folder(&[("a.obj", text.as_bytes())]);
    let said = scene.warnings.join("; ");
    for word in ["lines and points", "free-form", "`xyz`", "fewer than three", "`brick`"] {
        assert_eq!(said.matches(word).count(), 1, "{word}: {said}");
    }
}

#[test]
fn materials_are_read() {
    let scene = Scene::load(&case("room.obj")).expect("a scene");
    let names: Vec<&str> = scene.materials.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["red", "green", "lamp"]);
    assert_eq!(scene.materials[0].base_color, Vec3::new(0.8, 0.05, 0.05));
    assert_eq!(scene.materials[2].emission, Vec3::new(30.0, 28.0, 25.0));
    assert_eq!(scene.materials[2].base_color, Vec3::ZERO);
    assert!(scene.materials.iter().all(|m| m.specular == 0.0 && !m.is_transparent()));
    let of = |material| scene.meshes[0].triangles.iter().filter(|t| t.material == material).count();
    assert_eq!([of(MaterialId(0)), of(MaterialId(1)), of(MaterialId(2))], [4, 8, 2]);
    assert_eq!(scene.warnings, [""; 0]);
    assert!(scene.environment.is_none() && scene.lights.is_empty(), "its lamp is enough");
}

#[test]
fn gloss_and_glass_become_those_of_gltf() {
    let mtl = "newmtl plastic\nKd .5 .5 .5\nKs .5 .5 .5\nNs 198\nillum 2\nnewmtl matt\nKs 1 1 1\nNs 10\nillum 1\n\
        newmtl mirror\nKd 0 0 0\nKs .9 .8 .7\nNs 1000\nillum 3\nnewmtl pane\nd .25\nnewmtl pane2\nTr .75\n\
        newmtl opaque\nTr 1\nnewmtl steel\nKd .6 .6 .6\nPm 1\nPr .3\n";
    let names = ["plastic", "matt", "mirror", "pane", "pane2", "opaque", "steel"];
    let faces: String = names.iter().map(|name| format!("usemtl {name}\nf 1 2 3\n")).collect();
    let text = format!("mtllib a.mtl\n{TRIANGLE}{faces}");
    let scene = folder(&[("a.obj", text.as_bytes()), ("a.mtl", mtl.as_bytes())]);
    let of = |name: &str| scene.materials.iter().find(|m| m.name == name).expect("a material");
    let plastic = of("plastic");
    // α² = 2 / 200: a roughness of √0.1.
    assert!((plastic.roughness - 0.1_f32.sqrt()).abs() < 1e-5 && plastic.metallic == 0.0);
    assert_eq!((plastic.specular, plastic.specular_color), (1.0, Vec3::ONE), "4 % head on");
    assert_eq!((of("matt").specular, of("matt").roughness), (0.0, 1.0));
    let mirror = of("mirror");
    assert_eq!((mirror.metallic, mirror.base_color), (1.0, Vec3::new(0.9, 0.8, 0.7)));
    assert!(mirror.roughness < 0.25);
    for name in ["pane", "pane2"] {
        assert!(of(name).blended && of(name).alpha == 0.25, "{name}");
    }
    assert!(!of("opaque").blended);
    assert_eq!((of("steel").metallic, of("steel").roughness), (1.0, 0.3));
    assert_eq!(scene.warnings, [""; 0]);
}

#[test]
fn pictures_are_found_and_used() {
    let colors = png([[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [255; 4]]);
    let mask = png([[0, 0, 0, 255], [255; 4], [255; 4], [255; 4]]);
    let bumps = png([[128, 128, 255, 255]; 4]);
    let heights = png([[90, 90, 90, 255]; 4]);
    let mtl = "newmtl wall\nKd 0 0 0\nmap_Kd -s 2 1 1 C:\\maker\\Walls.PNG\n\
        map_d maps\\mask.png\nmap_Bump -bm .5 maps/bumps.png\n\
        newmtl lamp\nmap_Ke maps/bumps.png\nbump maps/heights.png\nmap_Kd nowhere.png\nmap_Ns x.png\n";
    let text =
        format!("mtllib none.mtl my walls.mtl\n{TRIANGLE}usemtl wall\nf 1/1 2/2 3/3\nusemtl lamp\nf 1 3 2\n")
            .replace("none.mtl my walls.mtl", "my walls.mtl\nmtllib none.mtl");
    let scene = folder(&[
        ("a.obj", text.as_bytes()),
        ("my walls.mtl", mtl.as_bytes()),
        ("walls.png", &colors),
        ("maps/mask.png", &mask),
        ("maps/bumps.png", &bumps),
        ("maps/heights.png", &heights),
    ]);
    let [wall, lamp] = &scene.materials[..] else { panic!("{:?}", scene.materials) };
    assert_eq!((wall.base_color, lamp.emission), (Vec3::ONE, Vec3::ONE), "factors that nobody means");
    let base = wall.base_color_texture.expect("a picture");
    let texels = &scene.textures[base.texture as usize].texels;
    assert_eq!(texels[..], [[255, 0, 0, 0], [0, 255, 0, 255], [0, 0, 255, 255], [255; 4]]);
    assert_eq!((wall.alpha_cutoff, wall.blended), (Some(0.5), false));
    // (1, 0) counted upwards is the lower right corner; twice as fine, it is two pictures to the right.
    assert_eq!(base.transform.transform_point2(Vec2::new(1.0, 1.0)), Vec2::new(2.0, 1.0));
    assert_eq!(wall.normal_texture.map(|n| n.scale), Some(0.5));
    assert!(
        lamp.normal_texture.is_none() && lamp.base_color_texture.is_none() && lamp.emission_texture.is_some()
    );
    let mesh = &scene.meshes[0];
    assert_eq!((mesh.tangents.len(), mesh.uvs.len()), (mesh.positions.len(), mesh.positions.len()));
    assert!(mesh.tangents.iter().any(|t| t.truncate().abs_diff_eq(Vec3::X, 1e-5)));
    let said = scene.warnings.join("; ");
    for word in ["nowhere.png", "none.mtl", "`map_Ns`", "of heights"] {
        assert_eq!(said.matches(word).count(), 1, "{word}: {said}");
    }
    assert_eq!(scene.warnings.len(), 3, "{said}");
}

#[test]
fn several_names_and_broken_pictures_do_not_stop_a_scene() {
    let text =
        format!("mtllib a.mtl b.mtl\n{TRIANGLE}usemtl two\nf 1/1 2/2 3/3\nusemtl caf\u{e9}\nf 1 3 2\n");
    let latin1 = |text: &str| text.chars().map(|c| c as u8).collect::<Vec<u8>>();
    let scene = folder(&[
        ("a.obj", &latin1(&text)),
        ("a.mtl", &latin1("newmtl caf\u{e9}\nKd 1 0 0\n")),
        ("b.mtl", b"newmtl two\r\nKd 0 1 0\r\nmap_Kd b.mtl\r\nmap_Ks ..\r\nmap_Ke /dev/zero\r\n"),
    ]);
    let colors: Vec<Vec3> = scene.materials.iter().map(|m| m.base_color).collect();
    assert_eq!(colors, [Vec3::Y, Vec3::X]);
    assert_eq!(scene.warnings.len(), 3, "{:?}", scene.warnings);
    assert!(scene.textures.is_empty());
}

#[test]
fn colours_of_vertices_are_read() {
    let scene = load(&case("colours.ply"));
    let (mesh, material) = (&scene.meshes[0], &scene.materials[0]);
    assert!(material.vertex_colors && material.base_color == Vec3::ONE);
    assert_eq!(mesh.colors, [Vec3::X, Vec3::X, Vec3::Z, Vec3::Z]);
    let geometry = Geometry::new(&scene);
    let albedo = geometry.surface(&scene, 0, Vec2::ZERO, geometry.normal(0)).albedo;
    assert!(albedo.abs_diff_eq(Vec3::X, 1e-3), "{albedo}");
    let some = load(&case("vertex_colours_on_some.obj"));
    assert_eq!(some.meshes[0].colors, [Vec3::ONE, Vec3::X, Vec3::ONE]);
    // sRGB, of 1 or of 255; as floats and shorts in PLY files; an alpha is named.
    let gray = obj("v 0 0 0 127.5 127.5 127.5\nv 1 0 0 0 0 255\nv 0 1 0 0 0 0\nf 1 2 3\n");
    assert!((gray.colors[0].x - 0.2140).abs() < 1e-3 && gray.colors[1] == Vec3::Z, "{:?}", gray.colors);
    let text = std::fs::read_to_string(case("colours.ply")).expect("a file");
    for (kind, one) in [("float", "1"), ("ushort", "65535"), ("uchar", "255")] {
        let text = text
            .replace("property uchar blue\n", "property uchar blue\nproperty uchar alpha\n")
            .replace("uchar red", &format!("{kind} diffuse_red"))
            .replace(" 255 0 0\n", &format!(" {one} 0 0 9\n"))
            .replace(" 0 0 255\n", " 0 0 255 255\n");
        let scene = folder(&[("a.ply", text.as_bytes())]);
        assert_eq!(scene.meshes[0].colors, mesh.colors, "{kind}");
        assert!(scene.warnings[0].contains("alpha"), "{:?}", scene.warnings);
    }
}

#[test]
fn strips_and_pictures_of_scans_are_read() {
    let head = "ply\nformat ascii 1.0\ncomment TextureFile scan.png\n\
        element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
    let points = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n";
    let strip = format!(
        "{head}element tristrips 1\nproperty list int int vertex_indices\nend_header\n{points}8 0 1 2 3 -1 0 1 3\n"
    );
    let mesh = load_model_slice(strip.as_bytes(), "ply").expect("a model");
    assert_eq!(mesh.triangles.len(), 3);
    assert!(mesh.normals.iter().all(|n| *n == Vec3::Z), "{:?}", mesh.normals);
    let scan = format!(
        "{head}element face 1\nproperty list uchar int vertex_index\nproperty list uchar float texcoord\nend_header\n\
         {points}3 0 1 2 6 0 0 1 0 0 1\n"
    );
    let scene = folder(&[("a.ply", scan.as_bytes()), ("scan.png", &png([[9; 4]; 4]))]);
    assert!(scene.materials[0].base_color_texture.is_some() && scene.warnings.is_empty());
    assert_eq!(scene.meshes[0].uvs[1], [Vec2::new(1.0, 1.0); 2]);
    let points = format!("{head}end_header\n{points}");
    let refused = load_model_slice(points.as_bytes(), "ply").unwrap_err().to_string();
    assert!(refused.contains("only points"), "{refused}");
}

fn bounds(scene: &Scene) -> (DVec3, DVec3) {
    let geometry = Geometry::new(scene);
    let points = geometry.positions.iter().map(|p| p.as_dvec3() + geometry.origin);
    points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
}

#[test]
fn another_axis_may_point_up() {
    let path = case("house_zup.obj");
    let with = |up| {
        Scene::load_with(&path, LoadOptions { up, light: DefaultLight::None, ..LoadOptions::default() })
            .expect("a scene")
    };
    let doubts = |scene: &Scene| scene.warnings.iter().any(|w| w.ends_with(LIKELY_Z_UP));
    let plain = with(None);
    assert!(doubts(&plain) && !doubts(&with(Some(UpAxis::Y))), "{:?}", plain.warnings);
    assert_eq!(bounds(&plain), (DVec3::ZERO, DVec3::new(6.0, 4.0, 4.5)));
    let z = with(Some(UpAxis::Z));
    let (low, high) = bounds(&z);
    assert!(
        low.abs_diff_eq(DVec3::new(0.0, 0.0, -4.0), 1e-6)
            && high.abs_diff_eq(DVec3::new(6.0, 4.5, 0.0), 1e-6)
    );
    assert_eq!(z.meshes[0].patches.len(), plain.meshes[0].patches.len());
    let (low, high) = bounds(&with(Some(UpAxis::X)));
    assert!(
        low.abs_diff_eq(DVec3::new(-4.0, 0.0, 0.0), 1e-6)
            && high.abs_diff_eq(DVec3::new(0.0, 6.0, 4.5), 1e-6)
    );
    // The same of a mesh by itself; fronts stay fronts.
    let mut mesh = load_model(&path).expect("a model");
    mesh.turn_up(UpAxis::Z);
    assert!(mesh.positions.contains(&Vec3::new(6.0, 4.5, -2.0)));
    for t in &mesh.triangles {
        let [a, b, c] = t.vertices.map(|v| mesh.positions[v as usize]);
        assert!((b - a).cross(c - a).normalize().abs_diff_eq(mesh.normals[t.vertices[0] as usize], 1e-5));
    }
    // Nothing is said of what stands, of boxes, walls and rooms.
    for name in ["house_vn.obj", "room.obj", "door_wall.obj", "L_floor.obj", "colours.ply"] {
        assert!(!doubts(&load(&case(name))), "{name}");
    }
    let turned = obj_text(&mesh);
    assert!(!doubts(&folder(&[("turned.obj", turned.as_bytes())])));
}

fn obj_text(mesh: &girandole_core::scene::Mesh) -> String {
    let vertices = mesh.positions.iter().map(|p| format!("v {} {} {}\n", p.x, p.y, p.z));
    let faces = mesh.triangles.iter().map(|t| {
        let [a, b, c] = t.vertices.map(|v| v + 1);
        format!("f {a} {b} {c}\n")
    });
    vertices.chain(faces).collect()
}
