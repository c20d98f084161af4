//! Objects that are lit by precomputed radiance transfer.

use crate::common::{Context, OneView, Stage, Test, exact};
use girandole::{MapUpdates, Mode, RenderSettings, RendererOptions, Shading};
use girandole_core::glam::{DAffine3, DMat3, DVec3, Vec3};
use girandole_core::illumination::{IlluminationSettings, Rewalk};
use girandole_core::image::Image;
use girandole_core::lights::{Clamp, LightSettings};
use girandole_core::scene::builtin::{self, MovingObject};
use girandole_core::scene::{ObjectId, Scene, Transform, View};
use girandole_core::transfer::{Compression, Gathering, ObjectTransfer, TransferSettings, TransferredLight};
use girandole_reference::{OracleSettings, oracle_with_transfer};
use std::sync::Arc;

const SIZE: [u32; 2] = [96, 72];

pub fn tests() -> Vec<Test> {
    vec![
        ("transfer_is_that_of_traced_rays", by_rays),
        ("transfer_is_the_same_in_all_modes", modes),
        ("compressed_transfer_is_that_of_its_vectors", compressed),
        ("transfer_is_seen_in_mirrors", mirrored),
        ("transfer_follows_what_moves", follows),
        ("transfer_is_not_darkened_by_former_selves", stale),
        ("transfer_ends_where_objects_are_stretched", stretched),
    ]
}

fn simulated(scene: &Scene) -> (ObjectId, Arc<ObjectTransfer>) {
    let object = mover(scene);
    let settings = TransferSettings { directions: 128, bounces: 1, ..TransferSettings::default() };
    (object, Arc::new(ObjectTransfer::simulate(scene, object, &settings, &|_| ()).expect("transfer")))
}

fn mover(scene: &Scene) -> ObjectId {
    scene.objects.iter().position(|object| object.dynamic).expect("something that moves").into()
}

/// A room with its torus, and a view of that.
fn stage(lights: u32) -> (Stage, View) {
    let scene = builtin::build("table", MovingObject::Torus).expect("a built-in scene");
    let stage = Stage::new(scene, &LightSettings { count: lights, ..LightSettings::default() });
    let view = close(&stage.scene, 0.35);
    (stage, view)
}

/// A view of the torus.
fn close(scene: &Scene, radius: f32) -> View {
    let node = scene.objects[mover(scene).index()].node;
    let center = scene.world_from_node(node).translation;
    let mut posed = scene.clone();
    let eye = center + DVec3::new(1.1, 0.9, 1.3) * f64::from(radius) * 2.0;
    let eye_node = posed.add_node("eye", Transform::looking_at(eye.as_vec3(), center.as_vec3()));
    let projection = girandole_core::scene::Projection::Perspective { yfov: 0.7 };
    let camera = girandole_core::scene::Camera {
        name: String::new(),
        node: eye_node,
        projection,
        clip: Default::default(),
    };
    View::new(&posed, &camera, SIZE[0] as f32 / SIZE[1] as f32)
}

/// The pixels that show the torus.
fn mask(stage: &Stage, view: &View) -> Vec<bool> {
    let (tracer, object) = (stage.tracer(), mover(&stage.scene).0);
    let view = stage.local(view);
    let pixel = |i: u32| girandole_core::glam::Vec2::new((i % SIZE[0]) as f32, (i / SIZE[0]) as f32) + 0.5;
    let shows = |i: u32| {
        let (origin, direction) = view.pixel_ray(pixel(i), SIZE);
        let hit = tracer.closest_visible(origin, direction);
        hit.is_some_and(|hit| stage.geometry.triangles[hit.triangle as usize].object == object)
    };
    let mask: Vec<bool> = (0..SIZE[0] * SIZE[1]).map(shows).collect();
    assert!(mask.iter().filter(|shown| **shown).count() > 1000);
    mask
}

/// Mean difference over a mask, relative to the mean; and the ratio of means.
fn difference(a: &Image, b: &Image, mask: &[bool]) -> (f32, f32) {
    let pairs = || a.pixels.iter().zip(&b.pixels).zip(mask).filter(|(_, shown)| **shown).map(|(p, _)| p);
    let sum = |v: Vec3| v.element_sum();
    let (ma, mb) = (pairs().map(|(a, _)| sum(*a)).sum::<f32>(), pairs().map(|(_, b)| sum(*b)).sum::<f32>());
    let apart: f32 = pairs().map(|(a, b)| sum((*a - *b).abs())).sum();
    (apart / mb, ma / mb)
}

