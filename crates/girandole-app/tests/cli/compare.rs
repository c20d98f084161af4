//! `girandole compare`: numbers, thresholds, exit codes.

use crate::{Girandole, stderr, stdout};
use girandole_core::glam::Vec3;
use girandole_core::image::Image;
use girandole_reference::image_file::write_exr;

fn with_pictures() -> Girandole {
    let girandole = Girandole::new();
    for (file, seed) in [("a.exr", "0"), ("b.exr", "1"), ("a.png", "0")] {
        let size = ["--size", "48x36", "--lights", "24", "--engine", "cpu"];
        girandole.succeed(&[&["render", "table", "-o", file, "--seed", seed], &size[..]].concat());
    }
    girandole.succeed(&[
        "render",
        "table",
        "-o",
        "small.exr",
        "--size",
        "8x6",
        "--lights",
        "4",
        "--engine",
        "cpu",
    ]);
    girandole
}

#[test]
fn equal_pictures_pass_and_others_do_not() {
    let girandole = with_pictures();
    let thresholds =
        ["--max-rel-mse", "0", "--max-rmse", "0", "--max-flip", "0", "--max-energy-error", "0", "--json"];
    let same = girandole.succeed(&[&["compare", "a.exr", "a.exr"], &thresholds[..]].concat());
    let numbers: serde_json::Map<String, serde_json::Value> = serde_json::from_str(&stdout(&same)).unwrap();
    assert_eq!(numbers["energy_ratio"], 1.0);
    assert_eq!(numbers["rel_mse"], 0.0);
    assert_eq!(numbers["valid_pixels"], 48 * 36);

    let other = girandole.run(&[&["compare", "a.exr", "b.exr"], &thresholds[..]].concat());
    assert_eq!(other.status.code(), Some(1));
    assert_eq!(stderr(&other).lines().count(), 1, "{}", stderr(&other));
    for name in ["relMSE", "RMSE", "FLIP", "energy"] {
        assert!(stderr(&other).contains(name), "{}", stderr(&other));
    }
    // Each threshold decides by itself, and only beyond it.
    for threshold in ["--max-rel-mse", "--max-rmse", "--max-flip", "--max-energy-error"] {
        assert_eq!(girandole.run(&["compare", "a.exr", "b.exr", threshold, "0"]).status.code(), Some(1));
        girandole.succeed(&["compare", "a.exr", "b.exr", threshold, "1000"]);
    }
    let table = stdout(&girandole.succeed(&["compare", "a.exr", "b.exr"]));
    for row in ["valid pixels", "energy ratio", "relMSE", "RMSE", "FLIP", "worst pixel"] {
        assert!(table.contains(row), "{table}");
    }
}

#[test]
fn trim_mask_and_heat_map() {
    let girandole = with_pictures();
    let number = |arguments: &[&str], key: &str| -> f64 {
        let all = [&["compare", "a.exr", "b.exr", "--json"], arguments].concat();
        let numbers: serde_json::Value = serde_json::from_str(&stdout(&girandole.succeed(&all))).unwrap();
        numbers[key].as_f64().unwrap()
    };
    assert!(number(&["--trim", "0.1"], "rel_mse") < number(&[], "rel_mse"));
    // Ten columns of emitters, and five of edges.
    let mut mask = Image::new(48, 36);
    for (i, pixel) in mask.pixels.iter_mut().enumerate() {
        *pixel = match i % 48 {
            0..10 => Vec3::X,
            10..15 => Vec3::Z,
            _ => Vec3::ZERO,
        };
    }
    write_exr(&girandole.path().join("mask.exr"), &mask).unwrap();
    assert_eq!(number(&["--mask", "mask.exr"], "valid_pixels"), 33.0 * 36.0);
    assert_eq!(number(&["--mask", "mask.exr", "--edges"], "valid_pixels"), 38.0 * 36.0);
    // Two masks leave out what either does.
    for (i, pixel) in mask.pixels.iter_mut().enumerate() {
        *pixel = if i % 48 < 40 { Vec3::ZERO } else { Vec3::Y };
    }
    write_exr(&girandole.path().join("right.exr"), &mask).unwrap();
    let both = number(&["--mask", "mask.exr", "--mask", "right.exr"], "valid_pixels");
    assert_eq!(both, 25.0 * 36.0);
    assert_eq!(number(&[], "outliers"), 0.0);
    girandole.succeed(&["compare", "a.exr", "b.exr", "--out", "heat.png"]);
    assert!(girandole.bytes("heat.png").starts_with(b"\x89PNG"));
}

#[test]
fn sizes_have_to_agree() {
    let girandole = with_pictures();
    for arguments in [
        &["compare", "a.exr", "small.exr", "--out", "heat.png"][..],
        &["compare", "a.exr", "b.exr", "--mask", "small.exr"],
        &["compare", "a.exr", "b.exr", "--mask", "a.exr", "--mask", "small.exr"],
    ] {
        let output = girandole.run(arguments);
        assert_eq!(output.status.code(), Some(2));
        assert_eq!(stderr(&output).lines().count(), 1, "{}", stderr(&output));
        assert_eq!(stdout(&output), "");
    }
    assert!(!girandole.files().contains(&"heat.png".into()));
    girandole.succeed(&["compare", "a.png", "a.png", "--max-rmse", "0"]);
}
