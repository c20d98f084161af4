//! Whole apps without a window, on whatever adapter there is; a software device will do.

use bevy::app::PluginsState;
use bevy::camera::{Exposure, Hdr, RenderTarget};
use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::gpu_readback::{Readback, ReadbackComplete};
use bevy::render::pipelined_rendering::PipelinedRenderingPlugin;
use bevy::render::render_resource::{PipelineCache, TextureFormat, TextureUsages};
use bevy::window::ExitCondition;
use bevy::winit::WinitPlugin;
use bevy_girandole::girandole::light::Rewalk;
use bevy_girandole::{Girandole, GirandolePlugin};
use half::f16;
use std::sync::Mutex;

const SIZE: [u32; 2] = [96, 64];

/// Software devices are slow enough alone.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

#[derive(Resource, Default)]
struct Read(Option<Vec<u8>>);

#[derive(Component)]
struct Mover;

/// A floor, a wall, and a cube before it.
fn hall(app: &mut App, cube_at: f32) {
    let world = app.world_mut();
    let plain = world.resource_mut::<Assets<StandardMaterial>>().add(Color::linear_rgb(0.6, 0.6, 0.6));
    for (size, at, moves) in [
        (vec3(8.0, 0.2, 8.0), vec3(0.0, -0.1, 0.0), false),
        (vec3(8.0, 4.0, 0.2), vec3(0.0, 2.0, -3.0), false),
        (Vec3::ONE, vec3(cube_at, 0.6, 0.0), true),
    ] {
        let mesh = world.resource_mut::<Assets<Mesh>>().add(Cuboid::from_size(size));
        let mut entity =
            world.spawn((Mesh3d(mesh), MeshMaterial3d(plain.clone()), Transform::from_translation(at)));
        if moves {
            entity.insert(Mover);
        }
    }
}

fn lamps(app: &mut App) {
    for x in [-1.5, 0.2, 1.5] {
        let lamp = PointLight { intensity: 30_000.0, range: 1000.0, shadow_maps_enabled: true, ..default() };
        app.world_mut().spawn((lamp, Transform::from_xyz(x, 3.0, 1.5)));
    }
}

/// An app with a camera that looks at the hall; what it draws into.
fn app(is_girandole: bool) -> (App, Handle<Image>) {
    // What a renderer makes that has just opened the scene.
    let mut app = without_cameras(Rewalk::All);
    let target = camera(&mut app, is_girandole, vec3(0.0, 2.0, 6.0));
    (app, target)
}

fn without_cameras(rewalk: Rewalk) -> App {
    let mut app = App::new();
    let windowless =
        WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() };
    let plugins = DefaultPlugins.build().disable::<WinitPlugin>().disable::<PipelinedRenderingPlugin>();
    let mut plugin = GirandolePlugin::default();
    plugin.illumination.rewalk = rewalk;
    plugin.illumination.lights.count = 200;
    app.add_plugins(plugins.set(windowless).disable::<bevy::log::LogPlugin>()).add_plugins(plugin);
    app.insert_resource(ClearColor(Color::linear_rgb(0.0, 0.0, 0.25)))
        .insert_resource(GlobalAmbientLight::NONE);
    app.init_resource::<Read>();
    while app.plugins_state() == PluginsState::Adding {
        bevy::tasks::tick_global_task_pools_on_main_thread();
    }
    app.finish();
    app.cleanup();
    app
}

/// A camera that looks at the hall from there; what it draws into.
fn camera(app: &mut App, is_girandole: bool, from: Vec3) -> Handle<Image> {
    let mut image = Image::new_target_texture(SIZE[0], SIZE[1], TextureFormat::Rgba16Float, None);
    image.texture_descriptor.usage |= TextureUsages::COPY_SRC;
    let target = app.world_mut().resource_mut::<Assets<Image>>().add(image);
    let mut camera = app.world_mut().spawn((
        Camera3d::default(),
        Hdr,
        Msaa::Off,
        Tonemapping::None,
        Exposure { ev100: 7.0 },
        RenderTarget::from(target.clone()),
        Transform::from_translation(from).looking_at(vec3(0.0, 1.0, 0.0), Vec3::Y),
    ));
    if is_girandole {
        camera.insert(Girandole::default());
    }
    target
}

