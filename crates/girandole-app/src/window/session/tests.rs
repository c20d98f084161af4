use super::super::clock::Instant;
use super::super::presets::PRESETS;
use super::*;
use crate::args::{BackgroundArg, EnvironmentArg};
use crate::window::budget::Quality;
use girandole::wgpu;
use girandole_core::glam::Vec3;
use girandole_core::lights::LightSettings;
use girandole_core::scene::Edit;
use girandole_core::scene::builtin::{self, MovingObject};
use girandole_core::tonemap::Exposure;

pub const SIZE: [u32; 2] = [64, 48];

/// A device that draws nothing.
fn device() -> (wgpu::Device, wgpu::Queue) {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::NOOP;
    descriptor.backend_options.noop.enable = true;
    let instance = wgpu::Instance::new(descriptor);
    pollster::block_on(async {
        let adapter = instance.request_adapter(&Default::default()).await.unwrap();
        adapter.request_device(&Default::default()).await.unwrap()
    })
}

/// A session without a renderer.
pub fn session() -> Session {
    let mut scene = builtin::build("pillars", MovingObject::Torus).unwrap();
    scene.open();
    let eye = Eye::Camera(0);
    let light = IlluminationSettings {
        lights: LightSettings { count: 8, candidates: 1, ..LightSettings::default() },
        views: vec![eye.view(&scene, 4.0 / 3.0)],
        rewalk: Rewalk::Off,
        ..IlluminationSettings::default()
    };
    let (options, settings) = (RendererOptions::default(), RenderSettings::default());
    let source = Source { scene: "pillars".into(), ..Source::default() };
    Session::new(Start {
        budget: None,
        source,
        scene,
        edits: Edits::default(),
        eye,
        options,
        light,
        settings,
        refine: true,
        transfers: Transfers::new(crate::args::TransferArgs::default(), Vec::new()),
    })
}

/// Makes all light that is to be made, a slice at a time.
pub fn make(session: &mut Session, (device, queue): &(wgpu::Device, wgpu::Queue)) {
    for _ in 0..10_000 {
        if !session.is_making() {
            return;
        }
        session.make((device, queue), Instant::now());
    }
    panic!("it never ends");
}

pub struct Drawn {
    pub device: (wgpu::Device, wgpu::Queue),
    pub target: PictureTarget,
    pub session: Session,
}

/// A session with its first picture.
pub fn drawn() -> Drawn {
    let device = device();
    let mut target = PictureTarget::new((&device.0, &device.1), SIZE, wgpu::TextureFormat::Bgra8Unorm);
    let mut session = session();
    assert_eq!(session.work(), Work::Renderer);
    make(&mut session, &device);
    assert_eq!((session.work(), &session.notice), (Work::Nothing, &None));
    assert!(session.wants_picture(SIZE));
    session.draw(&mut target);
    assert!(!session.wants_picture(SIZE), "{:?}", session.notice);
    Drawn { device, target, session }
}

#[test]
fn only_what_a_change_needs_is_made_anew() {
    let Drawn { mut session, .. } = drawn();
    session.settings.exposure = Exposure::Ev(1.0);
    assert_eq!((session.work(), session.wants_picture(SIZE)), (Work::Nothing, true));
    session.settings.exposure = Exposure::Auto;
    assert!(!session.wants_picture(SIZE));
    session.light.lights.seed = 1;
    assert_eq!(session.work(), Work::Light);
    session.light.lights.seed = 0;
    session.options.pcf = 3;
    assert_eq!(session.work(), Work::Renderer);
}

#[test]
fn exposure_and_curve_leave_radiance_as_it_is() {
    let picture =
        |settings| Picture { view: session().view(SIZE), size: SIZE, settings, quality: Quality::FULL };
    let first = RenderSettings::default();
    let brighter = RenderSettings { exposure: Exposure::Ev(2.0), ..first };
    let finer = RenderSettings { samples_per_axis: 2, ..first };
    assert!(picture(first).has_radiance_of(&picture(brighter)));
    assert!(!picture(first).has_radiance_of(&picture(finer)));
}

