//! What is followed path by path is what a fresh walk leaves.

use super::*;
use crate::lights::tests::{agrees, flux, over_seeds};
use crate::lights::walk::Path;
use crate::scene::builtin::{self, MovingObject};
use crate::scene::{MaterialId, Transform};
use crate::trace::SceneTracer;
use glam::{DVec3, Quat, vec3};

const ALL: Pace = Pace { paths: u32::MAX, fade: 0 };

fn room() -> Scene {
    builtin::build("table", MovingObject::Torus).expect("it is built in")
}

fn settings(count: u32, seed: u32) -> LightSettings {
    LightSettings { count, seed, candidates: 8, ..LightSettings::default() }
}

/// Moves the torus, and the room's lamp, to where they are in a frame.
fn pose(scene: &mut Scene, frame: u32, lamp_too: bool) {
    let lamp = scene.objects.iter().find(|o| o.name == "light").expect("a lamp").node;
    let torus = scene.objects.iter().find(|o| o.dynamic && o.node != lamp).expect("a torus").node;
    let t = frame as f32;
    let place = vec3(0.5 * (t * 0.9).sin(), 0.9 + 0.05 * t, 0.4 * (t * 0.7).cos());
    scene.set_transform(torus, Transform::rigid(Quat::from_rotation_y(t), place)).expect("a place");
    if lamp_too {
        let mut local = scene.nodes[lamp].local.affine();
        local.translation.x = 0.1 * f64::from(frame);
        scene.set_transform(lamp, Transform::Affine(local)).expect("a place");
    }
}

fn opened(scene: &Scene, settings: &LightSettings, pace: Pace) -> (IncrementalWalk, LightSet) {
    complete(IncrementalWalk::new(scene, &Geometry::new(scene), settings, &[], pace)).expect("there is light")
}

/// The light set after some frames of motion.
fn after(
    frames: u32,
    lamp_too: bool,
    settings: &LightSettings,
    pace: Pace,
) -> (Scene, IncrementalWalk, LightSet) {
    let mut scene = room();
    pose(&mut scene, 0, lamp_too);
    let (mut walk, mut set) = opened(&scene, settings, pace);
    for frame in 1..=frames {
        pose(&mut scene, frame, lamp_too);
        set = walk.follow(&scene, &Geometry::new(&scene)).expect("it follows");
    }
    (scene, walk, set)
}

/// How many paths are not what a walk from scratch makes of them.
fn wrong_paths(scene: &Scene, walk: &IncrementalWalk) -> usize {
    let geometry = Geometry::new(scene);
    let emissions = walk.placements.sampled.emissions();
    let groups = emitters::groups(scene, &geometry, emissions);
    let trees = emitters::trees(&groups, &emitters::punctual_sources(scene, &geometry, emissions));
    let tracer = SceneTracer::new(scene, &geometry);
    let (walked, seed) = (&walk.sampling.indirect.walked, walk.sampling.indirect.seed);
    let fresh = Walk {
        tracer: &tracer,
        world_from_nodes: &scene.world_from_nodes(),
        emissions,
        emitters: &trees,
        guides: &walk.sampling.guides,
        settings: &walk.settings,
        seed,
    };
    let fresh = complete(fresh.paths(walked.paths.iter().map(|path| path.index).collect()));
    let differ = |(fresh, held): (Path, &Path)| fresh.deposits != held.deposits;
    fresh.into_iter().zip(&walked.paths).map(differ).filter(|differ| *differ).count()
}

#[test]
fn paths_are_those_of_a_fresh_walk() {
    for walk_dynamic in [true, false] {
        for lamp_too in [false, true] {
            let settings = LightSettings { walk_dynamic, ..settings(60, 3) };
            let (scene, walk, _) = after(7, lamp_too, &settings, ALL);
            assert_eq!(wrong_paths(&scene, &walk), 0, "{walk_dynamic} {lamp_too}");
            assert_eq!(walk.waiting(), WaitingPaths::default());
            // The control: without walking them again they are not, if they see what moves.
            let (scene, walk, _) = after(7, lamp_too, &settings, Pace { paths: 0, fade: 0 });
            assert_eq!(wrong_paths(&scene, &walk) > 10, walk_dynamic || lamp_too);
            assert_eq!(walk.waiting().paths > 10, walk_dynamic || lamp_too);
        }
    }
}

