//! Shiny surfaces, repetition and the variance.

use crate::common::{Stage, assert_constant, assert_picture, deviation, look, trace};
use girandole_core::brdf::{Surface, specular_brdf};
use girandole_core::glam::{DVec3, Vec3};
use girandole_core::scene::{Material, PunctualKind};
use girandole_core::trace::SceneTracer;
use girandole_reference::{PathSettings, path_trace};
use std::f32::consts::{PI, TAU};

/// The share of uniform light that a surface reflects towards `wo`: over half vectors on a grid that follows GGX.
fn reflected_share(s: &Surface, wo: Vec3) -> Vec3 {
    let (steps, a2) = (400, s.alpha * s.alpha);
    let mut sum = DVec3::ZERO;
    for (i, j) in (0..steps).flat_map(|i| (0..steps).map(move |j| (i, j))) {
        let (u, v) = ((i as f32 + 0.5) / steps as f32, (j as f32 + 0.5) / steps as f32);
        let cos2 = (1.0 - u) / (1.0 + u * (a2 - 1.0));
        let (sine, cosine) = ((1.0 - cos2).sqrt(), cos2.sqrt());
        let h = Vec3::new(sine * (TAU * v).cos(), sine * (TAU * v).sin(), cosine);
        let wi = h * (2.0 * h.dot(wo)) - wo;
        if wi.z > 0.0 && h.dot(wo) > 0.0 {
            let distribution = a2 / (PI * (cos2 * (a2 - 1.0) + 1.0).powi(2));
            let weight = wi.z * 4.0 * h.dot(wo) / (distribution * cosine);
            sum += (specular_brdf(Vec3::Z, wo, wi, s.f0, s.f90, s.alpha) * weight).as_dvec3();
        }
    }
    (sum / f64::from(steps * steps)).as_vec3() + s.albedo
}

/// A plate in a glowing, black room: its radiance is what it reflects of uniform light.
#[test]
fn uniform_light_on_ggx() {
    for (metallic, roughness) in [(1.0, 0.15), (1.0, 0.5), (0.0, 0.4), (0.0, 0.9), (0.6, 0.25)] {
        for cosine in [0.3f32, 0.9] {
            let mut stage = Stage::default();
            let base_color = Vec3::new(0.9, 0.6, 0.3);
            let plate = Material { metallic, roughness, specular: 1.0, ..Material::diffuse("", base_color) };
            let plate = stage.material(plate);
            let sky = stage.material(Material::emitter("", Vec3::ONE));
            stage.room(Vec3::splat(-3.0), Vec3::splat(3.0), sky);
            stage.quad(Vec3::new(-0.1, 0.0, -0.1), Vec3::Z * 0.2, Vec3::X * 0.2, plate);
            let geometry = stage.geometry();
            let wo = Vec3::new((1.0 - cosine * cosine).sqrt(), cosine, 0.0);
            let view = look(wo, Vec3::ZERO, 1e-4);
            let settings = PathSettings { paths: 200, bounces: Some(0), seed: 3 };
            let estimate = trace(&stage.scene, &geometry, &view, 16, settings);
            let surface = Surface::from_metallic_roughness(base_color, metallic, roughness, 1.0, Vec3::ONE);
            let expected = reflected_share(&surface, Vec3::new(wo.x, 0.0, wo.y));
            let what = format!("metallic {metallic}, roughness {roughness}, cosine {cosine}");
            assert_constant(&estimate, expected, &what);
        }
    }
}

fn small_room() -> Stage {
    let mut stage = Stage::default();
    let walls = stage.material(Material { specular: 1.0, roughness: 0.4, ..Material::default() });
    let lamp = stage.material(Material::emitter("", Vec3::new(5.0, 4.0, 3.0)));
    stage.room(Vec3::splat(-1.0), Vec3::splat(1.0), walls);
    stage.quad(Vec3::new(-0.3, 0.9, -0.3), Vec3::X * 0.6, Vec3::Z * 0.6, lamp);
    stage.punctual(PunctualKind::Point, Vec3::new(0.0, 0.1, 0.3), Vec3::new(0.5, 0.0, 0.5), Vec3::ZERO);
    stage
}

