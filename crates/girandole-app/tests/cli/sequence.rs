//! What moves: `--time` and `--frames`.

use crate::{Girandole, stderr};

const SMALL: [&str; 8] = ["render", "table", "--size", "48x36", "--lights", "24", "--engine", "cpu"];

fn small<'a>(more: &[&'a str]) -> Vec<&'a str> {
    SMALL.into_iter().chain(more.iter().copied()).collect()
}

#[test]
fn frames_are_the_same_alone_resumed_and_in_sequence() {
    for rewalk in ["off", "30", "all"] {
        let girandole = Girandole::new();
        let frames = |range: &str, name: &str| {
            girandole.succeed(&small(&["--frames", range, "--fps", "2", "--rewalk", rewalk, "-o", name]))
        };
        let said = stderr(&frames("0..3", "f.##.exr"));
        assert!(said.contains("4 of 4 frames"), "{said}");
        assert_eq!(girandole.files(), ["f.00.exr", "f.01.exr", "f.02.exr", "f.03.exr"]);
        let all: Vec<Vec<u8>> = girandole.files().iter().map(|name| girandole.bytes(name)).collect();
        for (a, b) in [(0, 1), (1, 2), (2, 3)] {
            assert!(all[a] != all[b], "{rewalk}: nothing moves from {a} to {b}");
        }
        frames("2..2", "alone#.exr");
        assert!(girandole.bytes("alone2.exr") == all[2], "{rewalk}");
        // Frames that are there stay as they are; one that is missing is the same again.
        std::fs::remove_file(girandole.path().join("f.02.exr")).unwrap();
        std::fs::write(girandole.path().join("f.01.exr"), "mine").unwrap();
        let said = stderr(&frames("0..3", "f.##.exr"));
        assert!(said.contains("1 of 4 frames, 3 were there"), "{said}");
        assert!(girandole.bytes("f.02.exr") == all[2] && girandole.bytes("f.01.exr") == b"mine", "{rewalk}");
        assert!(stderr(&frames("0..3", "f.##.exr")).contains("0 of 4 frames"));
    }
}

#[test]
fn sequences_hold_their_light_samples_unless_they_are_sampled_anew() {
    let girandole = Girandole::new();
    let first = |name: &str, more: &[&str]| {
        girandole.succeed(&small(&[&["--frames", "1..1", "--fps", "1", "-o", name], more].concat()));
        girandole.bytes(&name.replace('#', "1"))
    };
    let held = first("held#.exr", &[]);
    assert!(held == first("off#.exr", &["--rewalk", "off"]), "the default is off");
    let fresh = first("fresh#.exr", &["--rewalk", "all"]);
    assert!(held != fresh);
    // Sampled anew, a frame is the picture of that moment.
    girandole.succeed(&small(&["--time", "1", "-o", "still.exr"]));
    assert!(girandole.bytes("still.exr") == fresh);
    // The path tracer has no samples to hold.
    let path = |name: &str, more: &[&str]| {
        let all = [&["--engine", "path", "--paths", "2", "-o", name], more].concat();
        girandole.succeed(&[&SMALL[..6], &all].concat());
    };
    path("p#.exr", &["--frames", "1..1", "--fps", "1"]);
    path("still.exr", &["--time", "1"]);
    assert!(girandole.bytes("p1.exr") == girandole.bytes("still.exr"));
}

#[test]
fn moments_repeat_and_still_scenes_say_so() {
    let girandole = Girandole::new();
    let at = |seconds: &str| {
        girandole.succeed(&small(&["--time", seconds, "-o", "p.exr"]));
        girandole.bytes("p.exr")
    };
    let (start, later) = (at("0"), at("2.5"));
    assert!(start != later && later == at("10.5") && start == at("8"));
    girandole.succeed(&small(&["-o", "plain.exr"]));
    assert!(start == girandole.bytes("plain.exr"), "without --time it is as it is at 0");
    let said = stderr(&girandole.succeed(&small(&["--object", "none", "--frames", "0..1", "-o", "s#.exr"])));
    assert!(said.contains("nothing in table is animated"), "{said}");
    assert!(girandole.bytes("s0.exr") == girandole.bytes("s1.exr"));
}
