//! After any sequence of changes everything is what it would be from scratch.

mod opening;
mod placing;

use super::*;
use crate::lights::{LightSample, SampleOrigin};
use crate::scene::builtin::{self, MovingObject, shapes};
use crate::scene::{LightId, Material, MaterialId, ObjectId, PunctualKind, PunctualLight, Transform};
use crate::visibility::State;
use glam::{Quat, Vec3, vec3};
use proptest::prelude::*;

fn settings() -> IlluminationSettings {
    IlluminationSettings {
        lights: LightSettings { count: 12, candidates: 2, ..LightSettings::default() },
        visibility: Some(VisibilitySettings::default()),
        views: Vec::new(),
        rewalk: Rewalk::All,
    }
}

/// Everything that follows from a scene, in terms that can be compared.
fn contents(of: &Illumination) -> (String, Vec<Vec<State>>) {
    let (geometry, lights) = (of.geometry(), of.lights());
    let database = of.visibility().expect("it was asked for");
    let arrays = format!(
        "{:?} {:?} {:?} {:?} {:?} {:?} {:?}",
        geometry.frame_of_reference(),
        geometry.positions,
        geometry.normals,
        geometry.triangles,
        geometry.patches,
        geometry.objects,
        database.receivers(),
    );
    let lights = format!("{:?} {:?} {} {}", lights.samples(), lights.ids(), lights.direct, lights.paths);
    let leaves = 0..database.receivers().leaves.len() as u32;
    (arrays + &lights, leaves.map(|leaf| database.leaf_states(leaf).to_vec()).collect())
}

#[derive(Clone, Debug)]
enum Step {
    Move(usize, Vec3, f32),
    Dim(u32, f32),
    Insert(Vec3, bool),
    Remove(usize),
    Touch(usize),
}

fn steps() -> impl Strategy<Value = Vec<Step>> {
    let place = || (-3.0..3.0_f32, 0.1..2.5_f32, -3.0..3.0_f32).prop_map(|(x, y, z)| vec3(x, y, z));
    let far = (0.9..1.0_f32).prop_map(|x| vec3(12.0 * x, 1.0, 0.0));
    let step = prop_oneof![
        4 => (any::<usize>(), place(), 0.0..6.0_f32).prop_map(|(o, p, turn)| Step::Move(o, p, turn)),
        1 => (any::<usize>(), far).prop_map(|(o, p)| Step::Move(o, p, 0.0)),
        2 => (any::<u32>(), 0.0..9.0_f32).prop_map(|(m, light)| Step::Dim(m, light)),
        2 => (place(), any::<bool>()).prop_map(|(p, dynamic)| Step::Insert(p, dynamic)),
        2 => any::<usize>().prop_map(Step::Remove),
        1 => any::<usize>().prop_map(Step::Touch),
    ];
    prop::collection::vec(step, 1..7)
}

/// Objects that a room can do without.
fn movable(scene: &Scene) -> Vec<ObjectId> {
    scene.placed_objects().filter(|(_, o)| o.dynamic || o.name == "new").map(|(id, _)| id).collect()
}

fn take(scene: &mut Scene, step: &Step) -> Result<()> {
    let things = movable(scene);
    let pick = |i: usize| things.get(i % things.len().max(1)).copied();
    match *step {
        Step::Move(which, at, turn) => match pick(which) {
            Some(object) => {
                let place = Transform::rigid(Quat::from_rotation_y(turn), at);
                scene.set_transform(scene.objects[object].node, place)
            }
            None => Ok(()),
        },
        Step::Dim(which, light) => {
            // The room's own lamps stay on.
            let own = |m: &MaterialId| ["glow", "new"].contains(&scene.materials[*m].name.as_str());
            let others: Vec<MaterialId> =
                (0..scene.materials.len()).map(MaterialId::from).filter(own).collect();
            let which = others[which as usize % others.len()];
            scene.set_emission(which, Vec3::new(light, 1.0, 0.5))
        }
        Step::Insert(at, dynamic) => {
            let material = scene.add_material(Material { name: "new".into(), ..Material::default() });
            let mesh = if dynamic {
                shapes::sphere(0.2, 6, 4, material)
            } else {
                shapes::cuboid(Vec3::splat(-0.2), Vec3::splat(0.2), material)
            };
            scene.insert_object("new", mesh, Transform::translation(at), dynamic).map(|_| ())
        }
        Step::Remove(which) => pick(which).map_or(Ok(()), |object| scene.remove_object(object)),
        Step::Touch(which) => {
            let material = which % scene.materials.len();
            scene.materials[material].base_color *= 0.9;
            scene.touch();
            Ok(())
        }
    }
}

