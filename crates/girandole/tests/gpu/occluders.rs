//! What is drawn into shadow maps of dynamic objects that are small there.

use crate::common::{Context, Test, camera, lamp, mean, room};
use crate::motion::{SIZE, held, updated};
use girandole::core::glam::{Quat, Vec3};
use girandole::core::image::Image;
use girandole::core::math::sequence;
use girandole::core::scene::builtin::shapes;
use girandole::core::scene::{Material, Mesh, Scene, Transform, View};
use girandole::{CullCounts, DeviceTuning, MapUpdates, Mode, RenderSettings, RendererOptions};
use girandole_reference::metrics::{CompareOptions, Comparison, compare};

pub fn tests() -> Vec<Test> {
    vec![
        ("small_movers_drawn_as_texels_block_what_their_triangles_do", small),
        ("large_movers_are_drawn_as_ever", large),
        ("texels_of_small_movers_follow_them", followed),
        ("maps_that_are_refreshed_show_what_drawn_ones_do", refreshed),
    ]
}

/// A room full of tori of a radius in metres, shifted by some metres.
fn stage(count: u32, radius: f32, shift: f32) -> Scene {
    let mut scene = Scene::default();
    let gray = scene.add_material(Material::diffuse("gray", Vec3::splat(0.6)));
    room(&mut scene, Vec3::new(4.0, 3.0, 4.0), gray, None);
    lamp(&mut scene, 0.3, 20.0, Quat::IDENTITY, Vec3::new(0.3, 2.9, 0.2));
    for index in 0..count {
        scene.add_object("torus", shapes::torus(radius, 0.4 * radius, 12, 8, gray), place(index, shift));
        scene.objects.last_mut().expect("it was added").dynamic = true;
    }
    camera(&mut scene, Vec3::new(1.8, 1.6, 1.8), Vec3::new(-1.0, 0.6, -1.0), 1.2);
    scene
}

fn place(index: u32, shift: f32) -> Transform {
    let [x, y, z] = [0, 1, 2].map(|axis| sequence::sample(index, axis, 5));
    let at = Vec3::new(x * 3.2 - 1.6, 0.2 + y * 1.6 + shift, z * 3.2 - 1.6);
    Transform::rigid(Quat::from_axis_angle(Vec3::new(x, 1.0, z).normalize(), index as f32), at)
}

fn options(map_size: u32, small_movers_as_texels: bool) -> RendererOptions {
    RendererOptions { map_size: Some(map_size), small_movers_as_texels, ..Default::default() }
}

/// A picture, and what was drawn into shadow maps.
fn picture(context: &Context, scene: &Scene, options: RendererOptions, mode: Mode) -> (Image, CullCounts) {
    let mut renderer = context.renderer(options);
    renderer.open(scene, &held(60, false)).expect("open");
    let view = View::new(scene, &scene.cameras[0], 4.0 / 3.0);
    let settings = RenderSettings { mode, ..RenderSettings::default() };
    let image = context.frame(&mut renderer, &view, SIZE, &settings);
    (image, context.wait(renderer.stats()).expect("stats").culling)
}

fn compared(reference: &Image, test: &Image) -> Comparison {
    compare(reference, test, &CompareOptions::default()).expect("pictures of one size")
}

fn small(context: &Context) {
    let of = |shift, texels, mode| picture(context, &stage(60, 0.05, shift), options(64, texels), mode);
    for mode in [Mode::Naive, Mode::Full] {
        let ((by_texels, drawn), (by_triangles, all)) = (of(0.0, true, mode), of(0.0, false, mode));
        assert!(drawn.texels_drawn > 500 && all.texels_drawn == 0, "{drawn:?} {all:?}");
        assert!(drawn.triangles_drawn * 4 < all.triangles_drawn, "{drawn:?} {all:?}");
        let found = compared(&by_triangles, &by_texels);
        assert!(found.rel_mse < 2e-4 && (found.energy_ratio - 1.0).abs() < 1e-3, "{mode:?}: {found:?}");
        // The controls: half a texel elsewhere, and without them.
        let (shifted, _) = of(0.02, false, mode);
        let off = compared(&by_triangles, &shifted);
        assert!(off.rel_mse > 10.0 * found.rel_mse && off.rel_mse > 2e-3, "{mode:?}: {off:?}");
        let (empty, _) = picture(context, &stage(0, 0.05, 0.0), options(64, true), mode);
        assert!(mean(&empty) / mean(&by_triangles) > 1.01, "{} {}", mean(&empty), mean(&by_triangles));
    }
}

fn large(context: &Context) {
    let of = |texels| picture(context, &stage(2, 0.3, 0.0), options(256, texels), Mode::Full);
    let ((with, drawn), (without, all)) = (of(true), of(false));
    assert!(with.pixels == without.pixels && drawn == all && drawn.texels_drawn == 0, "{drawn:?} {all:?}");
    // The control: in smaller maps they are small.
    let (_, drawn) = picture(context, &stage(2, 0.3, 0.0), options(32, true), Mode::Full);
    assert!(drawn.texels_drawn > 0);
}

