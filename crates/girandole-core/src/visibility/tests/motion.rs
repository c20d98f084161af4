//! A database that follows what moves is one from scratch.

use super::random::{random_lights, random_room};
use super::*;
use crate::scene::ObjectId;
use crate::scene::builtin::{self, MovingObject, shapes};
use crate::visibility::state_matrix::StateMatrix;
use crate::visibility::{Counts, Tests};

/// Everything that it says: the states of all nodes, and those that static blockers leave.
pub type Contents = (crate::visibility::Receivers, StateMatrix, StateMatrix);

pub fn contents(database: &VisibilityDatabase) -> Contents {
    (database.receivers().clone(), database.states().clone(), database.assembly.visibility.clone())
}

/// How much there is of everything but tests.
pub fn without_tests(database: &VisibilityDatabase) -> Counts {
    Counts { tests: Tests::default(), ..database.counts() }
}

pub fn dynamic_objects(scene: &Scene) -> Vec<usize> {
    (0..scene.objects.len()).filter(|&i| scene.objects[i].dynamic).collect()
}

/// What happened to a database along a sequence of moves.
#[derive(Debug, Default)]
struct Followed {
    /// How often it followed, and how often the states of all nodes were others then.
    steps: usize,
    changed: usize,
    /// How often it could not follow, by whether objects were made flat.
    anew: [usize; 2],
    /// States of static leaves that became, and that stopped being, full; and those of dynamic leaves.
    covered: usize,
    uncovered: usize,
    on_movers: usize,
    /// How often a mover that stood still would have been elsewhere.
    stale: usize,
}

/// Brings a database up to the scene as it stands and compares it with a new one; `false` where it did not follow.
fn follow(
    scene: &mut Scene,
    samples: &[LightSample],
    database: &mut VisibilityDatabase,
    (flat, seen): (bool, &mut Followed),
) -> bool {
    let changes = scene.take_changes();
    if changes.reopened {
        return false;
    }
    let moved = |object: u32| changes.moved.iter().any(|id| id.index() == object as usize);
    let geometry = Geometry::new(scene);
    let lights = set(&geometry, samples.to_vec());
    let fresh = VisibilityDatabase::build(scene, &geometry, &lights, &VisibilitySettings::default())
        .expect("a database");
    let mut unmoved = database.clone();
    let before = contents(database);
    let of_lights = super::changes(database, &lights);
    if !database.follow(scene, &geometry, (&lights, &of_lights), moved) {
        assert!(contents(database) == before, "it is left as it was");
        seen.anew[usize::from(flat)] += 1;
        return false;
    }
    seen.steps += 1;
    database.belongs_to(&geometry, &lights).expect("it is of this version");
    let after = contents(database);
    assert!(after == contents(&fresh));
    assert_eq!(without_tests(database), without_tests(&fresh));
    assert!(
        contents(&database.redetermined(scene, &geometry, &lights).expect("it is of this scene")) == after
    );
    seen.changed += usize::from(before.1 != after.1);
    // The control: one that is not told what moved.
    assert!(unmoved.follow(scene, &geometry, (&lights, &of_lights), |_| false));
    seen.stale += usize::from(contents(&unmoved) != after);
    let receivers = database.receivers();
    for leaf in 0..receivers.leaves.len() as u32 {
        let node = receivers.leaves[leaf as usize].node as usize;
        for (light, &now) in database.leaf_states(leaf).iter().enumerate() {
            let then = (node < before.0.nodes.len()).then(|| before.1.row(node)[light]);
            if leaf >= database.first_dynamic_leaf() {
                seen.on_movers += usize::from(then != Some(now));
            } else if then != Some(now) {
                seen.covered += usize::from(now == State::Full);
                seen.uncovered += usize::from(then == Some(State::Full));
            }
        }
    }
    true
}

pub fn shift(scene: &mut Scene, object: usize, by: Vec3, rotation: Option<Quat>, scale: Vec3) {
    let node = scene.objects[object].node;
    let Transform::Parts { translation, rotation: before, .. } = scene.nodes[node].local else {
        panic!("they have parts")
    };
    let rotation = rotation.unwrap_or(before);
    let place = Transform::Parts { translation: translation + by, rotation, scale };
    scene.set_transform(node, place).expect("a place");
}