/// What the camera shows by now.
fn picture(app: &mut App, target: &Handle<Image>) -> Vec<Vec3> {
    let mut ready = 0;
    // Bevy compiles its pipelines beside the frames.
    while ready < 4 {
        app.update();
        let pipelines = app.sub_app(RenderApp).world().resource::<PipelineCache>();
        ready = if pipelines.waiting_pipelines().next().is_none() { ready + 1 } else { 0 };
    }
    app.world_mut().resource_mut::<Read>().0 = None;
    let reader = app.world_mut().spawn(Readback::texture(target.clone())).id();
    app.world_mut().entity_mut(reader).observe(|done: On<ReadbackComplete>, mut read: ResMut<Read>| {
        read.0 = Some(done.data.clone());
    });
    let bytes = loop {
        app.update();
        if let Some(bytes) = app.world_mut().resource_mut::<Read>().0.take() {
            break bytes;
        }
    };
    app.world_mut().despawn(reader);
    let row = bytes.len() / SIZE[1] as usize;
    let value = |texel: &[u8], i: usize| f16::from_le_bytes([texel[2 * i], texel[2 * i + 1]]).to_f32();
    bytes
        .chunks_exact(row)
        .flat_map(|row| row[..SIZE[0] as usize * 8].chunks_exact(8))
        .map(|texel| Vec3::new(value(texel, 0), value(texel, 1), value(texel, 2)))
        .collect()
}

fn pixel(picture: &[Vec3], x: f32, y: f32) -> Vec3 {
    let [x, y] = [(x * SIZE[0] as f32) as usize, (y * SIZE[1] as f32) as usize];
    picture[y * SIZE[0] as usize + x]
}

/// relMSE, as `girandole compare` has it.
fn error(reference: &[Vec3], test: &[Vec3]) -> f32 {
    let all = reference.iter().zip(test).map(|(a, b)| ((*b - *a).powf(2.0) / (*a * *a + 0.01)).element_sum());
    all.sum::<f32>() / (3 * reference.len()) as f32
}

#[test]
fn a_cube_that_moved_is_lit_as_one_that_was_always_there() {
    let _guard = ONE_AT_A_TIME.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let (mut moving, target) = app(true);
    hall(&mut moving, -1.4);
    lamps(&mut moving);
    let before = picture(&mut moving, &target);
    let mut cubes = moving.world_mut().query_filtered::<&mut Transform, With<Mover>>();
    for x in [-0.5, 0.4, 1.3] {
        for mut transform in cubes.iter_mut(moving.world_mut()) {
            transform.translation.x = x;
        }
        moving.update();
    }
    let after = picture(&mut moving, &target);
    drop(moving);
    let (mut fresh, target) = app(true);
    hall(&mut fresh, 1.3);
    lamps(&mut fresh);
    let there = picture(&mut fresh, &target);
    let (same, other) = (error(&there, &after), error(&there, &before));
    assert!(
        same < 2e-3 && other > 20.0 * same.max(1e-3),
        "relMSE {same} of the moved, {other} of the unmoved"
    );

    // Without its lamps it is dark.
    let mut lamps = fresh.world_mut().query_filtered::<&mut Visibility, With<PointLight>>();
    for mut visibility in lamps.iter_mut(fresh.world_mut()) {
        *visibility = Visibility::Hidden;
    }
    let dark = picture(&mut fresh, &target);
    assert!(pixel(&there, 0.5, 0.9).x > 0.02 && pixel(&dark, 0.5, 0.9) == Vec3::ZERO);
}

#[test]
fn emissive_things_light_others_and_the_rest_stays_bevys() {
    let _guard = ONE_AT_A_TIME.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let show = |is_girandole: bool| {
        let (mut app, target) = app(is_girandole);
        hall(&mut app, 0.0);
        let world = app.world_mut();
        let glow = StandardMaterial { emissive: LinearRgba::rgb(4.0, 4.0, 4.0), ..default() };
        // Blended, so Bevy draws them: one before the cube, one behind it.
        let red = StandardMaterial {
            base_color: Color::linear_rgba(1.0, 0.0, 0.0, 0.999),
            alpha_mode: AlphaMode::Blend,
            unlit: true,
            ..default()
        };
        let [glow, red] = [glow, red].map(|m| world.resource_mut::<Assets<StandardMaterial>>().add(m));
        for (size, at, material) in [
            (vec3(2.0, 0.1, 2.0), vec3(0.0, 3.2, 0.5), &glow),
            (vec3(0.2, 0.2, 0.02), vec3(0.0, 0.8, 1.5), &red),
            (vec3(0.3, 0.3, 0.02), vec3(0.0, 0.5, -1.0), &red),
        ] {
            let mesh = world.resource_mut::<Assets<Mesh>>().add(Cuboid::from_size(size));
            world.spawn((Mesh3d(mesh), MeshMaterial3d(material.clone()), Transform::from_translation(at)));
        }
        picture(&mut app, &target)
    };
    let (girandole, bevy) = (show(true), show(false));
    let [lit, unlit] = [&girandole, &bevy].map(|picture| pixel(picture, 0.5, 0.9));
    assert!(lit.min_element() > 0.02, "the floor is lit by what glows: {lit}");
    assert!(unlit.max_element() < 1e-4, "Bevy's is not: {unlit}");
    // Nothing is seen at the top: the clear colour. The emissive panel looks the same in both.
    for picture in [&girandole, &bevy] {
        let nothing = pixel(picture, 0.02, 0.02);
        assert!(nothing.abs_diff_eq(vec3(0.0, 0.0, 0.25), 1e-3), "{nothing}");
    }
    let reds = |picture: &[Vec3]| picture.iter().filter(|p| p.x > 0.9 && p.y < 0.02).count();
    assert!(
        reds(&bevy) > 2 && reds(&girandole).abs_diff(reds(&bevy)) <= 2,
        "{} {}",
        reds(&girandole),
        reds(&bevy)
    );
    // What it reflects comes on top.
    let glows =
        |picture: &[Vec3]| picture.iter().filter(|p| p.min_element() > 3.9 && p.max_element() < 4.5).count();
    assert!(glows(&bevy) > 20 && glows(&girandole).abs_diff(glows(&bevy)) <= glows(&bevy) / 5);
}