fn followed(context: &Context) {
    let mut scene = stage(20, 0.05, 0.0);
    let nodes: Vec<usize> = scene.objects.iter().filter(|o| o.dynamic).map(|o| o.node).collect();
    let [mut renderer, mut other] = [(), ()].map(|()| context.renderer(options(64, true)));
    scene.take_changes();
    renderer.open(&scene, &held(40, false)).expect("open");
    let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
    let mut before = context.frame(&mut renderer, &view, SIZE, &RenderSettings::default()).pixels;
    for step in 1..=4 {
        // Some of them at a time, so that others are drawn in parts of maps.
        for (index, node) in (0..).zip(&nodes).filter(|(index, _)| index % 4 < step) {
            scene.set_transform(*node, place(index, 0.07 * step as f32)).expect("a place");
        }
        let all = RenderSettings { updates: MapUpdates::default(), ..RenderSettings::default() };
        let ([after, anew], stats) = updated(context, [&mut renderer, &mut other], (&mut scene, &view), &all);
        assert!(after == anew && stats.culling.texels_drawn > 0, "step {step}");
        // The control: they move.
        assert!(after != before);
        before = after;
    }
}

/// Tori of all sizes, one of which comes close to the lamp, and a box that does not move.
fn tori(shift: f32) -> Scene {
    let mut scene = stage(12, 0.05, shift);
    let mut shelf = Mesh::default();
    shelf.add_box(Vec3::new(-0.3, 0.5, -1.2), Vec3::new(0.3, 0.6, -0.7), 0);
    scene.add_object("shelf", shelf, Transform::IDENTITY);
    for index in 12..18 {
        let radius = 0.08 * (index - 11) as f32;
        let torus = shapes::torus(radius, 0.35 * radius, 40, 24, 0);
        scene.add_object("torus", torus, place(index, shift));
        scene.objects.last_mut().expect("it was added").dynamic = true;
    }
    scene
}

/// Where kernels refresh maps from what does not move, these show what maps show that are drawn anew, to the bit, and what devices
/// rasterise, up to rounding.
fn refreshed(context: &Context) {
    let steps = |refresh_maps: bool, map_size: u32| {
        let tuning = Some(DeviceTuning { copy_maps: true, refresh_maps, ..context.tuning() });
        let options = RendererOptions { tuning, ..options(map_size, true) };
        let [mut renderer, mut other] = [(), ()].map(|()| context.renderer(options));
        let mut scene = tori(0.0);
        let nodes: Vec<usize> = scene.objects.iter().filter(|o| o.dynamic).map(|o| o.node).collect();
        scene.take_changes();
        renderer.open(&scene, &held(70, false)).expect("open");
        let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
        context.frame(&mut renderer, &view, SIZE, &RenderSettings::default());
        [1, 2, 3].map(|step| {
            for (index, &node) in (0..).zip(&nodes) {
                let place = match (index, step) {
                    (17, _) => Transform::translation(Vec3::new(0.3, 2.9 - 0.2 * step as f32, 0.2)),
                    _ => place(index, 0.07 * step as f32),
                };
                scene.set_transform(node, place).expect("a place");
            }
            let all = RenderSettings { updates: MapUpdates::default(), ..RenderSettings::default() };
            let ([after, anew], stats) =
                updated(context, [&mut renderer, &mut other], (&mut scene, &view), &all);
            assert!(after == anew, "{refresh_maps} {map_size}: step {step}");
            (Image { width: SIZE[0], height: SIZE[1], pixels: after }, stats)
        })
    };
    for map_size in [64, 200] {
        let [by_kernel, drawn] = [true, false].map(|refresh_maps| steps(refresh_maps, map_size));
        for ((by_kernel, stats), (drawn, of_drawn)) in by_kernel.iter().zip(&drawn) {
            let found = compared(drawn, by_kernel);
            assert!(found.rel_mse < 2e-5 && (found.energy_ratio - 1.0).abs() < 1e-3, "{map_size}: {found:?}");
            assert!(stats.still_maps_bytes > stats.atlas_bytes / 2 && of_drawn.still_maps_bytes == 0);
        }
        // The controls: the next step's picture is another one, and what is kept is not drawn again.
        let other = compared(&drawn[0].0, &by_kernel[1].0);
        assert!(other.rel_mse > 1e-3, "{map_size}: {other:?}");
        let clusters = [&by_kernel, &drawn].map(|steps| steps[1].1.culling.clusters_drawn);
        assert!(clusters[0] < clusters[1], "{map_size}: {clusters:?}");
    }
}
