//! Light from infinitely far away, and the background.

use crate::common::{Context, Stage, Test, camera, exact};
use crate::selected::{bounded, flip};
use girandole::core::glam::{Quat, Vec3};
use girandole::core::image::Image;
use girandole::core::lights::LightSettings;
use girandole::core::scene::builtin::shapes;
use girandole::core::scene::{Environment, Material, Mesh, Scene, Transform};
use girandole::{Mode, RenderSettings, RendererOptions};
use girandole_reference::metrics::{CompareOptions, compare};

pub fn tests() -> Vec<Test> {
    vec![
        ("samples_of_an_environment_are_shadowed_as_traced", outdoors_as_traced),
        ("all_modes_agree_under_an_environment", modes),
        ("the_environment_is_seen_where_it_is", background),
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

/// A sphere and a box on a floor.
fn outdoors(count: u32) -> Stage {
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
    Stage::new(scene, &LightSettings { count, ..LightSettings::default() })
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
        }
    }
}
