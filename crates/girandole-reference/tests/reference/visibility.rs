//! Visibility determination does not change a picture whose visibility is traced.

use girandole_core::image::Image;
use girandole_core::lights::{LightSet, LightSettings, Profile, SampleOrigin};
use girandole_core::scene::builtin::{self, MovingObject};
use girandole_core::scene::{Geometry, LightId, Scene, View};
use girandole_core::trace::SceneTracer;
use girandole_core::visibility::{State, VisibilityDatabase, VisibilitySettings};
use girandole_reference::{OracleSettings, oracle, oracle_with_states};
use std::path::Path;

const SIZE: [u32; 2] = [96, 72];

/// Pixels that differ by more than 1e-5 of their value plus the picture's mean.
fn different(a: &Image, b: &Image) -> usize {
    let mean = a.mean();
    let differs = |(x, y): (&girandole_core::glam::Vec3, &girandole_core::glam::Vec3)| {
        !(*x - *y).abs().cmple((*x + mean) * 1e-5).all()
    };
    a.pixels.iter().zip(&b.pixels).filter(|&pair| differs(pair)).count()
}

/// The picture with and without a database; and, as a negative control, with the database of other lights.
fn same_picture(scene: &Scene, lights: Option<LightSet>, partial: std::ops::Range<f64>) {
    let geometry = Geometry::new(scene);
    let tracer = SceneTracer::new(scene, &geometry);
    let sampled = |seed| {
        let settings = LightSettings { count: 60, seed, ..LightSettings::default() };
        LightSet::sample(scene, &geometry, &settings).expect("there is light")
    };
    let lights = lights.unwrap_or_else(|| sampled(0));
    let settings = VisibilitySettings::default();
    let build = |lights: &LightSet| {
        VisibilityDatabase::build(scene, &geometry, lights, &settings).expect("a database")
    };
    let database = build(&lights);
    let share = database.counts().area_shares[State::Partial as usize];
    assert!(partial.contains(&share), "{}: {share}", scene.name);
    let reversed = lights.samples().iter().rev().copied().collect();
    let wrong = build(&LightSet::from_samples(&geometry, reversed));
    let mut noticed = false;
    for camera in &scene.cameras {
        let view = View::new(scene, camera, SIZE[0] as f32 / SIZE[1] as f32);
        let settings = OracleSettings::default();
        let expected = oracle(&tracer, &lights, &view, SIZE, &settings, &|_| ());
        let with = |database| oracle_with_states(&tracer, &lights, database, &view, SIZE, &settings, &|_| ());
        let found = different(&expected, &with(&database));
        assert_eq!(found, 0, "{} {}: {found} pixels", scene.name, camera.name);
        noticed = noticed || different(&expected, &with(&wrong)) > 100;
    }
    assert!(noticed, "{}: wrong states are not told", scene.name);
}

#[test]
fn built_in_rooms() {
    for (i, name) in builtin::EXPERIMENTS.iter().enumerate() {
        let object = if i % 2 == 0 { MovingObject::Torus } else { MovingObject::Teapot };
        let scene = builtin::build(name, object).expect("it is built in");
        assert!(scene.objects.iter().any(|o| o.dynamic));
        same_picture(&scene, None, 0.01..0.5);
    }
}

#[test]
fn scenes_of_another_renderer() {
    for name in ["cornell", "table", "punctual"] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/truth").join(name);
        let scene = Scene::load(&folder.join("scene.glb")).expect("the scene loads");
        same_picture(&scene, None, 0.01..0.7);
    }
}

#[test]
fn lights_of_all_profiles() {
    let mut scene = builtin::build("area-lights", MovingObject::Teapot).expect("it is built in");
    // The sun shines into it.
    scene.objects.retain(|o| o.name != "ceiling");
    let geometry = Geometry::new(&scene);
    let lights =
        LightSet::sample(&scene, &geometry, &LightSettings { count: 60, ..LightSettings::default() })
            .expect("there is light");
    let count = lights.len();
    let mut samples = lights.samples().to_vec();
    for (i, light) in samples.iter_mut().enumerate() {
        light.profile = match i * 4 / count {
            0 => Profile::Cosine,
            1 => Profile::Hemisphere,
            2 => Profile::Spot { scale: 2.0, offset: -1.0 },
            _ => Profile::Directional,
        };
        if light.profile == Profile::Directional {
            light.origin = SampleOrigin::Punctual { light: LightId(0) };
        }
    }
    same_picture(&scene, Some(LightSet::from_samples(&geometry, samples)), 0.01..0.5);
}
