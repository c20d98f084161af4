//! What `girandole render` leaves behind.

use crate::pixels::differ;
use crate::{Girandole, stderr, stdout};

const SMALL: [&str; 6] = ["render", "table", "--size", "48x36", "--lights", "24"];

fn small(more: &[&'static str]) -> Vec<&'static str> {
    SMALL.into_iter().chain(more.iter().copied()).collect()
}

#[test]
fn same_command_same_bytes_on_any_number_of_threads() {
    let girandole = Girandole::new();
    for (name, threads) in [("a", "1"), ("b", "2"), ("c", "2")] {
        for engine in ["cpu", "path"] {
            for extension in ["png", "exr"] {
                let file = format!("{name}-{engine}.{extension}");
                let arguments = [&SMALL[..], &["--engine", engine, "--paths", "4", "-o", &file]].concat();
                let output =
                    girandole.command(&arguments).env("RAYON_NUM_THREADS", threads).output().unwrap();
                assert!(output.status.success(), "{}", stderr(&output));
                assert_eq!(stdout(&output), "");
            }
        }
    }
    assert_eq!(girandole.files().len(), 12);
    for engine in ["cpu", "path"] {
        for extension in ["png", "exr"] {
            let of = |name| girandole.bytes(&format!("{name}-{engine}.{extension}"));
            assert!(of("a") == of("b") && of("b") == of("c"), "{engine} {extension}");
        }
    }
    // Another seed is another picture.
    girandole.succeed(&small(&["--engine", "cpu", "--seed", "1", "-o", "d.exr"]));
    assert!(differ(&girandole.bytes("d.exr"), &girandole.bytes("a-cpu.exr")));
}

#[test]
fn exposure_and_tone_curve_concern_pngs_only() {
    let girandole = Girandole::new();
    let render = |file: &'static str, more: &[&'static str]| {
        girandole.succeed(&small(&[&["--engine", "cpu", "-o", file], more].concat()));
        girandole.bytes(file)
    };
    let linear = render("a.exr", &[]);
    assert!(linear == render("b.exr", &["--exposure", "-3", "--tonemap", "none"]));
    let shown = render("a.png", &[]);
    assert!(differ(&shown, &render("b.png", &["--exposure", "-3"])));
    assert!(differ(&shown, &render("c.png", &["--tonemap", "aces"])));
    // Anti-aliasing concerns both.
    assert!(differ(&linear, &render("c.exr", &["--aa", "2"])));
}

#[test]
fn options_change_the_picture() {
    let girandole = Girandole::new();
    let render = |more: &[&'static str]| {
        girandole.succeed(&small(&[&["--engine", "cpu", "-o", "picture.exr"], more].concat()));
        girandole.bytes("picture.exr")
    };
    let plain = render(&[]);
    for more in [
        ["--lights", "25"],
        ["--direct", "0.5"],
        ["--placement", "scene"],
        ["--bounces", "0"],
        ["--clamp", "0.05"],
        ["--camera", "1"],
        ["--object", "teapot"],
        ["--termination", "throughput"],
        ["--environment", "1,2,3"],
        ["--environment", "sky"],
        ["--environment", "sky:10,90,6"],
        ["--light", "studio"],
    ] {
        // The later one of an option that is given twice would be an error; take the first away.
        let base: Vec<&str> = if more[0] == "--lights" { SMALL[..4].to_vec() } else { SMALL.to_vec() };
        girandole.succeed(&[&base[..], &["--engine", "cpu", "-o", "picture.exr"], &more[..]].concat());
        assert!(differ(&plain, &girandole.bytes("picture.exr")), "{more:?} changes nothing");
    }
    assert!(plain == render(&[]));
}

#[test]
fn models_are_seen_in_a_studio_unless_there_is_other_light() {
    let girandole = Girandole::new();
    std::fs::write(
        girandole.path().join("wedge.obj"),
        b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 3 4\n",
    )
    .unwrap();
    let render = |more: &[&'static str]| {
        let base =
            ["render", "wedge.obj", "--engine", "cpu", "--size", "32x24", "--lights", "20", "-o", "w.exr"];
        let output = girandole.succeed(&[&base[..], more].concat());
        (crate::stderr(&output).contains("a studio lights it"), girandole.bytes("w.exr"))
    };
    let (is_said, alone) = render(&[]);
    assert!(is_said);
    assert!(render(&["--light", "studio"]) == (false, alone.clone()));
    // It stands on a ground, but before nothing.
    let said = |more: &[&'static str]| {
        let base =
            ["render", "wedge.obj", "--engine", "cpu", "--size", "8x6", "--lights", "4", "-o", "x.exr"];
        crate::stderr(&girandole.succeed(&[&base[..], more].concat()))
    };
    assert!(said(&[]).contains("a studio lights it, and it stands on a ground"), "{}", said(&[]));
    let transparent = said(&["--background", "transparent"]);
    assert!(transparent.contains("a studio lights it") && !transparent.contains("ground"), "{transparent}");
    let (is_said, colored) = render(&["--environment", "1,0.5,0.25"]);
    assert!(!is_said && differ(&colored, &alone));
    let turned = render(&["--environment", "sky", "--environment-rotation", "90"]);
    assert!(differ(&render(&["--environment", "sky"]).1, &turned.1));
    // Millimetres are noticed, unless they are meant.
    let warns = |scale: &'static str| {
        let output = girandole.succeed(&[
            "render",
            "wedge.obj",
            "--engine",
            "cpu",
            "--size",
            "8x6",
            "--lights",
            "4",
            "-o",
            "w.exr",
            "--scale",
            scale,
        ]);
        crate::stderr(&output).contains("--scale")
    };
    assert!(!warns("0.001"));
    std::fs::write(girandole.path().join("speck.obj"), b"v 0 0 0\nv 1e-4 0 0\nv 0 1e-4 0\nf 1 2 3\n")
        .unwrap();
    let speck = ["render", "speck.obj", "--engine", "cpu", "--size", "8x6", "--lights", "4", "-o", "w.exr"];
    assert!(crate::stderr(&girandole.succeed(&speck)).contains("--scale"));
}

