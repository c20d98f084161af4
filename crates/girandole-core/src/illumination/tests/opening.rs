//! What is opened in slices is what is opened at once.

use super::super::{Opening, Stage};
use super::*;

/// Opens a scene slice by slice; returns how many there were up to its light, and in all.
fn in_slices(
    scene: &Arc<Scene>,
    settings: &IlluminationSettings,
    most: Option<usize>,
) -> (Illumination, [usize; 2]) {
    let (mut opening, mut opened, mut slices) = (Opening::new(settings.clone()), None, [0; 2]);
    let mut before = 0.0;
    loop {
        assert!(opening.progress() >= before, "{} after {before}", opening.progress());
        before = opening.progress();
        slices[1] += 1;
        match (opening.step(scene, || false).expect("a slice"), &mut opened) {
            (Stage::Lights(mut illumination), none) => {
                illumination.light(scene, most).expect("light");
                *none = Some(*illumination);
                slices[0] = slices[1];
            }
            (Stage::Slice, _) => {}
            (Stage::Visibility(database), Some(opened)) => {
                opened.set_visibility(scene, database).expect("visibility");
            }
            (Stage::Visibility(_), None) => panic!("there are no lights"),
            (Stage::Done, _) => return (opened.expect("it is open"), slices),
        }
    }
}

#[test]
fn slices_lead_to_the_same() {
    for name in ["pillars", "gap"] {
        let scene = Arc::new(builtin::build(name, MovingObject::Torus).expect("a room"));
        let settings = IlluminationSettings { rewalk: Rewalk::Off, ..settings() };
        let whole = Illumination::new(&scene, &settings).expect("opens");
        let (opened, slices) = in_slices(&scene, &settings, None);
        assert_eq!(contents(&opened), contents(&whole), "{name}");
        let [light, all] = slices;
        assert!(light > 8 && all > light + 4, "{name}: {slices:?} slices");
        let blind = IlluminationSettings { visibility: None, ..settings };
        assert!(in_slices(&scene, &blind, None).0.visibility().is_none());
    }
}

#[test]
fn slices_of_another_version_are_refused() {
    let scene = Arc::new(builtin::build("gap", MovingObject::Torus).expect("a room"));
    let mut changed = scene.clone();
    Arc::make_mut(&mut changed).set_time(1.0).expect("a moment");
    // While light is sampled, and after.
    for sampled in [false, true] {
        let mut opening = Opening::new(settings());
        while !matches!(opening.step(&scene, || false).expect("a slice"), Stage::Lights(_)) && sampled {}
        assert!(opening.step(&changed, || false).is_err());
    }
}

#[test]
fn few_lit_samples_have_the_visibility_of_all_and_become_all() {
    let mut scene = Arc::new(builtin::build("pillars", MovingObject::Torus).expect("a room"));
    let settings = IlluminationSettings { rewalk: Rewalk::Off, ..settings() };
    let (mut few, _) = in_slices(&scene, &settings, Some(4));
    let lit = |of: &Illumination| of.lights().samples().iter().filter(|s| s.intensity != Vec3::ZERO).count();
    let mut all = Illumination::new(&scene, &settings).expect("opens");
    assert_eq!((lit(&few), lit(&all)), (4, all.lights().len()));
    assert_eq!(contents(&few).1, contents(&all).1);
    // They stay as few while things move.
    let moving = Arc::make_mut(&mut scene);
    moving.set_time(1.5).expect("a moment");
    let changes = moving.take_changes();
    few.update(&scene, &changes).expect("update");
    all.update(&scene, &changes).expect("update");
    assert_eq!(lit(&few), 4);
    few.light(&scene, Some(8)).expect("light");
    assert_eq!(lit(&few), 8);
    few.light(&scene, None).expect("light");
    assert_eq!(contents(&few), contents(&all));
}

#[test]
fn what_is_handed_over_has_its_time_for_itself() {
    let scene = Arc::new(builtin::build("gap", MovingObject::Torus).expect("a room"));
    let mut opening = Opening::new(settings());
    let mut stages = Vec::new();
    while stages.last() != Some(&"done") {
        stages.push(match opening.step(&scene, || true).expect("a slice") {
            Stage::Slice => "slices",
            Stage::Lights(_) => "light",
            Stage::Visibility(_) => "visibility",
            Stage::Done => "done",
        });
    }
    assert_eq!(
        stages,
        ["slices", "light", "slices", "visibility", "done"],
        "with all the time that there is"
    );
}
