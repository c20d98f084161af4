//! Shadow maps in a building: drawn only for lights that leave something to what is seen, and kept for the next frame.

use crate::common::{Context, OneView, Stage, Test, camera, lamp, mean};
use crate::selected::flip;
use girandole::{MapUpdates, Mode, RenderSettings, RendererOptions};
use girandole_core::glam::{Quat, Vec3};
use girandole_core::image::Image;
use girandole_core::lights::LightSettings;
use girandole_core::scene::{Material, Mesh, Scene, Transform, View};
use girandole_core::visibility::VisibilityDatabase;
use std::sync::Arc;

pub fn tests() -> Vec<Test> {
    vec![
        ("frames_of_a_walk_are_those_rendered_alone", walk),
        ("maps_that_nobody_needs_change_nothing", needed),
        ("mirrors_need_maps_where_they_are_seen", in_mirrors),
    ]
}

const SIZE: [u32; 2] = [48, 36];
const LIGHTS: u32 = 160;
/// Maps a frame, where they are few.
const FEW: u32 = 4;

/// Six rooms of 4 × 4 m in two rows, with doors between neighbours, a lamp and a table in each.
fn building() -> Scene {
    let mut scene = Scene::default();
    let white = scene.add_material(Material::diffuse("white", Vec3::splat(0.7)));
    let add = |scene: &mut Scene, low: Vec3, high: Vec3| {
        let mut mesh = Mesh::default();
        mesh.add_box(low, high, white);
        scene.add_object("wall", mesh, Transform::IDENTITY);
    };
    let height = 2.6;
    for x in [0, 1, 2, 3] {
        let at = 4.0 * x as f32;
        for row in [0.0, 4.0] {
            // With a door, or without one at the ends.
            let door = if x == 0 || x == 3 { row + 4.0 } else { row + if x == 1 { 0.4 } else { 2.6 } };
            add(&mut scene, Vec3::new(at - 0.05, 0.0, row), Vec3::new(at + 0.05, height, door));
            if door < row + 4.0 {
                add(
                    &mut scene,
                    Vec3::new(at - 0.05, 0.0, door + 0.9),
                    Vec3::new(at + 0.05, height, row + 4.0),
                );
                add(&mut scene, Vec3::new(at - 0.05, 2.0, door), Vec3::new(at + 0.05, height, door + 0.9));
            }
        }
    }
    for (row, at) in [(0, 0.0), (1, 4.0), (2, 8.0)] {
        for column in 0..3 {
            let from = 4.0 * column as f32;
            let door = if row == 1 && column != 1 { from + 2.8 } else { from + 4.0 };
            add(&mut scene, Vec3::new(from, 0.0, at - 0.05), Vec3::new(door, height, at + 0.05));
            if door < from + 4.0 {
                add(&mut scene, Vec3::new(door, 2.0, at - 0.05), Vec3::new(from + 4.0, height, at + 0.05));
            }
        }
    }
    for (x, z) in [(2.0, 2.0), (6.0, 2.0), (10.0, 2.0), (2.0, 6.0), (6.0, 6.0), (10.0, 6.0)] {
        let (low, high) = (Vec3::new(x - 2.0, 0.0, z - 2.0), Vec3::new(x + 2.0, 0.0, z + 2.0));
        add(&mut scene, low - Vec3::Y * 0.1, high);
        add(&mut scene, low + Vec3::Y * height, high + Vec3::Y * (height + 0.1));
        lamp(&mut scene, 0.5, 20.0, Quat::IDENTITY, Vec3::new(x, 2.5, z));
        add(&mut scene, Vec3::new(x - 0.8, 0.0, z + 0.6), Vec3::new(x, 0.8, z + 1.2));
    }
    camera(&mut scene, Vec3::new(0.6, 1.6, 0.6), Vec3::new(3.0, 1.0, 3.0), 1.2);
    scene
}

/// From a place towards another one.
fn view_of(stage: &Stage, eye: [f32; 2], to: [f32; 2]) -> View {
    let mut scene = stage.scene.clone();
    scene.cameras.clear();
    camera(&mut scene, Vec3::new(eye[0], 1.6, eye[1]), Vec3::new(to[0], 1.2, to[1]), 1.2);
    View::new(&scene, &scene.cameras[0], SIZE[0] as f32 / SIZE[1] as f32)
}

/// Views from one room into the next, and a cut or two.
fn views(stage: &Stage) -> Vec<View> {
    let of = |eye, to| view_of(stage, eye, to);
    let walk = (0..4).map(|i| 1.0 + 1.6 * i as f32).map(|x| of([x, 0.8], [x + 2.0, 1.2]));
    walk.chain([
        of([7.0, 3.0], [4.0, 2.0]),
        of([10.0, 7.0], [9.0, 4.5]),
        of([1.0, 7.0], [3.5, 4.0]),
        of([1.0, 0.8], [3.0, 1.2]),
    ])
    .collect()
}

fn load(renderer: &mut OneView, stage: &Stage, database: &Arc<VisibilityDatabase>) {
    renderer.load(&stage.scene, &stage.geometry, &stage.lights).expect("load");
    let (scene, geometry, lights) = (&stage.scene, &stage.geometry, &stage.lights);
    renderer.load_visibility(scene, geometry, lights, database.clone()).expect("visibility");
}

fn stage() -> (Stage, Arc<VisibilityDatabase>) {
    let stage = Stage::new(building(), &LightSettings { count: LIGHTS, ..LightSettings::default() });
    let database = Arc::new(stage.visibility());
    (stage, database)
}

