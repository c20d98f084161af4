//! Light samples are placed for views, and for those to come.

use super::*;
use crate::scene::{MaterialId, Shades};

#[test]
fn placing_for_a_view_is_deriving_for_it() {
    let mut scene = builtin::build("table", MovingObject::None).expect("a room");
    let view = View::new(&scene, &scene.cameras[0], 1.3);
    // With enough candidates to tell apart.
    let settings = || {
        let lights = LightSettings { candidates: 64, ..settings().lights };
        IlluminationSettings { lights, ..settings() }
    };
    let placed = IlluminationSettings { views: vec![view], ..settings() };
    let mut held = Illumination::new(&scene, &settings()).expect("there is light");
    let by_power = contents(&held);
    held.place_for(&scene, &[view]).expect("the same scene");
    let for_view = contents(&Illumination::new(&scene, &placed).expect("there is light"));
    assert!(contents(&held) == for_view, "placed");
    assert!(for_view != by_power, "the view counts");
    // Views stay what they are through updates.
    let _ = scene.take_changes();
    let lamp = scene.materials.iter().position(Material::emits).expect("a lamp").into();
    scene.set_emission(lamp, vec3(1.0, 2.0, 3.0)).expect("an emission");
    let changes = scene.take_changes();
    assert!(held.place_for(&scene, &[]).is_err(), "the scene has changed since");
    held.update(&scene, &changes).expect("they follow");
    assert!(contents(&held) == contents(&Illumination::new(&scene, &placed).expect("there is light")));
    held.place_for(&scene, &[]).expect("the same scene");
    assert!(contents(&held) == contents(&Illumination::new(&scene, &settings()).expect("there is light")));
}

#[test]
fn what_is_sampled_anew_is_placed_for_the_views_of_now() {
    let mut scene = builtin::build("table", MovingObject::None).expect("a room");
    let [then, now] = [1.3, 0.2].map(|aspect| View::new(&scene, &scene.cameras[0], aspect));
    let placed = |view| {
        let lights = LightSettings { candidates: 64, ..settings().lights };
        IlluminationSettings { lights, views: vec![view], ..settings() }
    };
    let held_already = scene.take_changes();
    let mut held = Illumination::new(&scene, &placed(then)).expect("there is light");
    let before = contents(&held);
    // Nothing is sampled for what is held already, nor for changes that do not follow it: then the views stay, too.
    let all = SceneChanges { everything: true, ..held_already.clone() };
    held.update_for(&scene, &all, &[now]).expect("nothing is to be done");
    let lamp = scene.materials.iter().position(Material::emits).expect("a lamp").into();
    scene.set_emission(lamp, vec3(1.0, 2.0, 3.0)).expect("an emission");
    assert!(held.update_for(&scene, &held_already, &[now]).is_err(), "other changes");
    assert!(contents(&held) == before && held.settings().views == [then]);
    let changes = scene.take_changes();
    held.update_for(&scene, &changes, &[now]).expect("they follow");
    let [of_then, of_now] =
        [then, now].map(|view| contents(&Illumination::new(&scene, &placed(view)).expect("there is light")));
    assert!(contents(&held) == of_now && held.settings().views == [now]);
    assert!(of_then != of_now, "the control: the view counts");
}

#[test]
fn samples_wait_in_rooms_that_will_be_seen() {
    let mut scene = builtin::build("gap", MovingObject::None).expect("a room");
    let [there, _, here] = [0, 1, 2].map(|camera| View::new(&scene, &scene.cameras[camera], 1.3));
    let settings = IlluminationSettings {
        lights: LightSettings { count: 480, direct_share: Some(0.2), ..LightSettings::default() },
        visibility: None,
        views: vec![here],
        rewalk: Rewalk::Paths(Pace { paths: 60, fade: 6 }),
    };
    let mut after = |to_come: &[View]| {
        let mut held = Illumination::new(&scene, &settings).expect("there is light");
        let changes = scene.take_changes();
        for _ in 0..60 {
            held.place_on_way(&scene, &[here], to_come).expect("the same scene");
            held.update(&scene, &changes).expect("nothing changed");
        }
        held
    };
    let [seen, known, same] = [after(&[]), after(&[there, there]), after(&[here])];
    // In the half behind the wall.
    let behind = |held: &Illumination| {
        let samples = held.lights().samples().iter();
        samples.filter(|s| s.intensity != Vec3::ZERO && s.position.x > 0.1).count()
    };
    assert!(behind(&known) >= behind(&seen) + 5, "{} {}", behind(&known), behind(&seen));
    // The control: views to come that are what is seen already say nothing, and nothing changes.
    assert!(same.lights().samples() == seen.lights().samples() && seen.is_settled());
    let opened = Illumination::new(&scene, &settings).expect("there is light");
    assert!(seen.lights().samples() == opened.lights().samples());
}

#[test]
fn what_is_smooth_enough_for_mirrored_rays_follows_the_materials() {
    let mut scene = builtin::build("gap", MovingObject::None).expect("a room");
    for material in &mut scene.materials {
        (material.specular, material.roughness) = (0.5, 0.9);
    }
    let view = View::new(&scene, &scene.cameras[0], 1.3);
    let settings = IlluminationSettings { views: vec![view], rewalk: Rewalk::Off, ..settings() };
    let mut held = Illumination::new(&scene, &settings).expect("there is light");
    let mirrors = |of: &Illumination| -> Vec<u32> {
        let database = of.visibility().expect("it was asked for");
        (0..database.receivers().leaves.len() as u32).filter(|leaf| database.is_mirror(*leaf)).collect()
    };
    assert!(mirrors(&held).is_empty());
    for material in (0..scene.materials.len()).map(MaterialId::from) {
        let shades = Shades { roughness: 0.1, ..scene.materials[material].shades() };
        scene.set_shades(material, shades).expect("a material");
    }
    let changes = scene.take_changes();
    assert!(changes.is_motion(), "visibility is not made anew");
    held.update(&scene, &changes).expect("they follow");
    let database = held.visibility().expect("it was asked for");
    assert_eq!(mirrors(&held).len(), database.receivers().leaves.len());
}