#[test]
fn motion_is_followed_and_repeats() {
    let Drawn { mut session, mut target, .. } = drawn();
    session.playback.playing = true;
    let duration = session.scene.duration();
    session.advance(duration + 0.5);
    assert!((session.playback.seconds - 0.5).abs() < 1e-9);
    session.follow(SIZE);
    assert!(session.wants_picture(SIZE));
    session.draw(&mut target);
    assert_eq!((session.notice.clone(), session.wants_picture(SIZE)), (None, false));
}

#[test]
fn what_is_refused_is_said_once_and_not_tried_again() {
    let Drawn { mut session, device, .. } = drawn();
    session.light.lights.candidates = 0;
    make(&mut session, &device);
    assert!(session.notice.as_ref().unwrap().contains("candidates"), "{:?}", session.notice);
    assert_eq!((session.work(), session.wants_picture(SIZE)), (Work::Nothing, false));
    session.light.lights.candidates = 1;
    assert_eq!(session.work(), Work::Light);
    make(&mut session, &device);
    assert_eq!((session.notice.clone(), session.wants_picture(SIZE)), (None, true));
}

#[test]
fn another_scene_is_lit_by_the_same_settings() {
    let Drawn { mut session, device, .. } = drawn();
    let views = session.light.views.clone();
    session.replace_scene(Source::default(), builtin::build("table", MovingObject::None).unwrap(), SIZE);
    assert_eq!((session.work(), session.light.lights.count), (Work::Light, 8));
    assert_ne!(session.light.views, views);
    make(&mut session, &device);
    assert!(session.wants_picture(SIZE) && !session.is_placed_elsewhere(SIZE));
}

#[test]
fn what_is_around_the_scene_can_be_changed() {
    let Drawn { mut session, device, .. } = drawn();
    let torus = session.scene.objects.last().unwrap().node;
    let transform = girandole_core::scene::Transform::translation(Vec3::new(0.5, 1.5, 0.0));
    session.edit(Edit::SetTransform {
        node: girandole_core::scene::NamedIndex::node(&session.scene, torus),
        transform,
    });
    let place = session.scene.world_from_node(torus);
    let surround = |session: &mut Session, load: LoadArgs| {
        session.surround(load.clone());
        assert_eq!((session.work(), &session.source.load), (Work::Light, &load));
        make(session, &device);
        assert_eq!((session.work(), &session.notice), (Work::Nothing, &None));
        assert_eq!(session.scene.world_from_node(torus), place, "edits stay");
    };
    let sky = EnvironmentArg::Sky([40.0, 225.0, 3.0]);
    let mut load = LoadArgs { environment: Some(sky), ..LoadArgs::default() };
    surround(&mut session, load.clone());
    let bright = session.scene.environment.clone().unwrap();
    assert!(bright.visible);
    load.environment_strength = Some(0.5);
    load.background = BackgroundArg::Transparent;
    surround(&mut session, load.clone());
    let dim = session.scene.environment.clone().unwrap();
    assert!(dim.strength == 0.5 && !dim.visible && dim.map == bright.map);
    load.environment = Some(EnvironmentArg::Color([1.0, 2.0, 3.0]));
    surround(&mut session, load);
    assert_ne!(session.scene.environment.as_ref().unwrap().map, bright.map);
    surround(&mut session, LoadArgs::default());
    assert!(session.scene.environment.is_none());
    // What cannot be read is said, and nothing changes.
    let missing = EnvironmentArg::File("no such sky.exr".into());
    session.surround(LoadArgs { environment: Some(missing), ..LoadArgs::default() });
    assert!(session.notice.is_some() && session.source.load == LoadArgs::default());
}