#[test]
fn after_any_moves_it_is_one_from_scratch() {
    let mut seen = Followed::default();
    for seed in 0..60 {
        let mut numbers = Numbers(seed);
        let mut scene = random_room(&mut numbers);
        let movers = dynamic_objects(&scene);
        if movers.is_empty() {
            continue;
        }
        let geometry = Geometry::new(&scene);
        let samples = random_lights(&scene, &geometry, &mut numbers, 24);
        let mut database = build(&scene, &geometry, samples.clone());
        for step in 0..4 {
            // Several at once, sometimes turned and stretched; the last time so far that nothing is left of them.
            for &mover in &movers {
                let scale = if step == 3 { Vec3::X } else { Vec3::ONE + numbers.vector().abs() * 0.5 };
                let by = numbers.vector() * 0.3;
                let rotation = (numbers.unit() >= 0.5).then(|| numbers.rotation());
                shift(&mut scene, mover, by, rotation, scale);
            }
            if !follow(&mut scene, &samples, &mut database, (step == 3, &mut seen)) {
                break;
            }
        }
    }
    // The controls: there was something to follow, and what cannot be followed is not.
    let Followed { steps, changed, stale, anew, .. } = seen;
    assert!(steps > 40 && changed * 2 > steps && stale * 2 > steps, "{seen:?}");
    assert!(anew[0] * 10 < steps && anew[1] > 5, "{seen:?}");
    assert!(seen.covered > 100 && seen.uncovered > 100 && seen.on_movers > 100, "{seen:?}");
}

#[test]
fn after_long_sequences_it_is_one_from_scratch() {
    for seed in 0..3 {
        let mut numbers = Numbers(seed);
        let mut scene = empty_scene();
        add(&mut scene, room(vec3(-2.0, 0.0, -3.0), vec3(2.0, 2.5, 3.0)));
        let mut table = Mesh::default();
        table.add_box(vec3(-0.6, 0.6, -0.4), vec3(0.6, 0.7, 0.4), MaterialId(0));
        add(&mut scene, table);
        // A door, a box, a torus, a cylinder and a two-sided board.
        let mut door = Mesh::default();
        door.add_box(vec3(0.0, 0.0, -0.02), vec3(0.9, 2.0, 0.02), MaterialId(0));
        let mut cube = Mesh::default();
        cube.add_box(Vec3::splat(-0.2), Vec3::splat(0.2), MaterialId(0));
        let board = [vec3(-0.5, -0.5, 0.0), vec3(0.5, -0.5, 0.0), vec3(0.5, 0.5, 0.0), vec3(-0.5, 0.5, 0.0)];
        let meshes = [
            door,
            cube,
            shapes::torus(0.3, 0.1, 14, 9, MaterialId(0)),
            shapes::cylinder(0.2, 0.5, 11, MaterialId(0)),
            polygon(&board, MaterialId(1)),
        ];
        for (i, mesh) in meshes.into_iter().enumerate() {
            let at = vec3(i as f32 * 0.6 - 1.2, 0.9, 1.2 - i as f32 * 0.4);
            let index = scene.add_object("", mesh, Transform::rigid(Quat::IDENTITY, at));
            scene.objects[index].dynamic = true;
        }
        let movers = dynamic_objects(&scene);
        let geometry = Geometry::new(&scene);
        let samples = random_lights(&scene, &geometry, &mut numbers, 40);
        let mut database = build(&scene, &geometry, samples.clone());
        let mut seen = Followed::default();
        for step in 0..30 {
            // The door turns; of the others some move, some rest, and all come back.
            shift(
                &mut scene,
                movers[0],
                Vec3::ZERO,
                Some(Quat::from_rotation_y(step as f32 * 0.2)),
                Vec3::ONE,
            );
            for &mover in &movers[1..] {
                let by = numbers.vector() * 0.2;
                if numbers.unit() < 0.4 {
                    let scale = Vec3::ONE + numbers.vector().abs() * 0.3;
                    let rotation = (numbers.unit() < 0.5).then(|| numbers.rotation());
                    shift(&mut scene, mover, by, rotation, scale);
                    if !follow(&mut scene, &samples, &mut database, (false, &mut seen)) {
                        database = build(&scene, &Geometry::new(&scene), samples.clone());
                    }
                    shift(&mut scene, mover, -by, None, Vec3::ONE);
                }
            }
            if !follow(&mut scene, &samples, &mut database, (false, &mut seen)) {
                database = build(&scene, &Geometry::new(&scene), samples.clone());
            }
        }
        assert!(seen.steps >= 60 && seen.changed * 4 > seen.steps * 3, "{seen:?}");
        assert!(seen.covered > 50 && seen.uncovered > 50 && seen.stale * 4 > seen.steps * 3, "{seen:?}");
    }
}

