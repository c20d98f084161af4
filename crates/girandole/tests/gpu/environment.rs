//! Light from infinitely far away, and the background.

use crate::common::{Context, Stage, Test, camera, exact, mean, room};
use crate::selected::{bounded, flip};
use girandole::{Mode, RenderSettings, RendererOptions};
use girandole_core::glam::{DVec3, Quat, Vec3};
use girandole_core::image::Image;
use girandole_core::lights::{BoundingSphere, LightSample, LightSet, LightSettings, Profile};
use girandole_core::scene::builtin::shapes;
use girandole_core::scene::{Environment, Geometry, Material, MaterialId, Mesh, Scene, Sky, Transform};
use girandole_reference::metrics::{CompareOptions, Comparison, compare};

pub fn tests() -> Vec<Test> {
    vec![
        ("samples_of_an_environment_are_shadowed_as_traced", outdoors_as_traced),
        ("maps_that_show_only_what_is_seen", fitted_maps),
        ("maps_are_fine_where_most_is_seen", cored_maps),
        ("no_sky_in_a_closed_room", closed_room),
        ("all_modes_agree_under_an_environment", modes),
        ("the_environment_is_seen_where_it_is", background),
        ("the_sun_is_seen_as_large_as_it_is", sun),
    ]
}

const SIZE: [u32; 2] = [192, 144];

/// Colours that differ in all directions.
fn surroundings() -> Environment {
    let pixel = |i: u32| {
        let (x, y) = ((i % 64) as f32 / 64.0, (i / 64) as f32 / 32.0);
        let side = (x * std::f32::consts::TAU).sin() * 0.4 + 0.5;
        Vec3::new(1.3 - y, side, 0.2 + 0.8 * y + if y < 0.2 { 4.0 } else { 0.0 })
    };
    let map = Image { width: 64, height: 32, pixels: (0..64 * 32).map(pixel).collect() };
    Environment { rotation: 0.9, strength: 1.5, ..Environment::new(map).expect("an environment") }
}

fn outdoors(count: u32) -> Stage {
    Stage::new(sphere_and_box(), &LightSettings { count, ..LightSettings::default() })
}

/// A sphere and a box on a floor.
fn sphere_and_box() -> Scene {
    let mut scene = Scene::default();
    let white = scene.add_material(Material::diffuse("white", Vec3::splat(0.8)));
    let red = scene.add_material(Material::diffuse("red", Vec3::new(0.7, 0.2, 0.1)));
    let mut floor = Mesh::default();
    floor.add_polygon(
        &[(-3.0, -3.0), (-3.0, 3.0), (3.0, 3.0), (3.0, -3.0)].map(|(x, z)| Vec3::new(x, 0.0, z)),
        white,
    );
    scene.add_object("floor", floor, Transform::IDENTITY);
    let sphere = shapes::sphere(0.5, 48, 24, white);
    scene.add_object("sphere", sphere, Transform::rigid(Quat::IDENTITY, Vec3::new(-0.7, 0.5, 0.0)));
    let mut block = Mesh::default();
    block.add_box(Vec3::new(0.3, 0.0, -0.4), Vec3::new(1.0, 0.9, 0.4), red);
    scene.add_object("box", block, Transform::IDENTITY);
    camera(&mut scene, Vec3::new(0.6, 1.4, 3.2), Vec3::new(0.0, 0.4, 0.0), 0.8);
    scene.environment = Some(surroundings());
    scene
}

fn outdoors_as_traced(context: &Context) {
    let stage = outdoors(300);
    let view = stage.view(0, SIZE);
    let oracle = stage.oracle(&view, SIZE, 1);
    let picture = context.picture(&stage, RendererOptions::default(), &view, SIZE);
    let options = CompareOptions { trim: 0.002, ..CompareOptions::default() };
    let found = compare(&oracle, &picture, &options).expect("comparable");
    assert!((found.energy_ratio - 1.0).abs() < 0.005 && found.rel_mse < 1e-3, "{found:?}");
    // The control: light from elsewhere.
    let mut turned = outdoors(300);
    let environment = turned.scene.environment.as_mut().expect("an environment");
    environment.rotation += 1.0;
    turned = Stage::new(turned.scene, &LightSettings::default());
    let other = compare(&turned.oracle(&view, SIZE, 1), &picture, &options).expect("comparable");
    assert!(other.rel_mse > 1e-2, "{other:?}");
}