#[test]
fn transparent_backgrounds_are_alpha() {
    let girandole = Girandole::new();
    std::fs::write(girandole.path().join("t.obj"), b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let render = |output: &'static str, more: &[&'static str]| {
        let base = ["render", "t.obj", "--engine", "cpu", "--size", "16x12", "--lights", "8", "-o", output];
        girandole.succeed(&[&base[..], more].concat());
        girandole.bytes(output)
    };
    let has_alpha = |exr: &[u8]| {
        let list = exr.windows(7).position(|w| w == b"chlist\0").expect("channels");
        exr[list + 11..].starts_with(b"A\0")
    };
    let transparent = ["--background", "transparent"];
    // The byte that says what the colours of a PNG are: 2 is RGB, 6 with alpha.
    assert_eq!([render("t.png", &[])[25], render("t.png", &transparent)[25]], [2, 6]);
    assert!(!has_alpha(&render("t.exr", &[])) && has_alpha(&render("t.exr", &transparent)));
    let frames = [&transparent[..], &["--frames", "0..0"]].concat();
    let base = ["render", "t.obj", "--engine", "cpu", "--size", "8x6", "--lights", "4", "-o", "f.#.exr"];
    girandole.succeed(&[&base[..], &frames].concat());
    assert!(has_alpha(&girandole.bytes("f.0.exr")));
}

#[test]
fn statistics_are_one_flat_object() {
    let girandole = Girandole::new();
    let output = girandole.succeed(&small(&[
        "--engine", "cpu", "--aa", "2", "--seed", "7", "-o", "p.png", "--stats", "s.json",
    ]));
    assert_eq!(girandole.files(), ["p.png", "s.json"]);
    assert!(stderr(&output).contains("p.png") && stderr(&output).contains("24 light samples"));
    let stats = girandole.json("s.json");
    for (key, value) in &stats {
        assert!(!value.is_object() && !value.is_array(), "{key} is not flat");
        assert!(key.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_'), "{key}");
    }
    for (key, expected) in [
        ("width", 48),
        ("height", 36),
        ("lights", 24),
        ("seed", 7),
        ("bounces", 5),
        ("pairs", 48 * 36 * 4 * 24),
    ] {
        assert_eq!(stats[key], expected, "{key}");
    }
    assert_eq!(stats["direct_lights"].as_u64().unwrap() + stats["indirect_lights"].as_u64().unwrap(), 24);
    assert_eq!(stats["engine"], "cpu");
    assert!(stats["adapter"].as_str().unwrap().starts_with("CPU"));
    for key in ["frame_ms", "scene_ms", "light_samples_ms"] {
        assert!(stats[key].as_f64().unwrap() >= 0.0, "{key}");
    }
    assert!(stats["paths"].as_u64().unwrap() > 0);
}

#[test]
fn a_picture_that_is_there_is_replaced() {
    let girandole = Girandole::new();
    std::fs::write(girandole.path().join("p.png"), "old").unwrap();
    girandole.succeed(&small(&["--engine", "cpu", "-o", "p.png"]));
    assert!(girandole.bytes("p.png").starts_with(b"\x89PNG"));
    assert_eq!(girandole.files(), ["p.png"]);
}

#[test]
fn the_bound_of_g_says_what_it_loses() {
    let girandole = Girandole::new();
    let output = girandole.succeed(&small(&["--engine", "cpu", "--clamp", "0.05", "--stats", "s.json"]));
    assert!(stderr(&output).contains("loses about"), "{}", stderr(&output));
    assert!(girandole.json("s.json")["clamp_lost_energy_share"].as_f64().unwrap() > 0.05);
    for unbounded in ["off", "auto"] {
        let output = girandole.succeed(&small(&["--engine", "cpu", "--clamp", unbounded]));
        assert!(!stderr(&output).contains("loses"), "{}", stderr(&output));
    }
}

#[cfg(target_os = "linux")]
#[test]
fn without_an_adapter_the_cpu_does_it() {
    let girandole = Girandole::new();
    let mut command = girandole.command(&small(&["-o", "auto.exr", "--stats", "s.json"]));
    let output = crate::without_adapters(&mut command).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(stderr(&output).contains("mesa-vulkan-drivers"), "{}", stderr(&output));
    assert_eq!(girandole.json("s.json")["engine"], "cpu");
    girandole.succeed(&small(&["--engine", "cpu", "-o", "cpu.exr"]));
    assert!(girandole.bytes("auto.exr") == girandole.bytes("cpu.exr"));
    // An explicit `--engine gpu` does not fall back.
    let mut command = girandole.command(&small(&["--engine", "gpu", "-o", "gpu.exr"]));
    let output = crate::without_adapters(&mut command).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(stderr(&output).lines().count(), 1, "{}", stderr(&output));
    assert!(!girandole.files().contains(&"gpu.exr".into()));
}