#[test]
fn light_is_that_of_a_fresh_set_in_the_mean() {
    // By how much light there is, and where.
    let measure = |set: &LightSet| {
        let moment: DVec3 =
            set.samples().iter().map(|s| s.position.as_dvec3() * f64::from(s.intensity.element_sum())).sum();
        [flux(set.samples()), moment]
    };
    let run = |seeds: u32, pace: Pace, which: usize| {
        over_seeds(seeds, |seed| measure(&after(6, true, &settings(24, seed), pace).2)[which])
    };
    for which in 0..2 {
        let (expected, error) = over_seeds(60, |seed| {
            let mut scene = room();
            pose(&mut scene, 6, true);
            let set = LightSet::sample(&scene, &Geometry::new(&scene), &settings(24, seed + 1000));
            measure(&set.expect("there is light"))[which]
        });
        let (mean, own) = run(60, ALL, which);
        let both = (mean, (own * own + error * error).map(f64::sqrt));
        assert!(agrees(both, expected, 0.0), "{both:?} for {expected}");
        // The control: where it was at first.
        let stale = run(60, Pace { paths: 0, fade: 0 }, which);
        assert!(which == 0 || !agrees(stale, expected, 0.0), "{stale:?} for {expected}");
    }
}

#[test]
fn light_is_kept_in_the_mean_as_the_view_moves() {
    let scene = room();
    let geometry = Geometry::new(&scene);
    let views: Vec<View> = (0..5)
        .map(|step| {
            let view = View::new(&scene, &scene.cameras[0], 1.0);
            let turn = Quat::from_rotation_y(0.5 * step as f32);
            let [right, up, forward] = [view.right, view.up, view.forward].map(|axis| turn * axis);
            View { right, up, forward, ..view }
        })
        .collect();
    let (expected, error) = over_seeds(60, |seed| {
        let set = LightSet::sample(&scene, &geometry, &settings(40, seed + 1000)).expect("there is light");
        flux(set.samples())
    });
    let first = |seed: u32| {
        let settings = settings(40, seed);
        let opened = IncrementalWalk::new(&scene, &geometry, &settings, &views[..1], ALL);
        complete(opened).expect("there is light")
    };
    let (mean, own) = over_seeds(60, |seed| {
        let (mut walk, mut set) = first(seed);
        for view in &views[1..] {
            walk.place_for(&scene, &geometry, &[*view], &[]);
            for _ in 0..3 {
                set = walk.follow(&scene, &geometry).expect("it follows");
            }
        }
        flux(set.samples())
    });
    let both = (mean, (own * own + error * error).map(f64::sqrt));
    assert!(agrees(both, expected, 0.0), "{both:?} for {expected}");
    // The control: samples go over to where the view is.
    let (mut walk, before) = first(0);
    walk.place_for(&scene, &geometry, &views[4..], &[]);
    let moved = (0..30).filter(|_| {
        let after = walk.follow(&scene, &geometry).expect("it follows");
        after != before
    });
    assert!(moved.count() > 20);
}

#[test]
fn there_are_no_more_slots_than_visibility_takes() {
    assert_eq!(shown(300, MOST_LIGHTS), [300, 75]);
    assert_eq!(shown(MOST_LIGHTS as u32, MOST_LIGHTS), [MOST_LIGHTS as u32 / 4 * 3, MOST_LIGHTS as u32 / 4]);
    assert_eq!((shown(8, 10), shown(1, 0), shown(0, 10)), ([6, 4], [1, 0], [0, 3]));
    // The control: where there is room, all that were asked for are shown.
    assert_eq!((shown(1, 10), shown(8, 100)), ([1, 4], [8, 4]));
}

fn lit(set: &LightSet) -> usize {
    set.samples().iter().filter(|sample| sample.intensity != Vec3::ZERO).count()
}

