//! Bad input: one sentence, exit code 2, nothing left behind.

use crate::{Girandole, stderr, stdout};
use std::process::Output;

/// Whether the program refused as it should, mentioning `fragment`.
fn refusal(output: &Output, fragment: &str) -> Result<(), String> {
    let said = stderr(output);
    let problem = if output.status.code() != Some(2) {
        format!("exit code {:?}", output.status.code())
    } else if !said.starts_with("error: ") || said.lines().count() != 1 || said.contains("panicked") {
        "not one sentence".into()
    } else if !said.contains(fragment) {
        format!("no mention of {fragment:?}")
    } else if said.matches("os error").count() > 1 {
        "a cause is named twice".into()
    } else if !stdout(output).is_empty() {
        "something on standard output".into()
    } else {
        return Ok(());
    };
    Err(format!("{problem}: {said}"))
}

#[test]
fn a_success_and_another_failure_are_no_refusal() {
    let girandole = Girandole::new();
    assert!(refusal(&girandole.run(&["--help"]), "").is_err());
    assert!(refusal(&girandole.run(&["render", "nowhere"]), "something else").is_err());
    assert!(refusal(&girandole.run(&["render", "nowhere"]), "nowhere").is_ok());
}

#[test]
fn bad_arguments() {
    let girandole = Girandole::new();
    std::fs::create_dir(girandole.path().join("folder.png")).unwrap();
    for (arguments, fragment) in [
        // Names.
        ("frobnicate", "frobnicate"),
        ("--frobnicate", "--frobnicate"),
        ("render nowhere", "living-room, area-lights, table, pillars, block, gap"),
        ("render nowhere.obj", "nowhere.obj"),
        ("render nowhere.glb", "nowhere.glb"),
        ("render nowhere.gltf", "nowhere.gltf"),
        ("render table --camera 17", "table"),
        ("render table --camera nobody", "nobody"),
        ("render table --object cow", "none, torus, teapot"),
        ("render table --object cow.ply", "cow.ply"),
        ("render table --transfer everywhere", "centre, grid"),
        ("render table --object none --transfer grid", "--object"),
        ("render table --transfer grid --transfer-nodes nobody", "nobody"),
        ("render table --transfer-nodes torus", "--transfer grid"),
        ("render table --transfer grid --transfer-points 17", "1..=16"),
        ("render table --transfer grid --transfer-bands 9", "1..=8"),
        ("render table --transfer grid --engine path", "--engine gpu and cpu"),
        ("render nowhere.glb --object torus", "--object"),
        ("render table --environment nowhere.hdr", "nowhere.hdr"),
        ("render table --environment 1,2", "three numbers"),
        ("render table --environment 1,-2,3", "three numbers"),
        ("render table --environment sky:100", "0 to 90°"),
        ("render table --environment sky:40,0,11", "1 to 10"),
        ("render table --environment sky:40,0,3,1", "elevation"),
        ("render table --environment sky40", "elevation"),
        ("render table --environment-strength 2", "--environment"),
        ("render table --environment 1,1,1 --environment-strength -1", "0 to 1000000"),
        ("render table --environment 1,1,1 --environment-rotation nan", "--environment-rotation"),
        ("render table --environment 1,1,1 --light studio", "--light"),
        ("render table --background transparent --debug levels", "--background"),
        ("render table --scale 0.01", "--scale"),
        ("render table --up z", "--up"),
        ("render table --object torus --up z", "--up"),
        ("render room.glb --scale 0", "1e-12"),
        ("render table --clip swim", "no animation called `swim`"),
        ("render table --view 1,2,3", "ten numbers"),
        ("render table --view -1,2,3", "ten numbers"),
        ("render table --view 0,1.7,4,0,1.7,0,0,1,0,x", "ten numbers"),
        ("render table --view 0,1.7,4,0,1.7,4,0,1,0,60", "same point"),
        ("render table --view 0,1.7,4,0,1.7,nan,0,1,0,60", "finite"),
        ("render table --view 0,1.7,4,0,1.7,0,0,0,1,60", "up"),
        ("render table --view 0,1.7,4,0,1.7,0,0,1,0,180", "180"),
        ("render table --view 0,1.7,4,0,1.7,0,0,1,0,60 --camera 0", "--camera"),
        ("render table --edits nowhere.json", "cannot read nowhere.json"),
        ("render table --edits folder.png", "folder.png"),
        ("bench table gap --view 0,1.7,4,0,1.7,0,0,1,0,60", "one scene"),
        ("bench --edits nowhere.json", "one scene"),
        ("bench table --edits nowhere.json", "cannot read nowhere.json"),
        ("render table --size 8x6 --lights 4 --adapter nobody's", "nobody's"),
        ("render table --engine cpu --adapter any", "--adapter"),
        ("render table --engine warp", "auto, gpu, cpu, path"),
        ("render table --tonemap loud", "agx, aces, none"),
        ("render table --shadow-map flat", "octahedral, parabolic, cube"),
        ("render table --debug shades", "light-maps"),
        ("render table --debug states:x", "states:N"),
        ("render table --debug levels --engine cpu", "--debug"),
        ("render table --refine 0", "--refine"),
        ("render table --part 1/2", "--frames"),
        ("render table --part 3/2 --frames 0..1 -o f#.png", "counted from 1"),
        ("render table --region 0,0,0,5 -o r.exr", "--region"),
        ("render table --size 40x30 --region 30,0,11,5 -o r.exr", "40×30"),
        ("render table --region 0,0,8,8 -o r.png", "--exposure"),
        ("render table --region 0,0,8,8 -o r.exr --engine cpu", "--engine gpu"),
        ("render table --region 0,0,8,8 -o r.exr --debug levels", "--debug"),
        ("render table --size 60000x60000 -o large.exr", "--region"),
        ("render table --size 9000x6 --engine cpu -o large.exr", "--engine gpu"),
        ("render table --size 9000x6 --debug levels -o large.exr", "8192"),
        ("render table --size 9000x6 --frames 0..1 --updates 4 -o large#.exr", "8192"),
        ("render table --sets 0..3 -o s.exr", "--refine"),
        ("render table --refine 4 --sets 2..4 -o s.exr", "0 to 3"),
        ("render table --refine 4 --sets 2..1 -o s.exr", "--sets"),
        ("render table --refine 4 --sets 0..1 -o s.png", ".exr"),
        ("render table --refine 4 --sets 0..1 --frames 0..1 -o f#.exr", "--refine"),
        ("join -o j.exr", "PART.exr"),
        ("join nowhere.exr -o j.exr", "nowhere.exr"),
        ("join part.png -o j.exr", "part.png"),
        ("join part.exr -o j.jpg", ".exr or .png"),
        ("submit slurm table", "one piece"),
        ("submit pbs table --frames 0..3 -o f#.exr", "slurm"),
        ("submit slurm table --frames 0..3 -o f.exr", "#"),
        ("submit slurm table --frames 0..3 -o f#.exr --part 1/2", "--part"),
        ("submit slurm table --frames 0..3 -o f#.exr --regions 2x2", "--regions"),
        ("submit openjd table --refine 4 --sets 0..1 -o s.exr", "--sets"),
        ("submit openjd table --engine cpu --regions 2x2 --print -o s.exr", "--engine gpu"),
        ("submit openjd nowhere.glb --refine 4 -o s.exr", "nowhere.glb"),
        ("render table --refine 4 --engine cpu", "--refine"),
        ("render table --refine 4 --engine path", "--refine"),
        ("render table --refine 4 --debug levels", "--refine"),
        ("render table --refine 4 --frames 0..1 -o f#.png", "--refine"),
        ("render table --tolerance 2", "0 to 1"),
        ("render table --mode naive --shading multipass", "--shading"),
        ("render table --mode naive --light-maps on", "--light-maps"),
        ("render table --shading twice", "fused, multipass"),
        ("render table --time later", "seconds"),
        ("render table --time -1", "seconds"),
        ("render table --frames 5..3 -o f#.exr", "first"),
        ("render table --frames 5 -o f#.exr", "0..239"),
        ("render table --frames 0..3 -o frame.exr", "frame.####.exr"),
        ("render table --frames 0..3 -o f#.exr --stats s.json", "--stats"),
        ("render table --frames 0..3 --time 2 -o f#.exr", "--time"),
        ("render table --frames 0..3 --fps 0 -o f#.exr", "frames a second"),
        ("render table --fps 24", "--frames"),
        ("render table --overwrite", "--frames"),
        ("render table --rewalk all", "--frames"),
        ("render table --rewalk 20", "--frames"),
        ("render table --fade 2", "--frames"),
        ("render table --frames 0..3 --rewalk 20 --fade 1001 -o f#.exr", "0..=1000"),
        ("render table --frames 0..3 --rewalk 0 -o f#.exr", "off, all"),
        ("render table --updates 5", "--frames"),
        ("render table --frames 0..3 --updates 5s -o f#.exr", "`all`"),
        ("render table --frames 0..3 --updates 5 --rewalk all -o f#.exr", "--rewalk off"),
        ("render table --frames 0..3 --updates 5 --engine cpu -o f#.exr", "--engine gpu"),
        ("render table --max-map-age 3", "--updates"),
        ("render table --updates 5 --max-map-age 3", "--frames"),
        ("bench table --updates 5", "--moving"),
        ("bench table --rewalk 200", "--moving"),
        ("bench table --moving --updates 5ms", "a number of shadow maps"),
        ("bench table --moving --modes full", "--modes"),
        ("render table --frames 0..3 --rewalk some -o f#.exr", "off, all"),
        ("render table --lights-per-pass 33", "1..=32"),
        ("bench nowhere", "nowhere"),
        ("bench table --modes naive,naive", "twice"),
        ("bench table --modes best", "full, vd-lp, vd, naive"),
        ("bench table --lights 0", "1..="),
        ("bench table --repeat 0", "1..="),
        ("bench table --json times.txt", ".json"),
        ("bench table --csv nowhere/times.csv", "nowhere"),
        ("render table --mode best", "full, vd-lp, vd, naive"),
        // Sizes and counts.
        ("render --size 0x5", "65536"),
        ("render --size 5x0", "65536"),
        ("render --size 1000000x5", "65536"),
        ("render --size 99999999999999999999x5", "1024x768"),
        ("render --size -5x5", "size"),
        ("render --size 640", "1024x768"),
        ("render --size 8x8x8", "1024x768"),
        ("render --lights 0", "1..="),
        ("render --lights -3", "--lights"),
        ("render --lights 99999999999", "1..="),
        ("render --lights many", "many"),
        ("render --direct 1.5", "0 to 1"),
        ("render --direct -0.1", "0 to 1"),
        ("render --direct nan", "0 to 1"),
        ("render --placement here", "view, scene"),
        ("render --bounces -1", "--bounces"),
        ("render --bounces 4000000000", "1000"),
        ("render nowhere.glb --bounces 65", "--bounces 64"),
        ("render --bounces unlimited", "--engine path"),
        ("render --seed -1", "--seed"),
        ("render --clamp nan", "positive"),
        ("render --clamp 0", "positive"),
        ("render --clamp -2", "positive"),
        ("render --clamp inf", "positive"),
        ("render --map-size 0", "16..=8192"),
        ("render --map-size 1000000", "16..=8192"),
        ("render --pcf 0", "1 to 16"),
        ("render --pcf 99", "1 to 16"),
        ("render --memory 0", "1..="),
        ("render --paths 0", "1..="),
        ("render --exposure nan", "stops"),
        ("render --exposure inf", "stops"),
        ("render --exposure 1e9", "stops"),
        ("render --aa 3", "off, 2, 4"),
        // Files.
        ("render table -o picture.bmp", ".exr or .png"),
        ("render table -o picture", ".exr or .png"),
        ("render table -o nowhere/picture.png", "no directory nowhere"),
        ("render table -o folder.png", "directory"),
        ("render table --stats nowhere/stats.json", "no directory nowhere"),
        ("render table --stats stats.txt", ".json"),
        ("render table extra", "extra"),
        ("compare", "<REF>"),
        ("compare one.exr", "<TEST>"),
        ("compare one.exr two.exr", "one.exr"),
        ("compare one.txt two.txt", ".exr"),
        ("compare one.exr two.exr --edges", "--mask"),
        ("compare one.exr two.exr --trim 1", "less than 1"),
        ("compare one.exr two.exr --trim nan", "less than 1"),
        ("compare one.exr two.exr --max-rel-mse nan", "not negative"),
        ("compare one.exr two.exr --max-flip -1", "not negative"),
        ("compare one.exr two.exr --out heat.exr", ".png"),
        ("info nowhere", "area-lights"),
        ("info nowhere.glb", "nowhere.glb"),
    ] {
        let words: Vec<&str> = arguments.split(' ').collect();
        let output = girandole.run(&words);
        refusal(&output, fragment).unwrap_or_else(|problem| panic!("{arguments}: {problem}"));
    }
    assert_eq!(girandole.files(), ["folder.png"]);
}

