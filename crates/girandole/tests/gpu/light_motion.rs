//! Lights that move, are dimmed and are switched off while light samples are held: they cost only themselves.

use crate::common::{Context, OneView, Test, camera, room};
use crate::motion::{SIZE, held, updated};
use girandole::{FrameStats, MapUpdates, RenderSettings, RendererOptions};
use girandole_core::glam::{Quat, Vec3};
use girandole_core::illumination::IlluminationSettings;
use girandole_core::scene::builtin::shapes;
use girandole_core::scene::{LightId, Material, Mesh, PunctualKind, PunctualLight, Scene, Transform, View};
use girandole_core::visibility::VisibilitySettings;

pub fn tests() -> Vec<Test> {
    vec![
        ("one_light_that_changes_is_all_that_is_summed_again", one_of_many),
        ("lights_that_change_in_any_order_give_the_picture_of_a_fresh_renderer", many_changes),
        ("dark_lights_are_in_no_list_and_their_maps_wait", dark),
    ]
}

/// Samples of a point light.
const SIDES: u32 = 2;
const LAMPS: usize = 20;

/// A room with a shelf, a torus that may move, and point lights in two rows.
fn stage() -> Scene {
    let mut scene = Scene::default();
    let gray = scene.add_material(Material::diffuse("gray", Vec3::splat(0.6)));
    room(&mut scene, Vec3::new(5.0, 3.0, 4.0), gray, None);
    let mut shelf = Mesh::default();
    shelf.add_box(Vec3::new(-1.4, 1.2, -0.6), Vec3::new(0.2, 1.3, 0.5), gray);
    scene.add_object("shelf", shelf, Transform::IDENTITY);
    let place = Transform::translation(Vec3::new(0.9, 0.7, 0.2));
    scene.add_object("torus", shapes::torus(0.3, 0.1, 16, 8, gray), place);
    scene.objects.last_mut().expect("it was added").dynamic = true;
    for index in 0..LAMPS {
        let node = scene.add_node("lamp", Transform::translation(place_of(index)));
        let intensity = Vec3::new(0.6, 0.5, 0.4) * (1.0 + 0.1 * index as f32);
        scene.lights.push(PunctualLight { name: String::new(), node, kind: PunctualKind::Point, intensity });
    }
    camera(&mut scene, Vec3::new(2.2, 1.8, 1.8), Vec3::new(-1.0, 0.8, -0.8), 1.0);
    scene
}

fn place_of(lamp: usize) -> Vec3 {
    Vec3::new(0.45 * (lamp / 2) as f32 - 2.0, 2.6, if lamp.is_multiple_of(2) { -0.8 } else { 0.9 })
}

/// A renderer that has drawn a scene, another one, and a view.
fn opened(context: &Context, scene: &Scene, settings: &IlluminationSettings) -> ([OneView; 2], View) {
    let options = RendererOptions { map_size: Some(32), ..Default::default() };
    let [mut renderer, other] = [context.renderer(options), context.renderer(options)];
    renderer.open(scene, settings).expect("open");
    let view = View::new(scene, &scene.cameras[0], 4.0 / 3.0);
    context.frame(&mut renderer, &view, SIZE, &RenderSettings::default());
    ([renderer, other], view)
}

fn stats(context: &Context, renderer: &OneView) -> FrameStats {
    context.wait(renderer.stats()).expect("stats")
}

fn one_of_many(context: &Context) {
    let coarser = VisibilitySettings { split: 1e4, ..fine() };
    for visibility in [fine(), coarser] {
        let settings = IlluminationSettings { visibility: Some(visibility), ..settings() };
        let mut scene = stage();
        let ([mut renderer, mut other], view) = opened(context, &scene, &settings);
        let opened = stats(context, &renderer);
        let [_, maps] = opened.leaves;
        assert!(opened.light_map_changes > 10 * maps, "most maps hold many lights: {opened:?}");
        // Each map loses and gains no more than the light's two sides, a twentieth of all.
        let is_little = |counts: &FrameStats| {
            let changes = counts.light_map_changes;
            assert!(changes > 0 && changes <= 2 * SIDES * maps, "{changes} changes of {maps} maps");
            assert!(changes * 8 < opened.light_map_changes, "{changes} of {}", opened.light_map_changes);
        };
        let full = RenderSettings::default();
        let mut step = |scene: &mut Scene| {
            let ([after, anew], counts) =
                updated(context, [&mut renderer, &mut other], (scene, &view), &full);
            assert!(after == anew);
            // The control: all of them are summed where nothing was held.
            assert!(stats(context, &other).light_map_changes > 10 * maps);
            (after, counts)
        };
        let (before, counts) = step(&mut scene);
        assert_eq!((counts.light_map_changes, counts.maps_drawn), (0, 0), "at rest");
        let mut last = before.clone();
        let places = [Vec3::new(0.2, 2.4, 0.1), Vec3::new(-1.9, 0.5, 1.5), place_of(7)];
        for (moves, place) in places.into_iter().enumerate() {
            scene.set_transform(scene.lights[7].node, Transform::translation(place)).expect("a place");
            let (after, counts) = step(&mut scene);
            is_little(&counts);
            // Those of its sides that something may hide.
            assert!((1..=SIDES).contains(&counts.maps_drawn));
            assert!(after != last, "it moves");
            assert_eq!(moves == 2, after == before, "it is back at the end");
            last = after;
        }
        let intensity = scene.lights[3].intensity;
        for share in [0.3, 1.0] {
            scene.set_intensity(LightId(3), intensity * share).expect("an intensity");
            let (after, counts) = step(&mut scene);
            is_little(&counts);
            assert_eq!(counts.maps_drawn, 0);
            assert_eq!(share == 1.0, after == before);
        }
    }
}