fn lit_room() -> Scene {
    let mut scene = builtin::build("gap", MovingObject::Torus).expect("it is built in");
    let glow = scene.add_material(Material::emitter("glow", Vec3::ONE));
    scene.add_object(
        "glow",
        shapes::cuboid(Vec3::splat(-0.05), Vec3::splat(0.05), glow),
        Transform::translation(vec3(0.3, 0.5, 0.3)),
    );
    scene
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn after_any_changes_it_is_that_of_the_scene(steps in steps(), grouped in any::<u32>()) {
        let mut scene = lit_room();
        let mut held = Illumination::new(&scene, &settings()).expect("there is light");
        for (i, step) in steps.iter().enumerate() {
            take(&mut scene, step).expect("it is possible");
            // Several changes at a time.
            if grouped >> i & 1 == 0 || i + 1 == steps.len() {
                let changes = scene.take_changes();
                held.update(&scene, &changes).expect("it follows");
                let fresh = Illumination::new(&scene, &settings()).expect("there is light");
                prop_assert!(contents(&held) == contents(&fresh), "{step:?}");
                prop_assert_eq!(held.generation(), scene.generation());
            }
        }
    }
}

#[test]
fn the_comparison_sees_each_kind_of_change() {
    let scene = lit_room();
    let held = Illumination::new(&scene, &settings()).expect("there is light");
    for step in [
        Step::Move(0, vec3(0.5, 1.0, 0.5), 1.0),
        Step::Dim(0, 3.0),
        Step::Insert(vec3(0.0, 1.0, 0.0), false),
        Step::Remove(0),
    ] {
        let mut changed = scene.clone();
        take(&mut changed, &step).expect("it is possible");
        let other = Illumination::new(&changed, &settings()).expect("there is light");
        assert!(contents(&held) != contents(&other), "{step:?}");
    }
}

#[test]
fn changes_that_do_not_follow_are_refused_and_change_nothing() {
    let mut scene = lit_room();
    let mut held = Illumination::new(&scene, &settings()).expect("there is light");
    let first = held.generation();
    let step = |scene: &mut Scene, light: f32| {
        take(scene, &Step::Dim(0, light)).expect("it is possible");
        scene.take_changes()
    };
    let (one, two) = (step(&mut scene, 2.0), step(&mut scene, 3.0));
    let refused = |held: &mut Illumination, scene: &Scene, changes: &SceneChanges| {
        let sentence = held.update(scene, changes).expect_err("it does not follow").to_string();
        assert_eq!(held.generation(), first);
        sentence
    };
    assert!(refused(&mut held, &scene, &one).contains("as it stands"));
    assert!(refused(&mut held, &scene, &two).contains("do not start"));
    // No light: nothing can be derived, and both batches come together once there is some.
    let all_dark = |scene: &mut Scene| {
        for material in 0..scene.materials.len() {
            scene.set_emission(material.into(), Vec3::ZERO).expect("it is possible");
        }
        scene.take_changes()
    };
    let (mut all, dark) = (one, all_dark(&mut scene));
    all.then(&two).expect("they follow");
    all.then(&dark).expect("they follow");
    assert!(refused(&mut held, &scene, &all).contains("no light"));
    all.then(&step(&mut scene, 4.0)).expect("they follow");
    held.update(&scene, &all).expect("there is light again");
    assert_eq!(held.generation(), scene.generation());
    // A touched scene is taken whatever went before.
    step(&mut scene, 5.0);
    scene.touch();
    let changes = scene.take_changes();
    held.update(&scene, &changes).expect("everything changed");
    // Nothing new is nothing to do.
    let lights = held.lights().generation();
    let changes = scene.take_changes();
    held.update(&scene, &changes).expect("nothing changed");
    assert_eq!(held.lights().generation(), lights);
}

fn holding() -> IlluminationSettings {
    let lights =
        LightSettings { count: 60, direct_share: Some(0.5), walk_dynamic: false, ..LightSettings::default() };
    IlluminationSettings { lights, rewalk: Rewalk::Off, ..settings() }
}

fn follow(held: &mut Illumination, scene: &mut Scene) {
    let changes = scene.take_changes();
    held.update(scene, &changes).expect("it follows");
}