#[test]
fn broken_files() {
    let girandole = Girandole::new();
    let header = |length: u32| {
        let mut glb = b"glTF\x02\0\0\0".to_vec();
        glb.extend(length.to_le_bytes());
        glb
    };
    for (name, content) in [
        ("empty.glb", vec![]),
        ("text.glb", b"hello".to_vec()),
        ("cut.glb", header(4000)),
        ("liar.glb", header(u32::MAX)),
        ("empty.gltf", vec![]),
        ("text.gltf", b"hello".to_vec()),
        ("array.gltf", b"[]".to_vec()),
        ("version.gltf", br#"{"asset":{"version":"1.0"}}"#.to_vec()),
        ("version3.gltf", br#"{"asset":{"version":"3.0"}}"#.to_vec()),
        ("least.gltf", br#"{"asset":{"version":"2.0","minVersion":"3.0"}}"#.to_vec()),
        ("later.gltf", br#"{"asset":{"version":"2.1","minVersion":"2.1"}}"#.to_vec()),
        ("nothing.gltf", br#"{"asset":{"version":"2.0"}}"#.to_vec()),
    ] {
        std::fs::write(girandole.path().join(name), content).unwrap();
    }
    let before = girandole.files();
    for name in &before {
        let output = girandole.run(&["render", name, "--engine", "cpu", "--size", "8x6", "--lights", "4"]);
        refusal(&output, if name == "nothing.gltf" { "no triangles" } else { name })
            .unwrap_or_else(|problem| panic!("{name}: {problem}"));
    }
    assert_eq!(girandole.files(), before);

    for name in ["text.exr", "cut.png"] {
        std::fs::write(girandole.path().join(name), b"\x89PNG\r\n\x1a\n").unwrap();
        let output = girandole.run(&["compare", name, name]);
        refusal(&output, name).unwrap_or_else(|problem| panic!("{name}: {problem}"));
    }
    for (name, content) in
        [("cut.hdr", &b"#?RADIANCE\n"[..]), ("text.hdr", b"hello"), ("square.hdr", SQUARE_HDR)]
    {
        std::fs::write(girandole.path().join(name), content).unwrap();
        let output = girandole.run(&["render", "table", "--environment", name]);
        refusal(&output, name).unwrap_or_else(|problem| panic!("{name}: {problem}"));
    }
    std::fs::write(girandole.path().join("triangle.obj"), b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let output = girandole.run(&["render", "triangle.obj", "--light", "none", "--engine", "cpu"]);
    refusal(&output, "no light").unwrap();
    std::fs::write(girandole.path().join("text.ply"), b"hello").unwrap();
    let output = girandole.run(&["render", "table", "--object", "text.ply"]);
    refusal(&output, "text.ply").unwrap();
}

/// A picture of one direction, not of all: two by two pixels of radiance 1.
const SQUARE_HDR: &[u8] = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 2\n\x80\x80\x80\x81\x80\x80\x80\x81\x80\x80\x80\x81\x80\x80\x80\x81";

/// A triangle before a camera, with a point light as bright as single precision allows, and a name that a terminal would obey.
const BLINDING: &str = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1,2]}],
    "extensionsUsed":["KHR_lights_punctual","NO\u001b[31mBODY"],
    "extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","intensity":3.4e38}]}},
    "nodes":[{"mesh":0},{"translation":[0.2,0.2,1],"camera":0},
        {"translation":[0.2,0.2,0.05],"extensions":{"KHR_lights_punctual":{"light":0}}}],
    "cameras":[{"type":"perspective","perspective":{"yfov":0.8,"znear":0.1}}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
    "bufferViews":[{"buffer":0,"byteLength":36}],
    "buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;

#[test]
fn pictures_of_what_are_no_numbers() {
    let girandole = Girandole::new();
    std::fs::write(girandole.path().join("blinding.gltf"), BLINDING).unwrap();
    for engine in ["cpu", "path"] {
        let output = girandole.run(&["render", "blinding.gltf", "--engine", engine, "--size", "32x24"]);
        let said = crate::stderr(&output);
        assert!(output.status.code() == Some(2) && said.contains("are no numbers"), "{engine}: {said}");
        assert!(said.contains("BODY") && !said.contains('\u{1b}'), "{said:?}");
        assert_eq!(girandole.files(), ["blinding.gltf"]);
    }
    let dim = BLINDING.replace("3.4e38", "3.4");
    std::fs::write(girandole.path().join("blinding.gltf"), dim).unwrap();
    girandole.succeed(&["render", "blinding.gltf", "--engine", "cpu", "--size", "32x24"]);
}

#[test]
#[cfg(unix)]
fn pipes_and_devices() {
    let girandole = Girandole::new();
    for name in ["scene.glb", "scene.obj", "sky.hdr", "edits.json"] {
        std::os::unix::fs::symlink("/dev/zero", girandole.path().join(name)).unwrap();
    }
    for arguments in [
        &["render", "scene.glb"][..],
        &["render", "scene.obj"],
        &["render", "table", "--environment", "sky.hdr"],
        &["render", "table", "--edits", "edits.json"],
    ] {
        refusal(&girandole.run(arguments), "device")
            .unwrap_or_else(|problem| panic!("{arguments:?}: {problem}"));
    }
}

#[test]
fn names_that_are_too_long() {
    let girandole = Girandole::new();
    let name = format!("{}.png", "n".repeat(300));
    // Before anything else is looked at.
    refusal(&girandole.run(&["render", "nowhere.glb", "-o", &name]), "cannot write").unwrap();
    refusal(&girandole.run(&["render", "nowhere.glb", "-o", "n.png"]), "nowhere.glb").unwrap();
    assert!(girandole.files().is_empty());
}

#[test]
fn a_window_without_a_display_is_refused() {
    let girandole = Girandole::new();
    let output = girandole
        .command(&["view", "table"])
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2));
    let said = stderr(&output);
    assert!(said.starts_with("error: there is no display") && said.lines().count() == 1, "{said}");
    assert!(girandole.files().is_empty());
}