#[test]
fn receivers_on_what_rests_are_not_tested_again() {
    let mut numbers = Numbers(7);
    let mut scene = empty_scene();
    add(&mut scene, room(vec3(-2.0, 0.0, -3.0), vec3(2.0, 2.5, 3.0)));
    for i in 0..12 {
        // Furniture, so that what stands blocks something.
        let (foot, mut post) = (vec3(i as f32 * 0.3 - 1.8, 0.0, -1.0), Mesh::default());
        post.add_box(foot, foot + vec3(0.1, 2.0, 0.1), MaterialId(0));
        add(&mut scene, post);
        let mut cube = Mesh::default();
        cube.add_box(Vec3::splat(-0.1), Vec3::splat(0.1), MaterialId(0));
        // Boxes, whose receivers may be split otherwise in another place, and meshes.
        let mesh = if i % 2 == 0 { cube } else { shapes::torus(0.1, 0.04, 14, 9, MaterialId(0)) };
        let at = vec3(i as f32 * 0.3 - 1.7, 1.0, numbers.unit());
        let index = scene.add_object("", mesh, Transform::rigid(Quat::IDENTITY, at));
        scene.objects[index].dynamic = true;
    }
    let movers = dynamic_objects(&scene);
    let geometry = Geometry::new(&scene);
    let samples = random_lights(&scene, &geometry, &mut numbers, 30);
    let mut database = build(&scene, &geometry, samples.clone());
    scene.take_changes();
    // The first, one amid the others, the last, and some.
    for some in [&movers[..1], &movers[5..6], &movers[11..], &movers[3..7]] {
        for &mover in some {
            shift(&mut scene, mover, vec3(0.05, 0.02, -0.1), Some(numbers.rotation()), Vec3::ONE);
        }
        let mut seen = Followed::default();
        assert!(follow(&mut scene, &samples, &mut database, (false, &mut seen)));
        assert_eq!((seen.changed, seen.stale), (1, 1), "the controls");
    }
    // The tests that receivers on some of them cost.
    let geometry = Geometry::new(&scene);
    let objects: Vec<u32> = movers.iter().map(|&mover| mover as u32).collect();
    let tests = |some: &[usize]| {
        let mut of_some = database.clone();
        of_some.tests = Tests::default();
        let has_moved: Vec<bool> = (0..scene.objects.len()).map(|object| some.contains(&object)).collect();
        of_some.lay_dynamic(&geometry, &objects, &has_moved);
        assert!(contents(&of_some) == contents(&database));
        of_some.tests.total()
    };
    let each: Vec<u64> = movers.iter().map(|&mover| tests(&[mover])).collect();
    assert!(each.iter().all(|n| *n > 0));
    assert_eq!((tests(&[]), tests(&movers)), (0, each.iter().sum()));
}

#[test]
fn a_mover_that_covers_nothing_blocks_for_a_node_what_it_blocks_for_its_leaves() {
    let scene = builtin::build("pillars", MovingObject::Torus).expect("a room");
    let geometry = Geometry::new(&scene);
    let lights = sampled(&scene, &geometry, 60);
    let database = VisibilityDatabase::build(&scene, &geometry, &lights, &VisibilitySettings::default())
        .expect("a database");
    let nodes = &database.receivers().nodes;
    let (mut blocked, mut lit) = (0, 0);
    for (index, node) in nodes.iter().enumerate().filter(|(_, node)| node.leaf == NONE) {
        for light in 0..lights.len() as u32 {
            let standing = |node: u32| database.assembly.visibility.row(node as usize)[light as usize];
            let by_mover = |node: u32| {
                standing(node) == State::Unoccluded && database.state(node, light) == State::Partial
            };
            match database.state(index as u32, light) {
                State::Unoccluded => {
                    lit += 1;
                    assert!(node.children.iter().all(|c| database.state(*c, light) != State::Partial));
                }
                State::Partial if by_mover(index as u32) => {
                    blocked += 1;
                    assert!(node.children.iter().any(|c| by_mover(*c)));
                }
                _ => {}
            }
        }
    }
    assert!(blocked > 50 && lit > 1000, "{blocked} {lit}");
}

