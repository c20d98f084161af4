//! What is undone leaves nothing behind.

use super::super::selection::{Selected, delete, duplicate};
use super::super::tools::Tools;
use super::super::{bookmarks, lamps};
use super::tests::{Drawn, SIZE, drawn, make};
use super::*;
use crate::args::EnvironmentArg;
use girandole_core::glam::Vec3;
use girandole_core::illumination::Illumination;
use girandole_core::scene::{
    Edit, FieldOfView, Geometry, LightId, MaterialId, NamedIndex, PunctualKind, Shades, Shape, Transform,
    Viewpoint,
};
use girandole_reference::{OracleSettings, oracle};

/// Random numbers that are the same on each machine.
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0 >> 33
    }

    fn below(&mut self, end: usize) -> usize {
        self.next() as usize % end
    }

    fn share(&mut self) -> f32 {
        (self.next() % 1000) as f32 / 1000.0
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.share(), self.share(), self.share())
    }
}

/// The picture of the CPU engine with light that is sampled for it, pixel by pixel: that of `girandole render` on
/// any machine.
fn picture(session: &Session) -> Vec<u32> {
    let view = session.view([16, 12]);
    let mut settings = IlluminationSettings { views: vec![session.view(SIZE)], ..session.light.clone() };
    (settings.visibility, settings.lights.dark) = (None, true);
    let light = Illumination::new(&session.scene, &settings).expect("it is lit, or dark");
    let tracer = SceneTracer::new(&session.scene, light.geometry());
    let image = oracle(&tracer, light.lights(), &view, [16, 12], &OracleSettings::default(), &|_| ());
    image.pixels.iter().flat_map(|p| p.to_array()).map(f32::to_bits).collect()
}

/// All that pictures depend on but the light.
fn state(session: &Session) -> String {
    let scene = &session.scene;
    let geometry = Geometry::new(scene);
    let positions: Vec<u32> =
        geometry.positions.iter().flat_map(|p| p.to_array()).map(f32::to_bits).collect();
    format!(
        "{:?} {:?} {:?} {:?} {:?} {:?} {:?} {} {:?} {positions:?}",
        scene.frame_of_reference(),
        scene.nodes,
        scene.objects,
        scene.materials,
        scene.lights,
        scene.cameras,
        session.source,
        scene.meshes.len(),
        session.edits,
    )
}

/// One of all kinds of changes, as hands make them.
fn change(session: &mut Session, tools: &mut Tools, dice: &mut Dice) {
    let object = dice.below(session.scene.objects.len());
    let node = NamedIndex::node(&session.scene, session.scene.objects[object].node);
    let material = MaterialId::from(dice.below(session.scene.materials.len()));
    let named = NamedIndex::material(&session.scene, material);
    tools.select(Some(Selected::Object(object.into())));
    match dice.below(14) {
        0 | 1 => {
            // A drag, now and then out of the room.
            let reach = if dice.below(4) == 0 { 60.0 } else { 1.0 };
            let to = (dice.vector() - 0.5) * reach;
            for share in [0.2, 0.6, 1.0] {
                let transform = Transform::translation(to * share);
                session.edit(Edit::SetTransform { node: node.clone(), transform });
            }
        }
        2 => delete(session, tools),
        3 => duplicate(session, tools),
        4 => session.edit(Edit::SetEmission { material: named, emission: dice.vector() * 3.0 }),
        5 => session.edit(Edit::SetEmission { material: named, emission: Vec3::ZERO }),
        6 => {
            let (specular, metallic) = (dice.below(2) as f32, dice.below(2) as f32);
            let shades = Shades { base_color: dice.vector(), roughness: dice.share(), metallic, specular };
            session.edit(Edit::SetShades { material: named, shades });
        }
        7 => lamps::add(session, tools, lamps::NewLamp::Point),
        8 => lamps::add(session, tools, lamps::NewLamp::Spot),
        9 => lamps::add(session, tools, lamps::NewLamp::Panel),
        10 => {
            let lights = session.scene.lights.len();
            if lights > 0 {
                tools.select(Some(Selected::Light(dice.below(lights).into())));
                if dice.below(2) == 0 { delete(session, tools) } else { duplicate(session, tools) }
            }
        }
        11 => {
            let sky = [10.0 + dice.below(70) as f32, 120.0, 3.0];
            let environment = [None, Some(EnvironmentArg::Sky(sky)), Some(EnvironmentArg::Color([0.5; 3]))];
            let environment = environment[dice.below(3)].clone();
            session.surround(LoadArgs { environment, ..LoadArgs::default() });
        }
        12 => session.seek(f64::from(dice.share()) * 4.0),
        _ => {
            let shape = [Shape::Torus, Shape::Teapot][dice.below(2)].clone();
            let transform = Transform::translation(dice.vector());
            let name = "thing".into();
            session.edit(Edit::InsertObject { name, shape, material: None, transform, dynamic: true });
        }
    }
    session.end_step();
}

