//! A scene that is opened slice by slice, lit by more and more of its samples, and determined for one view after the other.

use super::common::{Context, OneView, Test, camera, lamp, mean, room};
use girandole::{Mode, RenderSettings, RendererOptions};
use girandole_core::glam::{Quat, Vec3, vec3};
use girandole_core::illumination::{Illumination, IlluminationSettings, Opening, Rewalk, Stage};
use girandole_core::lights::LightSettings;
use girandole_core::scene::{Material, Mesh, Scene, SceneChanges, Transform, View, builtin};
use girandole_core::visibility::{LeafKind, VisibilityDatabase, VisibilitySettings};
use std::sync::Arc;

const SIZE: [u32; 2] = [96, 72];

pub fn tests() -> Vec<Test> {
    vec![
        ("a_picture_grows_from_few_samples_to_all", grows),
        ("rooms_that_no_view_needs_are_not_determined_and_change_no_picture", rooms),
    ]
}

/// Two closed rooms with a box and a lamp in each, and a camera; in the second one a mirror.
fn two_rooms() -> Scene {
    let mut scene = Scene::default();
    let white = scene.add_material(Material::default());
    for x in [0.0, 5.0] {
        room(&mut scene, vec3(4.0, 3.0, 4.0), white, None);
        let shell = scene.objects.last().expect("it was added").node;
        scene.set_transform(shell, Transform::translation(Vec3::X * x)).expect("a node");
        let mut cube = Mesh::default();
        cube.add_box(vec3(-0.5, 0.0, -0.5), vec3(0.5, 0.8, 0.5), white);
        scene.add_object("box", cube, Transform::translation(vec3(x - 0.6, 0.0, -0.7)));
        lamp(&mut scene, 0.6, 5.0, Quat::IDENTITY, vec3(x + 0.5, 2.9, 0.0));
        if x > 0.0 {
            let mirror = Material { metallic: 1.0, roughness: 0.0, ..Material::default() };
            let (mirror, mut panel) = (scene.add_material(mirror), Mesh::default());
            let corners = [(-1.8, 0.4), (1.8, 0.4), (1.8, 2.6), (-1.8, 2.6)];
            panel.add_polygon(&corners.map(|(across, up)| vec3(across, up, -1.95)), mirror);
            scene.add_object("mirror", panel, Transform::translation(Vec3::X * x));
        }
        camera(&mut scene, vec3(x + 1.6, 1.6, 1.7), vec3(x - 0.5, 0.6, -0.5), 1.0);
    }
    scene
}

fn rooms(context: &Context) {
    let scene = two_rooms();
    let [here, there] = [0, 1].map(|index| View::new(&scene, &scene.cameras[index], 4.0 / 3.0));
    let lights = LightSettings { count: 80, candidates: 2, ..LightSettings::default() };
    let settings = IlluminationSettings { lights, views: vec![here], ..IlluminationSettings::default() };
    let options = RendererOptions { map_size: Some(64), ..Default::default() };
    let full = RenderSettings::default();
    let naive = RenderSettings { mode: Mode::Naive, ..full };

    let lit = Illumination::new(&scene, &settings).expect("opens");
    let (geometry, lights) = (lit.geometry(), lit.lights());
    let mut of_all = context.renderer(options);
    of_all.load(&scene, geometry, lights).expect("load");
    let all = VisibilityDatabase::build(&scene, geometry, lights, &VisibilitySettings::default());
    of_all.load_visibility(&scene, geometry, lights, all.expect("visibility")).expect("visibility");
    let mut renderer = context.renderer(options);
    renderer.open(&scene, &settings).expect("open");
    let has_rest = |renderer: &OneView| {
        let database = renderer.illumination().and_then(Illumination::visibility).expect("visibility");
        database.receivers().leaves[0].kind == LeafKind::Undetermined
    };
    assert!(has_rest(&renderer), "the other room is left out");
    let mut of_both =
        |view: &View| [&mut renderer, &mut of_all].map(|renderer| context.frame(renderer, view, SIZE, &full));
    let [of_here, of_all_here] = of_both(&here);
    assert!(of_here == of_all_here, "where one looks nothing is another one");
    // Before it is determined, the other room is lit by all lights through their maps.
    let [before, _] = of_both(&there);
    let exact = context.frame(&mut of_all, &there, SIZE, &naive);
    let difference = |picture: &girandole_core::image::Image| {
        let pairs = picture.pixels.iter().zip(&exact.pixels);
        pairs.map(|(a, b)| (*a - *b).abs().max_element()).sum::<f32>()
            / exact.pixels.len() as f32
            / mean(&exact)
    };
    let changes = SceneChanges::none(scene.generation());
    renderer.follow(&scene, &changes, &[there]).expect("it is open");
    let mut of_both =
        |view: &View| [&mut renderer, &mut of_all].map(|renderer| context.frame(renderer, view, SIZE, &full));
    for view in [&there, &here] {
        let [determined, of_all] = of_both(view);
        assert!(determined == of_all, "what was determined later is as what was at once");
    }
    let [determined, _] = of_both(&there);
    let errors = [&before, &determined].map(difference);
    assert!(errors[0] < 1.1 * errors[1], "{errors:?}");
    // The control: it was another picture, if little.
    assert!(before != determined);
}

