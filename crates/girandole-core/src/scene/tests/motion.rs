//! Motion by animations.

use super::*;
use crate::scene::builtin::{self, MovingObject};
use crate::scene::{Animation, Channel, Interpolation, Keyframes};
use crate::trace::SceneTracer;
use glam::Quat;
use std::f32::consts::FRAC_PI_2;

/// A room with a box in it whose node these channels drive.
fn animated(channels: &[(&[f32], Keyframes, Interpolation)]) -> (Scene, NodeId) {
    let mut scene = room();
    let node = scene.objects[1].node;
    let channels = channels.iter().map(|(times, keyframes, interpolation)| Channel {
        node,
        times: times.to_vec(),
        keyframes: keyframes.clone(),
        interpolation: *interpolation,
    });
    scene.animations.push(Animation { name: "test".into(), channels: channels.collect() });
    (scene, node)
}

fn at(scene: &mut Scene, node: NodeId, seconds: f64) -> (Vec3, Quat, Vec3) {
    scene.set_time(seconds).expect("a moment");
    match scene.nodes[node].local {
        Transform::Parts { translation, rotation, scale } => (translation, rotation, scale),
        Transform::Affine(_) => panic!("an animated node has parts"),
    }
}

#[test]
fn keys_are_interpolated_as_the_format_says() {
    use Interpolation::{CubicSpline, Linear, Step};
    let times = [1.0, 2.0, 4.0];
    // A polynomial of the third degree, by its values and slopes.
    let (value, slope) = (|t: f32| t * t * t - 3.0 * t, |t: f32| 3.0 * t * t - 3.0);
    let vector = |x: f32| vec3(x, 0.5 * x, 1.0);
    let spline = times.iter().flat_map(|&t| {
        let tangent = vec3(slope(t), 0.5 * slope(t), 0.0);
        [tangent, vector(value(t)), tangent]
    });
    let turns = [0.0, FRAC_PI_2, 0.0].map(Quat::from_rotation_y);
    let turns = vec![turns[0], -turns[1], turns[2]];
    let scales: Vec<Vec3> = [1.0, 2.0, 3.0].map(Vec3::splat).to_vec();
    let (mut scene, node) = animated(&[
        (&times, Keyframes::Translation(spline.collect()), CubicSpline),
        (&times, Keyframes::Rotation(turns), Linear),
        (&times, Keyframes::Scale(scales.clone()), Step),
    ]);
    for t in [1.0, 1.25, 1.9, 2.0, 2.7, 3.99] {
        let (translation, rotation, scale) = at(&mut scene, node, t);
        let t = t as f32;
        assert!(translation.distance(vector(value(t))) < 1e-4, "{t}: {translation}");
        let angle = FRAC_PI_2 * if t < 2.0 { t - 1.0 } else { (4.0 - t) * 0.5 };
        // By the shorter arc, though one key is the other quaternion of its rotation.
        assert!(rotation.angle_between(Quat::from_rotation_y(angle)) < 1e-3, "{t}: {rotation}");
        assert_eq!(scale, Vec3::splat(if t < 2.0 { 1.0 } else { 2.0 }), "{t}");
    }
    // Held before the first key, repeated after the last.
    assert_eq!(at(&mut scene, node, 0.0).0, vector(value(1.0)));
    assert_eq!(at(&mut scene, node, 4.0).2, Vec3::splat(3.0));
    assert_eq!(at(&mut scene, node, 4.0 + 2.7), at(&mut scene, node, 2.7));
    assert_ne!(at(&mut scene, node, 4.0 + 2.7).0, at(&mut scene, node, 4.0).0);
    // Straight lines.
    let line = vec![Vec3::ZERO, vec3(1.0, 2.0, 3.0), Vec3::ZERO];
    let (mut scene, node) = animated(&[(&times, Keyframes::Translation(line), Linear)]);
    assert_eq!(at(&mut scene, node, 1.25).0, vec3(0.25, 0.5, 0.75));
    assert_eq!(at(&mut scene, node, 3.0).0, vec3(0.5, 1.0, 1.5));
}

