//! A database that follows what moves is one from scratch.

use super::random::{random_lights, random_room};
use super::*;
use crate::visibility::Blocker;

/// Everything that it says.
type Contents = (crate::visibility::Receivers, Vec<State>, Vec<Vec<(Blocker, bool)>>);

fn contents(database: &VisibilityDatabase) -> Contents {
    let nodes = 0..database.receivers().nodes.len() as u32;
    let pairs =
        || nodes.clone().flat_map(|node| (0..database.lights() as u32).map(move |light| (node, light)));
    (
        database.receivers().clone(),
        pairs().map(|(node, light)| database.state(node, light)).collect(),
        pairs().map(|(node, light)| database.blockers(node, light).collect()).collect(),
    )
}

#[test]
fn after_any_moves_it_is_one_from_scratch() {
    let (mut followed, mut changed, mut anew) = (0, 0, [0; 2]);
    for seed in 0..60 {
        let mut numbers = Numbers(seed);
        let mut scene = random_room(&mut numbers);
        let movers: Vec<usize> = (0..scene.objects.len()).filter(|&i| scene.objects[i].dynamic).collect();
        if movers.is_empty() {
            continue;
        }
        let geometry = Geometry::new(&scene);
        let samples = random_lights(&scene, &geometry, &mut numbers, 24);
        let mut database = build(&scene, &geometry, samples.clone());
        for step in 0..4 {
            // Several at once, sometimes turned and stretched; the last time so far that nothing is left of them.
            for &mover in &movers {
                let node = scene.objects[mover].node;
                let Transform::Parts { translation, rotation, .. } = scene.nodes[node].local else {
                    panic!("they have parts")
                };
                let scale = if step == 3 { Vec3::X } else { Vec3::ONE + numbers.vector().abs() * 0.5 };
                let place = Transform::Parts {
                    translation: translation + numbers.vector() * 0.3,
                    rotation: if numbers.unit() < 0.5 { rotation } else { numbers.rotation() },
                    scale,
                };
                scene.set_transform(node, place).expect("a place");
            }
            if scene.take_changes().reopened {
                break;
            }
            let geometry = Geometry::new(&scene);
            let lights = set(&geometry, samples.clone());
            let fresh = VisibilityDatabase::build(&scene, &geometry, &lights, &VisibilitySettings::default())
                .expect("a database");
            let before = contents(&database);
            if database.follow(&scene, &geometry, &lights) {
                followed += 1;
                database.belongs_to(&geometry, &lights).expect("it is of this version");
                assert!(contents(&database) == contents(&fresh), "{seed} {step}");
                assert_eq!(database.counts().tests, fresh.counts().tests);
                changed += u32::from(before.1 != contents(&fresh).1);
            } else {
                // What grows may become a receiver of its own; what is flat is none.
                anew[usize::from(step == 3)] += 1;
                break;
            }
        }
    }
    // The controls: there was something to follow, and what cannot be followed is not.
    assert!(followed > 40 && changed * 2 > followed, "{followed} {changed}");
    assert!(anew[0] * 10 < followed && anew[1] > 5, "{followed} {anew:?}");
}
