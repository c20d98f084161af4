//! Frames that shade only what the picture needs, at the ends of what sizes and numbers may be.

use crate::common::{Context, Stage, Test, camera, lamp, mean, room};
use crate::selected::{bounded, flip};
use girandole::{Mode, RenderSettings, RendererOptions};
use girandole_core::glam::{Quat, Vec3};
use girandole_core::image::Image;
use girandole_core::lights::{LightSet, LightSettings};
use girandole_core::scene::builtin::{self, MovingObject};
use girandole_core::scene::{Geometry, Material, MaterialId, Mesh, Scene, Transform, View};
use girandole_core::visibility::{VisibilityDatabase, VisibilitySettings};

pub fn tests() -> Vec<Test> {
    vec![
        ("many_batches_and_sizes", batches_and_sizes),
        ("pictures_may_be_as_large_as_textures", largest),
        ("receivers_may_fill_the_picture", large_receivers),
        ("the_atlas_fills_its_budget_and_no_more", budget),
        ("what_is_far_away_changes_no_picture", far_away),
    ]
}

fn budget(context: &Context) {
    let stage = Stage::builtin("table", 300);
    // More than that is of no use to so many maps.
    for memory_mib in [16, 40, 90] {
        let mut renderer = context.renderer(RendererOptions { memory_mib, ..Default::default() });
        renderer.load(&stage.scene, &stage.geometry, &stage.lights).expect("load");
        let bytes = context.wait(renderer.stats()).expect("stats").atlas_bytes;
        let budget = u64::from(memory_mib) << 20;
        // The control: it is not far below either.
        assert!(bytes <= budget && bytes > budget * 4 / 5, "{bytes} of {memory_mib} MiB");
    }
}

fn far_away(context: &Context) {
    let size = [256, 192];
    let picture = |at: Option<f32>| {
        let mut scene = builtin::build("table", MovingObject::Torus).expect("a built-in scene");
        if let Some(x) = at {
            let mut mesh = Mesh::default();
            mesh.add_box(Vec3::splat(-0.2), Vec3::splat(0.2), MaterialId(0));
            scene.add_object("box", mesh, Transform::translation(Vec3::new(x, 0.5, 0.0)));
        }
        let geometry = Geometry::new(&scene);
        let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
        let lights =
            LightSet::sample_for(&scene, &geometry, &LightSettings::default(), &[view]).expect("lights");
        let stage = Stage { scene, geometry, lights };
        let mut renderer = context.loaded(&stage, RendererOptions::default());
        context.frame(&mut renderer, &view, size, &bounded(Mode::Full))
    };
    let alone = picture(None);
    for (x, most) in [(20.0, 0.02), (100.0, 0.001), (1e4, 0.001)] {
        let far = flip(&alone, &picture(Some(x)));
        assert!(far <= most, "at {x} m FLIP {far}");
    }
    // The control: within the room it is seen.
    assert!(flip(&alone, &picture(Some(0.0))) > 0.02);
}