fn walk(context: &Context) {
    let (stage, database) = stage();
    // Maps of several sizes, and little room for them.
    let options = RendererOptions { memory_mib: 8, ..RendererOptions::default() };
    let [mut following, mut sparing, mut alone] = [0; 3].map(|_| context.renderer(options));
    load(&mut following, &stage, &database);
    load(&mut sparing, &stage, &database);
    let all = RenderSettings::default();
    let few = RenderSettings { updates: MapUpdates { most: Some(FEW), ..MapUpdates::default() }, ..all };
    let frame = |renderer: &mut OneView, view: &View, settings: &RenderSettings| -> (Image, u32) {
        let picture = context.frame(renderer, view, SIZE, settings);
        (picture, context.wait(renderer.stats()).expect("stats").maps_drawn)
    };
    let (mut drawn, mut drawn_alone, mut incomplete) = (0, 0, 0);
    for (index, view) in views(&stage).iter().enumerate() {
        load(&mut alone, &stage, &database);
        let (fresh, of_fresh) = frame(&mut alone, view, &all);
        let (now, of_now) = frame(&mut following, view, &all);
        assert!(mean(&fresh) > 0.01 && now == fresh, "view {index}");
        let (still, of_still) = frame(&mut following, view, &all);
        assert!(still == fresh && of_still == 0, "view {index}: {of_still} at rest");
        // Within the budget, soon the same.
        let mut repeated = 0;
        loop {
            let (picture, of_few) = frame(&mut sparing, view, &few);
            assert!(of_few <= FEW || index == 0, "view {index}: {of_few}");
            if picture == fresh && sparing.stale().maps == 0 {
                break;
            }
            // What has no map yet is dark, and does not leak.
            assert!(mean(&picture) <= mean(&fresh) * 1.001, "view {index}");
            incomplete += 1;
            repeated += 1;
            assert!(repeated < 8, "view {index} is not complete: {:?}", sparing.stale());
        }
        (drawn, drawn_alone) = (drawn + of_now, drawn_alone + of_fresh);
    }
    // The controls: a good part of all lights is of no use to a view, some maps are kept, and the budget was too small sometimes.
    let all = LIGHTS * views(&stage).len() as u32;
    assert!(5 * drawn_alone < 4 * all && drawn < drawn_alone, "{drawn} {drawn_alone} of {all}");
    assert!(incomplete > 2, "{incomplete}");
}

/// Against every light at every pixel, with all maps.
fn needed(context: &Context) {
    let (stage, database) = stage();
    let options = RendererOptions { map_size: Some(128), ..RendererOptions::default() };
    let [mut selected, mut naive] = [0; 2].map(|_| context.renderer(options));
    load(&mut selected, &stage, &database);
    naive.load(&stage.scene, &stage.geometry, &stage.lights).expect("load");
    let mut different = 0;
    for (index, view) in views(&stage).iter().enumerate() {
        let settings = |mode| RenderSettings { mode, ..RenderSettings::default() };
        let reference = context.frame(&mut naive, view, SIZE, &settings(Mode::Naive));
        let picture = context.frame(&mut selected, view, SIZE, &settings(Mode::Visibility));
        let energy = mean(&picture) / mean(&reference);
        let flip = flip(&reference, &picture);
        println!("view {index}: energy {energy:.4}, FLIP {flip:.4}");
        assert!((energy - 1.0).abs() < 0.01 && flip < 0.02, "view {index}: {energy} {flip}");
        different += u32::from(picture != reference);
    }
    assert!(different > 0, "maps err somewhere");
}

/// A mirror on the wall of the first room: it shows what is behind the camera; from another room nobody needs that.
fn in_mirrors(context: &Context) {
    let mut scene = building();
    let metal = Material { metallic: 1.0, roughness: 0.0, ..Material::diffuse("mirror", Vec3::splat(0.9)) };
    let metal = scene.add_material(metal);
    let mut quad = Mesh::default();
    let corner = |z: f32, y: f32| Vec3::new(0.06, y, z);
    quad.add_polygon(&[corner(3.6, 0.4), corner(0.4, 0.4), corner(0.4, 2.2), corner(3.6, 2.2)], metal);
    scene.add_object("mirror", quad, Transform::IDENTITY);
    let stage = Stage::new(scene, &LightSettings { count: LIGHTS, ..LightSettings::default() });
    let database = Arc::new(stage.visibility());
    let mut renderer = context.renderer(RendererOptions::default());
    let mut frame = |eye: [f32; 2], to: [f32; 2], settings: &RenderSettings| {
        let view = view_of(&stage, eye, to);
        load(&mut renderer, &stage, &database);
        let picture = context.frame(&mut renderer, &view, SIZE, settings);
        (picture, context.wait(renderer.stats()).expect("stats").maps_drawn)
    };
    let with = RenderSettings { mode: Mode::Visibility, ..RenderSettings::default() };
    let without = RenderSettings { mirrors: 0, ..with };
    let naive = RenderSettings { mode: Mode::Naive, ..with };
    // At the mirror, from the first room.
    let (eye, to) = ([2.5, 2.0], [0.0, 2.2]);
    let ((picture, seen), (_, plain)) = (frame(eye, to, &with), frame(eye, to, &without));
    assert!(seen > plain, "{seen} maps, {plain} without mirrors");
    assert!(flip(&frame(eye, to, &naive).0, &picture) < 0.01);
    // From the last room away from it: the same maps, fewer than there are lights.
    let (eye, to) = ([10.0, 7.0], [11.5, 5.0]);
    let ((away, of_away), (same, of_same)) = (frame(eye, to, &with), frame(eye, to, &without));
    assert!(away == same && of_away == of_same && of_away < LIGHTS, "{of_away} maps, {of_same}");
}
