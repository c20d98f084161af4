//! Scenes that are written, and read again.

use crate::{Girandole, stderr, stdout};
use girandole_core::image::Image;
use girandole_reference::image_file::{read_exr, write_exr};

/// A textured square under a lamp, as a file that the program did not write.
const ROOM: &str = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1]}],
    "extensionsUsed":["KHR_lights_punctual"],
    "extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","intensity":20.0,"color":[1,0.8,0.3]}]}},
    "nodes":[{"name":"floor","mesh":0,"rotation":[0,0.1,0,0.99498744]},
        {"name":"lamp","translation":[0.3,0.9,0.4],"extensions":{"KHR_lights_punctual":{"light":0}}}],
    "materials":[{"name":"sand","pbrMetallicRoughness":{"baseColorFactor":[0.7,0.5,0.3,1],"roughnessFactor":0.4,"metallicFactor":0}}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[-1,0,-1],"max":[1,0,1]},
        {"bufferView":1,"componentType":5121,"count":6,"type":"SCALAR"}],
    "bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":6}],
    "buffers":[{"byteLength":54,"uri":"data:application/octet-stream;base64,AACAvwAAAAAAAIC/AACAvwAAAAAAAIA/AACAPwAAAAAAAIA/AACAPwAAAAAAAIC/AAECAAID"}]}"#;

impl Girandole {
    /// A picture's pixels by one of the engines that need no device.
    fn rendered(&self, scene: &str, options: &[&str]) -> Image {
        let render = ["render", scene, "--size", "32x24", "-o", "rendered.exr"];
        self.succeed(&[&render[..], options].concat());
        read_exr(&self.path().join("rendered.exr")).unwrap()
    }
}

const SAMPLED: [&str; 4] = ["--engine", "cpu", "--lights", "24"];
const TRACED: [&str; 4] = ["--engine", "path", "--paths", "8"];

#[test]
fn files_have_the_same_pixels() {
    let girandole = Girandole::new();
    let sampled = |scene| girandole.rendered(scene, &SAMPLED).pixels;
    let traced = |scene| girandole.rendered(scene, &TRACED).pixels;
    std::fs::write(girandole.path().join("room.gltf"), ROOM).unwrap();
    girandole.succeed(&["export", "room.gltf", "-o", "again.glb"]);
    assert!(sampled("again.glb") == sampled("room.gltf"));
    assert!(traced("again.glb") == traced("room.gltf"));
    // What was written stays so.
    girandole.succeed(&["export", "again.glb", "-o", "third.glb"]);
    assert!(sampled("third.glb") == sampled("room.gltf"));
    // The control: another room has another picture.
    std::fs::write(girandole.path().join("other.gltf"), ROOM.replace("0.7,0.5,0.3", "0.3,0.5,0.7")).unwrap();
    assert!(sampled("other.gltf") != sampled("room.gltf"));
}

#[test]
fn rooms_are_written_as_they_stand() {
    let girandole = Girandole::new();
    let edits = r#"{"version": 1, "edits": [{"insert_object": {"name": "ring", "shape": "torus"}}]}"#;
    std::fs::write(girandole.path().join("edits.json"), edits).unwrap();
    girandole.succeed(&["export", "table", "--edits", "edits.json", "--time", "1.25", "-o", "table.glb"]);
    let flip = |written: &[&str], room: &[&str]| {
        for (name, picture) in [("a.exr", ("table.glb", written)), ("b.exr", ("table", room))] {
            let picture = girandole.rendered(picture.0, &[&TRACED[..], picture.1].concat());
            write_exr(&girandole.path().join(name), &picture).unwrap();
        }
        girandole
            .run(&["compare", "a.exr", "b.exr", "--max-flip", "0.01", "--max-energy-error", "0.001"])
            .status
            .code()
    };
    // Triangles of a room have another order in the file.
    assert_eq!(flip(&[], &["--edits", "edits.json", "--time", "1.25"]), Some(0));
    assert_eq!(flip(&["--time", "0"], &["--edits", "edits.json", "--time", "0"]), Some(0), "animations");
    assert_eq!(flip(&[], &["--time", "1.25"]), Some(1), "the control: without the edits");
    let info = stdout(&girandole.succeed(&["info", "table.glb"]));
    assert!(info.contains("animations  1") && info.contains("red-wall"), "{info}");
}

#[test]
fn what_is_not_written_is_named() {
    let girandole = Girandole::new();
    let said = girandole.succeed(&["export", "table", "--environment", "sky", "-o", "table.glb"]);
    let said = stderr(&said);
    assert!(said.contains("wrote table.glb, without what is all around"), "{said}");
    for (arguments, why) in [
        (["export", "table", "-o", "table.obj"], ".glb"),
        (["export", "table", "-o", "nowhere/table.glb"], "no directory"),
        (["export", "nowhere.glb", "-o", "x.glb"], "nowhere.glb"),
    ] {
        let refused = girandole.run(&arguments);
        let said = stderr(&refused);
        assert!(refused.status.code() == Some(2) && said.contains(why), "{arguments:?}: {said}");
    }
    assert!(!girandole.files().iter().any(|name| name.contains("part")));
}