fn by_rays(context: &Context) {
    let (stage, view) = stage(150);
    let (object, transfer) = simulated(&stage.scene);
    let mask = mask(&stage, &view);
    let truth = |gathering| {
        let mut light = TransferredLight::new();
        let tracer = stage.tracer();
        light
            .add(&tracer, (&stage.lights, None), (object, &transfer), gathering, Clamp::Own)
            .expect("this mesh");
        let settings = OracleSettings { clamp: Clamp::Own, ..OracleSettings::default() };
        oracle_with_transfer(&tracer, &stage.lights, &light, &view, SIZE, &settings, &|_| ())
    };
    let mut renderer = context.renderer(RendererOptions::default());
    let mut shown = |gathering| {
        let transfer = Some((transfer.clone(), gathering));
        renderer.set_transfer(&stage.scene, object, transfer).expect("this mesh");
        context.load(&mut renderer, &stage);
        let settings = RenderSettings { mode: Mode::Naive, ..RenderSettings::default() };
        context.frame(&mut renderer, &view, SIZE, &settings)
    };
    let [center, grid] =
        [Gathering::Center, Gathering::GRID].map(|gathering| (shown(gathering), truth(gathering)));
    let (apart, energy) = difference(&center.0, &center.1, &mask);
    assert!(apart < 2e-4 && (energy - 1.0).abs() < 1e-4, "centre: {apart} {energy}");
    let (apart, energy) = difference(&grid.0, &grid.1, &mask);
    assert!(apart < 0.012 && (energy - 1.0).abs() < 0.01, "grid: {apart} {energy}");
    // The controls: the light elsewhere, and what the object hides from itself counted twice.
    let (apart, _) = difference(&grid.0, &center.1, &mask);
    assert!(apart > 0.02, "{apart}");
    let unlit = context.picture(&stage, RendererOptions::default(), &view, SIZE);
    assert!(difference(&unlit, &grid.1, &mask).0 > 0.03);
}

/// The torus as a mirror shows it, which no ray of the camera meets there.
fn mirrored(context: &Context) {
    const LARGE: [u32; 2] = [256, 192];
    let scene = builtin::build("mirrors", MovingObject::Torus).expect("a built-in scene");
    let stage = Stage::new(scene, &LightSettings { count: 100, ..LightSettings::default() });
    let view = stage.view(0, LARGE);
    let (object, transfer) = simulated(&stage.scene);
    let (tracer, local) = (stage.tracer(), stage.local(&view));
    let shows = |i: u32| {
        let pixel = girandole_core::glam::Vec2::new((i % LARGE[0]) as f32, (i / LARGE[0]) as f32) + 0.5;
        let (origin, direction) = local.pixel_ray(pixel, LARGE);
        let hit = tracer.closest_visible(origin, direction)?;
        let surface =
            stage.geometry.surface(&stage.scene, hit.triangle, hit.barycentric, -direction.normalize());
        let direction = direction.reject_from(surface.shading_normal) * 2.0 - direction;
        let end = tracer.closest_hit(surface.position, direction, f32::INFINITY, hit.triangle)?;
        let ends_there = stage.geometry.triangles[end.triangle as usize].object == object.0;
        Some(ends_there && surface.albedo == Vec3::ZERO)
    };
    let mask: Vec<bool> = (0..LARGE[0] * LARGE[1]).map(|i| shows(i).unwrap_or(false)).collect();
    assert!(mask.iter().filter(|shown| **shown).count() > 20);
    let mut light = TransferredLight::new();
    let lit = (object, &*transfer);
    light.add(&tracer, (&stage.lights, None), lit, Gathering::Center, Clamp::Own).expect("this mesh");
    let settings = OracleSettings { clamp: Clamp::Own, ..OracleSettings::default() };
    let truth = oracle_with_transfer(&tracer, &stage.lights, &light, &view, LARGE, &settings, &|_| ());
    let mut renderer = context.renderer(RendererOptions::default());
    let mut shown = |transfer, mode| {
        renderer.set_transfer(&stage.scene, object, transfer).expect("this mesh");
        context.load(&mut renderer, &stage);
        context.frame(&mut renderer, &view, LARGE, &RenderSettings { mode, ..RenderSettings::default() })
    };
    for mode in [Mode::Naive, Mode::Full] {
        let picture = shown(Some((transfer.clone(), Gathering::Center)), mode);
        let (apart, energy) = difference(&picture, &truth, &mask);
        assert!(apart < 0.02 && (energy - 1.0).abs() < 0.01, "{mode:?}: {apart} {energy}");
    }
    // The control: lit by shadow maps it looks otherwise there.
    let (apart, _) = difference(&shown(None, Mode::Full), &truth, &mask);
    assert!(apart > 0.04, "{apart}");
}

