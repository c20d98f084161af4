//! Light that passes surfaces, against closed forms.

use crate::common::{Stage, assert_constant, constant, look, trace};
use girandole_core::glam::Vec3;
use girandole_core::image::{Image, Region};
use girandole_core::lights::LightSet;
use girandole_core::scene::{Environment, Material, PunctualKind, View};
use girandole_core::trace::SceneTracer;
use girandole_reference::metrics::{CompareOptions, compare};
use girandole_reference::{OracleSettings, PathSettings, coverage, oracle};

const GLOW: Vec3 = Vec3::new(2.0, 1.0, 0.5);

/// Panes of these materials at z = 1, 2 and so on, facing +z, before a wall at z = 0.
fn stage(panes: &[Material], wall: Material) -> Stage {
    let mut stage = Stage::default();
    let wall = stage.material(wall);
    let across = |z: f32| (Vec3::new(-4.0, -4.0, z), Vec3::X * 8.0, Vec3::Y * 8.0);
    let (corner, u, v) = across(0.0);
    stage.quad(corner, u, v, wall);
    for (i, pane) in panes.iter().enumerate() {
        let material = stage.material(pane.clone());
        let (corner, u, v) = across(i as f32 + 1.0);
        stage.quad(corner, u, v, material);
    }
    stage
}

fn blended(alpha: f32, emission: Vec3) -> Material {
    Material { blended: true, alpha, emission, base_color: Vec3::ZERO, ..Material::default() }
}

fn glass(tint: Vec3, specular: f32) -> Material {
    Material { transmission: 1.0, base_color: tint, specular, roughness: 0.3, ..Material::default() }
}

#[test]
fn what_is_behind_is_seen_through() {
    let tint = Vec3::new(0.9, 0.5, 0.7);
    let dim = Vec3::new(0.1, 0.2, 0.3);
    for (panes, seen) in [
        (vec![blended(0.25, Vec3::ZERO)], GLOW * 0.75),
        (vec![blended(0.25, dim), blended(0.5, Vec3::ZERO)], (GLOW * 0.75 + dim) * 0.5),
        (vec![glass(tint, 0.0)], GLOW * tint),
        (vec![glass(tint, 1.0), glass(tint, 1.0)], GLOW * tint * tint * 0.96 * 0.96),
    ] {
        let stage = stage(&panes, Material::emitter("", GLOW));
        let geometry = stage.geometry();
        // Along the normal, nearly.
        let view = look(Vec3::new(0.0, 0.0, 6.0), Vec3::ZERO, 0.05);
        let tracer = SceneTracer::new(&stage.scene, &geometry);
        let none = LightSet::from_samples(&geometry, Vec::new());
        let exact = oracle(&tracer, &none, &view, [16, 16], &OracleSettings::default(), &|_| ());
        let options = CompareOptions::default();
        let error = compare(&constant(&exact, seen), &exact, &options).expect("comparable").rel_mse;
        assert!(error < 1e-8, "{panes:?}: {}", exact.mean());
        let estimate = trace(
            &stage.scene,
            &geometry,
            &view,
            16,
            PathSettings { paths: 2048, bounces: Some(0), seed: 2 },
        );
        // What the panes reflect of the glowing wall comes on top: nothing, as it is behind them.
        assert_constant(&estimate, seen, "through panes");
    }
    // The control: from behind single-sided panes are not there.
    let stage =
        stage(&[blended(0.5, Vec3::ZERO)], Material { double_sided: true, ..Material::emitter("", GLOW) });
    let geometry = stage.geometry();
    let view = look(Vec3::new(0.0, 0.0, -6.0), Vec3::ZERO, 0.05);
    let behind =
        trace(&stage.scene, &geometry, &view, 4, PathSettings { paths: 4, bounces: Some(0), seed: 2 });
    assert_eq!(behind.mean.mean().x, GLOW.x);
}

#[test]
fn light_is_tinted_on_its_way() {
    let tint = Vec3::new(0.9, 0.5, 0.7);
    for (pane, passes) in [(blended(0.25, Vec3::ZERO), Vec3::splat(0.75)), (glass(tint, 0.0), tint)] {
        let mut stage = stage(&[], Material::diffuse("", Vec3::splat(0.5)));
        let pane = stage.material(pane);
        // The light passes the pane, the view does not.
        stage.quad(Vec3::new(1.0, -1.0, 2.0), Vec3::X * 2.0, Vec3::Y * 2.0, pane);
        stage.punctual(PunctualKind::Directional, Vec3::splat(2.0), Vec3::new(4.0, 0.0, 4.0), Vec3::ZERO);
        let geometry = stage.geometry();
        let view = look(Vec3::new(0.0, 0.0, 6.0), Vec3::ZERO, 0.05);
        let settings = PathSettings { paths: 16, bounces: Some(0), seed: 2 };
        let estimate = trace(&stage.scene, &geometry, &view, 8, settings);
        let without = 0.5 / std::f32::consts::PI * 2.0 * std::f32::consts::FRAC_1_SQRT_2;
        let found = estimate.mean.mean() / without;
        assert!(found.abs_diff_eq(passes, 1e-3), "{found}");
    }
}