/// Leaves so small that light maps hold most lights.
fn fine() -> VisibilitySettings {
    VisibilitySettings { split: 1e5, least_gain: 0.0, max_depth: 4, ..VisibilitySettings::default() }
}

fn settings() -> IlluminationSettings {
    let mut settings = IlluminationSettings { visibility: Some(fine()), ..held(LAMPS as u32 * SIDES, false) };
    // All samples are the lamps', each with its own.
    settings.lights.bounces = 0;
    settings
}

/// Random changes of lights and of a torus, several between two frames.
fn many_changes(context: &Context) {
    let mut scene = stage();
    let ([mut renderer, mut other], view) = opened(context, &scene, &settings());
    let mut seed = 7u32;
    let mut random = move || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (seed >> 8) as f32 / (1u32 << 24) as f32
    };
    let torus = scene.objects.last().expect("a torus").node;
    let full = RenderSettings::default();
    let mut pictures: Vec<Vec<Vec3>> = Vec::new();
    for frame in 0..12 {
        for _ in 0..3 {
            // Few of them, or most.
            for _ in 0..if frame % 4 == 3 { 2 * LAMPS } else { 2 } {
                let lamp = (random() * LAMPS as f32) as usize;
                let place = Vec3::new(4.6 * random() - 2.3, 0.2 + 2.6 * random(), 3.6 * random() - 1.8);
                scene.set_transform(scene.lights[lamp].node, Transform::translation(place)).expect("a place");
                let lamp = (random() * LAMPS as f32) as usize;
                // Over four orders of magnitude, or dark.
                let intensity = (10f32.powf(4.0 * random() - 3.0) - 1e-2).max(0.0);
                scene.set_intensity(lamp.into(), Vec3::splat(intensity)).expect("an intensity");
            }
            let at = Vec3::new(random() - 0.5, 0.5 + random(), random() - 0.5);
            let turn = Quat::from_rotation_x(6.0 * random());
            scene.set_transform(torus, Transform::rigid(turn, at)).expect("a place");
            let changes = scene.take_changes();
            renderer.update(&scene, &changes).expect("update");
        }
        let ([after, anew], counts) =
            updated(context, [&mut renderer, &mut other], (&mut scene, &view), &full);
        assert!(after == anew, "frame {frame}");
        assert_eq!(counts.pairs, stats(context, &other).pairs, "frame {frame}");
        assert!(pictures.last().is_none_or(|last| *last != after), "things change");
        pictures.push(after);
    }
}

fn dark(context: &Context) {
    let mut scene = stage();
    let ([mut renderer, mut other], view) = opened(context, &scene, &settings());
    let full = RenderSettings::default();
    let lit = scene.lights[4].intensity;
    let torus = scene.objects.last().expect("a torus").node;
    let mut step = |scene: &mut Scene| {
        let ([after, anew], counts) = updated(context, [&mut renderer, &mut other], (scene, &view), &full);
        assert!(after == anew);
        (after, counts)
    };
    let (before, all) = step(&mut scene);
    scene.set_intensity(LightId(4), Vec3::ZERO).expect("an intensity");
    let (without, counts) = step(&mut scene);
    assert!(without != before);
    let summed = |stats: &FrameStats| stats.pairs.evaluated() + stats.pairs.mapped;
    let points = |stats: &FrameStats| stats.points.iter().sum::<u64>();
    let per_point = |stats: &FrameStats| summed(stats) as f64 / points(stats) as f64;
    assert!(per_point(&counts) < per_point(&all), "{counts:?} {all:?}");
    let pairs = summed(&counts) + counts.pairs.skipped;
    assert_eq!(pairs, points(&counts) * u64::from(counts.lights), "each pair is something");
    assert_eq!(counts.maps_drawn, 0);
    // What moves in the dark, and the dark light itself, has no map drawn; the torus has those of the others.
    scene
        .set_transform(scene.lights[4].node, Transform::translation(Vec3::new(0.5, 2.0, 0.0)))
        .expect("a place");
    let (after, counts) = step(&mut scene);
    assert!(after == without && counts.maps_drawn == 0 && counts.light_map_changes == 0, "{counts:?}");
    assert_eq!(counts.stale.maps, 0);
    scene.set_intensity(LightId(4), lit).expect("an intensity");
    let (_, counts) = step(&mut scene);
    assert!((1..=SIDES).contains(&counts.maps_drawn), "it is drawn where it is lit again");
    // All dark but one: a budget of none leaves that one's maps stale, and no others.
    for lamp in (0..LAMPS).filter(|&lamp| lamp != 4) {
        scene.set_intensity(lamp.into(), Vec3::ZERO).expect("an intensity");
    }
    step(&mut scene);
    scene.set_transform(torus, Transform::translation(Vec3::new(0.4, 0.9, 0.1))).expect("a place");
    let changes = scene.take_changes();
    renderer.update(&scene, &changes).expect("update");
    let updates = MapUpdates { most: Some(0), ..MapUpdates::default() };
    renderer.render(&view, SIZE, &RenderSettings { updates, ..full }).expect("render");
    let counts = stats(context, &renderer);
    assert!((1..=SIDES).contains(&counts.stale.maps) && counts.stale.oldest == 1, "{:?}", counts.stale);
    assert_eq!(counts.maps_drawn, 0);
}
