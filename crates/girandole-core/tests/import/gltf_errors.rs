//! What the glTF importer refuses, and what it says then.

use crate::bending::Bending;
use crate::builder::{File, container, some_of_everything};
use girandole_core::Error;
use girandole_core::scene::{Scene, load_gltf, load_gltf_slice};
use serde_json::{Value, json};
use std::path::PathBuf;

/// One sentence without the prefix, or a panic.
fn refused(bytes: &[u8]) -> String {
    match load_gltf_slice(bytes, None) {
        Err(Error::Broken { reason, .. }) => reason,
        other => panic!("not refused as broken: {other:?}"),
    }
}

fn expect(change: impl Fn(&mut File), words: &str) {
    let mut file = some_of_everything();
    assert!(load_gltf_slice(&file.glb(), None).is_ok(), "the file is in order before it is changed");
    change(&mut file);
    let reason = refused(&file.glb());
    assert!(reason.contains(words), "`{reason}` does not say `{words}`");
    assert!(!reason.contains('\n') && reason.len() < 400, "not a sentence: {reason}");
}

/// The file is loaded without something, and says without what.
fn left_out(change: impl Fn(&mut File), words: &str) {
    let mut file = some_of_everything();
    change(&mut file);
    assert_named(&file, words);
}

fn assert_named(file: &File, words: &str) {
    let scene = load_gltf_slice(&file.glb(), None).unwrap_or_else(|e| panic!("{words}: {e}"));
    let named = scene.warnings.iter().filter(|w| w.contains(words)).count();
    assert_eq!(named, 1, "`{words}`: {:?}", scene.warnings);
    assert!(scene.warnings.iter().all(|w| !w.contains('\n') && w.len() < 500), "{:?}", scene.warnings);
    assert!(!scene.objects.is_empty());
}

fn set(pointer: &'static str, value: Value) -> impl Fn(&mut File) {
    move |file| *file.json.pointer_mut(pointer).unwrap_or_else(|| panic!("{pointer}")) = value.clone()
}

#[test]
fn broken_containers() {
    let glb = some_of_everything().glb();
    let words = |bytes: &[u8], words: &str| {
        let reason = refused(bytes);
        assert!(reason.contains(words), "{reason}");
    };
    words(b"", "it is empty");
    words(b"ply\nformat ascii 1.0\n", "it is not a glTF file");
    words(&glb[..11], "it ends after 11 bytes");
    words(&glb[..glb.len() - 8], "it ends after");
    words(b"glTF\x02\0\0\0\x04\0\0\0", "header");
    words(b"glTF\x01\0\0\0\x0c\0\0\0", "version 1");
    words(b"{\"asset\": {\"version\": \"1.0\"}, \"meshes\": {}}", "version 1.0");
    words(b"{\"meshes\": 3}", "no `asset.version`");
    words(b"{\"asset\": {\"version\": \"2.0\"}", "JSON is broken");
    words(b"{\"asset\": {\"version\": \"2.0\"}}", "no triangles");
    words(&container(b"[".repeat(100_000), &[]), "JSON is broken");
}

#[test]
fn broken_references() {
    left_out(set("/nodes/0/mesh", json!(7)), "mesh 7 of 1");
    left_out(set("/nodes/1/children", json!([1])), "its own ancestor");
    left_out(set("/nodes/1/children", json!([2])), "two parents");
    left_out(set("/nodes/1/children", json!([99])), "node 99");
    left_out(set("/scene", json!(3)), "scene 3");
    left_out(set("/meshes/0/primitives/0/material", json!(5)), "material 5");
    expect(set("/meshes/0/primitives/0/attributes/POSITION", json!(99)), "accessor 99");
    expect(set("/meshes/0/primitives/0/indices", json!(0)), "indices");
    left_out(set("/textures/0/source", json!(4)), "image 4");
    left_out(set("/textures/0/sampler", json!(4)), "sampler 4");
    left_out(set("/nodes/2/extensions/KHR_lights_punctual/light", json!(9)), "light 9");
    left_out(set("/animations/0/channels/0/sampler", json!(9)), "animation sampler 9");
    left_out(set("/bufferViews/0/buffer", json!(9)), "buffer 9");
    expect(set("/accessors/0/bufferView", json!(99)), "buffer view 99");
}