#[test]
fn a_furnace_stays_one_behind_glass() {
    // Walls glow and reflect; panes that take nothing away change nothing.
    let mut stage = Stage::default();
    let half = Material { emission: GLOW * 0.5, ..Material::diffuse("", Vec3::splat(0.5)) };
    let wall = stage.material(half);
    stage.room(Vec3::splat(-2.0), Vec3::splat(2.0), wall);
    for material in [
        Material { double_sided: true, ..blended(0.5, GLOW * 0.5) },
        Material { double_sided: true, transmission: 0.5, ..Material::diffuse("", Vec3::ONE) },
    ] {
        let pane = stage.material(material);
        stage.quad(Vec3::new(-1.0, -1.0, 0.1 * pane.0 as f32), Vec3::X * 2.0, Vec3::Y * 2.0, pane);
    }
    let geometry = stage.geometry();
    let view = look(Vec3::new(0.3, 0.2, 1.9), Vec3::ZERO, 0.5);
    let estimate =
        trace(&stage.scene, &geometry, &view, 16, PathSettings { paths: 1024, bounces: None, seed: 4 });
    assert_constant(&estimate, GLOW, "furnace");
}

#[test]
fn coverage_is_what_is_kept_back() {
    let mut stage = Stage::default();
    let [opaque, half, clear] = [
        Material::diffuse("", Vec3::ONE),
        blended(0.5, Vec3::ZERO),
        Material { transmission: 1.0, ..Material::diffuse("", Vec3::new(0.9, 0.6, 0.3)) },
    ]
    .map(|material| stage.material(material));
    // Columns of one unit from x = −2: opaque, half, half and clear behind one another, nothing.
    stage.quad(Vec3::new(-2.0, -2.0, 0.0), Vec3::X, Vec3::Y * 4.0, opaque);
    stage.quad(Vec3::new(-1.0, -2.0, 0.0), Vec3::X * 2.0, Vec3::Y * 4.0, half);
    stage.quad(Vec3::new(0.0, -2.0, -0.5), Vec3::X, Vec3::Y * 4.0, clear);
    let geometry = stage.geometry();
    let tracer = SceneTracer::new(&stage.scene, &geometry);
    let view = View { orthographic: true, ..look(Vec3::Z * 5.0, Vec3::ZERO, 2.0) };
    let found = coverage(&tracer, &view, ([4, 1], Region::whole([4, 1])), 2);
    let part = Region { first: [1, 0], size: [2, 1] };
    assert_eq!(coverage(&tracer, &view, ([4, 1], part), 2), found[1..3]);
    let expected = [1.0, 0.5, 1.0 - 0.5 * 0.6, 0.0];
    assert!(found.iter().zip(expected).all(|(f, e)| (f - e).abs() < 1e-5), "{found:?}");
    // A pixel of everything.
    let whole = coverage(&tracer, &view, ([1, 1], Region::whole([1, 1])), 4);
    assert!((whole[0] - expected.iter().sum::<f32>() / 4.0).abs() < 1e-5, "{whole:?}");
}

#[test]
fn an_invisible_environment_lights_all_the_same() {
    let mut stage = stage(&[], Material::diffuse("", Vec3::splat(0.5)));
    let mut pictures = Vec::new();
    for visible in [true, false] {
        let environment = Environment::constant(Vec3::ONE).expect("a sky");
        stage.scene.environment = Some(Environment { visible, ..environment });
        let geometry = stage.geometry();
        // Half of what is seen is the wall.
        let view =
            View { orthographic: true, ..look(Vec3::new(4.0, 0.0, 6.0), Vec3::new(4.0, 0.0, 0.0), 2.0) };
        let traced =
            trace(&stage.scene, &geometry, &view, 8, PathSettings { paths: 4, bounces: Some(0), seed: 2 });
        let tracer = SceneTracer::new(&stage.scene, &geometry);
        let lights = LightSet::from_samples(&geometry, Vec::new());
        let summed = oracle(&tracer, &lights, &view, [8, 8], &OracleSettings::default(), &|_| ());
        pictures.push([traced.mean, summed]);
    }
    let at = |image: &Image, x: usize| image.pixels[8 * 4 + x];
    for (seen, unseen) in pictures[0].iter().zip(&pictures[1]) {
        assert_eq!(at(seen, 1), at(unseen, 1));
        assert_eq!((at(seen, 7), at(unseen, 7)), (Vec3::ONE, Vec3::ZERO));
    }
    assert!(at(&pictures[1][0], 1).x > 0.1, "it is lit");
}
