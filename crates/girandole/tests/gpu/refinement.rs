//! Pictures of further light sets, averaged: they converge to the path tracer's.

use crate::common::{Context, OneView, Stage, Test, camera, exact, lamp, room};
use girandole::{DebugView, Mode, RenderSettings, RendererOptions};
use girandole_core::glam::{Quat, Vec3};
use girandole_core::illumination::IlluminationSettings;
use girandole_core::image::Image;
use girandole_core::lights::{Clamp, LightSet, LightSettings};
use girandole_core::scene::builtin::{self, MovingObject};
use girandole_core::scene::{Geometry, Material, Mesh, PunctualKind, PunctualLight, Scene, Transform, View};
use girandole_core::tonemap::Exposure;
use girandole_reference::metrics::{CompareOptions, Comparison, compare};
use girandole_reference::{Estimate, OracleSettings, PathSettings, PictureSum, path_trace};
use std::sync::OnceLock;

pub fn tests() -> Vec<Test> {
    vec![
        ("refined_pictures_converge_to_the_path_tracers", converges),
        ("what_is_glossy_converges_to_the_path_tracers_picture", glossy_converges),
        ("what_is_glossy_shows_points_of_light_in_all_sets", glossy_shows_points),
        ("refined_pictures_repeat_and_begin_anew", repeats),
        ("refined_pictures_are_refused_with_a_sentence", refuses),
        ("turned_shadow_maps_show_the_same", turned),
        ("sets_alone_are_those_that_are_averaged", alone),
    ]
}

const SIZE: [u32; 2] = [64, 48];

/// The room `table`, to be lit by few samples.
struct Room {
    scene: Scene,
    view: View,
    light: IlluminationSettings,
}

impl Room {
    fn new() -> Self {
        let scene = builtin::build("table", MovingObject::Torus).expect("a built-in scene");
        let view = View::new(&scene, &scene.cameras[0], SIZE[0] as f32 / SIZE[1] as f32);
        let lights = LightSettings { count: 100, ..LightSettings::default() };
        let light = IlluminationSettings { lights, views: vec![view], ..IlluminationSettings::default() };
        Self { scene, view, light }
    }

    /// A lamp, or a point of light in its place, that stands before the viewer, on a floor of rough metal.
    fn glossy(is_point: bool) -> Self {
        let mut scene = Scene::default();
        let metal = Material {
            metallic: 1.0,
            roughness: 0.3,
            double_sided: true,
            ..Material::diffuse("metal", Vec3::splat(0.9))
        };
        let metal = scene.add_material(metal);
        let mut floor = Mesh::default();
        let corner = |x: f32, z: f32| Vec3::new(2.0 * x, 0.0, 3.0 * z);
        floor.add_polygon(
            &[corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, -1.0)],
            metal,
        );
        scene.add_object("floor", floor, Transform::IDENTITY);
        let place = Vec3::new(0.0, 0.4, -1.0);
        if is_point {
            let node = scene.add_node("bulb", Transform::translation(place));
            let (name, intensity) = (String::new(), Vec3::ONE);
            scene.lights.push(PunctualLight { name, node, kind: PunctualKind::Point, intensity });
        } else {
            lamp(&mut scene, 0.4, 4.0, Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2), place);
        }
        camera(&mut scene, Vec3::new(0.0, 0.8, 2.0), Vec3::new(0.0, 0.0, -0.1), 0.6);
        let view = View::new(&scene, &scene.cameras[0], SIZE[0] as f32 / SIZE[1] as f32);
        let lights = LightSettings { count: 64, bounces: 0, ..LightSettings::default() };
        let light = IlluminationSettings { lights, views: vec![view], ..IlluminationSettings::default() };
        Self { scene, view, light }
    }

    fn opened(&self, context: &Context) -> OneView {
        let mut renderer = context.renderer(RendererOptions::default());
        renderer.open(&self.scene, &self.light).expect("open");
        renderer
    }

    /// Goes on until so many sets are averaged.
    fn refine(&self, context: &Context, renderer: &mut OneView, sets: u32) -> Image {
        loop {
            let settings = RenderSettings::default();
            renderer.refine(&self.scene, &self.view, SIZE, &settings).expect("refine");
            if renderer.refined_sets() == sets {
                return context.wait(renderer.radiance()).expect("radiance");
            }
        }
    }

    /// The path tracer's picture, with relMSE of its own.
    fn truth(&self, bounces: u32) -> (Image, f64) {
        let geometry = Geometry::new(&self.scene);
        let tracer = girandole_core::trace::SceneTracer::new(&self.scene, &geometry);
        let settings = PathSettings { paths: 1024, bounces: Some(bounces), seed: 3 };
        let Estimate { mean, variance } = path_trace(&tracer, &self.view, SIZE, &settings, &|_| {});
        let relative = |(m, v): (&Vec3, &Vec3)| f64::from((*v / (*m * *m + 0.01)).element_sum() / 3.0);
        let noise = mean.pixels.iter().zip(&variance.pixels).map(relative).sum::<f64>();
        (mean, noise / variance.pixels.len() as f64)
    }
}