#[test]
fn broken_data() {
    expect(set("/accessors/0/count", json!(4_000_000_000_u32)), "4000000000 elements");
    expect(set("/accessors/0/count", json!(u64::MAX)), "more than 32-bit");
    for offset in [u64::MAX, u64::MAX - 40, 44] {
        expect(
            |f| f.json["accessors"][0]["byteOffset"] = json!(offset),
            "accessor 0 has 4 elements, more than",
        );
    }
    expect(set("/accessors/0/type", json!("VEC9")), "unknown type");
    expect(set("/accessors/0/componentType", json!(5)), "unknown type");
    expect(set("/bufferViews/1/byteLength", json!(u64::MAX)), "buffer view 1");
    expect(set("/bufferViews/1/byteOffset", json!(u64::MAX)), "buffer view 1");
    expect(set("/accessors/1/count", json!(3)), "4 positions and 3");
    expect(set("/buffers/0/byteLength", json!(1_u64 << 40)), "cut off");
    expect(|f| f.json["bufferViews"][1]["byteStride"] = json!(1), "stride of 1");
    expect(
        |f| {
            let accessor = f.json["accessors"][0].as_object_mut().expect("an accessor");
            accessor.remove("bufferView");
            accessor.insert("count".into(), json!(1 << 30));
        },
        "without data",
    );
    let positions = |f: &File| f.json["bufferViews"][1]["byteOffset"].as_u64().expect("an offset") as usize;
    for value in [f32::NAN, f32::INFINITY] {
        expect(
            |f| {
                let at = positions(f) + 4;
                f.bin[at..at + 4].copy_from_slice(&value.to_le_bytes());
            },
            "its vertex 0 is at",
        );
    }
    expect(
        |f| {
            let at = f.json["bufferViews"][4]["byteOffset"].as_u64().expect("an offset") as usize;
            f.bin[at + 2] = 200;
        },
        "vertex 200 of 4",
    );
    expect(set("/nodes/1/translation", json!([1e38, 1e38, 0.0])), "scale it to metres");
    left_out(set("/nodes/1/rotation", json!([0.0, 0.0, 0.0, 0.0])), "node 1");
    left_out(set("/materials/0/emissiveFactor", json!([-1.0, 0.0, 0.0])), "emission of material `all`");
    left_out(set("/extensions/KHR_lights_punctual/lights/0/intensity", json!(-2.0)), "bulb");
    expect(
        |f| {
            let indices = f.view(&[9]);
            let values = f.view(&[0; 12]);
            f.json["accessors"][0]["sparse"] = json!({
                "count": 1, "indices": {"bufferView": indices, "componentType": 5121},
                "values": {"bufferView": values},
            });
        },
        "sparse indices",
    );
}

#[test]
fn broken_animations() {
    let times = |f: &File| f.json["animations"][0]["samplers"][0]["input"].as_u64().expect("times") as usize;
    left_out(
        |f| {
            let view = f.json["accessors"][times(f)]["bufferView"].as_u64().expect("a view") as usize;
            let at = f.json["bufferViews"][view]["byteOffset"].as_u64().expect("an offset") as usize;
            f.bin[at..at + 4].copy_from_slice(&9.0_f32.to_le_bytes());
        },
        "do not ascend",
    );
    left_out(
        |f| {
            let times = times(f);
            f.json["accessors"][times]["count"] = json!(2);
        },
        "values instead of",
    );
    left_out(set("/animations/0/samplers/0/interpolation", json!("MAGIC")), "interpolation");
}

