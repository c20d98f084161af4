//! Scenes in which things move while light samples are held.

use crate::common::{Context, OneView, Test, bending_ball, camera, lamp, room};
use girandole::{FrameStats, MapUpdates, Mode, RenderSettings, RendererOptions};
use girandole_core::glam::{Quat, Vec3};
use girandole_core::illumination::{IlluminationSettings, Rewalk};
use girandole_core::lights::{LightSettings, Pace};
use girandole_core::scene::builtin::{self, MovingObject, shapes};
use girandole_core::scene::{Material, Mesh, Scene, Transform, View};

pub fn tests() -> Vec<Test> {
    vec![
        ("with_held_lights_the_picture_is_that_of_a_fresh_renderer", held_lights),
        ("boxes_that_move_change_only_what_they_block", boxes),
        ("static_objects_that_are_moved_become_dynamic", grabbed),
        ("materials_that_come_later_light_and_reflect", new_materials),
        ("light_that_follows_path_by_path_gives_the_picture_of_its_samples", rewalked),
        ("after_many_frames_the_picture_is_that_of_a_fresh_renderer", many_frames),
        ("what_is_hidden_from_a_light_leaves_its_map_alone", hidden),
        ("with_few_updates_a_frame_maps_are_bounded_and_catch_up", few_updates),
    ]
}

pub const SIZE: [u32; 2] = [64, 48];

/// A renderer that loads geometry and lights as they are, and determines visibility from scratch on the same hierarchy.
fn load_anew(renderer: &mut OneView, scene: &Scene, follower: &OneView) {
    let illumination = follower.illumination().expect("it is open");
    let (geometry, lights) = (illumination.geometry().clone(), illumination.lights().clone());
    let held = illumination.visibility().expect("it was determined");
    let database = held.redetermined(scene, &geometry, &lights).expect("visibility");
    renderer.load(scene, &geometry, &lights).expect("load");
    renderer.load_visibility(scene, &geometry, &lights, database).expect("visibility");
}

/// A full frame after the scene's changes, with what a fresh renderer with the same light set makes of it; and what was counted.
pub fn updated(
    context: &Context,
    [renderer, other]: [&mut OneView; 2],
    (scene, view): (&mut Scene, &View),
    settings: &RenderSettings,
) -> ([Vec<Vec3>; 2], FrameStats) {
    let changes = scene.take_changes();
    renderer.update(scene, &changes).expect("update");
    let after = context.frame(renderer, view, SIZE, settings);
    let stats = context.wait(renderer.stats()).expect("stats");
    load_anew(other, scene, renderer);
    let anew = context.frame(other, view, SIZE, settings);
    ([after.pixels, anew.pixels], stats)
}

pub fn held(count: u32, walk_dynamic: bool) -> IlluminationSettings {
    let lights = LightSettings { count, candidates: 4, walk_dynamic, ..Default::default() };
    IlluminationSettings { lights, rewalk: Rewalk::Off, ..Default::default() }
}