fn grows(context: &Context) {
    let scene = Arc::new(builtin::build("table", builtin::MovingObject::Torus).expect("a room"));
    let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
    let lights = LightSettings { count: 150, candidates: 2, ..LightSettings::default() };
    let settings = IlluminationSettings { lights, rewalk: Rewalk::Off, ..IlluminationSettings::default() };
    let options = RendererOptions { map_size: Some(64), ..Default::default() };
    let naive = RenderSettings { mode: Mode::Naive, ..RenderSettings::default() };
    let full = RenderSettings::default();

    // What a renderer makes of so many at once.
    let whole = Illumination::new(&scene, &settings).expect("opens");
    let fresh = |most: usize, settings: &RenderSettings| {
        let mut renderer = context.renderer(options);
        let mut lit = whole.clone();
        lit.light(&scene, Some(most)).expect("light");
        renderer.open_with(&scene, lit).expect("open");
        context.frame(&mut renderer, &view, SIZE, settings)
    };

    let mut renderer = context.renderer(options);
    let mut opening = Opening::new(settings.clone());
    let drawn = |renderer: &OneView| context.wait(renderer.stats()).expect("stats").maps_drawn;
    loop {
        match opening.step(&scene, || false).expect("a slice") {
            Stage::Lights(mut illumination) => {
                illumination.light(&scene, Some(16)).expect("light");
                renderer.open_with(&scene, *illumination).expect("open");
                let picture = context.frame(&mut renderer, &view, SIZE, &naive);
                assert_eq!(drawn(&renderer), 16, "maps of dark samples wait");
                assert!(picture == fresh(16, &naive), "16 of 150, naive");
                renderer.light(&scene, Some(40)).expect("light");
                let picture = context.frame(&mut renderer, &view, SIZE, &naive);
                assert_eq!(drawn(&renderer), 24, "those that are there stay");
                assert!(picture == fresh(40, &naive), "40 of 150, naive");
            }
            Stage::Slice => {}
            Stage::Visibility(database) => renderer.set_visibility(&scene, database).expect("visibility"),
            Stage::Done => break,
        }
    }
    let picture = context.frame(&mut renderer, &view, SIZE, &full);
    assert_eq!(drawn(&renderer), 0, "visibility changes no map");
    assert!(picture == fresh(40, &full), "40 of 150, full");
    renderer.light(&scene, None).expect("light");
    let picture = context.frame(&mut renderer, &view, SIZE, &full);
    assert_eq!(drawn(&renderer), 110);
    let mut other = context.renderer(options);
    other.open(&scene, &settings).expect("open");
    assert!(picture == context.frame(&mut other, &view, SIZE, &full), "all of them");
}
