//! The path tracer against pictures by Mitsuba 3: see `tests/truth/README.md`.

use crate::common::{Deviation, deviation};
use girandole_core::image::Image;
use girandole_core::scene::{Geometry, Scene, View};
use girandole_core::trace::SceneTracer;
use girandole_reference::{Estimate, PathSettings, image_file, path_trace};
use std::path::{Path, PathBuf};

fn folder(scene: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/truth").join(scene)
}

/// How far the path tracer is from one of the pictures, and from the same 1 % brighter.
fn against(scene: &str, picture: &str, bounces: Option<u32>, paths: u32) -> [Deviation; 2] {
    let folder = folder(scene);
    let read =
        |name: &str| image_file::read_exr(&folder.join(name)).expect("the picture is in the repository");
    let (expected, mask) = (read(&format!("{picture}.exr")), read("mask.exr"));
    let stats = std::fs::read_to_string(folder.join("stats.json")).expect("so are the statistics");
    let stats: serde_json::Value = serde_json::from_str(&stats).expect("JSON");
    let noise = |name: &str| stats["images"][picture][name].as_f64().expect("a number");

    let loaded = Scene::load(&folder.join("scene.glb")).expect("the scene loads");
    assert_eq!(loaded.warnings, [""; 0]);
    let geometry = Geometry::new(&loaded);
    let tracer = SceneTracer::new(&loaded, &geometry);
    let size = [expected.width, expected.height];
    let view = View::new(&loaded, &loaded.cameras[0], size[0] as f32 / size[1] as f32);
    let settings = PathSettings { paths, bounces, seed: 1 };
    let mut estimate = path_trace(&tracer, &view, size, &settings, &|_| ());

    let valid = |i: usize| mask.pixels[i].x <= 0.0 && mask.pixels[i].y <= 0.0;
    add_noise(&mut estimate, &valid, noise("noise_8x8"));
    let test = |factor: f32| {
        let pixels = expected.pixels.iter().map(|p| *p * factor).collect();
        let expected = Image { pixels, ..expected };
        // Half floats are off by 2⁻¹² or so of their value, independently. And where few paths find any light, the
        // sample variance is too small.
        let rare = noise("noise_8x8") / 2.0;
        deviation(&expected, &estimate, &valid, &|mean| mean * 4e-5 + rare, noise("noise_mean"))
    };
    [test(1.0), test(1.01)]
}

/// Adds the other picture's noise to the variance: its root mean square over blocks is known, and it lies where the
/// path tracer's own does.
fn add_noise(estimate: &mut Estimate, valid: &dyn Fn(usize) -> bool, noise_8x8: f64) {
    let (mut own, mut count) = (0.0, 0.0);
    for (i, variance) in estimate.variance.pixels.iter().enumerate() {
        if valid(i) {
            own += f64::from(variance.element_sum() / 3.0);
            count += 1.0;
        }
    }
    let factor = 1.0 + noise_8x8 * noise_8x8 / (own / count / 64.0);
    for variance in &mut estimate.variance.pixels {
        *variance *= factor as f32;
    }
}

fn agrees(scene: &str) {
    let mut failed = false;
    // For numbers with less noise than a quick test allows.
    let more = std::env::var("GIRANDOLE_TRUTH_PATHS").ok().and_then(|n| n.parse().ok()).unwrap_or(1);
    for (picture, bounces, paths) in
        [("d2", Some(0), 16), ("d3", Some(1), 8), ("d6", Some(4), 6), ("full", None, 6)]
    {
        let [found, wrong] = against(scene, picture, bounces, paths * more);
        println!("{scene} {picture}: {found:.5?}");
        failed |= !found.is_noise() || (found.energy - 1.0).abs() > 0.01;
        assert!(!wrong.is_noise(), "{scene} {picture}: 1 % more is not told: {wrong:?}");
    }
    assert!(!failed);
}

#[test]
fn cornell() {
    agrees("cornell");
}

#[test]
fn table() {
    agrees("table");
}

#[test]
fn punctual() {
    agrees("punctual");
}