/// What fresh renderers of several sizes of light sets make of boxes that turn, grow, and hide behind each other.
fn boxes(context: &Context) {
    let mut scene = Scene::default();
    let gray = scene.add_material(Material::diffuse("gray", Vec3::splat(0.6)));
    room(&mut scene, Vec3::new(4.0, 3.0, 4.0), gray, None);
    lamp(&mut scene, 0.5, 20.0, Quat::IDENTITY, Vec3::new(0.3, 2.9, 0.2));
    let object = |scene: &mut Scene, name: &str, extent: Vec3, dynamic: bool| {
        let mut mesh = Mesh::default();
        mesh.add_box(-extent, extent, gray);
        scene.add_object(name, mesh, Transform::IDENTITY);
        let object = scene.objects.last_mut().expect("it was added");
        object.dynamic = dynamic;
        object.node
    };
    let stands = object(&mut scene, "shelf", Vec3::new(0.5, 0.05, 0.4), false);
    scene.set_transform(stands, Transform::translation(Vec3::new(-1.0, 1.2, 0.0))).expect("a place");
    let door = object(&mut scene, "door", Vec3::new(0.9, 0.9, 0.04), true);
    let cube = object(&mut scene, "cube", Vec3::splat(0.15), true);
    let ball = bending_ball(&mut scene, gray, Vec3::new(-0.9, 0.3, 1.0));
    camera(&mut scene, Vec3::new(1.8, 1.6, 1.8), Vec3::new(-1.0, 0.8, -1.0), 1.0);
    let place = |scene: &mut Scene, step: usize| {
        let (x, turn) = ([0.9, -0.8, -0.8, 0.0, 0.9][step], [0.0, 0.4, 1.5, 2.6, 0.0][step]);
        let [y, size] = [[1.0, 0.92, 1.5, 0.97, 1.0], [1.0, 1.0, 0.6, 1.05, 1.0]].map(|v: [f32; 5]| v[step]);
        let at = Transform::Parts {
            translation: Vec3::new(x, y, -0.3),
            rotation: Quat::from_rotation_y(turn),
            scale: Vec3::splat(size),
        };
        scene.set_transform(door, at).expect("a place");
        let beside = Vec3::new(x - 0.2, [0.2, 0.5, 2.2, 0.2, 0.2][step], 0.8 - x);
        scene.set_morph_weights(ball, &[[0.0, 1.0, 0.5, 0.7, 0.0][step]]).expect("weights");
        scene.set_transform(cube, Transform::translation(beside)).expect("a place");
    };
    let options = || RendererOptions { map_size: Some(64), ..Default::default() };
    let mut other = context.renderer(options());
    for walk_dynamic in [false, true] {
        place(&mut scene, 0);
        scene.take_changes();
        let mut renderer = context.renderer(options());
        renderer.open(&scene, &held(40, walk_dynamic)).expect("open");
        let (mut pictures, mut changes) = (Vec::new(), Vec::new());
        for step in 0..5 {
            place(&mut scene, step);
            let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
            let full = RenderSettings::default();
            let ([after, anew], stats) =
                updated(context, [&mut renderer, &mut other], (&mut scene, &view), &full);
            changes.push(stats.light_map_changes);
            assert!(after == anew, "step {step}, lights on what moves: {walk_dynamic}");
            pictures.push(after);
        }
        // The control: it moves, and it is back at the end.
        assert!((1..4).all(|i| pictures[i] != pictures[i - 1]) && pictures[4] == pictures[0]);
        // Lights that stay are not summed again; those that move are.
        let again = changes[1..].iter().map(|&n| f64::from(n) / f64::from(changes[0]));
        assert!(again.clone().all(|share| share > 0.0 && (share < 0.4 || walk_dynamic)), "{changes:?}");
    }
}

/// A hand takes hold of something that stood still.
fn grabbed(context: &Context) {
    let mut scene = builtin::build("table", MovingObject::None).expect("a room");
    let options = RendererOptions { map_size: Some(64), ..Default::default() };
    let mut renderer = context.renderer(options);
    renderer.open(&scene, &held(24, false)).expect("open");
    let mut other = context.renderer(options);
    let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
    let leg = scene.objects.iter().position(|o| !o.dynamic && o.name != "room").expect("furniture");
    let mut changes = Vec::new();
    for step in 1..=3 {
        let shift = Transform::translation(Vec3::new(0.1, 0.02, 0.1) * step as f32);
        scene.set_transform(scene.objects[leg].node, shift).expect("a place");
        let full = RenderSettings::default();
        let ([after, anew], stats) =
            updated(context, [&mut renderer, &mut other], (&mut scene, &view), &full);
        changes.push(stats.light_map_changes);
        assert!(after == anew, "step {step}");
    }
    // Once it is known to move, only what it changes is made anew.
    assert!(changes[1..].iter().all(|n| n * 3 < changes[0] * 2), "{changes:?}");
}

/// A material that was not there when the scene was opened, and then an object of it.
fn new_materials(context: &Context) {
    let mut scene = builtin::build("table", MovingObject::Torus).expect("a room");
    let options = RendererOptions { map_size: Some(64), ..Default::default() };
    let (mut renderer, mut other) = (context.renderer(options), context.renderer(options));
    renderer.open(&scene, &held(24, false)).expect("open");
    let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
    let full = RenderSettings::default();
    let mut step = |scene: &mut Scene, seconds: f64| {
        scene.set_time(seconds).expect("a moment");
        let ([after, anew], _) = updated(context, [&mut renderer, &mut other], (scene, &view), &full);
        assert!(after == anew, "{seconds} s");
        after
    };
    step(&mut scene, 0.2);
    let red = scene.add_material(Material::diffuse("red", Vec3::new(0.8, 0.1, 0.1)));
    let before = step(&mut scene, 0.4);
    let mut cube = Mesh::default();
    cube.add_box(Vec3::splat(-0.3), Vec3::splat(0.3), red);
    scene
        .insert_object("cube", cube, Transform::translation(Vec3::new(0.0, 1.6, 0.4)), true)
        .expect("a place");
    let after = step(&mut scene, 0.4);
    let reddened = before.iter().zip(&after).filter(|(b, a)| a.x * b.y > 2.0 * a.y * b.x).count();
    assert!(reddened > 20, "{reddened} pixels show it");
    step(&mut scene, 0.6);
}