fn compressed(context: &Context) {
    let (mut stage, view) = stage(40);
    let object = mover(&stage.scene);
    // Coloured, so that its channels differ.
    let material = stage.geometry.objects[object.index()].triangles.start;
    let material = stage.geometry.triangles[material as usize].material.index();
    stage.scene.materials[material].base_color = Vec3::new(0.8, 0.5, 0.2);
    let stage = Stage::new(stage.scene, &LightSettings { count: 40, ..LightSettings::default() });
    let mask = mask(&stage, &view);
    let mut renderer = context.renderer(RendererOptions::default());
    let mut pictures = |compression| {
        let settings =
            TransferSettings { directions: 128, bounces: 1, compression, ..TransferSettings::default() };
        let transfer = ObjectTransfer::simulate(&stage.scene, object, &settings, &|_| ()).expect("transfer");
        assert_eq!(transfer.channels(), 3);
        let mut light = TransferredLight::new();
        let tracer = stage.tracer();
        let lit = (object, &transfer);
        light.add(&tracer, (&stage.lights, None), lit, Gathering::Center, Clamp::Own).expect("this mesh");
        let settings = OracleSettings { clamp: Clamp::Own, ..OracleSettings::default() };
        let truth = oracle_with_transfer(&tracer, &stage.lights, &light, &view, SIZE, &settings, &|_| ());
        let lit = Some((Arc::new(transfer), Gathering::Center));
        renderer.set_transfer(&stage.scene, object, lit).expect("this mesh");
        context.load(&mut renderer, &stage);
        (context.frame(&mut renderer, &view, SIZE, &RenderSettings::default()), truth)
    };
    let (shown, truth) = pictures(Some(Compression { clusters: 8, bases: 3 }));
    let (apart, _) = difference(&shown, &truth, &mask);
    assert!(apart < 2e-4, "{apart}");
    let (exact, _) = pictures(None);
    let (lost, _) = difference(&shown, &exact, &mask);
    assert!((1e-3..0.1).contains(&lost), "the control: {lost}");
}

fn modes(context: &Context) {
    let (stage, view) = stage(60);
    let (object, transfer) = simulated(&stage.scene);
    let mask = mask(&stage, &view);
    let mut renderer = context.renderer(RendererOptions::default());
    let lit = Some((transfer, Gathering::GRID));
    renderer.set_transfer(&stage.scene, object, lit).expect("this mesh");
    context.load(&mut renderer, &stage);
    let mut frame = |settings: RenderSettings| context.frame(&mut renderer, &view, SIZE, &settings);
    let naive = frame(RenderSettings { mode: Mode::Naive, ..RenderSettings::default() });
    let is_same = |other: &Image| {
        let pairs = naive.pixels.iter().zip(&other.pixels).zip(&mask);
        pairs.filter(|(_, shown)| **shown).all(|((a, b), _)| a == b)
    };
    let multipass = Shading::Multipass { lights_per_pass: 7 };
    for settings in [
        RenderSettings::default(),
        RenderSettings { mode: Mode::Visibility, ..RenderSettings::default() },
        RenderSettings { mode: Mode::LowResolution, ..RenderSettings::default() },
        RenderSettings { shading: multipass, ..RenderSettings::default() },
    ] {
        let picture = frame(settings);
        assert!(is_same(&picture), "{settings:?}");
        let around: Vec<bool> = mask.iter().map(|shown| !shown).collect();
        assert!(difference(&picture, &naive, &around).0 < 0.02, "{settings:?}");
    }
    assert!(!is_same(&frame(RenderSettings { clamp: Clamp::At(0.01), ..exact() })), "the control");
    // With further samples of each pixel, too.
    let [fine, whole] = [Mode::Full, Mode::Naive]
        .map(|mode| frame(RenderSettings { mode, samples_per_axis: 2, ..RenderSettings::default() }));
    let everywhere = vec![true; mask.len()];
    let apart = difference(&fine, &whole, &everywhere).0;
    assert!(apart < 0.02, "{apart}");
    assert!(difference(&fine, &naive, &mask).0 > 0.001, "the control");
}

fn opened(context: &Context, scene: &Scene, lights: &IlluminationSettings) -> OneView {
    let mut renderer = context.renderer(RendererOptions::default());
    renderer.open(scene, lights).expect("open");
    renderer
}

fn settings(lights: u32) -> IlluminationSettings {
    let lights = LightSettings { count: lights, walk_dynamic: false, ..LightSettings::default() };
    IlluminationSettings { lights, rewalk: Rewalk::Off, ..IlluminationSettings::default() }
}