#[test]
fn seeds_and_threads() {
    let stage = small_room();
    let geometry = stage.geometry();
    let tracer = SceneTracer::new(&stage.scene, &geometry);
    let view = look(Vec3::new(0.0, 0.0, 0.9), Vec3::ZERO, 0.8);
    let run = |threads: usize, seed: u32| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let told = std::sync::atomic::AtomicU32::new(0);
        let settings = PathSettings { paths: 16, bounces: None, seed };
        let progress = |share: f32| {
            assert!(share > 0.0 && share <= 1.0);
            told.fetch_max((share * 1000.0) as u32, std::sync::atomic::Ordering::Relaxed);
        };
        let estimate = pool.install(|| path_trace(&tracer, &view, [50, 35], &settings, &progress));
        assert_eq!(told.into_inner(), 1000);
        estimate
    };
    let (one, three, other) = (run(1, 7), run(3, 7), run(3, 8));
    assert_eq!(one, three);
    assert_ne!(one.mean, other.mean);
}

/// The difference of two seeds has the variance that they estimate: no less and no more.
#[test]
fn variance_is_right() {
    let stage = small_room();
    let geometry = stage.geometry();
    let view = look(Vec3::new(0.0, 0.0, 0.9), Vec3::ZERO, 0.8);
    let run =
        |seed| trace(&stage.scene, &geometry, &view, 64, PathSettings { paths: 64, bounces: Some(3), seed });
    let (a, mut b) = (run(10), run(11));
    for (v, other) in b.variance.pixels.iter_mut().zip(&a.variance.pixels) {
        *v += *other;
    }
    let found = deviation(&a.mean, &b, &|_| true, &|_| DVec3::ZERO, 0.0);
    assert!(found.is_noise() && found.mean_square > 0.7, "{found:?}");
    let one = trace(&stage.scene, &geometry, &view, 8, PathSettings { paths: 1, bounces: None, seed: 0 });
    assert!(one.mean.mean().is_finite() && one.variance.pixels.iter().all(|v| *v == Vec3::INFINITY));
    // Negative control: the same noise twice is too little difference, one bounce more too much.
    let mut same = a.clone();
    same.variance = b.variance.clone();
    assert!(deviation(&a.mean, &same, &|_| true, &|_| DVec3::ZERO, 0.0).mean_square < 0.7);
    let settings = PathSettings { paths: 64, bounces: Some(4), seed: 12 };
    let more = trace(&stage.scene, &geometry, &view, 64, settings);
    assert!(!deviation(&a.mean, &more, &|_| true, &|_| DVec3::ZERO, 0.0).is_noise());
}

/// Roulette changes the noise, not the mean: no limit against a limit that is as good as none.
#[test]
fn roulette_is_unbiased() {
    let mut stage = Stage::default();
    let walls = stage.material(Material::diffuse("", Vec3::new(0.7, 0.5, 0.1)));
    let lamp = stage.material(Material::emitter("", Vec3::new(5.0, 4.0, 3.0)));
    stage.room(Vec3::splat(-1.0), Vec3::splat(1.0), walls);
    stage.quad(Vec3::new(-0.3, 0.9, -0.3), Vec3::X * 0.6, Vec3::Z * 0.6, lamp);
    let geometry = stage.geometry();
    let view = look(Vec3::new(0.0, 0.0, 0.9), Vec3::new(0.0, -0.5, 0.0), 0.5);
    let run =
        |bounces, seed| trace(&stage.scene, &geometry, &view, 24, PathSettings { paths: 64, bounces, seed });
    let (limited, mut unlimited) = (run(Some(24), 20), run(None, 21));
    for (v, other) in unlimited.variance.pixels.iter_mut().zip(&limited.variance.pixels) {
        *v += *other;
    }
    assert_picture(&unlimited, &limited.mean, 0.97, "roulette");
}