fn is_distant(sample: &&LightSample) -> bool {
    matches!(sample.profile, Profile::Distant { .. })
}

/// What the environment's maps make of a scene's first view where they show other spheres than those that they were given, to traced
/// shadows.
fn errors<const N: usize>(
    context: &Context,
    scene: Scene,
    shown: [impl Fn(BoundingSphere) -> BoundingSphere; N],
) -> [Comparison; N] {
    let geometry = Geometry::new(&scene);
    let mut stage = Stage { lights: LightSet::from_samples(&geometry, Vec::new()), scene, geometry };
    let view = stage.view(0, SIZE);
    let settings = LightSettings { count: 300, ..LightSettings::default() };
    stage.lights = LightSet::sample_for(&stage.scene, &stage.geometry, &settings, &[view]).expect("lights");
    let placed = stage.lights.samples().to_vec();
    assert!(placed.iter().filter(is_distant).count() > 100);
    let oracle = stage.oracle(&view, SIZE, 1);
    shown.map(|other| {
        let samples = placed.iter().map(|sample| {
            let mut sample = *sample;
            if let Profile::Distant { shown, .. } = &mut sample.profile {
                *shown = other(*shown);
            }
            sample
        });
        stage.lights = LightSet::from_samples(&stage.geometry, samples.collect());
        let picture = context.picture(&stage, RendererOptions::default(), &view, SIZE);
        let options = CompareOptions { trim: 0.002, ..CompareOptions::default() };
        compare(&oracle, &picture, &options).expect("comparable")
    })
}

/// A tower far from what is seen, which shades it all the same, and maps about what is seen alone.
fn fitted_maps(context: &Context) {
    let mut scene = sphere_and_box();
    let mut tower = Mesh::default();
    tower.add_box(Vec3::new(-40.0, -1.0, -60.0), Vec3::new(40.0, 70.0, -50.0), MaterialId(0));
    scene.add_object("tower", tower, Transform::IDENTITY);
    // Only the floor is behind what stands on it.
    scene.cameras.clear();
    camera(&mut scene, Vec3::new(0.6, 3.0, 1.6), Vec3::new(0.1, 0.2, 0.0), 0.8);
    let of = |radius: Option<f32>| {
        move |shown: BoundingSphere| {
            assert!(shown.radius < 5.0 && shown.core == shown.radius, "nothing is far away: {shown:?}");
            let radius = radius.unwrap_or(shown.radius);
            BoundingSphere { radius, core: radius, ..shown }
        }
    };
    let [found, coarse, small] = errors(context, scene, [None, Some(70.0), Some(0.5)].map(of));
    assert!((found.energy_ratio - 1.0).abs() < 0.005 && found.rel_mse < 1e-3, "{found:?}");
    // The controls: maps of the whole scene are coarse, and too small ones shade what they do not show.
    assert!(coarse.rel_mse > 4.0 * found.rel_mse, "{coarse:?} for {found:?}");
    assert!(small.rel_mse > 4.0 * found.rel_mse, "{small:?} for {found:?}");
}