#[test]
fn broken_deformation() {
    let bent = Bending::both().file();
    let expect = |change: &dyn Fn(&mut File), words: &str| {
        let mut file = Bending::both().file();
        assert!(load_gltf_slice(&file.glb(), None).is_ok(), "the file is in order before it is changed");
        change(&mut file);
        assert_named(&file, words);
    };
    let primitive = &bent.json["meshes"][2]["primitives"][0];
    let number = |value: &Value| value.as_u64().expect("an index") as usize;
    let accessor = |name: &str| number(&primitive["attributes"][name]);
    let (joints, weights) = (accessor("JOINTS_0"), accessor("WEIGHTS_0"));
    let matrices = number(&bent.json["skins"][0]["inverseBindMatrices"]);
    let shifts = number(&primitive["targets"][1]["POSITION"]);
    let start = |accessor: usize| {
        let view = number(&bent.json["accessors"][accessor]["bufferView"]);
        number(&bent.json["bufferViews"][view]["byteOffset"])
    };
    let float = |accessor: usize, value: f32| {
        let at = start(accessor);
        move |f: &mut File| f.bin[at..at + 4].copy_from_slice(&value.to_le_bytes())
    };
    expect(&set("/nodes/2/skin", json!(1)), "skin 1 of 1");
    expect(&set("/skins/0/joints/1", json!(99)), "node 99");
    expect(&set("/skins/0/joints", json!([4, 3, 3])), "3 joints and 2 inverse bind matrices");
    expect(&set("/scenes/0/nodes", json!([0, 1, 2])), "not in the scene");
    expect(&set("/skins/0/inverseBindMatrices", json!(shifts)), "inverse bind matrices are of type");
    expect(&float(matrices, f32::NAN), "inverse bind matrix that is not finite");
    expect(&|f| f.bin[start(joints) + 1] = 7, "joint 7 of 2");
    expect(&|f| f.json["accessors"][joints]["componentType"] = json!(5120), "bytes or shorts");
    for bad in [f32::NAN, f32::INFINITY, -0.5] {
        expect(&float(weights, bad), "joint weights that are");
    }
    for short in [joints, weights, shifts] {
        expect(&|f| f.json["accessors"][short]["count"] = json!(5), "81 positions and 5");
        expect(&|f| f.json["accessors"][short]["count"] = json!(100_000), "100000 elements");
    }
    let attributes = |change: &dyn Fn(&mut Value), words: &str| {
        expect(&|f| change(&mut f.json["meshes"][2]["primitives"][0]["attributes"]), words);
    };
    let remove = |names: &[&str], value: &mut Value| {
        names.iter().for_each(|name| drop(value.as_object_mut().expect("attributes").remove(*name)));
    };
    attributes(&|a| remove(&["WEIGHTS_0"], a), "JOINTS_0 or WEIGHTS_0 alone");
    attributes(&|a| remove(&["JOINTS_0", "WEIGHTS_0"], a), "a primitive without joints");
    let many = |a: &mut Value| {
        for set in 1..=4 {
            a[format!("JOINTS_{set}")] = json!(joints);
            a[format!("WEIGHTS_{set}")] = json!(weights);
        }
    };
    attributes(&many, "more than 16 joints");
    expect(&set("/meshes/2/primitives/0/targets/0/POSITION", json!(999)), "accessor 999");
    expect(&set("/meshes/2/primitives/0/targets/0/NORMAL", json!(weights)), "morph target 0");
    expect(&float(shifts, f32::NAN), "its vertex 0 has a morph target's positions that are not finite");
    expect(&set("/nodes/2/weights", json!([1.0])), "1 morph weights for 2");
    expect(
        &|f| {
            let again = f.json["meshes"][0]["primitives"][0].clone();
            f.json["meshes"][2]["primitives"].as_array_mut().expect("primitives").push(again);
        },
        "0 morph targets and a primitive before it 2",
    );
    let mut far = Bending::both().file();
    far.json["nodes"][2]["weights"] = json!([1e35, 0.0]);
    assert!(refused(&far.glb()).contains("scale it to metres"));
    expect(&set("/animations/0/channels/0/target/node", json!(0)), "0 each");
    let keys = number(&bent.json["animations"][0]["samplers"][0]["output"]);
    expect(&|f| f.json["accessors"][keys]["count"] = json!(9), "9 values instead of 6");
    expect(&float(keys, f32::INFINITY), "finite value");
}

