//! Light samples that follow what moves, against the path tracer once it is at rest.

use crate::common::{Stage, look};
use girandole_core::glam::{Quat, Vec3, vec3};
use girandole_core::illumination::{Illumination, IlluminationSettings, Rewalk};
use girandole_core::image::Image;
use girandole_core::lights::{LightSet, LightSettings, Pace};
use girandole_core::scene::{Geometry, Material, Mesh, NodeId, Scene, Transform, View};
use girandole_core::trace::SceneTracer;
use girandole_reference::metrics::{CompareOptions, compare};
use girandole_reference::{OracleSettings, PathSettings, oracle, path_trace};
use std::f32::consts::FRAC_PI_2;

const SIZE: [u32; 2] = [48, 36];
/// Frames of motion.
const FRAMES: u32 = 20;
const BOUNCES: u32 = 3;
const PACE: Pace = Pace { paths: 4000, fade: 8 };

/// A room with a wall across half of it, and a block.
fn room() -> Stage {
    let mut stage = Stage::default();
    let gray = stage.material(Material::diffuse("gray", Vec3::splat(0.7)));
    stage.room(vec3(-2.0, 0.0, -2.0), vec3(2.0, 2.5, 2.0), gray);
    let mut inside = Mesh::default();
    inside.add_box(vec3(-0.1, 0.0, -2.0), vec3(0.1, 2.5, 0.0), gray);
    inside.add_box(vec3(-1.5, 0.0, -1.0), vec3(-0.9, 0.8, -0.4), gray);
    stage.mesh(inside);
    stage
}

/// Adds something that moves.
fn add_mover(stage: &mut Stage, mesh: Mesh) -> NodeId {
    let object = stage.scene.add_object("mover", mesh, Transform::IDENTITY);
    let object = &mut stage.scene.objects[object];
    object.dynamic = true;
    object.node
}

/// A lamp that moves from one side of the wall to the other.
fn lamp_moves() -> (Scene, impl Fn(&mut Scene, f32)) {
    let mut stage = room();
    let glow = stage.material(Material::emitter("glow", vec3(9.0, 8.0, 6.0)));
    let mut lamp = Mesh::default();
    let corners = [vec3(-0.3, 0.0, -0.2), vec3(0.3, 0.0, -0.2), vec3(0.3, 0.0, 0.2), vec3(-0.3, 0.0, 0.2)];
    lamp.add_polygon(&corners, glow);
    let node = add_mover(&mut stage, lamp);
    (stage.scene, move |scene: &mut Scene, t: f32| {
        let place = Vec3::lerp(vec3(-1.2, 2.2, -1.2), vec3(1.2, 2.0, -1.0), t);
        scene.set_transform(node, Transform::rigid(Quat::from_rotation_x(0.2 * t), place)).expect("a place");
    })
}

/// A red door that opens beside a lamp, and lets light into the other half.
fn door_opens() -> (Scene, impl Fn(&mut Scene, f32)) {
    let mut stage = room();
    let glow = stage.material(Material::emitter("glow", vec3(14.0, 12.0, 9.0)));
    stage.quad(vec3(0.8, 2.3, 0.6), vec3(0.5, 0.0, 0.0), vec3(0.0, 0.0, 0.5), glow);
    let red = stage.material(Material::diffuse("red", vec3(0.8, 0.1, 0.05)));
    let mut door = Mesh::default();
    door.add_box(vec3(-0.04, 0.02, 0.0), vec3(0.04, 2.4, 1.95), red);
    let node = add_mover(&mut stage, door);
    (stage.scene, move |scene: &mut Scene, t: f32| {
        let turn = Quat::from_rotation_y(FRAC_PI_2 * 0.9 * t);
        scene.set_transform(node, Transform::rigid(turn, vec3(0.0, 0.0, 0.02))).expect("a place");
    })
}

fn picture(scene: &Scene, lights: &LightSet, view: &View) -> Image {
    let geometry = Geometry::new(scene);
    let tracer = SceneTracer::new(scene, &geometry);
    oracle(
        &tracer,
        lights,
        view,
        SIZE,
        &OracleSettings { samples_per_axis: 2, ..OracleSettings::default() },
        &|_| (),
    )
}

/// Moves, waits until the light has followed, and compares with the path tracer.
fn at_rest((mut scene, pose): (Scene, impl Fn(&mut Scene, f32)), view: &View, what: &str) {
    let lights = LightSettings { count: 4096, bounces: BOUNCES, ..LightSettings::default() };
    let settings =
        IlluminationSettings { lights, visibility: None, views: vec![*view], rewalk: Rewalk::Paths(PACE) };
    pose(&mut scene, 0.0);
    scene.take_changes();
    let mut light = Illumination::new(&scene, &settings).expect("there is light");
    let start = light.lights().clone();
    let mut waited = 0;
    for frame in 1..=FRAMES {
        pose(&mut scene, frame as f32 / FRAMES as f32);
        let changes = scene.take_changes();
        light.update(&scene, &changes).expect("it follows");
        waited = waited.max(light.waiting_paths().oldest);
    }
    let still = scene.take_changes();
    let mut rest = 0;
    while !light.is_settled() {
        light.update(&scene, &still).expect("it follows");
        waited = waited.max(light.waiting_paths().oldest);
        rest += 1;
        assert!(rest < 100, "{what} comes to no rest");
    }
    let geometry = Geometry::new(&scene);
    let tracer = SceneTracer::new(&scene, &geometry);
    let paths = PathSettings { paths: 400, bounces: Some(BOUNCES), seed: 3 };
    let truth = path_trace(&tracer, view, SIZE, &paths, &|_| ()).mean;
    let options = CompareOptions { trim: 0.001, ..CompareOptions::default() };
    let against = |lights: &LightSet| {
        compare(&truth, &picture(&scene, lights, view), &options).expect("they are alike")
    };
    let followed = against(light.lights());
    let fresh = against(&LightSet::sample_for(&scene, &geometry, &lights, &[*view]).expect("there is light"));
    assert!((followed.energy_ratio - 1.0).abs() < 0.02, "{what}: {followed:?}");
    assert!(followed.rel_mse < 1.6 * fresh.rel_mse, "{what}: {followed:?}, {fresh:?}");
    // Each path waits for its turn, and no longer.
    assert!(waited > 1 && waited < 12, "{what}: {waited}");
    // The control: light as it was.
    let before = against(&start);
    assert!(before.energy_ratio < 0.9 && before.rel_mse > 10.0 * followed.rel_mse, "{what}: {before:?}");
}

#[test]
fn light_of_a_lamp_that_moved() {
    at_rest(lamp_moves(), &look(vec3(1.8, 2.4, 1.8), vec3(-0.4, 0.5, -0.6), 0.8), "lamp");
}

#[test]
fn light_from_behind_a_door_that_opened() {
    at_rest(door_opens(), &look(vec3(-1.8, 2.4, 1.7), vec3(0.1, 0.6, -0.3), 0.8), "door");
}