/// A ground that goes on to the horizon, of which a strip is seen, with a wall on it.
fn cored_maps(context: &Context) {
    let mut scene = sphere_and_box();
    let mut ground = Mesh::default();
    let corners = [(-150.0, -150.0), (-150.0, 150.0), (150.0, 150.0), (150.0, -150.0)];
    ground.add_polygon(&corners.map(|(x, z)| Vec3::new(x, -0.5, z)), MaterialId(0));
    ground.add_box(Vec3::new(-30.0, -1.0, -55.0), Vec3::new(30.0, 9.0, -50.0), MaterialId(0));
    scene.add_object("ground", ground, Transform::IDENTITY);
    scene.cameras.clear();
    camera(&mut scene, Vec3::new(0.6, 3.0, 4.2), Vec3::new(0.1, 0.3, 0.0), 1.05);
    let of = |core: Option<f32>| {
        move |shown: BoundingSphere| {
            assert!(shown.radius > 30.0 && shown.core < 0.3 * shown.radius, "{shown:?}");
            BoundingSphere { core: core.map_or(shown.core, |core| core * shown.radius), ..shown }
        }
    };
    let [found, coarse, small] = errors(context, scene, [None, Some(1.0), Some(2e-4)].map(of));
    assert!((found.energy_ratio - 1.0).abs() < 0.005 && found.rel_mse < 3e-4, "{found:?}");
    // The controls: maps that show all alike are coarse, as are those with a core that is too small for what is close.
    assert!(coarse.rel_mse > 4.0 * found.rel_mse, "{coarse:?} for {found:?}");
    assert!(small.rel_mse > 4.0 * found.rel_mse, "{small:?} for {found:?}");
}

fn closed_room(context: &Context) {
    const TOP: usize = 3;
    let lit = |leave_out: Option<usize>| {
        let mut scene = Scene::default();
        let white = scene.add_material(Material::diffuse("white", Vec3::splat(0.8)));
        room(&mut scene, Vec3::new(4.0, 2.6, 5.0), white, leave_out);
        let mut tower = Mesh::default();
        tower.add_box(Vec3::new(20.0, 0.0, 20.0), Vec3::new(24.0, 30.0, 24.0), white);
        scene.add_object("tower", tower, Transform::IDENTITY);
        camera(&mut scene, Vec3::new(1.6, 1.5, 2.2), Vec3::new(-1.0, 1.2, -2.0), 1.2);
        scene.environment = Some(surroundings());
        let mut stage = Stage::new(scene, &LightSettings { count: 300, ..LightSettings::default() });
        let shown = BoundingSphere {
            center: (DVec3::new(0.0, 1.3, 0.0) - stage.geometry.origin).as_vec3(),
            radius: 3.6,
            core: 3.6,
        };
        let samples = stage.lights.samples().iter().filter(is_distant).map(|sample| {
            let mut sample = *sample;
            if let Profile::Distant { shown: of_sample, .. } = &mut sample.profile {
                *of_sample = shown;
            }
            sample
        });
        let samples: Vec<_> = samples.collect();
        assert!(samples.len() > 100);
        stage.lights = LightSet::from_samples(&stage.geometry, samples);
        context.picture(&stage, RendererOptions::default(), &stage.view(0, SIZE), SIZE)
    };
    let (closed, open) = (lit(None), lit(Some(TOP)));
    // Walls without thickness: what leaks is a line along their seams.
    assert!(mean(&closed) < 2e-3 * mean(&open), "{} of {}", mean(&closed), mean(&open));
}

fn modes(context: &Context) {
    let stage = outdoors(300);
    let view = stage.view(0, SIZE);
    let mut renderer = context.loaded(&stage, RendererOptions::default());
    let naive = context.frame(&mut renderer, &view, SIZE, &bounded(Mode::Naive));
    for (mode, most) in [(Mode::Visibility, 0.001), (Mode::LowResolution, 0.02), (Mode::Full, 0.02)] {
        let picture = context.frame(&mut renderer, &view, SIZE, &bounded(mode));
        let difference = flip(&naive, &picture);
        assert!(difference < most, "{mode:?}: {difference}");
    }
    let dark = Image::new(SIZE[0], SIZE[1]);
    assert!(flip(&naive, &dark) > 0.3);
}

