//! What moves: `--time` and `--frames`.

use crate::pixels::differ;
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
            assert!(differ(&all[a], &all[b]), "{rewalk}: nothing moves from {a} to {b}");
        }
        frames("2..2", "alone#.exr");
        assert!(girandole.bytes("alone2.exr") == all[2], "{rewalk}");
        // Frames that are there stay as they are; one that is missing is the same again.
        std::fs::remove_file(girandole.path().join("f.02.exr")).unwrap();
        let said = stderr(&frames("0..3", "f.##.exr"));
        assert!(said.contains("1 of 4 frames, 3 were there"), "{said}");
        assert!(girandole.bytes("f.02.exr") == all[2], "{rewalk}");
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
    assert!(differ(&held, &fresh));
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
    assert!(differ(&start, &later) && later == at("10.5") && start == at("8"));
    girandole.succeed(&small(&["-o", "plain.exr"]));
    assert!(start == girandole.bytes("plain.exr"), "without --time it is as it is at 0");
    let said = stderr(&girandole.succeed(&small(&["--object", "none", "--frames", "0..1", "-o", "s#.exr"])));
    assert!(said.contains("nothing in table is animated"), "{said}");
    assert!(girandole.bytes("s0.exr") == girandole.bytes("s1.exr"));
}

const TINY: [&str; 6] = ["--size", "16x12", "--lights", "4", "--engine", "cpu"];

/// Three frames of `table`, as a rule.
fn frames(girandole: &Girandole, more: &[&str]) -> std::process::Output {
    let given = |option: &str| more.contains(&option);
    let mut words: Vec<&str> = vec!["render"];
    if more.first().is_none_or(|word| word.starts_with('-')) {
        words.push("table");
    }
    words.extend(more);
    for pair in TINY.chunks(2).chain([&["--frames", "0..2"][..], &["-o", "f#.png"]]) {
        if !given(pair[0]) {
            words.extend(pair);
        }
    }
    girandole.run(&words)
}

#[test]
fn sequences_never_mix() {
    let girandole = Girandole::new();
    girandole.succeed(&[&["render", "table", "--frames", "0..2", "-o", "f#.png"][..], &TINY].concat());
    let before: Vec<Vec<u8>> = girandole.files().iter().map(|name| girandole.bytes(name)).collect();
    for (more, differs) in [
        (&["pillars"][..], "another scene"),
        (&["--object", "teapot"], "another scene"),
        (&["--light", "studio"], "another scene"),
        (&["--environment", "1,2,3"], "another scene"),
        (&["--size", "12x16"], "16x12 pixels instead of 12x16"),
        (&["--camera", "1"], "another view"),
        (&["--view", "1,1.6,1.5,0,0.8,0,0,1,0,60"], "another view"),
        (&["--fps", "7"], "another moment"),
        (&["--lights", "5"], "--lights 4 instead of 5"),
        (&["--seed", "1"], "--seed 0 instead of 1"),
        (&["--bounces", "2"], "--bounces 5 instead of 2"),
        (&["--aa", "2"], "--aa off instead of 2"),
        (&["--exposure", "1"], "--exposure auto instead of 1"),
        (&["--tonemap", "aces"], "--tonemap agx instead of aces"),
        (&["--background", "transparent"], "--background environment instead of transparent"),
        (&["--rewalk", "all"], "--rewalk off"),
        (&["--engine", "path", "--paths", "1"], "--engine cpu instead of path"),
    ] {
        // It may go on elsewhere in the same sequence: that is a mixture, too.
        for range in ["0..2", "2..4", "5..6"] {
            let output = frames(&girandole, &[more, &["--frames", range]].concat());
            let said = stderr(&output);
            assert_eq!(output.status.code(), Some(2), "{more:?}: {said}");
            let first = if range == "2..4" && !differs.contains("moment") { "f0.png" } else { "f" };
            assert!(said.contains(first) && said.contains(differs) && said.contains("--overwrite"), "{said}");
            assert_eq!(said.lines().count(), 1, "{said}");
        }
    }
    assert_eq!(girandole.files(), ["f0.png", "f1.png", "f2.png"]);
    let after: Vec<Vec<u8>> = girandole.files().iter().map(|name| girandole.bytes(name)).collect();
    assert!(before == after);
    // What changes no picture does not count, nor what belongs to another engine.
    for more in [
        &["--exposure", "auto"][..],
        &["--pcf", "3"],
        &["--mode", "vd"],
        &["--paths", "9"],
        &["--object", "torus"],
    ] {
        let said = stderr(&frames(&girandole, more));
        assert!(said.contains("wrote 0 of 3 frames, 3 were there"), "{more:?}: {said}");
    }
    assert!(stderr(&frames(&girandole, &["--frames", "1..3"])).contains("wrote 1 of 3 frames, 2 were there"));
    // They are replaced if that is asked for; what is beyond the range is named.
    let said = stderr(&frames(&girandole, &["--seed", "1", "--overwrite"]));
    assert!(
        said.contains("wrote 3 of 3 frames") && said.contains("f3.png") && said.contains("warning"),
        "{said}"
    );
    assert!(differ(&girandole.bytes("f0.png"), &before[0]));
    let said = stderr(&frames(&girandole, &["--seed", "1", "--overwrite", "--frames", "0..3"]));
    assert!(said.contains("wrote 1 of 4 frames, 3 were there") && !said.contains("warning"), "{said}");
}