#[test]
fn held_samples_go_with_what_they_are_on() {
    // A lamp that moves, turns and grows, a point light, and a room's own lamp.
    let mut scene = lit_room();
    let lamp = scene.objects.iter().position(|o| o.name == "glow").expect("a lamp");
    scene.objects[lamp].dynamic = true;
    let glow = scene.materials.iter_mut().find(|m| m.name == "glow").expect("its material");
    glow.emission = Vec3::splat(300.0);
    let node = scene.add_node("bulb", Transform::translation(vec3(1.0, 1.0, 1.0)));
    let (kind, intensity) = (PunctualKind::Point, Vec3::ONE);
    scene.lights.push(PunctualLight { name: "bulb".into(), node, kind, intensity });
    let mut held = Illumination::new(&scene, &holding()).expect("there is light");
    let (before, was) = (held.lights().clone(), held.geometry().clone());
    let (translation, rotation) =
        (vec3(0.5, 1.4, -0.2), Quat::from_rotation_y(0.7) * Quat::from_rotation_x(0.3));
    let place = Transform::rigid(rotation, translation);
    let lamp_node = scene.objects[lamp].node;
    // By way of somewhere else.
    scene.set_transform(lamp_node, Transform::translation(vec3(-2.0, 1.0, 1.0))).expect("a place");
    follow(&mut held, &mut scene);
    scene.set_transform(lamp_node, place).expect("a place");
    scene.set_transform(node, Transform::translation(vec3(2.0, 1.5, 0.0))).expect("a place");
    follow(&mut held, &mut scene);
    held.lights().belongs_to(held.geometry()).expect("they belong");
    let after = held.lights();
    assert_eq!((before.ids(), before.direct), (after.ids(), after.direct));
    let fresh = Illumination::new(&scene, &holding()).expect("there is light");
    // Distances from a triangle's corners, and the side that is lit.
    let on_surface = |geometry: &Geometry, s: &LightSample| {
        let [a, b, c] = geometry.corners(s.triangle()).map(|corner| corner.distance(s.position));
        glam::vec4(a, b, c, geometry.normal(s.triangle()).dot(s.normal))
    };
    let mut on_the_lamp = 0;
    for (i, (a, b)) in after.samples().iter().zip(before.samples()).enumerate() {
        let is_on = |object| {
            a.triangle() != crate::scene::NONE
                && held.geometry().triangles[a.triangle() as usize].object as usize == object
        };
        if matches!(a.origin, SampleOrigin::Punctual { .. }) {
            assert_eq!(Some(a), fresh.lights().samples().get(i));
            assert_ne!(a.position, b.position);
        } else if !is_on(lamp) {
            assert_eq!(a, b);
        } else {
            on_the_lamp += 1;
            let [now, then] = [on_surface(held.geometry(), a), on_surface(&was, b)];
            assert!(now.abs_diff_eq(then, 1e-5), "{a:?} {b:?}");
            assert!(a.intensity.abs_diff_eq(b.intensity, 1e-5), "{a:?} {b:?}");
            assert!(a.position.distance(b.position) > 0.1, "the control");
        }
    }
    assert!(on_the_lamp > 3);
    // What grows shines more; what is stretched has rectangles still.
    let power = |held: &Illumination| -> f32 {
        let geometry = held.geometry();
        let on = |s: &&LightSample| {
            s.triangle() != crate::scene::NONE
                && geometry.triangles[s.triangle() as usize].object as usize == lamp
        };
        held.lights().samples().iter().filter(on).map(|s| s.intensity.x).sum()
    };
    let small = power(&held);
    for (scale, area) in [(Vec3::splat(2.0), Some(4.0)), (vec3(2.0, 3.0, 1.0), None)] {
        scene.set_transform(lamp_node, Transform::Parts { translation, rotation, scale }).expect("a place");
        follow(&mut held, &mut scene);
        let ratio = power(&held) / small;
        assert!(area.is_none_or(|area: f32| (ratio - area).abs() < 1e-3) && ratio > 2.0, "{ratio}");
        for s in held.lights().samples() {
            let [u, v] = s.rectangle.map_or([Vec3::ZERO; 2], |r| r.half_axes);
            let size = u.length() * v.length();
            assert!(u.dot(v).abs() <= 1e-4 * size && u.cross(v).dot(s.normal) >= 0.999 * size, "{s:?}");
        }
    }
}