fn against(reference: &Image, picture: &Image) -> Comparison {
    compare(reference, picture, &CompareOptions::default()).expect("comparable")
}

fn alone(context: &Context) {
    let room = Room::new();
    let mut renderer = room.opened(context);
    let settings = RenderSettings::default();
    let mut set = |set| {
        renderer.render_set(&room.scene, &room.view, SIZE, &settings, set).expect("a set");
        context.wait(renderer.radiance()).expect("radiance")
    };
    let forth: Vec<Image> = (0..4).map(&mut set).collect();
    assert!([3, 1, 0, 2].into_iter().all(|index| set(index as u32) == forth[index]), "order counts");
    assert!((1..4).all(|index| forth[index] != forth[index - 1]), "the control: sets differ");
    let mut sum = PictureSum::new(SIZE[0], SIZE[1]);
    assert!(forth.iter().all(|picture| sum.add(picture)));
    // Averages are stored as pictures are, with 18 bits.
    let averaged = room.refine(context, &mut renderer, 4);
    let worst = |(a, b): (&Vec3, &Vec3)| (*a - *b).abs().max_element() / a.max_element().max(1e-3);
    let mean = sum.mean();
    let worst = averaged.pixels.iter().zip(&mean.pixels).map(worst).fold(0.0, f32::max);
    assert!(worst < 1e-5, "{worst}");
    let estimated = context.wait(renderer.refined_error()).expect("an error").expect("of four");
    let found = sum.relative_error().expect("of four");
    assert!((estimated - found).abs() < 1e-3 * found, "{estimated} {found}");
    assert!(found > 1e-6, "the control: sets differ");
    assert!(averaged != forth[0], "the control: an average is no set");
}

fn converges(context: &Context) {
    static TRUTH: OnceLock<(Image, f64)> = OnceLock::new();
    let room = Room::new();
    let (truth, noise) = TRUTH.get_or_init(|| room.truth(5));
    let mut renderer = room.opened(context);
    let mut errors = Vec::new();
    for sets in [1, 4, 16] {
        let picture = room.refine(context, &mut renderer, sets);
        let estimate = context.wait(renderer.refined_error()).expect("an estimate");
        errors.push((against(truth, &picture), estimate));
    }
    let rel_mse = |i: usize| errors[i].0.rel_mse - noise;
    // About a quarter as much for four times as many sets; single sets differ.
    assert!(rel_mse(1) < 0.65 * rel_mse(0) && rel_mse(2) < 0.4 * rel_mse(1), "{noise}: {errors:?}");
    assert!((errors[2].0.energy_ratio - 1.0).abs() < 0.01, "{errors:?}");
    assert_eq!(errors[0].1, None, "one set says nothing of its error");
    for (comparison, estimate) in &errors[1..] {
        let ratio = estimate.expect("an estimate") / (comparison.rel_mse - noise);
        assert!((0.4..2.0).contains(&ratio), "{ratio}: {errors:?}");
    }
    // The control: a picture of one set is not taken for a refined one.
    let one = context.frame(&mut renderer, &room.view, SIZE, &RenderSettings::default());
    assert_eq!(against(truth, &one), errors[0].0);
}