#[test]
fn textures_that_cannot_be_used() {
    left_out(set("/images/0", json!({"uri": "no such file.png"})), "no such file.png");
    left_out(
        set("/images/0", json!({"uri": "https://example.org/wood.png"})),
        "https://example.org/wood.png",
    );
    left_out(set("/images/0", json!({"uri": "data:image/png;base64,!!!"})), "base64");
    left_out(set("/images/0", json!({"uri": "data:image/png;base64,AAAA"})), "cannot be decoded");
    left_out(set("/images/0", json!({})), "neither a file nor data");
    // A picture whose header promises more than can be held.
    let mut png = std::io::Cursor::new(Vec::new());
    image::GrayImage::new(9000, 1).write_to(&mut png, image::ImageFormat::Png).expect("a PNG");
    expect(
        |f| {
            let view = f.view(png.get_ref());
            f.json["images"][0]["bufferView"] = json!(view);
        },
        "9000 × 1 pixels",
    );
}

/// A folder that is removed in the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("girandole-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a folder");
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn files_beside_the_file() {
    let folder = Folder::new("beside");
    let mut file = some_of_everything();
    let bin = std::mem::take(&mut file.bin);
    file.json["buffers"][0] = json!({"uri": "the%20data.bin", "byteLength": bin.len()});
    let path = folder.0.join("a scene.gltf");
    std::fs::write(&path, file.json.to_string()).expect("a file");
    let sentence = load_gltf(&path).expect_err("the buffer is missing").to_string();
    assert!(sentence.contains("a scene.gltf") && sentence.contains("the data.bin"), "{sentence}");
    std::fs::write(folder.0.join("the data.bin"), &bin).expect("a file");
    let scene = Scene::load(&path).expect("a scene");
    assert_eq!((scene.name.as_str(), scene.objects.len()), ("a scene", 3));
    // Cut off.
    std::fs::write(folder.0.join("the data.bin"), &bin[..bin.len() - 1]).expect("a file");
    assert!(load_gltf(&path).expect_err("cut off").to_string().contains("cut off"));
    // A folder instead of a file, and a path that leaves no doubt where it leads.
    for (uri, words) in [(".", "not a file"), ("/dev/zero", "absolute path")] {
        file.json["buffers"][0]["uri"] = json!(uri);
        std::fs::write(&path, file.json.to_string()).expect("a file");
        assert!(load_gltf(&path).expect_err(uri).to_string().contains(words), "{uri}");
    }
}

#[test]
fn what_cannot_be_loaded_at_all() {
    let folder = Folder::new("kinds");
    let missing = Scene::load(&folder.0.join("missing.glb")).expect_err("no file");
    assert!(matches!(&missing, Error::Read { .. }) && missing.to_string().contains("missing.glb"));
    let unknown = Scene::load(&folder.0.join("scene.blend")).expect_err("no such kind");
    assert!(matches!(&unknown, Error::Unknown { .. }) && unknown.to_string().contains(".glb"));
    let path = folder.0.join("wrong.glb");
    std::fs::write(&path, "solid cube\n").expect("a file");
    let wrong = Scene::load(&path).expect_err("wrong extension").to_string();
    assert!(wrong.contains("wrong.glb") && wrong.contains("not a glTF file"), "{wrong}");
}

#[test]
fn too_many_triangles_are_refused_before_memory_is_taken() {
    // A strip of 30000 triangles shown a thousand times.
    let mut file = File::new();
    let zigzag: Vec<f32> = (0..30_002).flat_map(|i| [i as f32, (i % 2) as f32, 0.0]).collect();
    let positions = file.floats(&zigzag, "VEC3");
    let mesh = file.mesh(json!({"attributes": {"POSITION": positions}, "mode": 5}));
    for _ in 0..100 {
        file.node(json!({"mesh": mesh}));
    }
    assert_eq!(load_gltf_slice(&file.glb(), None).expect("three million are possible").objects.len(), 100);
    for _ in 0..900 {
        file.node(json!({"mesh": mesh}));
    }
    let reason = refused(&file.glb());
    assert!(reason.contains("MiB of memory"), "{reason}");
}