#[test]
fn objects_are_lit_by_transfer_as_long_as_it_is_chosen() {
    use girandole_core::transfer::{Gathering, ObjectTransfer, TransferSettings};
    let Drawn { mut session, device, mut target } = drawn();
    let object = (session.scene.objects.len() - 1).into();
    let settings = TransferSettings { directions: 64, bounces: 0, ..TransferSettings::default() };
    let transfer = ObjectTransfer::simulate(&session.scene, object, &settings, &|_| ()).unwrap().into();
    let transferred = crate::transfer::Transferred { object, transfer, gathering: Gathering::GRID };
    session.transfers = Transfers::new(crate::args::TransferArgs::default(), vec![transferred]);
    let lit = |session: &Session| session.shown_by().unwrap().0.transferred().collect::<Vec<_>>();
    let mut draw = |session: &mut Session| {
        assert!(session.wants_picture(SIZE));
        session.draw(&mut target);
        assert_eq!(session.notice, None);
    };
    session.forget_picture();
    draw(&mut session);
    assert_eq!((lit(&session), session.transfers.gathering(object)), (vec![object], Some(Gathering::GRID)));
    assert_eq!(session.transfers.arguments(&session.scene).gathering(), Some(Gathering::GRID));
    session.set_transfer(object, Some(Gathering::Center));
    draw(&mut session);
    assert_eq!(session.transfers.gathering(object), Some(Gathering::Center));
    // A renderer of other options lights it too.
    session.options.pcf = 3;
    make(&mut session, &device);
    draw(&mut session);
    assert_eq!(lit(&session), [object]);
    session.set_transfer(object, None);
    draw(&mut session);
    assert_eq!((lit(&session), session.transfers.gathering(object)), (vec![], None));
    assert_eq!(session.transfers.arguments(&session.scene), crate::args::TransferArgs::default());
}