#[test]
fn edits_of_another_scene() {
    let girandole = Girandole::new();
    std::fs::write(girandole.path().join("text.ply"), b"hello").unwrap();
    let torus = r#""node": {"index": 2, "name": "torus"}"#;
    let list = |edit: &str| format!(r#"{{"version": 1, "edits": [{edit}]}}"#);
    let inserted = |more: &str| list(&format!(r#"{{"insert_object": {{"name": "a", {more}}}}}"#));
    for (content, fragment) in [
        (String::new(), "no list of edits"),
        ("hello".into(), "no list of edits"),
        (r#"{"version": 7, "edits": []}"#.into(), "version is 7"),
        (list(r#"{"set_mood": {}}"#), "set_mood"),
        (list(r#"{"set_time": {"seconds": 1e999}}"#), "out of range"),
        (list(&format!(r#"{{"set_transform": {{{torus}, "transform": {{"parts": {{}}}}}}}}"#)), "node 2"),
        (
            list(r#"{"set_intensity": {"light": {"index": 0, "name": "sun"}, "intensity": [1, 1, 1]}}"#),
            "no light 0",
        ),
        (list(r#"{"remove_object": {"object": {"index": 999, "name": "torus"}}}"#), "no object 999"),
        (inserted(r#""shape": {"file": "nowhere.obj"}"#), "nowhere.obj"),
        (inserted(r#""shape": {"file": "text.ply"}"#), "text.ply"),
        (inserted(r#""shape": {"file": "a.txt"}"#), ".obj"),
        (inserted(r#""shape": "torus", "transform": {"parts": {"scale": [1e30, 1, 1]}}"#), "as large"),
    ] {
        std::fs::write(girandole.path().join("e.json"), &content).unwrap();
        let output = girandole.run(&["render", "table", "--engine", "cpu", "--edits", "e.json"]);
        refusal(&output, fragment).unwrap_or_else(|problem| panic!("{content}: {problem}"));
        refusal(&output, "e.json").unwrap_or_else(|problem| panic!("{content}: {problem}"));
    }
    assert_eq!(girandole.files(), ["e.json", "text.ply"]);
}
