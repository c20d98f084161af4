//! Several views of one scene: each picture is the one that its view has alone, and nothing is made anew for it.

use crate::common::{Context, OneView, Test, sun};
use girandole::{Mode, RenderSettings, Renderer, RendererOptions, Shading, Target, Viewport, wgpu};
use girandole_core::glam::Vec3;
use girandole_core::illumination::{IlluminationSettings, Rewalk};
use girandole_core::image::Image;
use girandole_core::lights::LightSettings;
use girandole_core::scene::builtin::MovingObject;
use girandole_core::scene::{Scene, Transform, View};

/// What every run has.
pub fn tests() -> Vec<Test> {
    vec![
        ("views_in_turn_are_as_each_alone", in_turn),
        ("views_recorded_together_are_as_each_alone", together),
        ("a_picture_is_refined_while_others_are_drawn", refined),
    ]
}

/// Sizes of the views.
const SIZES: [[u32; 2]; 2] = [[64, 36], [40, 40]];

/// A room with lamps and a sun, and two views of it.
fn room() -> (Scene, [View; 2]) {
    let mut scene = crate::common::with_object("pillars", MovingObject::Torus);
    sun(&mut scene, Vec3::new(1.0, 3.0, 2.0));
    let view = |camera: usize, [width, height]: [u32; 2]| {
        View::new(&scene, &scene.cameras[camera], width as f32 / height as f32)
    };
    let near = view(0, SIZES[1]);
    let near = View { half_extent: near.half_extent * 0.3, ..near };
    let views = [view(0, SIZES[0]), near];
    scene.take_changes();
    (scene, views)
}

fn opened(context: &Context, scene: &Scene, views: [View; 2]) -> OneView {
    let lights = LightSettings { count: 24, candidates: 2, ..LightSettings::default() };
    let (views, rewalk) = (views.to_vec(), Rewalk::Off);
    let settings = IlluminationSettings { lights, views, rewalk, ..IlluminationSettings::default() };
    let mut renderer = context.renderer(RendererOptions::default());
    renderer.open(scene, &settings).expect("open");
    renderer
}

fn picture(
    context: &Context,
    (renderer, viewport): (&mut Renderer, &mut Viewport),
    (view, size): (&View, [u32; 2]),
    settings: &RenderSettings,
) -> Image {
    renderer.render(viewport, view, size, settings).expect("render");
    context.wait(renderer.radiance(viewport)).expect("radiance")
}

/// Frames of two views in turn, at rest and while something moves.
fn in_turn(context: &Context) {
    let (mut scene, views) = room();
    let mut shared = opened(context, &scene, views).into_renderer();
    let mut alone = [0, 1].map(|_| opened(context, &scene, views));
    let mut viewports = [Viewport::default(), Viewport::default()];
    let full = RenderSettings::default();
    let multipass = Shading::Multipass { lights_per_pass: 4 };
    let all =
        [full, RenderSettings { shading: multipass, ..full }, RenderSettings { mode: Mode::Naive, ..full }];
    let torus = scene.objects.iter().rposition(|object| object.dynamic).expect("a torus");
    let node = scene.objects[torus].node;
    for step in 0..2 {
        if step > 0 {
            let place = Vec3::new(0.1 * step as f32, 0.5, -0.2);
            scene.set_transform(node, Transform::translation(place)).expect("a move");
            let changes = scene.take_changes();
            for renderer in alone.iter_mut().map(|alone| &mut **alone).chain([&mut shared]) {
                renderer.follow(&scene, &changes, &views).expect("follow");
            }
        }
        for (round, settings) in all.iter().chain([&full, &full]).enumerate() {
            let pictures = [0, 1].map(|view| {
                let seen = (&views[view], SIZES[view]);
                let viewport = &mut viewports[view];
                let picture = picture(context, (&mut shared, viewport), seen, settings);
                let stats = context.wait(shared.stats(viewport)).expect("stats");
                let expected = context.frame(&mut alone[view], seen.0, seen.1, settings);
                let stats_alone = context.wait(alone[view].stats()).expect("stats");
                assert!(picture.pixels == expected.pixels, "step {step}, round {round}, view {view}");
                assert_eq!(
                    (stats.points, stats.pairs, stats.passes),
                    (stats_alone.points, stats_alone.pairs, stats_alone.passes)
                );
                // Maps that one draws for itself are there in the next round, whatever the other looked up. The naive mode looks up all.
                match round {
                    0 => assert!(stats.maps_drawn > 0 || step + view > 0, "step {step}, view {view}"),
                    4 => assert_eq!(stats.maps_drawn, 0, "step {step}, view {view}"),
                    _ => {}
                }
                picture
            });
            assert!(pictures[0].pixels != pictures[1].pixels[..], "the control: they are two views");
        }
    }
    // Nothing is allocated for further frames.
    let allocated = || {
        context.gpu.wait().expect("the device");
        let report = context.gpu.device.generate_allocator_report();
        report.map(|report| (report.allocations.len(), report.total_allocated_bytes))
    };
    let mut turn = |count: usize| {
        for frame in 0..count {
            let view = frame % 2;
            shared.render(&mut viewports[view], &views[view], SIZES[view], &full).expect("render");
        }
    };
    turn(4);
    let before = allocated();
    assert!(before.is_some() || context.gpu.info.backend != wgpu::Backend::Vulkan, "it can be asked");
    turn(40);
    assert_eq!(allocated(), before, "further frames allocate something");
    // The control: one viewport for both makes its targets anew.
    let mut one = Viewport::default();
    shared.render(&mut one, &views[0], SIZES[0], &full).expect("render");
    assert!(before.is_none() || allocated() != before, "targets take memory");
}

