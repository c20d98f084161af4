//! The README's program: lights a room, moves what is in it, and saves pictures, `low.png` and `high.png`.

use girandole::glam::{DAffine3, DVec3};
use girandole::image::{Exposure, Tonemap, to_srgb8};
use girandole::light::IlluminationSettings;
use girandole::scene::{Scene, Transform, View, builtin};
use girandole::{Gpu, RenderSettings, Renderer, RendererOptions, Viewport};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut scene: Scene = builtin::build("table", builtin::MovingObject::Torus)?; // or Scene::load("room.glb".as_ref())?
    let view = View::new(&scene, scene.camera("0")?, 4.0 / 3.0);
    let gpu = pollster::block_on(Gpu::new(None))?; // or your own wgpu::Device and Queue
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, RendererOptions::default())?;
    let mut viewport = Viewport::default();
    // Samples its light for this view, and finds out what blocks it.
    renderer.open(&scene, &IlluminationSettings { views: vec![view], ..Default::default() })?;

    let (_, torus) = scene.placed_objects().find(|(_, object)| object.dynamic).ok_or("nothing moves")?;
    let (node, place) = (torus.node, scene.world_from_node(torus.node));
    for (file, metres) in [("low.png", 0.0), ("high.png", 0.4)] {
        let higher = DAffine3::from_translation(DVec3::Y * metres) * place;
        scene.set_transform(node, Transform::Affine(higher))?;
        let changes = scene.take_changes();
        renderer.follow(&scene, &changes, &[view])?; // the light follows
        renderer.render(&mut viewport, &view, [640, 480], &RenderSettings::default())?;
        let radiance = gpu.block_on(renderer.radiance(&viewport))??; // linear floating point
        let rgb = to_srgb8(&radiance, Exposure::Auto.ev(&radiance), Tonemap::Agx);
        image::save_buffer(file, &rgb, 640, 480, image::ColorType::Rgb8)?;
    }
    Ok(())
}
