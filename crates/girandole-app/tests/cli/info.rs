//! `girandole info`.

use crate::{Girandole, stderr, stdout};
use girandole_core::scene::builtin;
use std::process::Stdio;

#[test]
fn tells_what_a_scene_holds() {
    let girandole = Girandole::new();
    let text = stdout(&girandole.succeed(&["info", "table"]));
    for word in
        ["adapters", "scene table", "objects", "triangles", "patches", "materials", "textures", "cameras"]
    {
        assert!(text.contains(word), "{text}");
    }
    for word in ["emitters    1", "perspective", "lights", "animations", "warnings"] {
        assert!(text.contains(word), "{text}");
    }
    assert!(!stdout(&girandole.succeed(&["info"])).contains("scene"));
}

#[test]
fn every_built_in_room_has_a_camera_and_light() {
    let girandole = Girandole::new();
    for room in builtin::NAMES {
        let text = stdout(&girandole.succeed(&["info", room]));
        // `hall` has point lights, `blinds` the sun.
        let light = if room == "hall" { "lights" } else { "emitters" };
        let rows = if room == "blinds" { vec!["cameras"] } else { vec!["cameras", light] };
        for row in rows {
            let count = text.lines().find_map(|line| line.trim().strip_prefix(row)).map(|rest| {
                let digits: String = rest.trim().chars().take_while(char::is_ascii_digit).collect();
                digits.parse::<u32>()
            });
            assert!(matches!(count, Some(Ok(1..))), "{room} {row}: {text}");
        }
    }
}

#[test]
fn models_that_lie_on_their_side_are_named_and_turned() {
    let girandole = Girandole::new();
    // A floor, three walls and a gable of a house whose z axis points up.
    let house = "v 0 0 0\nv 6 0 0\nv 6 4 0\nv 0 4 0\nv 0 0 3\nv 6 0 3\nv 6 4 3\nv 0 4 3\nv 0 2 4.5\nv 6 2 4.5\n\
        f 4 3 2 1\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 10 6\nf 1 5 9 8 4\nf 5 6 10 9\nf 7 8 9 10\n";
    std::fs::write(girandole.path().join("house.obj"), house).unwrap();
    let lying = stdout(&girandole.succeed(&["info", "house.obj", "--light", "none"]));
    assert!(lying.contains("6.000 × 4.000 × 4.500 m") && lying.contains("give --up z"), "{lying}");
    assert!(lying.contains("patches     7"), "{lying}");
    let standing = stdout(&girandole.succeed(&["info", "house.obj", "--light", "none", "--up", "z"]));
    assert!(standing.contains("6.000 × 4.500 × 4.000 m") && !standing.contains("--up"), "{standing}");
    // The same of a room's object, which has no warning to give.
    girandole.succeed(&[
        "render",
        "table",
        "--object",
        "house.obj",
        "--up",
        "z",
        "--size",
        "16x12",
        "--lights",
        "4",
        "--engine",
        "cpu",
    ]);
}

#[test]
fn a_reader_that_leaves_is_no_error() {
    let girandole = Girandole::new();
    let mut child =
        girandole.command(&["info", "table"]).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(stderr(&output), "");
    assert_eq!(output.status.code(), Some(0));
}

#[cfg(target_os = "linux")]
#[test]
fn scripts_can_ask_for_an_adapter() {
    let girandole = Girandole::new();
    let mut command = girandole.command(&["info", "--require-adapter"]);
    let output = crate::without_adapters(&mut command).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(stdout(&output).contains("none"));
    // On a machine that has one, the same command succeeds.
    let machine = girandole.run(&["info", "--require-adapter"]);
    let usable = stdout(&machine).contains("usable          yes");
    assert_eq!(machine.status.code(), Some(if usable { 0 } else { 1 }));
}

#[test]
fn pictures_say_what_they_were_made_by() {
    let girandole = Girandole::new();
    let small =
        ["render", "table", "--size", "16x12", "--lights", "4", "--engine", "cpu", "--seed", "7", "-o"];
    for name in ["p.png", "p.exr"] {
        girandole.succeed(&[&small[..], &[name]].concat());
        let said = stdout(&girandole.succeed(&["info", name]));
        let value = |key: &str| {
            let line = said.lines().find(|line| line.split_whitespace().next() == Some(key));
            line.and_then(|line| line.split_whitespace().nth(1)).map(str::to_owned)
        };
        for (key, expected) in [("size", "16x12"), ("engine", "cpu"), ("lights", "4"), ("seed", "7")] {
            assert_eq!(value(key).as_deref(), Some(expected), "{said}");
        }
        assert_eq!(value("scene").map(|scene| scene.len()), Some(32));
        assert_eq!(value("exposure").is_some(), name == "p.png");
        // Neither where it was made, nor where it is.
        assert!(
            !girandole.path().to_str().is_some_and(|path| said.contains(path)) && value("output").is_none()
        );
    }
    std::fs::write(girandole.path().join("q.png"), "").unwrap();
    assert_eq!(girandole.run(&["info", "q.png"]).status.code(), Some(2));
}