#[test]
fn transfer_is_simulated_beside_what_is_shown() {
    use girandole_core::transfer::{Gathering, ObjectTransfer, TransferSettings};
    let Drawn { mut session, mut target, .. } = drawn();
    let object: girandole_core::scene::ObjectId = (session.scene.objects.len() - 1).into();
    let simulate = |session: &mut Session| {
        let (begin, begun) = std::sync::mpsc::channel();
        let scene = session.scene.clone();
        session.transfers.simulate(object, Gathering::Center, move |progress| {
            progress(0.25);
            begun.recv()?;
            let settings = TransferSettings { directions: 64, bounces: 0, ..TransferSettings::default() };
            let transfer = ObjectTransfer::simulate(&scene, object, &settings, &|_| ())?.into();
            Ok(crate::transfer::Transferred { object, transfer, gathering: Gathering::Center })
        });
        begin
    };
    let wait_until = |done: &mut dyn FnMut() -> bool| {
        let start = std::time::Instant::now();
        while !done() {
            assert!(start.elapsed().as_secs() < 60);
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
    };
    // Meanwhile shadow maps light it, and it can be left to them, or lit in another way.
    let begin = simulate(&mut session);
    wait_until(&mut || session.progress() == Some((0.25, "Light transfer")));
    assert!(!session.collect_transfer() && !session.wants_picture(SIZE));
    assert_eq!(session.transfers.gathering(object), Some(Gathering::Center));
    session.cancel();
    assert_eq!((session.progress(), session.transfers.gathering(object)), (None, None));
    drop(begin);
    let begin = simulate(&mut session);
    session.set_transfer(object, Some(Gathering::GRID));
    begin.send(()).unwrap();
    wait_until(&mut || session.collect_transfer());
    assert!(session.progress().is_none() && session.wants_picture(SIZE));
    session.draw(&mut target);
    assert_eq!(session.shown_by().unwrap().0.transferred().collect::<Vec<_>>(), [object]);
    assert_eq!(session.transfers.gathering(object), Some(Gathering::GRID));
    session.set_transfer(object, None);
    // What fails is said, and what was removed meanwhile is forgotten.
    drop(simulate(&mut session));
    wait_until(&mut || session.collect_transfer());
    assert!(session.notice.take().is_some() && session.transfers.gathering(object).is_none());
    let begin = simulate(&mut session);
    session.edit(Edit::RemoveObject {
        object: girandole_core::scene::NamedIndex::object(&session.scene, object),
    });
    begin.send(()).unwrap();
    wait_until(&mut || session.collect_transfer());
    assert_eq!((session.notice, session.transfers.gathering(object)), (None, None));
}

#[test]
fn samples_that_follow_little_by_little_go_over_to_what_is_seen() {
    let Drawn { mut session, device, mut target } = drawn();
    session.light.rewalk = Rewalk::Paths(girandole_core::lights::Pace { paths: 4, fade: 0 });
    make(&mut session, &device);
    session.draw(&mut target);
    let view = super::super::camera::moved(&session.view(SIZE), Vec3::X * 0.2);
    session.eye = Eye::free(&view).unwrap();
    session.follow(SIZE);
    assert_eq!((&session.light.views, session.work()), (&vec![session.view(SIZE)], Work::Nothing));
    assert!(session.notice.is_none());
}

#[test]
fn presets_are_found_by_their_settings_and_change_what_they_are_about() {
    let Drawn { mut session, .. } = drawn();
    let matching = |session: &Session| {
        PRESETS.iter().filter(|p| p.matches(session, SIZE)).map(|p| p.name).collect::<Vec<_>>()
    };
    assert!(matching(&session).is_empty());
    let seed = session.light.lights.seed;
    for preset in &PRESETS {
        preset.apply(&mut session, SIZE);
        assert_eq!((matching(&session), session.light.lights.seed), (vec![preset.name], seed));
    }
}

/// Light that was made sooner than rest has come does not leave a picture of lower resolution.
#[test]
fn a_hurried_picture_is_not_the_last_one() {
    let device = device();
    let mut session = session();
    make(&mut session, &device);
    session.rest(0.0, SIZE);
    assert!(session.is_fresh(SIZE) && session.rests_in(SIZE).is_none());
    session.budget.milliseconds = Some(33.0);
    assert!(session.is_hurried() && session.rests_in(SIZE).is_some());
    session.rest(1.0, SIZE);
    assert!(!session.is_hurried() && session.rests_in(SIZE).is_none());
}

/// Refines by the smallest slices until so many sets are averaged. Returns how many pictures there were.
fn refine(session: &mut Session, target: &mut PictureTarget, sets: u32) -> usize {
    let mut pictures = 0;
    for _ in 0..10_000 {
        if session.refined_sets() >= sets {
            return pictures;
        }
        assert!(session.may_refine(SIZE), "{:?}", session.notice);
        pictures += usize::from(session.refine(target, Instant::now()));
    }
    panic!("it never ends");
}

#[test]
fn what_rests_is_refined_until_something_changes() {
    let Drawn { mut session, mut target, .. } = drawn();
    // Whatever light was sampled for.
    session.fresh_at_rest = false;
    assert_eq!((session.refined_sets(), refine(&mut session, &mut target, 3)), (1, 2));
    assert!(!session.wants_picture(SIZE) && session.refinement.is_waiting());
    // Another exposure shows the same average.
    session.settings.exposure = Exposure::Ev(1.0);
    assert!(!session.may_refine(SIZE));
    session.draw(&mut target);
    assert_eq!((session.refined_sets(), session.may_refine(SIZE)), (3, true));
    // Another view begins anew, and so does motion.
    let view = super::super::camera::moved(&session.view(SIZE), Vec3::X * 0.2);
    session.eye = Eye::free(&view).unwrap();
    assert!(!session.may_refine(SIZE));
    session.draw(&mut target);
    assert_eq!((session.refined_sets(), refine(&mut session, &mut target, 2)), (1, 1));
    session.seek(0.5);
    session.follow(SIZE);
    assert!(!session.may_refine(SIZE));
    session.draw(&mut target);
    assert_eq!((session.refined_sets(), refine(&mut session, &mut target, 2)), (1, 1));
    session.refinement.on = false;
    assert_eq!((session.may_refine(SIZE), session.notice.clone()), (false, None));
}

/// However much time there is, neither goes together with anything else.
#[test]
fn what_a_renderer_loads_has_its_time_for_itself() {
    let device = device();
    let mut session = session();
    let loaded: Vec<_> = (0..5)
        .map(|_| {
            let much = Instant::now() + std::time::Duration::from_secs(3600);
            session.make((&device.0, &device.1), much);
            assert!(session.progress().is_none_or(|(share, _)| share <= 1.0), "{:?}", session.progress());
            session.illumination().map(|light| light.visibility().is_some())
        })
        .collect();
    assert_eq!((session.is_making(), &session.notice), (false, &None));
    assert_eq!(loaded, [None, Some(false), Some(false), Some(true), Some(true)]);
}