/// Two views in one encoder, on targets of the caller's.
fn together(context: &Context) {
    let (scene, views) = room();
    let mut renderer = opened(context, &scene, views).into_renderer();
    let format = wgpu::TextureFormat::Rgba16Float;
    let mut viewports = [Viewport::default(), Viewport::default()];
    let settings = RenderSettings::default();
    let targets = SIZES.map(|size| context.target(size, format).create_view(&Default::default()));
    let mut encoder = context.gpu.device.create_command_encoder(&Default::default());
    for round in 0..2 {
        for view in 0..2 {
            let target = Target::new(&targets[view], format, SIZES[view]);
            let viewport = &mut viewports[view];
            let recorded = renderer.record(viewport, &mut encoder, &views[view], &target, &settings);
            recorded.unwrap_or_else(|error| panic!("round {round}: {error}"));
        }
    }
    context.gpu.queue.submit([encoder.finish()]);
    for view in 0..2 {
        let shown = context.wait(renderer.radiance(&viewports[view])).expect("radiance");
        let alone = context.frame(&mut opened(context, &scene, views), &views[view], SIZES[view], &settings);
        assert!(shown.pixels == alone.pixels, "view {view}");
    }
}

/// A picture that is refined while others are drawn and refined is the one that is refined alone.
fn refined(context: &Context) {
    let (scene, views) = room();
    let mut renderer = opened(context, &scene, views);
    let settings = RenderSettings::default();
    let mut viewports = [Viewport::default(), Viewport::default()];
    let sets = 2;
    let expected = [0, 1].map(|view| {
        while renderer.refined_sets() < sets {
            renderer.refine(&scene, &views[view], SIZES[view], &settings).expect("refine");
        }
        let picture = context.wait(renderer.radiance()).expect("radiance");
        renderer.render(&views[view], SIZES[view], &settings).expect("render");
        let one_set = context.wait(renderer.radiance()).expect("radiance");
        assert!(picture.pixels != one_set.pixels, "the control: one set is another picture");
        picture
    });
    let mut other = Viewport::default();
    let renderer: &mut Renderer = &mut renderer;
    while viewports.iter().any(|viewport| renderer.refined_sets(viewport) < sets) {
        for view in 0..2 {
            if renderer.refined_sets(&viewports[view]) < sets {
                let (viewport, size) = (&mut viewports[view], SIZES[view]);
                renderer.refine(viewport, &scene, &views[view], size, &settings).expect("refine");
            }
        }
        renderer.render(&mut other, &views[0], [16, 16], &settings).expect("render");
    }
    for (viewport, expected) in viewports.iter().zip(&expected) {
        let picture = context.wait(renderer.radiance(viewport)).expect("radiance");
        assert!(picture.pixels == expected.pixels);
    }
    // What changes is seen by none of them.
    renderer.light(&scene, Some(10)).expect("light");
    assert_eq!(viewports.each_ref().map(|viewport| renderer.refined_sets(viewport)), [0; 2]);
}
