//! The environment's sun among light samples.

use super::*;
use crate::image::{Image, luminance};
use crate::scene::{Environment, Sky, View};
use glam::Vec2;

fn sky(elevation: f32) -> Environment {
    Environment::sky(&Sky { elevation: elevation.to_radians(), ..Sky::default() }).unwrap()
}

/// A picture of a dim sky with a sun of two pixels.
fn sunny_picture() -> Environment {
    let mut image = Image { width: 256, height: 128, pixels: vec![vec3(0.4, 0.5, 0.9); 256 * 128] };
    for x in [100, 101] {
        image.pixels[30 * 256 + x] = vec3(3000.0, 2800.0, 2400.0);
    }
    Environment::new(image).unwrap()
}

/// A cube on a floor.
fn outdoors(environment: Environment) -> (Scene, Geometry, View) {
    let mut mesh = Mesh::default();
    square(&mut mesh, Vec3::ZERO, 6.0, true, MaterialId(0));
    mesh.add_box(vec3(-0.5, 0.0, -0.5), vec3(0.5, 1.0, 0.5), MaterialId(0));
    let (mut scene, _) = scene_of(mesh, vec![Material::diffuse("white", Vec3::splat(0.7))]);
    scene.environment = Some(environment);
    let forward = vec3(0.0, -0.5, -1.0).normalize();
    let view = View {
        eye: DVec3::new(0.0, 2.0, 4.0),
        right: Vec3::X,
        up: Vec3::X.cross(forward),
        forward,
        half_extent: Vec2::splat(0.6),
        center: Vec2::ZERO,
        orthographic: false,
        depth: None,
        clip: Default::default(),
    };
    let geometry = Geometry::new(&scene);
    (scene, geometry, view)
}

fn suns(set: &LightSet) -> Vec<LightSample> {
    set.samples().iter().filter(|sample| sample.is_of_sun()).copied().collect()
}

#[test]
fn the_sun_has_up_to_a_tenth_of_the_samples_and_all_of_its_light() {
    let environments = [sky(3.0), sky(20.0), sky(60.0), sunny_picture()];
    for (i, environment) in environments.into_iter().enumerate() {
        let weight: f64 = (0..environment.sun_parts()).map(|part| environment.sun_weight(part)).sum();
        let (scene, geometry, view) = outdoors(environment);
        for (count, direct_share) in [(8, None), (100, None), (300, None), (100, Some(0.5))] {
            for views in [&[][..], &[view]] {
                let settings = LightSettings { count, direct_share, bounces: 2, ..Default::default() };
                let set = LightSet::sample_for(&scene, &geometry, &settings, views).unwrap();
                assert_eq!(set.len(), count as usize);
                let suns = suns(&set);
                let most = (count as usize / 10).max(1);
                assert!((1..=most).contains(&suns.len()), "{i}, {count} {direct_share:?}: {}", suns.len());
                // All of its light, whichever directions were chosen.
                let light: f64 = suns.iter().map(|s| f64::from(luminance(s.intensity))).sum();
                let is_approximate = i == 3;
                let error = (light / weight - 1.0).abs();
                assert!(
                    error < if is_approximate { 0.02 } else { 2e-3 },
                    "{i}, {count}: {light} for {weight}"
                );
            }
        }
    }
}

#[test]
fn where_it_does_not_shine_the_sun_has_hardly_a_sample() {
    let count = |azimuth: f32, gap: f32| {
        let sky = Sky { elevation: 20_f32.to_radians(), azimuth, ..Sky::default() };
        let (mut scene, _, view) = outdoors(Environment::sky(&sky).unwrap());
        // Walls between it and all that is seen, and what is between them.
        for [low, high] in [[-40.0, -gap], [gap, 40.0]] {
            let mut wall = Mesh::default();
            let corners = [(low, -1.0), (high, -1.0), (high, 60.0), (low, 60.0)];
            wall.add_polygon(&corners.map(|(x, y)| vec3(x, y, -4.0)), MaterialId(0));
            scene.add_object("wall", wall, Transform::IDENTITY);
        }
        let geometry = Geometry::new(&scene);
        let settings = LightSettings { count: 300, bounces: 0, ..Default::default() };
        suns(&LightSet::sample_for(&scene, &geometry, &settings, &[view]).unwrap()).len()
    };
    let [behind, before, between] =
        [(0.0, 0.0), (std::f32::consts::PI, 0.0), (0.0, 0.8)].map(|(a, g)| count(a, g));
    assert!((1..=3).contains(&behind) && before > 10, "{behind} {before}");
    // A strip of sunlight has more samples than one that only might be there.
    assert!(between > behind && (4..=8).contains(&between), "{between}");
}