/// Samples that come and go as a torus and a lamp move, until they are at rest.
fn rewalked(context: &Context) {
    let mut scene = builtin::build("table", MovingObject::Torus).expect("a room");
    let options = RendererOptions { map_size: Some(64), ..Default::default() };
    let (mut renderer, mut other) = (context.renderer(options), context.renderer(options));
    let lights = LightSettings { count: 40, candidates: 4, ..Default::default() };
    let pace = Pace { paths: 100, fade: 3 };
    let settings = IlluminationSettings { lights, rewalk: Rewalk::Paths(pace), ..Default::default() };
    renderer.open(&scene, &settings).expect("open");
    let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
    let lamp = scene.objects.iter().find(|o| o.name == "light").expect("a lamp").node;
    let full = RenderSettings::default();
    let mut pictures = Vec::new();
    for step in 0..4 {
        scene.set_time(f64::from(step) * 0.2).expect("a moment");
        let mut local = scene.nodes[lamp].local.affine();
        local.translation.x = 0.1 * f64::from(step);
        scene.set_transform(lamp, Transform::Affine(local)).expect("a place");
        let ([after, anew], _) = updated(context, [&mut renderer, &mut other], (&mut scene, &view), &full);
        assert!(after == anew, "step {step}");
        assert!(pictures.last() != Some(&after), "the control");
        pictures.push(after);
    }
    // Updates of no changes bring the light to rest, and then change nothing.
    let is_settled = |renderer: &OneView| renderer.illumination().expect("it is open").is_settled();
    assert!(!is_settled(&renderer));
    for _ in 0..200 {
        let still = scene.take_changes();
        renderer.update(&scene, &still).expect("update");
    }
    assert!(is_settled(&renderer));
    let ([rest, anew], _) = updated(context, [&mut renderer, &mut other], (&mut scene, &view), &full);
    assert!(rest == anew && Some(&rest) != pictures.last());
    let ([still, _], stats) = updated(context, [&mut renderer, &mut other], (&mut scene, &view), &full);
    assert!(still == rest && stats.maps_drawn == 0 && stats.light_map_changes == 0);
}

/// Frames of random motion, of lights that change and of budgets.
fn many_frames(context: &Context) {
    for rewalk in [Rewalk::Off, Rewalk::Paths(Pace { paths: 50, fade: 4 })] {
        many_frames_with(context, rewalk);
    }
}

fn many_frames_with(context: &Context, rewalk: Rewalk) {
    const FRAMES: u32 = 90;
    let mut scene = builtin::build("block", MovingObject::Torus).expect("a room");
    let torus = scene.objects.iter().position(|o| o.dynamic).expect("it is dynamic");
    let lamp = scene.materials.iter().position(|m| m.emits()).expect("a lamp");
    let emission = scene.materials[lamp].emission;
    let gray = scene.add_material(Material::diffuse("gray", Vec3::splat(0.5)));
    let cube = {
        let mut mesh = Mesh::default();
        mesh.add_box(Vec3::splat(-0.2), Vec3::splat(0.2), gray);
        scene.add_object("cube", mesh, Transform::IDENTITY);
        let cube = scene.objects.last_mut().expect("it was added");
        cube.dynamic = true;
        cube.node
    };
    let options = RendererOptions { map_size: Some(32), ..Default::default() };
    let mut renderer = context.renderer(options);
    let settings = IlluminationSettings { rewalk, ..held(30, rewalk != Rewalk::Off) };
    renderer.open(&scene, &settings).expect("open");
    let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
    let random = |frame: u32, what: u32| {
        let bits =
            (frame.wrapping_mul(0x9e37_79b9) ^ what.wrapping_mul(0x85eb_ca6b)).wrapping_mul(0xc2b2_ae35);
        (bits ^ bits >> 15).wrapping_mul(0x27d4_eb2f) as f32 / u32::MAX as f32
    };
    for frame in 0..FRAMES {
        let at = Vec3::new(random(frame, 1) - 0.5, 0.5 + random(frame, 2), random(frame, 3) - 0.5);
        let turn = Quat::from_rotation_y(random(frame, 4) * 6.0);
        let node = if frame % 3 == 0 { cube } else { scene.objects[torus].node };
        scene.set_transform(node, Transform::rigid(turn, at)).expect("a place");
        if frame % 10 == 9 {
            scene.set_emission(lamp.into(), emission * (0.5 + random(frame, 5))).expect("an emission");
        }
        let changes = scene.take_changes();
        renderer.update(&scene, &changes).expect("update");
        let most = [None, Some(4), Some(0)][frame as usize % 3];
        let updates = MapUpdates { most, ..MapUpdates::default() };
        let settings = RenderSettings { updates, ..RenderSettings::default() };
        renderer.render(&view, [32, 24], &settings).expect("render");
        context.wait(renderer.stats()).expect("stats");
    }
    let last = context.frame(&mut renderer, &view, SIZE, &RenderSettings::default());
    let mut other = context.renderer(options);
    load_anew(&mut other, &scene, &renderer);
    let fresh = context.frame(&mut other, &view, SIZE, &RenderSettings::default());
    assert!(last.pixels == fresh.pixels);
    // The control: with maps left stale it is not.
    let node = scene.objects[torus].node;
    scene.set_transform(node, Transform::translation(Vec3::new(0.3, 1.0, 0.6))).expect("a place");
    let changes = scene.take_changes();
    renderer.update(&scene, &changes).expect("update");
    let updates = MapUpdates { most: Some(0), ..MapUpdates::default() };
    let settings = RenderSettings { updates, ..RenderSettings::default() };
    let stale = context.frame(&mut renderer, &view, SIZE, &settings);
    load_anew(&mut other, &scene, &renderer);
    let fresh = context.frame(&mut other, &view, SIZE, &RenderSettings::default());
    assert!(stale.pixels != fresh.pixels);
}

