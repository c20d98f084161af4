//! The exact many-light sum.

use crate::common::{Stage, assert_picture, look, trace};
use girandole_core::glam::Vec3;
use girandole_core::lights::{Clamp, LightSample, LightSet, Profile, SampleOrigin};
use girandole_core::scene::{LightId, Material, MaterialId, Mesh, NONE, View};
use girandole_core::trace::SceneTracer;
use girandole_reference::{OracleSettings, PathSettings, oracle, oracle_pixel, radiance, visible};
use std::f32::consts::PI;

const GLOW: Vec3 = Vec3::new(6.0, 4.0, 2.0);
const LAMP: MaterialId = MaterialId(1);

/// A shiny floor, a lamp above it, and a block between them that the camera does not see.
fn stage() -> Stage {
    let mut stage = Stage::default();
    let floor =
        Material { specular: 1.0, roughness: 0.45, ..Material::diffuse("", Vec3::new(0.3, 0.5, 0.8)) };
    let floor = stage.material(floor);
    let lamp = stage.material(Material::emitter("", GLOW));
    assert_eq!(lamp, LAMP);
    stage.quad(Vec3::new(-3.0, 0.0, -3.0), Vec3::Z * 6.0, Vec3::X * 6.0, floor);
    stage.quad(Vec3::new(-0.5, 2.0, -0.5), Vec3::X, Vec3::Z, lamp);
    let mut block = Mesh::default();
    block.add_box(Vec3::new(-0.2, 1.0, -0.6), Vec3::new(0.3, 1.2, 0.1), floor);
    stage.mesh(block);
    stage
}

fn view() -> View {
    look(Vec3::new(0.0, 0.9, 1.6), Vec3::new(0.0, 0.0, 0.2), 0.35)
}

/// `n` × `n` samples on the lamp.
fn lights(tracer: &SceneTracer, n: u32) -> LightSet {
    let geometry = tracer.geometry();
    let count = geometry.triangles.len() as u32;
    let triangle = (0..count).find(|&i| geometry.triangles[i as usize].material == LAMP).unwrap_or(NONE);
    let [corner, end, _] = geometry.corners(triangle);
    assert_eq!(end - corner, Vec3::X);
    let sample = |i: u32| {
        let at = |i: u32| (i as f32 + 0.5) / n as f32;
        let (u, v) = (at(i % n), at(i / n));
        LightSample {
            position: tracer.offset_ray_origin(corner + Vec3::X * u + Vec3::Z * v, Vec3::NEG_Y),
            normal: Vec3::NEG_Y,
            intensity: GLOW / (n * n) as f32,
            profile: Profile::Cosine,
            origin: SampleOrigin::Emitter { triangle: triangle + u32::from(v > u), point: i },
            rectangle: None,
        }
    };
    LightSet::from_samples(geometry, (0..n * n).map(sample).collect())
}

#[test]
fn many_lights_are_an_area_light() {
    let stage = stage();
    let geometry = stage.geometry();
    let tracer = SceneTracer::new(&stage.scene, &geometry);
    let view = view();
    let settings = OracleSettings { samples_per_axis: 2, clamp: Clamp::Off, ..OracleSettings::default() };
    let sum = oracle(&tracer, &lights(&tracer, 32), &view, [24, 24], &settings, &|_| ());
    let estimate =
        trace(&stage.scene, &geometry, &view, 24, PathSettings { paths: 256, bounces: Some(0), seed: 5 });
    assert_picture(&estimate, &sum, 0.98, "many lights");
    // Negative control: without the block.
    let mut open = stage;
    open.scene.objects.pop();
    let geometry = open.geometry();
    let tracer = SceneTracer::new(&open.scene, &geometry);
    let lit = oracle(&tracer, &lights(&tracer, 32), &view, [24, 24], &settings, &|_| ());
    assert!(lit.mean().x > 1.02 * sum.mean().x, "{} {}", lit.mean(), sum.mean());
}

#[test]
fn threads_and_tiles_do_not_matter() {
    let stage = stage();
    let geometry = stage.geometry();
    let tracer = SceneTracer::new(&stage.scene, &geometry);
    let (view, size) = (view(), [45, 37]);
    let set = lights(&tracer, 6);
    let settings = OracleSettings { samples_per_axis: 2, clamp: Clamp::Off, ..OracleSettings::default() };
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| oracle(&tracer, &set, &view, size, &settings, &|_| ()))
    };
    let picture = run(1);
    assert_eq!(picture, run(4));
    for [x, y] in [[0, 0], [44, 36], [16, 20], [31, 15]] {
        let pixel = oracle_pixel(&tracer, &set, &view, size, [x, y], &settings);
        assert_eq!(pixel, picture.pixels[(y * size[0] + x) as usize]);
    }
    assert!(picture.mean().min_element() > 0.0);
}