/// Rays that are spread over lobes: a single set's blur is the same in all of them, and no mean of sets gets rid of it.
fn glossy_converges(context: &Context) {
    static TRUTH: OnceLock<(Image, f64)> = OnceLock::new();
    let room = Room::glossy(false);
    let (truth, noise) = TRUTH.get_or_init(|| room.truth(0));
    let mut renderer = room.opened(context);
    let mut rel_mse = |sets| against(truth, &room.refine(context, &mut renderer, sets)).rel_mse - noise;
    let errors = [1, 8, 64].map(&mut rel_mse);
    // Without that it stays at nine tenths of what one set is wrong by, as was tried.
    assert!(errors[1] < 0.2 * errors[0] && errors[2] < 0.2 * errors[1], "{noise}: {errors:?}");
}

/// No ray meets a point of light: samples bring all that is reflected of it.
fn glossy_shows_points(context: &Context) {
    let room = Room::glossy(true);
    let (truth, _) = room.truth(0);
    let energy_of = |picture: &Image| against(&truth, picture).energy_ratio;
    let stage = Stage::new(room.scene.clone(), &room.light.lights);
    let settings = OracleSettings { clamp: Clamp::Own, ..OracleSettings::default() };
    let sum =
        girandole_reference::oracle(&stage.tracer(), &stage.lights, &room.view, SIZE, &settings, &|_| {});
    assert!((energy_of(&sum) - 1.0).abs() < 0.01, "the oracle: {}", energy_of(&sum));
    let mut renderer = room.opened(context);
    for mode in [Mode::Naive, Mode::Full] {
        let settings = RenderSettings { mode, ..RenderSettings::default() };
        let energy = [0, 1].map(|set| {
            renderer.render_set(&room.scene, &room.view, SIZE, &settings, set).expect("a set");
            energy_of(&context.wait(renderer.radiance()).expect("radiance"))
        });
        assert!(energy.iter().all(|ratio| (ratio - 1.0).abs() < 0.01), "{mode:?}: {energy:?}");
    }
}

fn repeats(context: &Context) {
    let room = Room::new();
    let mut renderer = room.opened(context);
    let plain = context.frame(&mut renderer, &room.view, SIZE, &RenderSettings::default());
    assert_eq!(renderer.refined_sets(), 1);
    let refined = room.refine(context, &mut renderer, 3);
    assert!(refined != plain, "further sets change nothing");
    // Another exposure is the same picture; another time, it is the same from the start.
    let brighter = RenderSettings { exposure: Exposure::Ev(1.0), ..RenderSettings::default() };
    renderer.refine(&room.scene, &room.view, SIZE, &brighter).expect("refine");
    assert_eq!(renderer.refined_sets(), 3);
    assert!(room.refine(context, &mut room.opened(context), 3) == refined);
    assert!(context.frame(&mut renderer, &room.view, SIZE, &RenderSettings::default()) == plain);
    assert!(room.refine(context, &mut renderer, 3) == refined);
    // Another tolerance is another picture.
    let finer = RenderSettings { tolerance: 0.05, ..RenderSettings::default() };
    assert!(renderer.refine(&room.scene, &room.view, SIZE, &finer).expect("refine"));
    assert_eq!(renderer.refined_sets(), 1);
    // A scene that changed is followed from set 0 on.
    let mut moved = Room::new();
    let mut follows = moved.opened(context);
    moved.refine(context, &mut follows, 2);
    moved.scene.set_time(1.0).expect("a time");
    let before = follows.refine(&moved.scene, &moved.view, SIZE, &RenderSettings::default());
    assert!(before.is_err(), "a scene that changed is refined");
    let changes = moved.scene.take_changes();
    follows.update(&moved.scene, &changes).expect("update");
    assert_eq!(follows.refined_sets(), 0);
    let followed = moved.refine(context, &mut follows, 2);
    assert!(followed == moved.refine(context, &mut moved.opened(context), 2));
}