fn batches_and_sizes(context: &Context) {
    // 700 lights are two batches.
    let stage = Stage::builtin("table", 700);
    let mut renderer = context.loaded(&stage, RendererOptions { map_size: Some(128), ..Default::default() });
    let view = stage.view(0, [160, 120]);
    let naive = context.frame(&mut renderer, &view, [160, 120], &bounded(Mode::Naive));
    for (mode, bound) in [(Mode::Visibility, 0.005), (Mode::LowResolution, 0.02), (Mode::Full, 0.02)] {
        let careful = RenderSettings { tolerance: 0.05, ..bounded(mode) };
        let picture = context.frame(&mut renderer, &view, [160, 120], &careful);
        assert!(flip(&naive, &picture) < bound, "{mode:?}: {}", flip(&naive, &picture));
    }
    // Any size, down to a pixel, and more rows than a band has.
    let stage = Stage::builtin("pillars", 8);
    let mut renderer = context.loaded(&stage, RendererOptions { map_size: Some(256), ..Default::default() });
    for size in [[1, 1], [2, 1], [1, 9], [8, 8], [9, 9], [17, 3], [33, 31], [8000, 160]] {
        let view = stage.view(0, size);
        for samples_per_axis in [1, 3] {
            if size[0] == 8000 && samples_per_axis > 1 {
                continue;
            }
            let naive = RenderSettings { samples_per_axis, ..bounded(Mode::Naive) };
            let naive = context.frame(&mut renderer, &view, size, &naive);
            let full = RenderSettings { samples_per_axis, ..bounded(Mode::Full) };
            let full = context.frame(&mut renderer, &view, size, &full);
            let energy = mean(&full) / mean(&naive);
            // A pixel that holds half a wall is too coarse for its samples to share their light.
            let slack = if size[0] * size[1] < 300 { 0.5 } else { 0.05 };
            assert!((energy - 1.0).abs() < slack, "{size:?}, {samples_per_axis}: {energy}");
            if size[0] == 8000 {
                // Points are as few in the second band as in the first.
                let points: u64 = context.wait(renderer.stats()).expect("stats").points.iter().sum();
                assert!(points * 5 < 8000 * 160, "{points}");
                // Bands of 128 rows: nothing is seen of where they meet.
                let row = |image: &Image, y: usize| image.pixels[y * 8000..(y + 1) * 8000].to_vec();
                let error = |y: usize| {
                    let pairs = row(&naive, y).into_iter().zip(row(&full, y));
                    pairs.map(|(a, b)| (a - b).abs().max_element()).sum::<f32>() / 8000.0
                };
                let elsewhere = (100..156).map(error).sum::<f32>() / 56.0;
                assert!(error(127).max(error(128)) < 3.0 * elsewhere + 1e-4, "{} {elsewhere}", error(128));
            }
        }
    }
}

fn largest(context: &Context) {
    let largest = context.gpu.device.limits().max_texture_dimension_2d;
    let stage = Stage::builtin("pillars", 4);
    let mut renderer = context.loaded(&stage, RendererOptions { map_size: Some(64), ..Default::default() });
    for size in [[largest, 4], [4, largest]] {
        let view = stage.view(0, size);
        let [naive, full] =
            [Mode::Naive, Mode::Full].map(|mode| context.frame(&mut renderer, &view, size, &bounded(mode)));
        let energy = mean(&full) / mean(&naive);
        assert!(mean(&naive) > 0.01 && (energy - 1.0).abs() < 0.05, "{size:?}: {energy}");
        let error = renderer.render(&view, size.map(|side| side + 1), &bounded(Mode::Full));
        assert!(error.is_err(), "the control: {} is too large", largest + 1);
    }
}

/// Mesa's software driver ends an invocation's loops after 65535 rounds: nothing may take as many as there are points.
fn large_receivers(context: &Context) {
    let size = [1400, 1000];
    let mut scene = Scene::default();
    let white = scene.add_material(Material::diffuse("white", Vec3::splat(0.7)));
    room(&mut scene, Vec3::new(6.0, 3.0, 6.0), white, None);
    lamp(&mut scene, 0.5, 10.0, Quat::IDENTITY, Vec3::new(0.0, 2.9, 0.0));
    camera(&mut scene, Vec3::new(0.0, 1.5, 2.5), Vec3::new(0.3, 0.0, 0.0), 0.9);
    let stage = Stage::new(scene, &LightSettings { count: 4, ..Default::default() });
    let view = stage.view(0, size);
    let mut renderer = context.loaded(&stage, RendererOptions::default());
    let settings = VisibilitySettings::flat();
    let database = VisibilityDatabase::build(&stage.scene, &stage.geometry, &stage.lights, &settings)
        .expect("visibility");
    renderer.load_visibility(&stage.scene, &stage.geometry, &stage.lights, database).expect("visibility");
    let naive = context.frame(&mut renderer, &view, size, &bounded(Mode::Naive));
    let vd = context.frame(&mut renderer, &view, size, &bounded(Mode::Visibility));
    let stats = context.wait(renderer.stats()).expect("stats");
    assert!(flip(&naive, &vd) < 0.001, "{}", flip(&naive, &vd));
    assert!(stats.points[0] >= 1400 * 1000, "{}", stats.points[0]);
    // Two points a round.
    let rounds = stats.points[0] / u64::from(stats.leaves[0]) / 2;
    assert!(rounds > 65535, "{rounds}");
}