#[test]
fn a_pixel_is_the_sum_by_hand() {
    let stage = stage();
    let geometry = stage.geometry();
    let tracer = SceneTracer::new(&stage.scene, &geometry);
    let view = view();
    let set = lights(&tracer, 5);
    let mut shadowed = 0;
    for i in 0..100 {
        let pixel = [i % 10, i / 10];
        let at = girandole_core::glam::Vec2::new(pixel[0] as f32 + 0.5, pixel[1] as f32 + 0.5);
        let (origin, direction) = view.relative_to(geometry.origin).pixel_ray(at, [10, 10]);
        let hit = tracer.closest_visible(origin, direction).expect("the floor is everywhere");
        let wo = -direction.normalize();
        let surface = geometry.surface(&stage.scene, hit.triangle, hit.barycentric, wo);
        let diffuse = stage.scene.materials[0].base_color * (1.0 - (0.04 + 0.96 * 0.00367)) / PI;
        for clamp in [Clamp::Off, Clamp::At(0.1)] {
            let mut expected = Vec3::ZERO;
            for light in set.samples() {
                let to = light.position - surface.position;
                let wi = to.normalize();
                let bound = if let Clamp::At(bound) = clamp { bound } else { f32::MAX };
                let g = (wi.y * wi.y / to.length_squared()).min(bound);
                let f = girandole_core::brdf::specular_brdf(
                    Vec3::Y,
                    wo,
                    wi,
                    surface.f0,
                    surface.f90,
                    surface.alpha,
                );
                // The block is the only thing between: a slab test.
                let (low, high) = (Vec3::new(-0.2, 1.0, -0.6), Vec3::new(0.3, 1.2, 0.1));
                let shift = geometry.origin.as_vec3();
                let (a, b) = ((low - shift - surface.position) / to, (high - shift - surface.position) / to);
                let blocked = a.min(b).max_element() < a.max(b).min_element();
                assert_eq!(visible(&tracer, &surface, hit.triangle, light), !blocked);
                shadowed += u32::from(blocked);
                if !blocked {
                    expected += (diffuse + f) * light.intensity * g;
                }
            }
            let found = radiance(&tracer, &set, &surface, hit.triangle, wo, clamp);
            assert!((found - expected).abs().max_element() < 1e-5, "{found} for {expected}");
            let settings = OracleSettings { samples_per_axis: 1, clamp, ..OracleSettings::default() };
            assert_eq!(found, oracle_pixel(&tracer, &set, &view, [10, 10], pixel, &settings));
        }
    }
    assert!(shadowed > 100 && shadowed < 4000, "{shadowed}");
}

#[test]
fn directional_lights_and_emitters_seen() {
    let stage = stage();
    let geometry = stage.geometry();
    let tracer = SceneTracer::new(&stage.scene, &geometry);
    let sun = LightSample {
        position: Vec3::new(0.0, 100.0, 0.0),
        normal: Vec3::NEG_Y,
        intensity: Vec3::ONE,
        profile: Profile::Directional,
        origin: SampleOrigin::Punctual { light: LightId(0) },
        rectangle: None,
    };
    let set = LightSet::from_samples(&geometry, vec![sun]);
    let seen = |eye: Vec3, target: Vec3| {
        let view = look(eye, target, 1e-3);
        oracle_pixel(&tracer, &set, &view, [1, 1], [0, 0], &OracleSettings::default())
    };
    // Below the lamp (its back blocks too) and the block there is shadow; elsewhere E = 1.
    assert_eq!(seen(Vec3::new(0.0, 0.5, 0.0), Vec3::new(0.4, 0.0, 0.4)), Vec3::ZERO);
    let lit = seen(Vec3::new(2.0, 0.5, 0.0), Vec3::new(2.0, 0.0, 0.1));
    let diffuse = 0.8 * (1.0 - (0.04 + 0.96 * 0.00367)) / PI;
    assert!(lit.z > diffuse && lit.z < diffuse + 0.2, "{lit}");
    // The lamp itself from below; its back is not there, behind it there is nothing.
    assert_eq!(seen(Vec3::new(0.4, 1.5, 0.4), Vec3::new(0.4, 2.0, 0.41)), GLOW);
    assert_eq!(seen(Vec3::new(0.4, 3.0, 0.4), Vec3::new(0.4, 9.0, 0.41)), Vec3::ZERO);
    assert_eq!(seen(Vec3::new(0.4, 3.0, 0.4), Vec3::new(0.4, 2.0, 0.41)), Vec3::ZERO);
}