#[test]
fn fifty_random_edits_are_undone_and_done_again_to_the_bit() {
    let Drawn { mut session, device, .. } = drawn();
    let mut tools = Tools::new("shot.png".into(), SIZE, None);
    let (first, first_picture) = (state(&session), picture(&session));
    for seed in [1, 2] {
        let mut dice = Dice(seed);
        let mut states = vec![first.clone()];
        let mut made = 0;
        while made < 50 {
            change(&mut session, &mut tools, &mut dice);
            session.notice = None;
            let now = state(&session);
            if now != states[states.len() - 1] {
                states.push(now);
                made += 1;
            }
            // The renderer follows now and then, as it does between frames.
            if dice.below(8) == 0 {
                make(&mut session, &device);
                session.follow(SIZE);
            }
        }
        session.notice = None;
        let last_picture = picture(&session);
        assert_ne!(last_picture, first_picture, "the control");
        for before in states.iter().rev().skip(1) {
            session.undo();
            assert_eq!((&state(&session), &session.notice), (before, &None));
        }
        assert!(!session.can_undo_and_redo()[0]);
        assert!(session.edits == Edits::default() && picture(&session) == first_picture);
        session.undo();
        assert_eq!(state(&session), first);
        for after in states.iter().skip(1) {
            session.redo();
            assert_eq!(&state(&session), after);
        }
        assert!(!session.can_undo_and_redo()[1] && picture(&session) == last_picture);
        (0..50).for_each(|_| session.undo());
        assert_eq!(state(&session), first);
    }
}

#[test]
fn what_goes_on_is_one_step_and_what_comes_after_another() {
    let Drawn { mut session, .. } = drawn();
    let torus = session.scene.objects.last().unwrap().node;
    let node = NamedIndex::node(&session.scene, torus);
    let place = |session: &Session| session.scene.nodes[torus].local;
    let drag = |session: &mut Session, to: f32| {
        for share in [0.3, 0.7, 1.0] {
            let transform = Transform::translation(Vec3::Y * (1.0 + to * share));
            session.edit(Edit::SetTransform { node: node.clone(), transform });
            // Animations that play along belong to it.
            let seconds = f64::from(share);
            session.edit(Edit::SetTime { seconds });
            session.edit(Edit::SetTransform { node: node.clone(), transform });
        }
        session.end_step();
        place(session)
    };
    let first = place(&session);
    let (one, two) = (drag(&mut session, 0.1), drag(&mut session, 0.2));
    session.undo();
    assert_eq!(place(&session), one);
    session.redo();
    assert_eq!(place(&session), two);
    session.undo();
    session.undo();
    assert_eq!((place(&session), session.can_undo_and_redo()), (first, [false, true]));
    // What is done then leaves nothing to be made again.
    let three = drag(&mut session, 0.3);
    session.redo();
    assert_eq!((place(&session), session.can_undo_and_redo()), (three, [true, false]));
    // Time that passes, whether it is stopped or not, is one step.
    for seconds in [0.4, 0.5, 0.6] {
        session.seek(seconds);
        session.end_step();
    }
    session.undo();
    assert_eq!((place(&session), session.playback.seconds), (three, 1.0));
    // What is given up has never been.
    session.edit(Edit::SetTransform { node: node.clone(), transform: Transform::IDENTITY });
    session.cancel_step();
    assert_eq!((place(&session), session.can_undo_and_redo()), (three, [true, false]));
    session.cancel_step();
    session.undo();
    assert_eq!(place(&session), first);
    // What is refused is no step.
    session.edit(Edit::RemoveObject { object: NamedIndex { index: 99, name: String::new() } });
    assert!(session.notice.take().is_some() && session.can_undo_and_redo()[1]);
    session.undo();
    assert_eq!(place(&session), first);
}

#[test]
fn what_is_around_is_a_step_of_its_own_and_sliders_are_one() {
    let Drawn { mut session, .. } = drawn();
    let first = state(&session);
    let sky = |elevation: f32| {
        let environment = Some(EnvironmentArg::Sky([elevation, 200.0, 3.0]));
        LoadArgs { environment, ..LoadArgs::default() }
    };
    for elevation in [10.0, 20.0, 30.0] {
        session.surround(sky(elevation));
    }
    session.end_step();
    session.surround(sky(60.0));
    session.undo();
    assert_eq!(session.source.load, sky(30.0));
    session.undo();
    assert_eq!((state(&session), session.scene.environment.is_none()), (first, true));
    session.redo();
    assert_eq!(session.source.load, sky(30.0));
    // What cannot be read changes nothing, and is no step.
    let missing = Some(EnvironmentArg::File("no such sky.exr".into()));
    session.surround(LoadArgs { environment: missing, ..LoadArgs::default() });
    assert!(session.notice.take().is_some());
    session.undo();
    assert!(session.scene.environment.is_none());
}

