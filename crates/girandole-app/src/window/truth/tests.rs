use super::super::session::tests::{Drawn, SIZE, drawn, make};
use super::*;
use girandole_core::tonemap::Exposure;

/// Goes on until something is so; for ten seconds at most.
fn until(drawn: &mut Drawn, truth: &mut Truth, is_so: impl Fn(&Truth) -> bool) {
    let start = Instant::now();
    let context = egui::Context::default();
    while !is_so(truth) {
        assert!(start.elapsed() < Duration::from_secs(10), "{:?}", drawn.session.notice);
        make(&mut drawn.session, &drawn.device);
        drawn.session.follow(SIZE);
        if drawn.session.wants_picture(SIZE) {
            drawn.session.draw(&mut drawn.target);
        }
        truth.step(&mut drawn.session, SIZE, &context);
        let _ = drawn.device.0.poll(girandole::wgpu::PollType::Poll);
    }
}

fn against(against: Against) -> Truth {
    Truth { against, ..Truth::default() }
}

#[test]
fn the_path_tracer_goes_on_whatever_the_settings_of_the_picture() {
    let (mut drawn, mut truth) = (drawn(), against(Against::PathTracer));
    until(&mut drawn, &mut truth, |truth| truth.comparison.is_some());
    assert!(truth.texture.is_some());
    let paths = truth.paths();
    assert!(paths > Some(0));
    let before = truth.number;
    drawn.session.settings.exposure = Exposure::Ev(1.0);
    drawn.session.settings.tolerance = 0.3;
    drawn.session.light.lights.count = 9;
    until(&mut drawn, &mut truth, |truth| truth.number != before && truth.ours.pending.is_none());
    assert!(truth.paths() >= paths && truth.shown_as.map(|shown| shown.0) == Some(1.0));
}

#[test]
fn another_view_number_of_bounces_or_moment_begins_anew() {
    let (mut drawn, mut truth) = (drawn(), against(Against::PathTracer));
    let changes: [fn(&mut Session); 3] = [
        |session| session.light.lights.bounces = 2,
        |session| session.seek(0.5),
        |session| {
            let moved = super::super::camera::moved(&session.view(SIZE), girandole_core::glam::Vec3::X);
            session.eye = super::super::camera::Eye::free(&moved).expect("a view");
        },
    ];
    for change in changes {
        until(&mut drawn, &mut truth, |truth| truth.comparison.is_some() && !truth.has_news);
        let subject = truth.subject.clone();
        change(&mut drawn.session);
        until(&mut drawn, &mut truth, |truth| truth.subject != subject);
        assert!(truth.comparison.is_none());
        // All paths so far are of what is shown now.
        until(&mut drawn, &mut truth, |truth| truth.paths() > Some(0));
        let tracing = truth.tracing.as_ref().expect("paths");
        let view = drawn.session.view(SIZE);
        let mut anew = ProgressivePathTracer::new(&view, SIZE, &path_settings(&drawn.session.light));
        drawn.session.trace(&mut HeldHierarchies::default(), |tracer| {
            while anew.paths() < tracing.paths() {
                anew.step(tracer, SIZE[1]);
            }
        });
        // The last row has no other number of paths.
        let last_row = |tracing: &ProgressivePathTracer| {
            tracing.estimate().mean.pixels.split_off((SIZE[0] * (SIZE[1] - 1)) as usize)
        };
        assert_eq!(last_row(tracing), last_row(&anew));
        assert!(last_row(tracing).iter().any(|pixel| pixel.max_element() > 0.0));
    }
    truth.against = Against::Nothing;
    truth.step(&mut drawn.session, SIZE, &egui::Context::default());
    assert!(truth.tracing.is_none() && !truth.is_waiting());
}

#[test]
fn the_naive_picture_is_rendered_once_for_all_settings_of_ours() {
    let (mut drawn, mut truth) = (drawn(), against(Against::Naive));
    until(&mut drawn, &mut truth, |truth| truth.comparison.is_some() && !truth.is_waiting());
    let naive = truth.truth.image.clone().expect("a picture");
    assert_eq!(truth.paths(), None);
    drawn.session.settings.tolerance = 0.3;
    let before = truth.number;
    until(&mut drawn, &mut truth, |truth| truth.number != before && !truth.is_waiting());
    assert!(Arc::ptr_eq(&naive, truth.truth.image.as_ref().expect("a picture")));
    drawn.session.light.lights.seed = 3;
    until(&mut drawn, &mut truth, |truth| {
        truth.truth.image.as_ref().is_some_and(|i| !Arc::ptr_eq(i, &naive))
    });
}

#[test]
fn without_a_limit_paths_are_ended_by_chance() {
    let mut light = IlluminationSettings::default();
    assert_eq!(path_settings(&light).bounces, Some(light.lights.bounces));
    light.lights.bounces = u32::MAX;
    assert_eq!(path_settings(&light).bounces, None);
}