fn refuses(context: &Context) {
    let room = Room::new();
    let mut renderer = context.renderer(RendererOptions::default());
    let refine = |renderer: &mut OneView, settings: &RenderSettings| {
        renderer.refine(&room.scene, &room.view, SIZE, settings).err().map(|error| error.to_string())
    };
    let said = refine(&mut renderer, &RenderSettings::default());
    assert!(said.is_some_and(|sentence| sentence.contains("open a scene")));
    renderer.open(&room.scene, &room.light).expect("open");
    let debug = RenderSettings { debug: Some(DebugView::Levels), ..RenderSettings::default() };
    assert!(refine(&mut renderer, &debug).is_some_and(|sentence| sentence.contains("debug view")));
    assert_eq!(refine(&mut renderer, &RenderSettings::default()), None);
}

/// A room with a lamp that is a point: it is where it is in all sets, and only its map is turned.
fn lit_by_a_point() -> Scene {
    let mut scene = Scene::default();
    let white = scene.add_material(Material::diffuse("white", Vec3::splat(0.7)));
    room(&mut scene, Vec3::new(4.0, 3.0, 4.0), white, None);
    let mut block = Mesh::default();
    block.add_box(Vec3::new(-0.4, 0.0, -0.4), Vec3::new(0.4, 0.8, 0.4), white);
    scene.add_object("block", block, Transform::rigid(Quat::from_rotation_y(0.4), Vec3::ZERO));
    let node = scene.add_node("bulb", Transform::translation(Vec3::new(0.7, 2.2, 0.5)));
    let intensity = Vec3::splat(8.0);
    scene.lights.push(PunctualLight { name: String::new(), node, kind: PunctualKind::Point, intensity });
    camera(&mut scene, Vec3::new(1.8, 2.0, 1.8), Vec3::new(0.0, 0.4, 0.0), 1.2);
    scene
}

fn turned(context: &Context) {
    let settings = LightSettings { count: 2, bounces: 0, ..LightSettings::default() };
    let mut stage = Stage::new(lit_by_a_point(), &settings);
    let size = [160, 120];
    let view = stage.view(0, size);
    let oracle = stage.oracle(&view, size, 1);
    let mut renderer = context.renderer(RendererOptions::default());
    let mut pictures = Vec::new();
    for set in [0, 0, 1, 2] {
        stage.lights =
            LightSet::sample_set(&stage.scene, &stage.geometry, &settings, &[], set).expect("lights");
        renderer.load(&stage.scene, &stage.geometry, &stage.lights).expect("load");
        let picture = context.frame(&mut renderer, &view, size, &exact());
        let comparison = against(&oracle, &picture);
        assert!(comparison.rel_mse < 3e-3 && (comparison.energy_ratio - 1.0).abs() < 2e-3, "{comparison:?}");
        // Half of the bulb faces the block.
        let maps = [0, 1].map(|light| context.wait(renderer.shadow_map(light)).expect("a map"));
        pictures.push((picture, maps));
    }
    // The same set has the same map, another one does not; nor do edges of its texels fall on the same pixels.
    assert!(pictures[0] == pictures[1]);
    assert!(
        pictures[0].1 != pictures[2].1 && pictures[2].1 != pictures[3].1 && pictures[0].1 != pictures[3].1
    );
    assert!(pictures[0].0 != pictures[2].0);
}
