//! Many small movers at once: what they cost, and that it is still right.

use super::motion::{contents, shift, without_tests};
use super::random::random_lights;
use super::*;
use crate::scene::builtin::shapes;
use crate::visibility::Tests;
use crate::visibility::balls::visibility_about;
use crate::visibility::growth::{Grown, Soil};
use crate::visibility::node_visibility::SceneContext;
use crate::visibility::sources::Sources;

/// A room with a table, a screen and a post.
fn furnished() -> Scene {
    let mut scene = empty_scene();
    add(&mut scene, room(vec3(-2.0, 0.0, -3.0), vec3(2.0, 2.5, 3.0)));
    let mut furniture = Mesh::default();
    furniture.add_box(vec3(-0.6, 0.6, -0.4), vec3(0.6, 0.7, 0.4), MaterialId(0));
    furniture.add_box(vec3(1.0, 0.0, -2.0), vec3(1.1, 2.0, 0.5), MaterialId(0));
    add(&mut scene, furniture);
    add(&mut scene, shapes::cylinder(0.2, 1.8, 13, MaterialId(0)));
    scene
}

/// Small things of four kinds that are free to move: on the table, under it, and all about.
fn add_small(scene: &mut Scene, count: usize, numbers: &mut Numbers) -> Vec<ObjectId> {
    let mut cube = Mesh::default();
    cube.add_box(Vec3::splat(-0.025), Vec3::splat(0.025), MaterialId(0));
    let leaf =
        polygon(&[vec3(-0.04, -0.02, 0.0), vec3(0.04, -0.02, 0.0), vec3(0.0, 0.04, 0.0)], MaterialId(1));
    let kinds = [
        shapes::torus(0.03, 0.012, 8, 6, MaterialId(0)),
        cube,
        shapes::sphere(0.03, 8, 5, MaterialId(0)),
        leaf,
    ];
    (0..count)
        .map(|i| {
            let about = numbers.vector();
            let at = match i % 3 {
                0 => vec3(about.x * 0.6, 0.74, about.z * 0.4),
                1 => vec3(about.x * 0.6, 0.4, about.z * 0.4),
                _ => vec3(about.x * 1.9, 1.25 + about.y * 1.1, about.z * 2.9),
            };
            let index = scene.add_object("", kinds[i % 4].clone(), Transform::rigid(numbers.rotation(), at));
            scene.objects[index].dynamic = true;
            index
        })
        .collect()
}

#[test]
fn many_small_movers_are_followed_as_from_scratch_and_block_what_rays_hit() {
    let (mut stale, mut wrong_if_swapped, mut rays) = (0, 0, [0; 3]);
    for seed in 0..4 {
        let mut numbers = Numbers(seed);
        let mut scene = furnished();
        let movers = add_small(&mut scene, 20, &mut numbers);
        let geometry = Geometry::new(&scene);
        let mut samples = random_lights(&scene, &geometry, &mut numbers, 24);
        let others = random_lights(&scene, &geometry, &mut numbers, 24);
        let mut database = build(&scene, &geometry, samples.clone());
        scene.take_changes();
        for step in 0..10 {
            // Most go a little way, some rest, and now and then a light is another one, of those on what moves too.
            let moved: Vec<ObjectId> = movers.iter().copied().filter(|_| numbers.unit() < 0.8).collect();
            for &mover in &moved {
                let rotation = (numbers.unit() < 0.5).then(|| numbers.rotation());
                shift(&mut scene, mover.index(), numbers.vector() * 0.04, rotation, Vec3::ONE);
            }
            if step % 3 == 1 {
                let index = numbers.below(samples.len());
                samples[index] = others[numbers.below(others.len())];
            }
            assert!(!scene.take_changes().reopened);
            let geometry = Geometry::new(&scene);
            let lights = set(&geometry, samples.clone());
            let mut unmoved = database.clone();
            let changes = changes(&database, &lights);
            let has_moved = |object: u32| moved.contains(&ObjectId(object));
            assert!(database.follow(&scene, &geometry, (&lights, &changes), has_moved));
            let scratch = database.redetermined(&scene, &geometry, &lights).expect("it is of this scene");
            assert!(contents(&database) == contents(&scratch));
            assert_eq!(without_tests(&database), without_tests(&scratch));
            // The control: one that is not told what moved.
            assert!(unmoved.follow(&scene, &geometry, (&lights, &changes), |_| false));
            stale += usize::from(contents(&unmoved) != contents(&database));
            let verdict = verify(&scene, &geometry, &samples, &database, 1500, &mut numbers);
            assert_eq!(verdict.wrong, 0, "{verdict:?}");
            wrong_if_swapped += verdict.wrong_if_swapped;
            (0..3).for_each(|i| rays[i] += verdict.rays[i]);
        }
    }
    println!("{stale} {rays:?}");
    assert_eq!(stale, 40);
    assert!(rays.iter().all(|n| *n > 1000) && wrong_if_swapped > 1000, "{rays:?}");
}

