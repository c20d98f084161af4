//! `girandole info`.

use crate::{Girandole, stderr, stdout};
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
    for room in ["area-lights", "table", "pillars", "block", "gap"] {
        let text = stdout(&girandole.succeed(&["info", room]));
        for row in ["cameras", "emitters"] {
            let count = text.lines().find_map(|line| line.trim().strip_prefix(row)).map(|rest| {
                let digits: String = rest.trim().chars().take_while(char::is_ascii_digit).collect();
                digits.parse::<u32>()
            });
            assert!(matches!(count, Some(Ok(1..))), "{room} {row}: {text}");
        }
    }
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