/// A screen between a torus and half of the lights, from behind which it comes out.
fn hidden(context: &Context) {
    let mut scene = Scene::default();
    let gray = scene.add_material(Material::diffuse("gray", Vec3::splat(0.6)));
    room(&mut scene, Vec3::new(6.0, 3.0, 4.0), gray, None);
    for x in [-2.5, 2.0] {
        lamp(&mut scene, 0.4, 20.0, Quat::IDENTITY, Vec3::new(x, 2.9, 0.0));
    }
    let mut screen = Mesh::default();
    screen.add_box(Vec3::new(-0.05, 0.001, -1.9), Vec3::new(0.05, 2.6, 1.9), gray);
    scene.add_object("screen", screen, Transform::IDENTITY);
    scene.add_object(
        "torus",
        shapes::torus(0.2, 0.08, 24, 12, gray),
        Transform::translation(Vec3::new(1.0, 0.6, 0.0)),
    );
    scene.objects.last_mut().expect("it was added").dynamic = true;
    let torus = scene.objects.last().expect("it was added").node;
    camera(&mut scene, Vec3::new(2.8, 1.6, 1.8), Vec3::new(-0.5, 0.6, -0.5), 1.0);
    let options = RendererOptions { map_size: Some(64), ..Default::default() };
    let mut renderer = context.renderer(options);
    renderer.open(&scene, &held(60, false)).expect("open");
    let mut other = context.renderer(options);
    let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
    let mut drawn = Vec::new();
    for place in [
        Vec3::new(1.0, 0.5, 0.3),
        Vec3::new(0.6, 0.4, 0.3),
        Vec3::new(0.3, 2.7, 0.0),
        Vec3::new(-1.0, 0.6, 0.2),
    ] {
        context.frame(&mut renderer, &view, SIZE, &RenderSettings::default());
        scene.set_transform(torus, Transform::translation(place)).expect("a place");
        let full = RenderSettings::default();
        let ([after, anew], stats) =
            updated(context, [&mut renderer, &mut other], (&mut scene, &view), &full);
        drawn.push(stats.maps_drawn);
        assert!(after == anew, "{place}");
    }
    // Behind the screen, and, the control, from there over it.
    assert!(drawn[1] < 45 && drawn[2] > drawn[1] + 8, "{drawn:?}");
}