fn sun(context: &Context) {
    let sky = Sky::default();
    let level = sky.elevation.cos();
    let direction = Vec3::new(sky.azimuth.sin() * level, sky.elevation.sin(), -sky.azimuth.cos() * level);
    let mut scene = sphere_and_box();
    scene.cameras.clear();
    let environment = Environment { rotation: 0.4, ..Environment::sky(&sky).expect("a sky") };
    scene.environment = Some(environment.clone());
    let (eye, extent) = (Vec3::new(0.0, 3.0, 0.0), 0.02);
    camera(&mut scene, eye, eye + Quat::from_rotation_y(0.4) * direction, extent);
    let stage = Stage::new(scene, &LightSettings { count: 8, ..LightSettings::default() });
    let view = stage.view(0, SIZE);
    let picture = context.picture(&stage, RendererOptions::default(), &view, SIZE);
    let local = stage.local(&view);
    let (mut bright, mut other) = (0, 0);
    for (i, pixel) in picture.pixels.iter().enumerate() {
        let at = [i as u32 % SIZE[0], i as u32 / SIZE[0]].map(|n| n as f32 + 0.5);
        let expected = environment.radiance(local.pixel_ray(at.into(), SIZE).1.normalize());
        other += usize::from(!pixel.abs_diff_eq(expected, 2e-3 * expected.max_element()));
        bright += usize::from(pixel.x > 1e5);
    }
    let across = 2.0 * (0.5 * extent).tan() / SIZE[1] as f32;
    let radius = (bright as f32 / std::f32::consts::PI).sqrt() * across;
    assert!((radius.to_degrees() - 0.2665).abs() < 0.005, "{radius}");
    // But for the rim.
    assert!(other < picture.pixels.len() / 50, "{other}");
}

fn background(context: &Context) {
    let stage = outdoors(8);
    let environment = surroundings();
    // Away from everything, one after the other to all sides.
    for direction in [Vec3::Z, Vec3::X, Vec3::new(-1.0, 0.6, 0.3), Vec3::new(0.2, 1.0, 0.1)] {
        let mut scene = stage.scene.clone();
        scene.cameras.clear();
        let eye = Vec3::new(0.0, 3.0, 4.0);
        camera(&mut scene, eye, eye + direction, 0.9);
        let stage = Stage::new(scene, &LightSettings { count: 8, ..LightSettings::default() });
        let view = stage.view(0, SIZE);
        let local = stage.local(&view);
        let tracer = stage.tracer();
        for settings in [exact(), RenderSettings { samples_per_axis: 2, ..exact() }] {
            let mut renderer = context.renderer(RendererOptions::default());
            renderer.load(&stage.scene, &stage.geometry, &stage.lights).expect("load");
            let picture = context.frame(&mut renderer, &view, SIZE, &settings);
            let mut seen = 0;
            for (i, pixel) in picture.pixels.iter().enumerate() {
                let at = [i as u32 % SIZE[0], i as u32 / SIZE[0]].map(|n| n as f32 + 0.5);
                let (origin, direction) = local.pixel_ray(at.into(), SIZE);
                if tracer.closest_visible(origin, direction).is_some() {
                    continue;
                }
                let expected = environment.radiance(direction.normalize());
                seen += usize::from(pixel.abs_diff_eq(expected, 2e-3 * expected.max_element()));
            }
            // But for edges of what stands there.
            assert!(
                seen * 100 > picture.pixels.len() * 85,
                "{direction}: {seen} of {}",
                picture.pixels.len()
            );
            // Where it is not to be seen, it is not.
            let mut unseen = stage.scene.clone();
            unseen.environment.as_mut().expect("one").visible = false;
            renderer.load(&unseen, &stage.geometry, &stage.lights).expect("load");
            let unseen = context.frame(&mut renderer, &view, SIZE, &settings);
            let black = unseen.pixels.iter().filter(|pixel| **pixel == Vec3::ZERO).count();
            assert!(black >= seen, "{black} of {seen}");
        }
    }
}
