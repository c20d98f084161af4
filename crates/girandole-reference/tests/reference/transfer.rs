//! Precomputed transfer against the path tracer: an object alone under environments of spherical harmonics.

use crate::common::Stage;
use girandole_core::glam::{DAffine3, DVec3, Vec2, Vec3};
use girandole_core::lights::{Clamp, LightSample, LightSet, Profile, SampleOrigin};
use girandole_core::math::{sequence, sh};
use girandole_core::scene::builtin::shapes;
use girandole_core::scene::{Geometry, LightId, Material, MaterialId, Mesh, ObjectId, Scene, Transform};
use girandole_core::trace::SceneTracer;
use girandole_core::transfer::{Gathering, ObjectTransfer, TransferSettings, TransferredLight};
use girandole_reference::{Irradiance, PathSettings, irradiance};
use std::f32::consts::PI;

/// Coefficients of the same radiance from everywhere.
fn constant(radiance: Vec3) -> Vec<Vec3> {
    let mut environment = vec![Vec3::ZERO; 25];
    environment[0] = radiance * (4.0 * PI).sqrt();
    environment
}

/// As many lights, infinitely far away, as there are directions, each of the irradiance π where it comes straight down: negative in places.
fn directional(directions: &[(Vec3, Vec3)]) -> Vec<Vec3> {
    let mut environment = vec![Vec3::ZERO; 25];
    let mut values = [0.0; 25];
    for (direction, color) in directions {
        sh::basis(direction.normalize(), 5, &mut values);
        environment.iter_mut().zip(values).for_each(|(c, y)| *c += *color * (y * PI));
    }
    environment
}