#[test]
fn samples_come_and_go_little_by_little_and_come_to_rest() {
    let pace = Pace { paths: 60, fade: 6 };
    let mut scene = room();
    pose(&mut scene, 0, true);
    let (mut walk, mut before) = opened(&scene, &settings(80, 1), pace);
    // A quarter more slots than samples.
    assert_eq!((before.len(), lit(&before)), (100, 80));
    let (mut jumps, mut most_waited) = (0, 0);
    let mut settled = None;
    for frame in 1..400 {
        if frame <= 20 {
            pose(&mut scene, frame, true);
        }
        let set = walk.follow(&scene, &Geometry::new(&scene)).expect("it follows");
        assert_eq!(set.len(), 100);
        for (now, then) in set.samples().iter().zip(before.samples()) {
            let reach = then.rectangle.as_ref().map_or(0.0, crate::lights::Rectangle::radius) + 0.2;
            let is_another =
                origin(now) != origin(then) || now.position.distance(then.position) > 2.0 * reach;
            if is_another {
                jumps += 1;
                assert_eq!(then.intensity, Vec3::ZERO, "{now:?} in the place of {then:?}");
            }
        }
        let waiting = walk.waiting();
        most_waited = most_waited.max(waiting.oldest);
        if settled.is_some() {
            assert!(set == before, "nothing changes any more");
        } else if walk.is_settled() {
            settled = Some(frame);
        }
        before = set;
    }
    assert!(jumps > 20, "{jumps}");
    assert!(settled.is_some_and(|frame| frame < 200), "{settled:?}");
    // At rest as many samples are lit as were asked for, but for strata that nothing is left in.
    assert!((76..=80).contains(&lit(&before)), "{}", lit(&before));
    // All paths wait for their turn and none for much longer.
    let paths = walk.paths.len() as u32;
    assert!(most_waited > 1 && most_waited <= paths / pace.paths + 2, "{most_waited} of {paths}");
    assert_eq!(wrong_paths(&scene, &walk), 0);
    // At once, if that is wanted: the control.
    let (_, _, set) = after(3, true, &settings(80, 1), Pace { fade: 0, ..pace });
    assert_eq!(set.samples().iter().filter(|s| s.intensity == Vec3::ZERO).count(), 20);
}

#[test]
fn what_is_dimmed_is_not_walked_and_stays_dimmed_when_it_is() {
    let lamp_of = |scene: &Scene| scene.materials.iter().position(|m| m.emits()).expect("a lamp");
    let mut scene = room();
    pose(&mut scene, 0, true);
    let lamp = MaterialId::from(lamp_of(&scene));
    let emission = scene.materials[lamp].emission;
    let (mut walk, bright) = opened(&scene, &settings(60, 2), ALL);
    let factor = vec3(0.5, 0.25, 0.0);
    scene.set_emission(lamp, emission * factor).expect("an emission");
    let dim = walk.follow(&scene, &Geometry::new(&scene)).expect("it follows");
    for (now, then) in dim.samples().iter().zip(bright.samples()) {
        let expected = then.intensity * factor;
        assert!(now.intensity.abs_diff_eq(expected, 1e-5 * then.intensity.max_element()), "{now:?} {then:?}");
        assert_eq!((now.position, now.rectangle), (then.position, then.rectangle));
    }
    // What is walked again while it is dark is there when it is lit.
    scene.set_emission(lamp, Vec3::ZERO).expect("an emission");
    pose(&mut scene, 5, true);
    let dark = walk.follow(&scene, &Geometry::new(&scene)).expect("it follows");
    assert!(dark.samples().iter().all(|s| s.intensity == Vec3::ZERO));
    scene.set_emission(lamp, emission).expect("an emission");
    let lit = walk.follow(&scene, &Geometry::new(&scene)).expect("it follows");
    assert_eq!(wrong_paths(&scene, &walk), 0);
    let ratio = flux(lit.samples()) / flux(bright.samples());
    assert!((ratio - 1.0).abs().max_element() < 0.2, "{ratio}");
    // What emits in a channel for the first time makes all anew.
    let wall = scene.materials.iter().position(|m| !m.emits()).expect("a wall");
    scene.set_emission(wall.into(), Vec3::X).expect("an emission");
    assert!(walk.follow(&scene, &Geometry::new(&scene)).is_none());
}
