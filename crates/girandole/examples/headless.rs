//! Lights a scene made in code and writes `headless.png`: a lamp over a ball in a room that is open to the front.

#[path = "shared/png.rs"]
mod png;

use girandole::glam::{Vec3, vec3};
use girandole::light::IlluminationSettings;
use girandole::scene::builtin::shapes;
use girandole::scene::{Camera, Material, Mesh, Projection, Scene, Transform, View};
use girandole::{Gpu, RenderSettings, Renderer, RendererOptions, Viewport};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A scene: three walls, a floor, a lamp that faces down, a ball, a camera.
    let mut scene = Scene::default();
    let white = scene.add_material(Material::diffuse("white", Vec3::splat(0.75)));
    let red = scene.add_material(Material::diffuse("red", vec3(0.65, 0.08, 0.06)));
    let glow = scene.add_material(Material::emitter("glow", vec3(18.0, 16.0, 13.0)));
    let mut room = Mesh::default();
    for (corners, material) in [
        ([vec3(-2., 0., 2.), vec3(2., 0., 2.), vec3(2., 0., -2.), vec3(-2., 0., -2.)], white),
        ([vec3(-2., 0., -2.), vec3(2., 0., -2.), vec3(2., 3., -2.), vec3(-2., 3., -2.)], white),
        ([vec3(-2., 0., 2.), vec3(-2., 0., -2.), vec3(-2., 3., -2.), vec3(-2., 3., 2.)], red),
        ([vec3(2., 0., -2.), vec3(2., 0., 2.), vec3(2., 3., 2.), vec3(2., 3., -2.)], white),
        ([vec3(-0.5, 2.9, -0.5), vec3(0.5, 2.9, -0.5), vec3(0.5, 2.9, 0.5), vec3(-0.5, 2.9, 0.5)], glow),
    ] {
        room.add_polygon(&corners, material);
    }
    scene.add_object("room", room, Transform::IDENTITY);
    scene.add_object(
        "ball",
        shapes::sphere(0.6, 48, 24, white),
        Transform::translation(vec3(0.2, 0.6, -0.3)),
    );
    let node = scene.add_node("camera", Transform::looking_at(vec3(0.0, 1.6, 5.5), vec3(0.0, 1.3, 0.0)));
    scene.cameras.push(Camera {
        name: "front".into(),
        node,
        projection: Projection::Perspective { yfov: 0.7 },
        clip: Default::default(),
    });

    // Its light as 300 samples, and a device of our own; a program with a window hands in the one it has.
    let gpu = pollster::block_on(Gpu::new(None))?;
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, RendererOptions::default())?;
    let mut viewport = Viewport::default();
    let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
    let views = vec![view];
    renderer.open(&scene, &IlluminationSettings { views, ..IlluminationSettings::default() })?;
    renderer.render(&mut viewport, &view, [640, 480], &RenderSettings::default())?;
    let image = gpu.block_on(renderer.radiance(&viewport))??;
    Ok(png::write_png("headless.png", &image)?)
}