#[test]
fn held_samples_do_not_depend_on_the_way() {
    let mut scene = lit_room();
    let mover = movable(&scene)[0];
    let node = scene.objects[mover].node;
    let mut held = Illumination::new(&scene, &holding()).expect("there is light");
    let sampled = held.lights().clone();
    let mut direct = (scene.clone(), held.clone());
    for i in 0..5 {
        let place = Transform::rigid(Quat::from_rotation_y(i as f32), vec3(0.4 * i as f32, 1.0, 0.3));
        scene.set_transform(node, place).expect("a place");
        follow(&mut held, &mut scene);
        assert!(*held.lights() == sampled, "nothing is on the mover");
    }
    direct.0.set_transform(node, scene.nodes[node].local).expect("a place");
    follow(&mut direct.1, &mut direct.0);
    assert!(contents(&held) == contents(&direct.1));
    // Visibility is that of these samples in the scene as it stands.
    let fresh = VisibilityDatabase::build(
        &scene,
        held.geometry(),
        held.lights(),
        &holding().visibility.expect("it is asked for"),
    );
    let fresh = fresh.expect("a database");
    let database = held.visibility().expect("it is asked for");
    for leaf in 0..database.receivers().leaves.len() as u32 {
        assert_eq!(database.leaf_states(leaf), fresh.leaf_states(leaf));
    }
    // New lamps, objects and a new frame of reference make all anew.
    let wall = scene.materials.iter().position(|m| !m.emits()).expect("a wall");
    let glow = |scene: &mut Scene| scene.set_emission(wall.into(), Vec3::splat(3.0));
    let leave = |scene: &mut Scene| scene.set_transform(node, Transform::translation(vec3(40.0, 1.0, 0.0)));
    let remove = |scene: &mut Scene| scene.remove_object(mover);
    let squash = |scene: &mut Scene| {
        let flat = Transform::Affine(glam::DAffine3::from_scale(glam::DVec3::new(1.0, 0.0, 0.0)));
        scene.set_transform(node, flat)
    };
    type Change<'a> = &'a dyn Fn(&mut Scene) -> Result<()>;
    let changes: [Change; 4] = [&glow, &leave, &remove, &squash];
    for change in changes {
        let (mut scene, mut held) = (scene.clone(), held.clone());
        change(&mut scene).expect("it is possible");
        follow(&mut held, &mut scene);
        assert!(contents(&held) == contents(&Illumination::new(&scene, &holding()).expect("there is light")));
    }
}

#[test]
fn lights_that_are_dimmed_keep_their_samples() {
    // The room's own lamp, another one, and a point light, all of which light the whole room.
    let mut scene = lit_room();
    let glow = scene.objects.iter().position(|o| o.name == "glow").expect("a lamp");
    let glow = scene.meshes[scene.objects[glow].mesh].triangles[0].material;
    scene.materials[glow].emission = vec3(300.0, 200.0, 100.0);
    let lamp = (0..).map(MaterialId).find(|&m| m != glow && scene.materials[m].emits()).expect("the room's");
    let node = scene.add_node("bulb", Transform::translation(vec3(1.0, 1.0, 1.0)));
    let (kind, intensity) = (PunctualKind::Point, Vec3::splat(40.0));
    scene.lights.push(PunctualLight { name: "bulb".into(), node, kind, intensity });
    for direct_share in [None, Some(0.4)] {
        let mut scene = scene.clone();
        let lights = LightSettings { count: 200, direct_share, ..holding().lights };
        let settings = IlluminationSettings { lights, ..holding() };
        let mut held = Illumination::new(&scene, &settings).expect("there is light");
        let bright = held.lights().clone();
        let (lamp_emission, glow_emission) = (scene.materials[lamp].emission, scene.materials[glow].emission);
        let mut dimmed = |scene: &mut Scene, factors: [Vec3; 3]| {
            scene.set_emission(lamp, lamp_emission * factors[0]).expect("an emission");
            scene.set_emission(glow, glow_emission * factors[1]).expect("an emission");
            scene.set_intensity(LightId(0), intensity * factors[2]).expect("an intensity");
            follow(&mut held, scene);
            held.lights().clone()
        };
        let [one, none] = [Vec3::ONE, Vec3::ZERO];
        let alone = [[one, none, none], [none, one, none], [none, none, one]];
        let alone = alone.map(|factors| dimmed(&mut scene, factors));
        let factors = [vec3(0.5, 0.1, 0.9), vec3(0.2, 1.0, 0.0), vec3(3.0, 0.3, 1.0)];
        let mixed = dimmed(&mut scene, factors);
        let mut counts = [0; 3];
        for (i, sample) in bright.samples().iter().enumerate() {
            let parts = alone.each_ref().map(|set| set.samples()[i]);
            let same = |s: &LightSample| {
                (s.position, s.normal, s.origin, s.rectangle)
                    == (sample.position, sample.normal, sample.origin, sample.rectangle)
            };
            assert!(parts.iter().chain([&mixed.samples()[i]]).all(same), "samples stay");
            let near = |a: Vec3, b: Vec3| (a - b).abs().max_element() < 1e-4 * sample.intensity.max_element();
            let sum: Vec3 = parts.iter().map(|s| s.intensity).sum();
            assert!(near(sum, sample.intensity), "{sum} for {}", sample.intensity);
            let sum: Vec3 = parts.iter().zip(factors).map(|(s, factor)| s.intensity * factor).sum();
            assert!(near(sum, mixed.samples()[i].intensity), "{sum} for {}", mixed.samples()[i].intensity);
            counts.iter_mut().zip(&parts).for_each(|(n, s)| *n += usize::from(s.intensity != Vec3::ZERO));
        }
        assert!(counts.iter().all(|n| (2..200).contains(n)), "{counts:?}");
        // On emitters all of their light is their own; what samples have in all is what fresh ones have, about.
        let flux = |set: &LightSet| set.samples().iter().map(|s| s.intensity).sum::<Vec3>();
        let (now, fresh) = (flux(&mixed), LightSet::sample(&scene, &Geometry::new(&scene), &settings.lights));
        let ratio = now / flux(&fresh.expect("there is light"));
        assert!((ratio - Vec3::ONE).abs().max_element() < 0.15, "{ratio}");
        let ratio = flux(&bright) / flux(&mixed);
        assert!((ratio - Vec3::ONE).abs().max_element() > 0.3, "the control: {ratio}");
        // Back again, to the bit; and what did not shine in a channel makes all anew.
        assert!(dimmed(&mut scene, [one; 3]).samples() == bright.samples());
        dimmed(&mut scene, [one, vec3(0.0, 1.0, 1.0), one]);
        let mut scene = scene.clone();
        let mut held = Illumination::new(&scene, &settings).expect("there is light");
        let blue = held.lights().clone();
        scene.set_emission(glow, glow_emission).expect("an emission");
        follow(&mut held, &mut scene);
        assert!(held.lights().samples() != blue.samples());
        assert!(held.lights() == Illumination::new(&scene, &settings).expect("there is light").lights());
    }
}