#[test]
fn all_lamps_off_is_dark_and_one_on_is_light_again() {
    let Drawn { mut session, device, .. } = drawn();
    session.light.lights.dark = true;
    session.light.views = vec![session.view(SIZE)];
    let lit = |session: &Session| {
        let light = session.shown_by().unwrap().0.illumination().unwrap();
        light.lights().samples().iter().any(|sample| sample.intensity.max_element() > 0.0)
    };
    let all = lamps::Lamp::all(&session);
    assert!(!all.is_empty());
    make(&mut session, &device);
    for lamp in &all {
        let edit = lamp.shine(&session.scene, Vec3::ZERO);
        session.edit(edit);
    }
    session.follow(SIZE);
    session.forget_making();
    session.is_outdated = true;
    make(&mut session, &device);
    session.shown = Some(session.picture(SIZE));
    assert!(!lit(&session) && session.work() == Work::Nothing, "{:?}", session.notice);
    assert!(session.notice.as_ref().is_some_and(|notice| notice.contains("the scene has no light")));
    assert!(picture(&session).iter().all(|bits| *bits == 0));
    let edit = all[0].shine(&session.scene, Vec3::ONE);
    session.edit(edit);
    session.follow(SIZE);
    session.shown = Some(session.picture(SIZE));
    assert!(lit(&session), "{:?}", session.notice);
}

#[test]
fn bookmarks_come_back_to_the_view_and_are_edits() {
    let Drawn { mut session, .. } = drawn();
    let tools = Tools::new("shot.png".into(), SIZE, None);
    let field = FieldOfView::Perspective { degrees: 50.0 };
    let viewpoint = |x| Viewpoint {
        eye: Vec3::new(x, 1.5, 2.0).into(),
        target: Vec3::Y.into(),
        up: Vec3::Y.into(),
        field,
        clip: Default::default(),
    };
    for (number, x) in [(1, 0.5), (2, -0.7), (1, 0.3)] {
        session.eye = Eye::Free(viewpoint(x));
        bookmarks::store(&mut session, &tools, number);
    }
    let cameras = session.scene.cameras.len();
    session.eye = Eye::Camera(0);
    bookmarks::recall(&mut session, 3);
    assert_eq!(session.eye, Eye::Camera(0));
    for (number, x) in [(1, 0.3), (2, -0.7)] {
        bookmarks::recall(&mut session, number);
        let (seen, kept) = (session.view(SIZE), viewpoint(x).view(4.0 / 3.0).unwrap());
        assert!(seen.eye.abs_diff_eq(kept.eye, 1e-6) && seen.forward.abs_diff_eq(kept.forward, 1e-6));
    }
    assert_eq!((cameras, session.edits.0.len()), (session.scene.cameras.len(), 3));
    // Undone while one looks from it.
    (0..3).for_each(|_| session.undo());
    assert_eq!((session.eye, session.edits.0.len()), (Eye::Camera(0), 0));
    // Nothing is derived from cameras.
    assert!(session.work() == Work::Nothing);
}

#[test]
fn a_spot_s_cone_is_an_edit_and_structure_is_not_deleted_by_accident() {
    let Drawn { mut session, .. } = drawn();
    let mut tools = Tools::new("shot.png".into(), SIZE, None);
    lamps::add(&mut session, &mut tools, lamps::NewLamp::Spot);
    let light = NamedIndex::light(&session.scene, LightId(0));
    session.edit(Edit::SetCone { light, inner: 0.1, outer: 0.3 });
    assert_eq!(session.scene.lights[0].kind, PunctualKind::Spot { inner: 0.1, outer: 0.3 });
    session.follow(SIZE);
    session.shown = Some(session.picture(SIZE));
    let view = session.view(SIZE);
    let is_structure = |index: usize| Selected::Object(index.into()).is_structure(&session, &view);
    let names: Vec<&str> = session.scene.objects.iter().map(|object| object.name.as_str()).collect();
    let floor = names.iter().position(|name| *name == "floor").unwrap();
    assert!(is_structure(floor) && !is_structure(names.len() - 1), "{names:?}");
    (tools.selected, tools.is_locked) = (Some(Selected::Object(floor.into())), true);
    delete(&mut session, &mut tools);
    assert!(session.notice.take().is_some() && !session.scene.objects[floor].removed);
    tools.is_locked = false;
    delete(&mut session, &mut tools);
    assert!(session.scene.objects[floor].removed && tools.selected.is_none());
}
