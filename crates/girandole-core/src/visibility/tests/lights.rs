//! A database follows lights that change on the hierarchy that it has.

use super::motion::{Contents, contents, dynamic_objects, shift, without_tests};
use super::random::{random_lights, random_room};
use super::*;
use crate::scene::builtin::{self, MovingObject};

/// What happened along a sequence of changes.
#[derive(Debug, Default)]
struct Followed {
    /// How often lights changed, objects moved, and both.
    steps: [usize; 3],
    /// How often a database that was not told of the lights would say something else.
    stale: usize,
    /// How often lights that came back had the states that they had.
    back: usize,
    rays: [usize; 3],
    wrong_if_swapped: usize,
}

/// Brings a database up to date, and checks it against one from scratch on the same hierarchy.
fn follow(
    scene: &Scene,
    samples: &[LightSample],
    database: &mut VisibilityDatabase,
    moved: &[usize],
) -> Option<Contents> {
    let geometry = Geometry::new(scene);
    let lights = set(&geometry, samples.to_vec());
    let hierarchy = database.receivers().clone();
    let changes = changes(database, &lights);
    let has_moved = |object: u32| moved.contains(&(object as usize));
    if !database.follow(scene, &geometry, (&lights, &changes), has_moved) {
        return None;
    }
    database.belongs_to(&geometry, &lights).expect("it is of this version");
    let still = database.first_dynamic_leaf() as usize;
    assert!(database.receivers().leaves[..still] == hierarchy.leaves[..still]);
    assert!(!moved.is_empty() || *database.receivers() == hierarchy, "receivers are held");
    let scratch = database.redetermined(scene, &geometry, &lights).expect("it is of this scene");
    let after = contents(database);
    assert!(after == contents(&scratch));
    assert_eq!(without_tests(database), without_tests(&scratch));
    for leaf in 0..database.receivers().leaves.len() as u32 {
        assert_eq!(database.leaf_states(leaf), scratch.leaf_states(leaf));
        assert_eq!(database.standing_states(leaf), scratch.standing_states(leaf));
    }
    Some(after)
}

/// Some lights elsewhere: near where they were, or anywhere, outside the room too.
fn change(samples: &mut [LightSample], others: &[LightSample], numbers: &mut Numbers) {
    let count = 1 + numbers.below(4);
    for _ in 0..count {
        let index = numbers.below(samples.len());
        if numbers.unit() < 0.4 {
            samples[index].position += numbers.vector() * 0.2;
        } else {
            samples[index] = others[numbers.below(others.len())];
        }
    }
}

#[test]
fn after_any_changes_of_lights_it_is_one_from_scratch() {
    let mut seen = Followed::default();
    for seed in 100..112 {
        let mut numbers = Numbers(seed);
        let mut scene = random_room(&mut numbers);
        scene.take_changes();
        let movers = dynamic_objects(&scene);
        let geometry = Geometry::new(&scene);
        let first = random_lights(&scene, &geometry, &mut numbers, 16);
        let mut others = random_lights(&scene, &geometry, &mut numbers, 48);
        for sample in others.iter_mut().step_by(6) {
            sample.position *= 1.6;
        }
        let mut samples = first.clone();
        let mut database = build(&scene, &geometry, samples.clone());
        let before_all = contents(&database);
        for step in 0..32 {
            // Lights, objects, both, and now and then nothing.
            let kind = numbers.below(3);
            let mut moved = Vec::new();
            if kind != 1 || movers.is_empty() {
                change(&mut samples, &others, &mut numbers);
            }
            if kind != 0 {
                moved.extend(movers.iter().copied().filter(|_| numbers.unit() < 0.6));
            }
            let mut unchanged = database.clone();
            for &mover in &moved {
                let rotation = (numbers.unit() < 0.5).then(|| numbers.rotation());
                shift(&mut scene, mover, numbers.vector() * 0.1, rotation, Vec3::ONE);
            }
            if scene.take_changes().reopened {
                break;
            }
            let Some(after) = follow(&scene, &samples, &mut database, &moved) else { break };
            seen.steps[kind] += 1;
            // The control: one that believes that the lights are where they were.
            let geometry = Geometry::new(&scene);
            let lights = set(&geometry, samples.clone());
            let none = LightChanges::default();
            let has_moved = |object: u32| moved.contains(&(object as usize));
            assert!(unchanged.follow(&scene, &geometry, (&lights, &none), has_moved));
            seen.stale += usize::from(contents(&unchanged) != after);
            if step % 8 == 0 {
                let verdict = verify(&scene, &geometry, &samples, &database, 150, &mut numbers);
                assert_eq!(verdict.wrong, 0, "{verdict:?}");
                seen.wrong_if_swapped += verdict.wrong_if_swapped;
                (0..3).for_each(|i| seen.rays[i] += verdict.rays[i]);
            }
        }
        // All lights go back.
        if movers.is_empty() {
            let after = follow(&scene, &first, &mut database, &[]).expect("nothing came or went");
            assert!(after == before_all);
            seen.back += 1;
        }
    }
    println!("{seen:?}");
    assert!(seen.steps.iter().all(|n| *n > 60) && seen.stale > 100 && seen.back > 0, "{seen:?}");
    assert!(seen.rays.iter().all(|n| *n > 1000) && seen.wrong_if_swapped > 1000, "{seen:?}");
}