#[test]
fn lamps_that_move_keep_the_hierarchy_of_receivers() {
    let mut scene = lit_room();
    let lamp = scene.objects.iter().position(|o| o.name == "glow").expect("a lamp");
    scene.objects[lamp].dynamic = true;
    let node = scene.add_node("bulb", Transform::translation(vec3(1.0, 1.0, 1.0)));
    let (kind, intensity) = (PunctualKind::Point, Vec3::splat(20.0));
    scene.lights.push(PunctualLight { name: "bulb".into(), node, kind, intensity });
    let mut held = Illumination::new(&scene, &holding()).expect("there is light");
    let database = |held: &Illumination| held.visibility().cloned().expect("it is asked for");
    let still = |of: &VisibilityDatabase| {
        of.receivers().leaves[..of.first_dynamic_leaf() as usize].iter().map(|l| l.node).collect::<Vec<_>>()
    };
    let states = |of: &VisibilityDatabase| {
        (0..of.receivers().leaves.len() as u32).map(|l| of.leaf_states(l).to_vec()).collect::<Vec<_>>()
    };
    let first = database(&held);
    let (mut splits_differ, mut changed) = (0, 0);
    for step in 0..6_u8 {
        // The lamp with what lies on it, the bulb, or both.
        let by = f32::from(step);
        if step % 3 != 0 {
            let place = Transform::translation(vec3(0.4 * by - 1.0, 0.5, 0.3));
            scene.set_transform(scene.objects[lamp].node, place).expect("a place");
        }
        if step % 3 != 1 {
            scene
                .set_transform(node, Transform::translation(vec3(1.0 - 0.3 * by, 1.2, 0.5)))
                .expect("a place");
        }
        let before = database(&held);
        follow(&mut held, &mut scene);
        let after = database(&held);
        let (geometry, lights) = (held.geometry(), held.lights());
        assert_eq!(still(&after), still(&first));
        let scratch = after.redetermined(&scene, geometry, lights).expect("it is of this scene");
        assert!(states(&after) == states(&scratch));
        assert!(after.counts().tests.total() < scratch.counts().tests.total());
        // The controls: something changed, and a new hierarchy is another one.
        changed += usize::from(states(&before) != states(&after));
        let fresh =
            VisibilityDatabase::build(&scene, geometry, lights, after.settings()).expect("a database");
        splits_differ += usize::from(still(&fresh) != still(&after));
    }
    assert!(changed == 6 && splits_differ > 2, "{changed} {splits_differ}");
}
