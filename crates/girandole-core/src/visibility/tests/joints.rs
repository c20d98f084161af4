//! Joints of walls and floors, against rays that pass close to them.

use super::*;

/// A floor with a wall across it, so wide, which stands on the floor or a gap above it; turned and moved.
fn floor_and_wall([gap, width]: [f32; 2], (turn, to): (Quat, Vec3)) -> Scene {
    let mut scene = empty_scene();
    let at = |x: f32, y: f32, z: f32| vec3(x, y, z);
    let floor = [at(-4., 0., -2.5), at(-4., 0., 2.5), at(4., 0., 2.5), at(4., 0., -2.5)];
    let side = 0.5 * width;
    let wall = [at(0.3, gap, -side), at(0.3, gap, side), at(0.3, 2.6, side), at(0.3, 2.6, -side)];
    for corners in [floor, wall] {
        scene.add_object("", polygon(&corners, MaterialId(1)), Transform::rigid(turn, to));
    }
    scene
}

#[test]
fn where_a_wall_stands_between_a_light_and_a_floor_the_leaf_has_a_joint() {
    let mut numbers = Numbers(7);
    let [mut hidden, mut free] = [0; 2];
    for room in 0..20 {
        let is_moved = room % 2 == 1;
        let (turn, to) = match is_moved {
            true => (numbers.rotation(), numbers.vector() * 9.0),
            false => (Quat::IDENTITY, Vec3::ZERO),
        };
        for shape in [[0.0, 5.0], [0.05, 5.0], [0.0, 0.02]] {
            let scene = floor_and_wall(shape, (turn, to));
            let geometry = Geometry::new(&scene);
            let to = to - geometry.origin.as_vec3();
            let point = |p: Vec3| turn * p + to;
            let of_light = |at: Vec3| light(point(at), turn * Vec3::NEG_Y, Profile::Cosine);
            let lights: Vec<LightSample> = (0..20)
                .map(|_| {
                    of_light(vec3(
                        8.0 * numbers.unit() - 4.0,
                        0.5 + 2.0 * numbers.unit(),
                        4.0 * numbers.unit() - 2.0,
                    ))
                })
                .collect();
            let database = build(&scene, &geometry, lights.clone());
            for _ in 0..200 {
                let x = 0.3 + 0.02 * (numbers.unit() - 0.5);
                let position = point(vec3(x, 0.0, 4.8 * numbers.unit() - 2.4));
                let Some(leaf) = (0..2).find_map(|t| database.receivers().leaf_at(t, position, true)) else {
                    continue;
                };
                let joints = database.joints(leaf);
                for (light, state) in lights.iter().zip(database.leaf_states(leaf)) {
                    let local = turn.inverse() * (light.position - to);
                    let is_behind = (local.x < 0.3) != (x < 0.3);
                    let is_marked = joints.iter().any(|joint| joint.is_between(light));
                    let is_joint = shape == [0.0, 5.0];
                    if is_joint && is_behind && *state == State::Partial {
                        assert!(is_marked, "{room}: {joints:?} {local} {x}");
                        hidden += 1;
                    }
                    if !is_joint {
                        assert!(!is_marked, "{joints:?}");
                        free += 1;
                    }
                }
            }
        }
    }
    assert!(hidden > 1000 && free > 1000, "{hidden} {free}");
}