#[test]
fn only_lights_that_changed_are_tested() {
    let scene = builtin::build("table", MovingObject::Torus).expect("it is built in");
    let geometry = Geometry::new(&scene);
    let before = sampled(&scene, &geometry, 100).samples().to_vec();
    let database = build(&scene, &geometry, before.clone());
    let whole = database.counts().tests.total();
    let tests = |changed: &[usize]| {
        let mut samples = before.clone();
        for &light in changed {
            let along = samples[light].normal;
            samples[light].position += along * 0.05;
        }
        let mut database = database.clone();
        follow(&scene, &samples, &mut database, &[]).expect("nothing came or went");
        (contents(&database), database.counts().tests.total())
    };
    assert_eq!(tests(&[]).1, 0, "brightness alone costs nothing");
    let (one, cost) = tests(&[40]);
    assert!(cost > 0 && cost * 30 < whole, "{cost} of {whole}");
    // Columns that did not change are as they were; the one that did is not.
    let column = |all: &Contents, light: usize| -> Vec<State> {
        (0..all.0.nodes.len()).map(|node| all.1.row(node)[light]).collect()
    };
    let was = contents(&database);
    assert!((0..100).all(|light| (column(&one, light) == column(&was, light)) == (light != 40)));
    // Tests are as many as those of the lights by themselves.
    let alone: u64 = [10, 40, 70].map(|light| tests(&[light]).1).iter().sum();
    assert_eq!(tests(&[10, 40, 70]).1, alone);
}

#[test]
fn what_cannot_be_held_is_not_followed() {
    let scene = builtin::build("gap", MovingObject::Torus).expect("it is built in");
    let geometry = Geometry::new(&scene);
    let lights = sampled(&scene, &geometry, 12);
    let mut database = build(&scene, &geometry, lights.samples().to_vec());
    let before = contents(&database);
    let fewer = set(&geometry, lights.samples()[1..].to_vec());
    let changes = changes(&database, &fewer);
    assert!(!database.follow(&scene, &geometry, (&fewer, &changes), |_| false));
    assert!(contents(&database) == before);
    database.redetermined(&scene, &geometry, &fewer).expect_err("these are other lights");
    // Nor is a version that the database was not told of.
    let mut later = scene.clone();
    let torus = dynamic_objects(&later)[0];
    shift(&mut later, torus, Vec3::X * 0.1, None, Vec3::ONE);
    let geometry = Geometry::new(&later);
    let lights = set(&geometry, lights.samples().to_vec());
    database.redetermined(&later, &geometry, &lights).expect_err("it is of an earlier version");
}
