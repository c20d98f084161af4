//! The small version of `cargo xtask truth`: pictures by light samples and shadow maps against pictures by an
//! independent path tracer (`girandole-reference/tests/truth`).

use crate::common::{Context, Stage, Test};
use girandole::RendererOptions;
use girandole_core::image::Image;
use girandole_core::lights::LightSettings;
use girandole_core::scene::Scene;
use girandole_reference::image_file::read_exr;
use girandole_reference::metrics::{CompareOptions, Comparison, compare};
use std::path::{Path, PathBuf};

pub fn tests() -> Vec<Test> {
    vec![("truth_energy_and_error", energy_and_error), ("truth_punctual_lights", punctual)]
}

fn file(scene: &str, name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../girandole-reference/tests/truth").join(scene).join(name)
}

/// Our picture of a truth scene, not clamped, against one of its references, edges left out.
fn against(context: &Context, scene: &str, reference: &str, bounces: u32, count: u32) -> Comparison {
    let loaded = Scene::load(&file(scene, "scene.glb")).expect("a scene");
    let stage = Stage::new(loaded, &LightSettings { count, bounces, ..Default::default() });
    let size = [256, 192];
    let picture: Image = context.picture(&stage, RendererOptions::default(), &stage.view(0, size), size);
    let mask = read_exr(&file(scene, "mask.exr")).expect("a mask");
    let reference = read_exr(&file(scene, reference)).expect("a reference");
    compare(&reference, &picture, &CompareOptions { mask: Some(mask), keep_edges: false, trim: 0.001 })
        .expect("comparable")
}

fn is_energy_right(c: &Comparison) -> bool {
    (c.energy_ratio - 1.0).abs() < 0.02
}

fn energy_and_error(context: &Context) {
    for scene in ["cornell", "table"] {
        let mut last = f64::INFINITY;
        for count in [256, 1024, 4096] {
            let c = against(context, scene, "d6.exr", 4, count);
            eprintln!("{scene}, {count} lights: energy {:.4}, relMSE {:.5}", c.energy_ratio, c.rel_mse);
            assert!(
                (count < 1024 || is_energy_right(&c)) && c.rel_mse < last,
                "{scene}, {count} lights: {c:?}"
            );
            last = c.rel_mse;
        }
        assert!(last <= 0.005, "{scene}: {last}");
        for (bounces, reference) in [(0, "d2.exr"), (1, "d3.exr")] {
            let c = against(context, scene, reference, bounces, 1024);
            assert!(is_energy_right(&c) && c.rel_mse < 0.005, "{scene}, {bounces} bounces: {c:?}");
        }
        // The control: a bounce too few is seen.
        assert!(!is_energy_right(&against(context, scene, "d3.exr", 0, 1024)), "{scene}");
    }
}

fn punctual(context: &Context) {
    for (bounces, reference) in [(0, "d2.exr"), (4, "d6.exr")] {
        let c = against(context, "punctual", reference, bounces, 1024);
        assert!(is_energy_right(&c), "{bounces} bounces: {c:?}");
    }
    assert!(!is_energy_right(&against(context, "punctual", "d6.exr", 2, 1024)));
}