#[test]
fn what_is_no_frame_is_found() {
    let girandole = Girandole::new();
    assert_eq!(frames(&girandole, &[]).status.code(), Some(0));
    let path = girandole.path().join("f1.png");
    let whole = girandole.bytes("f1.png");
    let mut spoilt = whole.clone();
    let last = spoilt.len() - 40;
    spoilt[last] ^= 0x55;
    let foreign = {
        let other = Girandole::new();
        girandole_reference::image_file::write_png(&other.path().join("p.png"), 16, 12, &[9; 16 * 12 * 3])
            .unwrap();
        other.bytes("p.png")
    };
    for (bytes, why) in [
        (&b""[..], "empty"),
        (b"mine", "PNG"),
        (&whole[..whole.len() / 2], "PNG"),
        (&whole[..whole.len() - 14], "PNG"),
        (&spoilt, "PNG"),
        (&foreign, "does not say what it was made by"),
        (&girandole.bytes("f2.png"), "another moment"),
    ] {
        std::fs::write(&path, bytes).unwrap();
        let output = frames(&girandole, &[]);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{why}: {said}");
        assert!(said.contains("f1.png") && said.contains(why) && said.lines().count() == 1, "{why}: {said}");
        assert!(girandole.bytes("f1.png") == bytes);
        let said = stderr(&frames(&girandole, &["--overwrite"]));
        assert!(said.contains("wrote 1 of 3 frames, 2 were there"), "{said}");
        assert!(girandole.bytes("f1.png") == whole);
    }
    // Other names are not frames.
    for name in ["f01.png", "f.png", "f1.exr", "fx.png"] {
        std::fs::write(girandole.path().join(name), "").unwrap();
    }
    assert_eq!(frames(&girandole, &[]).status.code(), Some(0));
    std::fs::remove_file(&path).unwrap();
    std::fs::create_dir(&path).unwrap();
    for more in [&[][..], &["--overwrite"]] {
        let output = frames(&girandole, more);
        assert_eq!(output.status.code(), Some(2));
        assert!(stderr(&output).contains("f1.png is a folder"), "{}", stderr(&output));
    }
}

#[test]
fn processes_share_a_sequence() {
    let girandole = Girandole::new();
    let words = [&["render", "table", "--frames", "0..19", "-o", "f.##.exr"][..], &TINY].concat();
    let children: Vec<_> = (0..3)
        .map(|_| girandole.command(&words).stderr(std::process::Stdio::piped()).spawn().unwrap())
        .collect();
    let said: Vec<String> = children
        .into_iter()
        .map(|child| {
            let output = child.wait_with_output().unwrap();
            assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
            stderr(&output)
        })
        .collect();
    let written = |said: &String| -> usize {
        let line = said.lines().find(|line| line.starts_with("wrote ")).unwrap();
        line.split(' ').nth(1).unwrap().parse().unwrap()
    };
    assert_eq!(said.iter().map(written).sum::<usize>(), 20, "{said:?}");
    assert_eq!(girandole.files().len(), 20, "{:?}", girandole.files());
    // They are what one process makes.
    let alone = Girandole::new();
    alone.succeed(&words);
    for name in alone.files() {
        assert!(alone.bytes(&name) == girandole.bytes(&name), "{name}");
    }
}

#[test]
fn a_frame_that_another_process_renders_is_not_taken_for_something_else() {
    use girandole_core::files::{Claim, Claimed};
    let girandole = Girandole::new();
    let target = girandole.path().join("f0.png");
    let by = r#"{"size":"1x1"}"#;
    let Claimed::Mine(_claim) = Claim::take(&target, by).unwrap() else { panic!("it is free") };
    let output = frames(&girandole, &[]);
    assert_eq!(output.status.code(), Some(2));
    let said = stderr(&output);
    assert!(said.contains("another process renders something else"), "{said}");
    assert_eq!(girandole.files(), [".f0.png.claim"]);
}