#[test]
fn what_moves_is_written_down_and_nothing_else() {
    let mut scene = builtin::build("table", MovingObject::Torus).expect("a built-in scene");
    let mover = scene.objects.len() - 1;
    assert_eq!(scene.duration(), 8.0);
    let first = scene.generation();
    scene.set_time(0.0).expect("a moment");
    assert_eq!(scene.generation(), first, "it starts where it stands, to the bit");
    scene.set_time(1.5).expect("a moment");
    let changes = scene.take_changes();
    assert_eq!(changes.moved, vec![mover.into()]);
    assert!(!changes.reopened && !changes.everything && changes.from == first);
    let middle = scene.nodes[scene.objects[mover].node].local;
    scene.set_time(8.0).expect("a moment");
    let fresh = builtin::build("table", MovingObject::Torus).expect("a built-in scene");
    assert_eq!(scene.nodes[scene.objects[mover].node].local, fresh.nodes[scene.objects[mover].node].local);
    scene.set_time(9.5).expect("a moment");
    assert_eq!(scene.nodes[scene.objects[mover].node].local, middle);
    for wrong in [f64::NAN, f64::INFINITY] {
        assert!(scene.set_time(wrong).expect_err("no moment").to_string().contains("seconds"));
    }
    assert_eq!(scene.nodes[scene.objects[mover].node].local, middle);
    // A scene without animations stays as it is.
    let mut still = builtin::build("table", MovingObject::None).expect("a built-in scene");
    let before = still.generation();
    still.set_time(3.0).expect("a moment");
    assert!(still.duration() == 0.0 && still.generation() == before);
}

#[test]
fn frames_have_room_for_where_animations_lead() {
    let far = vec![Vec3::ZERO, vec3(0.0, 9.0, 0.0), Vec3::ZERO];
    let (mut scene, node) =
        animated(&[(&[0.0, 1.0, 2.0], Keyframes::Translation(far), Interpolation::Linear)]);
    scene.objects[1].dynamic = true;
    let scale = FrameOfReference::of(&scene).scale;
    for i in 0..=40 {
        scene.set_time(f64::from(i) * 0.05).expect("a moment");
        assert!(!scene.take_changes().reopened, "{i}");
        let geometry = Geometry::new(&scene);
        assert!(geometry.positions.iter().all(|p| p.cmple(geometry.bounds.1).all()), "{i}");
        assert_eq!(geometry.diagonal(), scale);
    }
    // The control: nobody said that it would get there.
    let mut unannounced = room();
    unannounced.objects[1].dynamic = true;
    unannounced.set_transform(node, Transform::translation(vec3(0.0, 9.0, 0.0))).expect("a place");
    assert!(unannounced.take_changes().reopened);
}

#[test]
fn what_moves_together_leaves_no_bounds_on_the_way() {
    // A parent that moves away, and its child by as much the other way.
    let away = |sign: f32| Keyframes::Translation(vec![Vec3::ZERO, vec3(0.0, 9.0 * sign, 0.0)]);
    let (mut scene, child) = animated(&[(&[0.0, 1.0], away(-1.0), Interpolation::Step)]);
    let parent = scene.add_node("parent", Transform::IDENTITY);
    // Parents come first.
    scene.nodes.swap(child.index(), parent.index());
    scene.objects[1].node = parent;
    scene.nodes[parent].parent = Some(child);
    scene.animations[0].channels[0].node = parent;
    let channel = Channel { node: child, keyframes: away(1.0), ..scene.animations[0].channels[0].clone() };
    scene.animations[0].channels.push(channel);
    scene.open();
    let mut one_by_one = scene.clone();
    scene.set_time(1.0).expect("a moment");
    assert!(!scene.take_changes().reopened);
    // The control.
    for node in [child, parent] {
        one_by_one.set_transform(node, scene.nodes[node].local).expect("a place");
    }
    assert!(one_by_one.take_changes().reopened);
}

#[test]
fn built_in_paths_run_into_nothing() {
    for name in builtin::NAMES {
        for object in [MovingObject::Torus, MovingObject::Teapot, MovingObject::Balloon] {
            let mut scene = builtin::build(name, object).expect("a built-in scene");
            for step in 0..=40 {
                scene.set_time(0.2 * f64::from(step)).expect("a moment");
                let geometry = Geometry::new(&scene);
                let tracer = SceneTracer::new(&scene, &geometry);
                let own = geometry.objects.last().expect("the mover").triangles.clone();
                let crosses = |shift: Vec3| {
                    own.clone().any(|triangle| {
                        let [a, b, _] = geometry.corners(triangle).map(|p| p + shift);
                        let edge = b - a;
                        let is_other = |t: u32, _| !own.contains(&t);
                        let length = edge.length();
                        length > 0.0 && tracer.closest_hit_where(a, edge / length, length, is_other).is_some()
                    })
                };
                assert!(!crosses(Vec3::ZERO), "{name} at {step}");
                let (low, high) = geometry.bounds;
                let inside = |p: &Vec3| p.cmpge(low).all() && p.cmple(high).all();
                assert!(geometry.positions.iter().all(inside), "{name} at {step}");
                // The control: a little lower it is in what it stands on.
                assert!(step > 0 || crosses(Vec3::NEG_Y * 0.05), "{name}");
            }
        }
    }
}