fn environments() -> [(&'static str, Vec<Vec3>); 3] {
    let side = (Vec3::new(1.0, 0.3, 0.2), Vec3::ONE);
    let colored =
        [(Vec3::new(-0.3, 1.0, 0.6), Vec3::X), (Vec3::new(0.2, -1.0, 0.1), Vec3::new(0.0, 0.8, 1.0))];
    [
        ("constant", constant(Vec3::ONE)),
        ("from the side", directional(&[side])),
        ("from above and below", directional(&colored)),
    ]
}

fn alone(mesh: Mesh, material: Material) -> Scene {
    let mut stage = Stage::default();
    stage.material(material);
    stage.mesh(mesh);
    stage.scene
}

/// By vertex, the mean of the directions to the middles of its triangles.
fn inwards(geometry: &Geometry) -> Vec<Vec3> {
    let mut sums = vec![(Vec3::ZERO, 0.0); geometry.positions.len()];
    for triangle in &geometry.triangles {
        let corners = triangle.vertices.map(|v| geometry.positions[v as usize]);
        let middle = corners.iter().sum::<Vec3>() / 3.0;
        for (vertex, corner) in triangle.vertices.into_iter().zip(corners) {
            sums[vertex as usize].0 += (middle - corner).normalize();
            sums[vertex as usize].1 += 1.0;
        }
    }
    sums.into_iter().map(|(sum, count)| sum / count).collect()
}

/// What some vertices receive, by the path tracer: vertex and irradiance.
fn truth(
    scene: &Scene,
    environment: &[Vec3],
    bounces: u32,
    vertices: u32,
    paths: u32,
) -> Vec<(usize, Irradiance)> {
    let geometry = Geometry::new(scene);
    let tracer = SceneTracer::new(scene, &geometry);
    let count = geometry.positions.len() as u32;
    let inwards = inwards(&geometry);
    let at = |i: u32| {
        // Spread over the mesh, without its period.
        let vertex = ((i * 2 + 1) * count / (2 * vertices)) as usize;
        let (position, normal) = (geometry.positions[vertex], geometry.normals[vertex]);
        // In a seam a vertex may lie within the wall that its triangles rise from.
        let along = inwards[vertex] - normal * normal.dot(inwards[vertex]);
        let start = tracer.offset_ray_origin(position, normal + along);
        let settings = PathSettings { paths, bounces: Some(bounces), seed: i };
        (vertex, irradiance(&tracer, environment, start, normal, &settings))
    };
    std::thread::scope(|scope| {
        let half = |first: u32| scope.spawn(move || (first..vertices).step_by(2).map(at).collect::<Vec<_>>());
        let halves = [half(0), half(1)];
        halves.into_iter().flat_map(|half| half.join().expect("truth")).collect()
    })
}

/// How far transfer is from the truth, as a share of what an unoccluded vertex receives at most.
#[derive(Debug)]
struct Found {
    mean: f32,
    worst: f32,
    /// Standard deviation of the truth at its noisiest vertex.
    noise: f32,
}

impl Found {
    fn agrees(&self) -> bool {
        self.mean < 0.01 && self.worst < 0.03
    }
}

fn compared(
    scene: &Scene,
    transfer: &ObjectTransfer,
    environment: &[Vec3],
    truth: &[(usize, Irradiance)],
) -> Found {
    let mut cosine = [0.0; 25];
    let mut whole = Vec3::ZERO;
    for normal in &scene.meshes[0].normals {
        sh::clamped_cosine(*normal, 5, &mut cosine);
        let unoccluded: Vec3 = environment.iter().zip(cosine).map(|(c, t)| *c * t).sum();
        whole = whole.max(unoccluded.abs());
    }
    let (mut sum, mut of_truth) = (Vec3::ZERO, Vec3::ZERO);
    let mut found = Found { mean: 0.0, worst: 0.0, noise: 0.0 };
    for (vertex, expected) in truth {
        let difference = transfer.irradiance(*vertex, environment) - expected.mean;
        sum += difference;
        of_truth += expected.mean;
        found.worst = found.worst.max((difference / whole).abs().max_element());
        let noise = expected.variance.map(f32::sqrt) / whole;
        found.noise = found.noise.max(noise.max_element());
    }
    found.mean = (sum / of_truth).abs().max_element();
    found
}

/// Only what nothing blocks: no shadows, and no interreflection.
fn without_shadows(scene: &Scene, environment: &[Vec3], truth: &[(usize, Irradiance)]) -> f32 {
    let mut cosine = [0.0; 25];
    let wrong = |(vertex, expected): &(usize, Irradiance)| {
        sh::clamped_cosine(scene.meshes[0].normals[*vertex], 5, &mut cosine);
        let unoccluded: Vec3 = environment.iter().zip(cosine).map(|(c, t)| *c * t).sum();
        (unoccluded - expected.mean).abs().max_element() / PI
    };
    truth.iter().map(wrong).fold(0.0, f32::max)
}

#[test]
fn transfer_is_what_paths_bring() {
    let torus = |albedo| alone(shapes::thesis_torus(MaterialId(0)), Material::diffuse("", albedo));
    let colored = Vec3::new(0.8, 0.5, 0.2);
    for (albedo, bounces) in [(Vec3::splat(0.8), 0), (Vec3::splat(0.8), 1), (colored, 1), (colored, 3)] {
        let scene = torus(albedo);
        let settings = TransferSettings { bounces, directions: 4096, ..TransferSettings::default() };
        let simulate = |settings| ObjectTransfer::simulate(&scene, ObjectId(0), settings, &|_| {});
        let transfer = simulate(&settings).expect("transfer");
        assert_eq!(transfer.channels(), if albedo == colored { 3 } else { 1 });
        assert!(transfer.error().has_enough_rays(), "{:?}", transfer.error());
        let shadows = simulate(&TransferSettings { bounces: 0, ..settings.clone() }).expect("transfer");
        for (name, environment) in environments() {
            let truth = truth(&scene, &environment, bounces, 48, 16384);
            let found = compared(&scene, &transfer, &environment, &truth);
            assert!(found.agrees() && found.noise < 0.01, "{albedo} {bounces} {name}: {found:?}");
            // The controls.
            assert!(without_shadows(&scene, &environment, &truth) > 0.03, "{name}");
            if bounces == 3 {
                assert!(!compared(&scene, &shadows, &environment, &truth).agrees(), "{name}");
            }
        }
    }
}

/// Grooves between lid and rim, seams of handle and spout, with the rays that are the default.
#[test]
fn deep_hollows_receive_what_paths_bring() {
    let material = Material::diffuse("", Vec3::new(0.8, 0.5, 0.2));
    let scene = alone(girandole_core::scene::builtin::teapot(6, MaterialId(0)), material);
    let simulate = |bounces| {
        let settings = TransferSettings { bounces, ..TransferSettings::default() };
        ObjectTransfer::simulate(&scene, ObjectId(0), &settings, &|_| {}).expect("transfer")
    };
    let [one, three] = [1, 3].map(simulate);
    assert!(three.error().has_enough_rays(), "{:?}", three.error());
    for (name, environment) in environments() {
        let truth = truth(&scene, &environment, 3, 131, 20000);
        let found = compared(&scene, &three, &environment, &truth);
        assert!(found.agrees() && found.noise < 0.01, "{name}: {found:?}");
        // The control: a third of the bounces.
        let found = compared(&scene, &one, &environment, &truth);
        assert!(!found.agrees(), "{name}: {found:?}");
    }
}

#[test]
fn no_energy_is_created() {
    let white = |mesh| alone(mesh, Material::diffuse("", Vec3::ONE));
    let received = |scene: &Scene| {
        let settings = TransferSettings { bounces: 8, ..TransferSettings::default() };
        let transfer = ObjectTransfer::simulate(scene, ObjectId(0), &settings, &|_| {}).expect("transfer");
        let environment = constant(Vec3::ONE);
        (0..transfer.vertex_count()).map(|v| transfer.irradiance(v, &environment).x).collect::<Vec<_>>()
    };
    // In a furnace all that is white receives π, and what has not been reflected often enough receives less.
    let scene = white(shapes::thesis_torus(MaterialId(0)));
    let torus = received(&scene);
    assert!(torus.iter().all(|e| *e <= PI * (1.0 + 1e-4)), "{torus:?}");
    // Lost is only what paths lose too, as nothing is reflected from below a triangle where its normals are bent.
    let by_paths = truth(&scene, &constant(Vec3::ONE), 8, 48, 16384);
    let mean = |value: &dyn Fn(&(usize, Irradiance)) -> f32| by_paths.iter().map(value).sum::<f32>() / 48.0;
    let (lost, by_paths) = (mean(&|(vertex, _)| PI - torus[*vertex]), mean(&|(_, found)| PI - found.mean.x));
    assert!((lost - by_paths).abs() < PI * 1e-3, "{lost} {by_paths}");
    let finer = received(&white(shapes::torus(1.0, 0.4, 80, 40, MaterialId(0))));
    assert!(finer.iter().all(|e| (PI * 0.999..PI * (1.0 + 1e-4)).contains(e)), "{finer:?}");
    let mut cube = Mesh::default();
    cube.add_box(Vec3::splat(-1.0), Vec3::ONE, MaterialId(0));
    let cube = received(&white(cube));
    assert!(cube.iter().all(|e| (e / PI - 1.0).abs() < 1e-5), "{cube:?}");
    // The control: what is grey receives less.
    let grey = received(&alone(shapes::thesis_torus(MaterialId(0)), Material::diffuse("", Vec3::splat(0.5))));
    assert!(grey.iter().any(|e| *e < PI * 0.95), "{grey:?}");
}

/// What the vertices of a torus receive beside a board and under some lights, all of it moved.
fn lit(place: DAffine3, lights: DAffine3) -> Vec<Vec3> {
    let mut scene = Scene::default();
    let white = scene.add_material(Material::diffuse("", Vec3::splat(0.8)));
    let mut board = Mesh::default();
    board.add_box(Vec3::new(-0.3, 0.9, -0.5), Vec3::new(0.5, 0.95, 0.4), white);
    scene.add_object("board", board, Transform::Affine(place));
    let torus = DAffine3::from_translation(DVec3::new(0.05, 0.4, 0.0)) * DAffine3::from_rotation_x(0.3);
    let torus = scene.add_object("torus", shapes::thesis_torus(white), Transform::Affine(place * torus));
    let geometry = Geometry::new(&scene);
    let scale = lights.matrix3.determinant().cbrt();
    let sample = |i: u32| {
        let s = |d| sequence::sample(i, d, 3);
        let at = (Vec3::new(s(0), s(1), s(2)) * 2.0 - 1.0).as_dvec3() * 2.0 + DVec3::new(0.0, 0.4, 0.0);
        let towards = (DVec3::new(0.05, 0.4, 0.0) - at).normalize();
        LightSample {
            position: (lights.transform_point3(at) - geometry.origin).as_vec3(),
            normal: lights.transform_vector3(towards).normalize().as_vec3(),
            intensity: Vec3::new(s(3), s(4), s(5)) * (scale * scale) as f32,
            profile: Profile::Cosine,
            origin: SampleOrigin::Punctual { light: LightId(0) },
            rectangle: None,
        }
    };
    let samples = LightSet::from_samples(&geometry, (0..40).map(sample).collect());
    let settings = TransferSettings { directions: 256, bounces: 1, ..TransferSettings::default() };
    let transfer = ObjectTransfer::simulate(&scene, torus, &settings, &|_| {}).expect("transfer");
    let tracer = SceneTracer::new(&scene, &geometry);
    let mut light = TransferredLight::new();
    let grid = Gathering::Grid { points: 3 };
    let object = (torus, &transfer);
    light.add(&tracer, (&samples, None), object, grid, Clamp::Off).expect("a torus");
    let at = |t: u32| light.irradiance(&geometry, (t, true), Vec2::ZERO).expect("of the torus");
    geometry.objects[torus.index()].triangles.clone().map(at).collect()
}

#[test]
fn turning_scaling_and_moving_the_world_changes_nothing() {
    let moved = DAffine3::from_translation(DVec3::new(3.0, -2.0, 5.0))
        * DAffine3::from_rotation_z(0.8)
        * DAffine3::from_rotation_y(2.1)
        * DAffine3::from_scale(DVec3::splat(2.5));
    let here = lit(DAffine3::IDENTITY, DAffine3::IDENTITY);
    let there = lit(moved, moved);
    let mean = here.iter().map(|e| e.element_sum()).sum::<f32>() / here.len() as f32;
    let apart = |other: &[Vec3]| {
        let worst = |(a, b): (&Vec3, &Vec3)| (*a - *b).abs().max_element();
        here.iter().zip(other).map(worst).fold(0.0, f32::max) / mean
    };
    assert!(apart(&there) < 1e-3, "{}", apart(&there));
    // The control: the lights alone turn.
    assert!(apart(&lit(DAffine3::IDENTITY, DAffine3::from_rotation_y(0.2))) > 0.03);
}

/// Of the variance, by a point of which all is known.
#[test]
fn the_path_tracer_knows_its_own_noise() {
    let mut stage = Stage::default();
    let white = stage.material(Material::default());
    stage.quad(Vec3::new(-10.0, 0.0, -10.0), Vec3::Z * 20.0, Vec3::X * 20.0, white);
    let (geometry, environment) = (stage.geometry(), directional(&[(Vec3::new(1.0, 0.5, 0.2), Vec3::ONE)]));
    let tracer = SceneTracer::new(&stage.scene, &geometry);
    let mut cosine = [0.0; 25];
    sh::clamped_cosine(Vec3::Y, 5, &mut cosine);
    let closed: Vec3 = environment.iter().zip(cosine).map(|(c, t)| *c * t).sum();
    let start = tracer.offset_ray_origin(Vec3::ZERO, Vec3::Y);
    let squares = |factor: f32| {
        let z = (0..64).map(|seed| {
            let settings = PathSettings { paths: 1024, bounces: Some(2), seed };
            let found = irradiance(&tracer, &environment, start, Vec3::Y, &settings);
            ((found.mean - closed * factor) / found.variance.map(f32::sqrt)).x
        });
        z.map(|z| z * z).sum::<f32>() / 64.0
    };
    // With 15 degrees of freedom z² has the mean 15/13.
    let found = squares(1.0);
    assert!((0.6..1.9).contains(&found), "{found}");
    assert!(squares(1.05) > 1.9, "negative control: {}", squares(1.05));
}
