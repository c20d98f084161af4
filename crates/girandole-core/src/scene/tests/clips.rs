//! Which animations play.

use super::*;

/// Moves a node along this axis by a metre in a second.
fn moving(name: &str, node: NodeId, axis: Vec3) -> Animation {
    let keyframes = Keyframes::Translation(vec![Vec3::ZERO, axis]);
    let channel = Channel { node, times: vec![0.0, 1.0], keyframes, interpolation: Interpolation::Linear };
    Animation { name: name.into(), channels: vec![channel] }
}

/// Two cubes, and four animations: of the first in two ways, of the second, and of both.
fn cubes() -> (Scene, [NodeId; 2]) {
    let mut scene = room();
    let nodes = [scene.objects[1].node, scene.add_node("other", Transform::translation(Vec3::Z))];
    let mesh = scene.objects[1].mesh;
    let other = Object { node: nodes[1], mesh, ..scene.objects[1].clone() };
    scene.objects.push(other);
    scene.animations = vec![moving("walk", nodes[0], Vec3::X), moving("", nodes[0], Vec3::NEG_X)];
    scene.animations.push(moving("door", nodes[1], Vec3::Y));
    let both = nodes.map(|node| moving("", node, Vec3::Z).channels.remove(0));
    scene.animations.push(Animation { name: "run".into(), channels: both.to_vec() });
    scene.animations[3].channels[1].times[1] = 3.0;
    (scene, nodes)
}

fn places(scene: &Scene, nodes: [NodeId; 2]) -> [Vec3; 2] {
    nodes.map(|node| scene.world_from_node(node).translation.as_vec3())
}

#[test]
fn what_drives_other_things_plays_with_the_first() {
    let (mut scene, nodes) = cubes();
    assert_eq!((scene.playing_clips(), scene.clip(), scene.duration()), (vec![0, 2], None, 1.0));
    scene.set_time(1.0).unwrap();
    assert_eq!(places(&scene, nodes), [Vec3::X, Vec3::Y]);
}

#[test]
fn a_chosen_one_plays_alone() {
    let (mut scene, nodes) = cubes();
    let rest = places(&scene, nodes);
    scene.set_time(1.0).unwrap();
    for (clip, expected) in [(1, [Vec3::NEG_X, rest[1]]), (2, [rest[0], Vec3::Y]), (0, [Vec3::X, rest[1]])] {
        scene.choose_clip(Some(clip)).unwrap();
        assert_eq!(places(&scene, nodes), rest, "what no longer plays rests");
        scene.set_time(1.0).unwrap();
        assert_eq!((places(&scene, nodes), scene.playing_clips()), (expected, vec![clip]));
    }
    scene.choose_clip(Some(3)).unwrap();
    assert_eq!(scene.duration(), 3.0);
    scene.choose_clip(None).unwrap();
    scene.set_time(1.0).unwrap();
    assert_eq!(places(&scene, nodes), [Vec3::X, Vec3::Y]);
    let sentence = scene.choose_clip(Some(4)).unwrap_err().to_string();
    assert!(sentence.contains("no animation 4; the scene has 4"), "{sentence}");
    // However it came there, it is the same scene, in the same frame.
    let (mut other, _) = cubes();
    other.choose_clip(Some(3)).unwrap();
    other.set_time(2.0).unwrap();
    scene.choose_clip(Some(3)).unwrap();
    scene.set_time(2.0).unwrap();
    assert_eq!(places(&scene, nodes), places(&other, nodes));
    assert_eq!(scene.frame_of_reference(), other.frame_of_reference());
}

#[test]
fn names_come_before_numbers() {
    let (mut scene, _) = cubes();
    assert_eq!(["run", "1", "door", "0"].map(|name| scene.find_clip(name).unwrap()), [3, 1, 2, 0]);
    scene.animations[2].name = "0".into();
    assert_eq!(scene.find_clip("0").unwrap(), 2);
    let sentence = scene.find_clip("swim").unwrap_err().to_string();
    assert!(sentence.contains("`swim`") && sentence.contains("0 (walk), 1 (), 2 (0), 3 (run)"), "{sentence}");
}