#[test]
fn what_is_hidden_is_seen_by_no_ray() {
    let mut scene = builtin::build("pillars", MovingObject::Torus).expect("a room");
    let torus = scene.objects.iter().position(|o| o.dynamic).expect("it is dynamic");
    let settings = LightSettings { count: 300, walk_dynamic: false, ..LightSettings::default() };
    let lights = LightSet::sample(&scene, &Geometry::new(&scene), &settings).expect("light");
    let (mut hidden, mut rays, mut open) = (0, 0, 0);
    for moment in 0..8 {
        scene.set_time(f64::from(moment)).expect("a moment");
        let geometry = Geometry::new(&scene);
        let lights = set(&geometry, lights.samples().to_vec());
        let database = VisibilityDatabase::build(&scene, &geometry, &lights, &VisibilitySettings::default())
            .expect("a database");
        let tracer = SceneTracer::new(&scene, &geometry);
        let is_static = |triangle: u32, _| geometry.triangles[triangle as usize].object as usize != torus;
        let vertices = geometry.objects[torus].vertices.clone();
        for (light, is_hidden) in lights.samples().iter().zip(database.hidden_from(torus.into())) {
            hidden += usize::from(is_hidden);
            for vertex in vertices.clone().step_by(17) {
                let to = geometry.positions[vertex as usize] - light.position;
                let blocked =
                    tracer.closest_hit_where(light.position, to.normalize(), to.length(), is_static);
                rays += usize::from(is_hidden);
                open += usize::from(!is_hidden && blocked.is_none() && light.normal.dot(to) > 0.0);
                assert!(!is_hidden || blocked.is_some());
            }
        }
        assert!(database.hidden_from(ObjectId(0)).iter().all(|hidden| !hidden), "it stands still");
    }
    // The control: most lights do see it.
    assert!(hidden > 20 && rays > 1000 && open > 20 * rays / hidden, "{hidden} {rays} {open}");
}

#[test]
fn what_turns_away_from_a_light_is_not_hidden_from_it() {
    // A shallow roof, too small to be patches, under a light and open to the floor or to the light.
    let sees = |flipped: bool| {
        let mut scene = empty_scene();
        let floor = [vec3(-5., 0., -5.), vec3(-5., 0., 5.), vec3(5., 0., 5.), vec3(5., 0., -5.)];
        add(&mut scene, polygon(&floor, MaterialId(0)));
        let mut roof = Mesh::default();
        for side in [-0.1, 0.1] {
            let mut corners =
                [vec3(0., 1.02, -0.1), vec3(0., 1.02, 0.1), vec3(side, 1., 0.1), vec3(side, 1., -0.1)];
            if (side > 0.0) == flipped {
                corners.reverse();
            }
            roof.add_polygon(&corners, MaterialId(0));
        }
        let roof = add(&mut scene, roof);
        scene.objects[roof.index()].dynamic = true;
        let geometry = Geometry::new(&scene);
        let above = vec3(0.0, 2.0, 0.0) - geometry.origin.as_vec3();
        let database = build(&scene, &geometry, vec![light(above, Vec3::NEG_Y, Profile::Cosine)]);
        let of_roof = database.first_dynamic_leaf()..database.receivers().leaves.len() as u32;
        let states: Vec<State> = of_roof.map(|leaf| database.leaf_states(leaf)[0]).collect();
        assert_eq!(database.counts().by_state[State::Partial as usize], 1, "the floor");
        (states, database.hidden_from(roof))
    };
    assert_eq!(sees(false), (vec![State::Unoccluded], vec![false]));
    assert_eq!(sees(true), (vec![State::Full], vec![false]));
}