#[test]
fn receivers_on_small_movers_cost_a_few_tests_a_light() {
    const LIGHTS: usize = 60;
    const MOVERS: usize = 60;
    let mut numbers = Numbers(5);
    let mut scene = furnished();
    let movers = add_small(&mut scene, MOVERS, &mut numbers);
    let geometry = Geometry::new(&scene);
    let lights = random_lights(&scene, &geometry, &mut numbers, LIGHTS);
    let database = build(&scene, &geometry, lights);
    let (surfaces, lights, blockers) = (&database.surfaces, &database.lights, &database.groups);
    let context = SceneContext { surfaces, lights, blockers };
    let soil = Soil {
        context: &context,
        settings: &database.settings,
        threshold: database.static_receivers.threshold,
    };
    // The tests of balls about them, of receivers that start from those, and of receivers that start from nothing.
    let mut tests = [Tests::default(); 3];
    for mover in movers {
        let sources = Sources::of_object(surfaces, mover.0);
        let roots = vec![true; sources.roots().len()];
        let (above, of_ball) = visibility_about(&context, &sources).expect("it is small");
        tests[0] += of_ball;
        tests[1] += Grown::new(&soil, &sources, &roots, Some(above.into())).tests;
        tests[2] += Grown::new(&soil, &sources, &roots, None).tests;
    }
    let [of_balls, from_balls, from_nothing] =
        tests.map(|tests| tests.total() as f64 / (MOVERS * LIGHTS) as f64);
    println!("{of_balls:.2} {from_balls:.2} {from_nothing:.2} tests a mover and light");
    assert!(of_balls > 0.0 && of_balls < 25.0 && from_balls < 2.0, "{of_balls} {from_balls}");
    // The control.
    assert!(from_nothing > 5.0 * from_balls, "{from_nothing} {from_balls}");
}

#[test]
fn what_is_hidden_from_a_light_blocks_nothing_of_it() {
    let (mut hidden, mut blocked) = (0, 0);
    for seed in 0..90 {
        let mut numbers = Numbers(100 + seed);
        let mut scene = furnished();
        // On the table, under it, and all about, of the kinds that are meshes.
        let mover = add_small(&mut scene, seed as usize % 3 + 1, &mut numbers).pop().expect("one");
        (0..mover.index()).for_each(|other| scene.objects[other].dynamic = false);
        let geometry = Geometry::new(&scene);
        let samples = random_lights(&scene, &geometry, &mut numbers, 60);
        let database = build(&scene, &geometry, samples);
        for (light, is_hidden) in database.hidden_from(mover).into_iter().enumerate() {
            let is_other =
                |leaf: u32| database.leaf_states(leaf)[light] != database.standing_states(leaf)[light];
            let changed = (0..database.first_dynamic_leaf()).filter(|&leaf| is_other(leaf)).count();
            assert!(!is_hidden || changed == 0, "seed {seed}, light {light}: {changed} leaves");
            hidden += usize::from(is_hidden);
            // The control: it blocks the light of others.
            blocked += usize::from(changed > 0);
        }
    }
    assert!(hidden > 50 && blocked > 50, "{hidden} {blocked}");
}