#[test]
fn the_component_brings_what_its_camera_needs() {
    let _guard = ONE_AT_A_TIME.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let (mut app, _) = app(true);
    let world = app.world_mut();
    for camera in [
        world.spawn((Camera3d::default(), Girandole::default())).id(),
        world.spawn((Girandole::default(), Camera3d::default())).id(),
        world.spawn(Girandole::default()).id(),
    ] {
        let camera = world.entity(camera);
        assert_eq!(camera.get::<Msaa>(), Some(&Msaa::Off));
        assert!(camera.contains::<Hdr>() && camera.contains::<Camera3d>());
    }
}

#[test]
fn cameras_have_pictures_of_their_own() {
    let _guard = ONE_AT_A_TIME.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let places = [vec3(0.0, 2.0, 6.0), vec3(3.0, 1.2, 4.0)];
    let show = |places: &[Vec3]| -> Vec<Vec<Vec3>> {
        // Samples that are the same for any view.
        let mut app = without_cameras(Rewalk::Off);
        hall(&mut app, 0.0);
        lamps(&mut app);
        let targets: Vec<_> = places.iter().map(|&place| camera(&mut app, true, place)).collect();
        targets.iter().map(|target| picture(&mut app, target)).collect()
    };
    let both = show(&places);
    for (place, seen) in places.iter().zip(&both) {
        let alone = show(&[*place]);
        let same = error(&alone[0], seen);
        assert!(same < 1e-6, "from {place}: {same}");
    }
    let other = error(&both[0], &both[1]);
    assert!(other > 0.01, "the control: they are two pictures, {other}");
}

#[test]
fn a_camera_with_msaa_is_left_to_bevy() {
    let _guard = ONE_AT_A_TIME.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let show = |is_girandole: bool| {
        let (mut app, target) = app(is_girandole);
        hall(&mut app, 0.0);
        lamps(&mut app);
        let mut cameras = app.world_mut().query_filtered::<&mut Msaa, With<Camera3d>>();
        for mut msaa in cameras.iter_mut(app.world_mut()) {
            *msaa = Msaa::Sample4;
        }
        picture(&mut app, &target)
    };
    let (asked, bevys) = (show(true), show(false));
    assert!(error(&bevys, &asked) < 1e-6 && pixel(&bevys, 0.5, 0.9).x > 0.02);
}

#[test]
fn lights_of_all_kinds_are_as_bright_as_bevys() {
    let _guard = ONE_AT_A_TIME.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let down = |at: Vec3| Transform::from_translation(at).looking_at(vec3(at.x, 0.0, at.z), Vec3::X);
    let above = down(vec3(0.0, 3.0, 3.0));
    for kind in ["sun", "spot", "rectangle", "environment"] {
        let [ours, bevys] = [true, false].map(|is_girandole| {
            let (mut app, target) = app(is_girandole);
            hall(&mut app, 0.0);
            let world = app.world_mut();
            match kind {
                "sun" => {
                    world.spawn((DirectionalLight { illuminance: 500.0, ..default() }, above));
                }
                "spot" => {
                    let light =
                        SpotLight { intensity: 50_000.0, range: 100.0, outer_angle: 1.0, ..default() };
                    world.spawn((light, above));
                }
                "rectangle" => {
                    let light =
                        RectLight { intensity: 20_000.0, range: 100.0, width: 1.0, height: 0.5, ..default() };
                    world.spawn((light, above));
                }
                _ => {
                    let mut images = world.resource_mut::<Assets<Image>>();
                    let light =
                        EnvironmentMapLight::solid_color(&mut images, Color::WHITE).with_intensity(500.0);
                    let mut cameras = world.query_filtered::<Entity, With<Camera3d>>();
                    let cameras: Vec<_> = cameras.iter(world).collect();
                    cameras.into_iter().for_each(|camera| {
                        world.entity_mut(camera).insert(light.clone());
                    });
                }
            }
            pixel(&picture(&mut app, &target), 0.5, 0.92)
        });
        let ratio = ours / bevys;
        // Girandole adds what the walls reflect, and takes what they are in the way of.
        assert!(ratio.min_element() > 0.75 && ratio.max_element() < 1.4, "{kind}: {ours} of {bevys}");
    }
}