#[test]
fn samples_of_the_sun_cover_its_disc() {
    let environment = sky(35.0);
    let disc = environment.map.disc().unwrap();
    let (scene, geometry, view) = outdoors(environment);
    let settings = LightSettings { count: 400, bounces: 0, ..Default::default() };
    let set = LightSet::sample_for(&scene, &geometry, &settings, &[view]).unwrap();
    let suns = suns(&set);
    assert!(suns.len() >= 20, "{}", suns.len());
    let (mut squares, mut middle, mut solid_angle) = (0.0, Vec3::ZERO, 0.0);
    for sun in &suns {
        let Profile::Distant { solid_angle: own, .. } = sun.profile else { panic!("{sun:?}") };
        let apart = (-sun.normal).distance(disc.direction);
        assert!(apart <= disc.chord * 1.001);
        squares += apart * apart / suns.len() as f32;
        middle += (-sun.normal - disc.direction) / suns.len() as f32;
        solid_angle += own;
    }
    // As a disc is spread: half of the largest square in the mean, about its middle. A single direction would fail both ways.
    let spread = squares / (0.5 * disc.chord * disc.chord);
    assert!((0.8..1.2).contains(&spread) && middle.length() < 0.15 * disc.chord, "{spread} {middle}");
    let expected = std::f32::consts::PI * disc.chord * disc.chord;
    assert!((solid_angle / expected - 1.0).abs() < 0.01, "{solid_angle} for {expected}");
}

#[test]
fn skies_without_a_sun_have_no_samples_of_one() {
    let overcast = |i: u32| Vec3::splat(1.0 - (i / 64) as f32 / 40.0);
    let image = Image { width: 64, height: 32, pixels: (0..64 * 32).map(overcast).collect() };
    let (scene, geometry, view) = outdoors(Environment::new(image).unwrap());
    let settings = LightSettings { count: 100, ..Default::default() };
    let set = LightSet::sample_for(&scene, &geometry, &settings, &[view]).unwrap();
    assert!(suns(&set).is_empty());
}

#[test]
fn the_sun_keeps_its_strata_while_things_move() {
    let (mut scene, _, view) = outdoors(sky(30.0));
    let mut mover = Mesh::default();
    mover.add_box(Vec3::splat(-0.2), Vec3::splat(0.2), MaterialId(0));
    scene.add_object("mover", mover, Transform::IDENTITY);
    scene.objects[1].dynamic = true;
    let node = scene.objects[1].node;
    let settings = LightSettings { count: 120, bounces: 2, ..Default::default() };
    let geometry = Geometry::new(&scene);
    let pace = Pace { paths: 200, fade: 2 };
    let opened = complete(IncrementalWalk::new(&scene, &geometry, &settings, &[view], pace));
    let (mut walk, first) = opened.unwrap();
    let lit = |set: &LightSet| suns(set).iter().filter(|s| s.intensity != Vec3::ZERO).count();
    let before = lit(&first);
    assert!((2..=12).contains(&before), "{before}");
    for frame in 0..12 {
        let to = Vec3::new(1.0, 0.5, frame as f32 * 0.1);
        scene.set_transform(node, Transform::rigid(glam::Quat::IDENTITY, to)).unwrap();
        let set = walk.follow(&scene, &Geometry::new(&scene)).expect("it follows");
        assert_eq!(lit(&set), before, "frame {frame}");
    }
}