fn few_updates(context: &Context) {
    let mut scene = builtin::build("pillars", MovingObject::Torus).expect("a room");
    let options = RendererOptions { map_size: Some(64), ..Default::default() };
    let mut renderer = context.renderer(options);
    renderer.open(&scene, &held(40, false)).expect("open");
    let mut other = context.renderer(options);
    let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
    let with = |most, oldest| RenderSettings {
        updates: MapUpdates { most, oldest, ..MapUpdates::default() },
        ..RenderSettings::default()
    };
    let frame = |renderer: &mut OneView, scene: &mut Scene, seconds: Option<f64>, settings| {
        if let Some(seconds) = seconds {
            scene.set_time(seconds).expect("a moment");
            let changes = scene.take_changes();
            renderer.update(scene, &changes).expect("update");
        }
        let picture = context.frame(renderer, &view, SIZE, &settings);
        (picture.pixels, context.wait(renderer.stats()).expect("stats"))
    };
    // Whatever the budget says, no map is shown that was never drawn.
    let (_, stats) = frame(&mut renderer, &mut scene, None, with(Some(0), None));
    assert_eq!((stats.maps_drawn, stats.stale.maps), (40, 0));
    // A budget is kept, and what is left behind grows older.
    for step in 1..=4 {
        let (_, stats) = frame(&mut renderer, &mut scene, Some(f64::from(step) * 0.4), with(Some(5), None));
        assert_eq!(stats.maps_drawn, 5, "step {step}");
        assert!(stats.stale.maps > 20 && stats.stale.oldest == step, "step {step}: {:?}", stats.stale);
    }
    // A bound on their age is kept whatever the budget is.
    for step in 5..10 {
        let (_, stats) =
            frame(&mut renderer, &mut scene, Some(f64::from(step) * 0.4), with(Some(0), Some(2)));
        assert!(stats.stale.oldest <= 2, "step {step}: {:?}", stats.stale);
    }
    // At rest the picture becomes that of a fresh renderer, and not before the last map is drawn.
    load_anew(&mut other, &scene, &renderer);
    let (fresh, _) = frame(&mut other, &mut scene, None, RenderSettings::default());
    let mut rounds = 0;
    loop {
        let (picture, stats) = frame(&mut renderer, &mut scene, None, with(Some(7), None));
        if stats.stale.maps == 0 {
            assert!(picture == fresh);
            break;
        }
        assert!(picture != fresh || rounds > 0);
        rounds += 1;
        assert!(rounds < 6);
    }
    let (still, stats) = frame(&mut renderer, &mut scene, None, RenderSettings::default());
    assert!(still == fresh && stats.maps_drawn == 0 && stats.light_map_changes == 0);
}

fn held_lights(context: &Context) {
    let options = || RendererOptions { map_size: Some(64), ..Default::default() };
    let mut scene = builtin::build("table", MovingObject::Torus).expect("a room");
    let mut renderer = context.renderer(options());
    renderer.open(&scene, &held(24, false)).expect("open");
    let mut other = context.renderer(options());
    let mut pictures = Vec::new();
    for seconds in [0.3, 1.1, 2.9] {
        scene.set_time(seconds).expect("a moment");
        let changes = scene.take_changes();
        renderer.update(&scene, &changes).expect("update");
        load_anew(&mut other, &scene, &renderer);
        let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
        for mode in [Mode::Naive, Mode::Full] {
            let settings = RenderSettings { mode, ..RenderSettings::default() };
            let after = context.frame(&mut renderer, &view, SIZE, &settings);
            let anew = context.frame(&mut other, &view, SIZE, &settings);
            assert!(after.pixels == anew.pixels, "{seconds} s, {mode:?}");
            pictures.push(after.pixels);
        }
    }
    // What is dimmed and coloured needs no map, and the next frame shows it.
    let lamp = scene.materials.iter().position(|m| m.emits()).expect("a lamp");
    for emission in [Vec3::new(2.0, 9.0, 4.0), Vec3::ZERO] {
        scene.set_emission(lamp.into(), emission).expect("an emission");
        let changes = scene.take_changes();
        renderer.update(&scene, &changes).expect("update");
        load_anew(&mut other, &scene, &renderer);
        let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
        for mode in [Mode::Naive, Mode::Full] {
            let settings = RenderSettings { mode, ..RenderSettings::default() };
            let after = context.frame(&mut renderer, &view, SIZE, &settings);
            assert_eq!(context.wait(renderer.stats()).expect("stats").maps_drawn, 0);
            let anew = context.frame(&mut other, &view, SIZE, &settings);
            assert!(after.pixels == anew.pixels, "{emission}, {mode:?}");
            pictures.push(after.pixels);
        }
    }
    assert!(pictures.last().expect("a picture").iter().all(|p| *p == Vec3::ZERO), "all is dark");
    // The control: it moves.
    assert!((2..pictures.len()).all(|i| pictures[i] != pictures[i - 2]));
}