fn follows(context: &Context) {
    let mut scene = builtin::build("table", MovingObject::Torus).expect("a built-in scene");
    scene.take_changes();
    let (object, transfer) = simulated(&scene);
    let view = close(&scene, 0.35);
    let mut renderer = opened(context, &scene, &settings(60));
    let frame = |renderer: &mut OneView| context.frame(renderer, &view, SIZE, &RenderSettings::default());
    let before = frame(&mut renderer);
    for gathering in [Gathering::Center, Gathering::GRID] {
        let lit = || Some((transfer.clone(), gathering));
        renderer.set_transfer(&scene, object, lit()).expect("this mesh");
        let still = frame(&mut renderer);
        assert!(still.pixels != before.pixels, "{gathering:?}: transfer changes nothing");
        // Moved, turned and scaled: as if it had been loaded there.
        let node = scene.objects[object.index()].node;
        let place = scene.nodes[node].local;
        let turned = DAffine3::from_rotation_y(0.7)
            * DAffine3::from_rotation_x(0.4)
            * DAffine3::from_scale(DVec3::splat(1.1));
        let there = place.affine() * turned;
        scene.set_transform(node, Transform::Affine(there)).expect("a place");
        let changes = scene.take_changes();
        renderer.update(&scene, &changes).expect("update");
        let moved = frame(&mut renderer);
        assert!(moved.pixels != still.pixels);
        let mut fresh = context.renderer(RendererOptions::default());
        let illumination = renderer.illumination().expect("open").clone();
        fresh.open_with(&scene, illumination).expect("open");
        fresh.set_transfer(&scene, object, lit()).expect("this mesh");
        assert!(frame(&mut fresh).pixels == moved.pixels, "{gathering:?}");
        scene.set_transform(node, place).expect("a place");
        let changes = scene.take_changes();
        renderer.update(&scene, &changes).expect("update");
        assert!(frame(&mut renderer).pixels == still.pixels, "{gathering:?}: back again");
    }
    renderer.set_transfer(&scene, object, None).expect("shadow maps again");
    assert!(frame(&mut renderer).pixels == before.pixels);
}

fn stale(context: &Context) {
    let mut scene = builtin::build("table", MovingObject::Torus).expect("a built-in scene");
    scene.take_changes();
    let (object, transfer) = simulated(&scene);
    let lights = settings(100);
    let mut renderer = opened(context, &scene, &lights);
    renderer.set_transfer(&scene, object, Some((transfer, Gathering::GRID))).expect("this mesh");
    let view = close(&scene, 0.35);
    let at_rest = context.frame(&mut renderer, &view, SIZE, &RenderSettings::default());
    // A little towards the light that is above: where it was is then in front of where it is from below alone.
    let node = scene.objects[object.index()].node;
    let local = scene.nodes[node].local.affine();
    let lower = DAffine3::from_translation(DVec3::new(0.0, -0.05, 0.0)) * local;
    scene.set_transform(node, Transform::Affine(lower)).expect("a place");
    let changes = scene.take_changes();
    renderer.update(&scene, &changes).expect("update");
    let mut frame = |most| {
        let updates = MapUpdates { most, ..MapUpdates::default() };
        context.frame(&mut renderer, &view, SIZE, &RenderSettings { updates, ..RenderSettings::default() })
    };
    let held = frame(Some(0));
    let current = frame(None);
    let geometry = girandole_core::scene::Geometry::new(&scene);
    let lights = girandole_core::lights::LightSet::from_samples(&geometry, Vec::new());
    let mask = mask(&Stage { scene: scene.clone(), geometry, lights }, &view);
    let (apart, energy) = difference(&held, &current, &mask);
    assert!(apart < 0.02 && (energy - 1.0).abs() < 0.01, "{apart} {energy}");
    assert!(difference(&at_rest, &current, &mask).0 > 0.03, "the control");
}

fn stretched(context: &Context) {
    let mut scene = builtin::build("table", MovingObject::Torus).expect("a built-in scene");
    scene.take_changes();
    let (object, transfer) = simulated(&scene);
    let view = close(&scene, 0.35);
    let mut renderer = opened(context, &scene, &settings(40));
    renderer.set_transfer(&scene, object, Some((transfer.clone(), Gathering::GRID))).expect("this mesh");
    let node = scene.objects[object.index()].node;
    let flat = DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(1.0, 0.5, 1.0)));
    let there = scene.nodes[node].local.affine() * flat;
    scene.set_transform(node, Transform::Affine(there)).expect("a place");
    let changes = scene.take_changes();
    renderer.update(&scene, &changes).expect("update");
    let shown = context.frame(&mut renderer, &view, SIZE, &RenderSettings::default());
    assert_eq!(context.wait(renderer.stats()).expect("stats").transfer.objects, 0);
    let refused = renderer.set_transfer(&scene, object, Some((transfer, Gathering::GRID)));
    assert!(refused.is_err_and(|error| error.to_string().contains("stretched")));
    renderer.set_transfer(&scene, object, None).expect("shadow maps again");
    assert!(context.frame(&mut renderer, &view, SIZE, &RenderSettings::default()).pixels == shown.pixels);
}
