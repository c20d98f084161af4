//! Shadow maps of what moves: parts that are drawn again show what whole maps do.

use crate::common::{Context, Test, camera, lamp, room};
use crate::motion::{SIZE, held, updated};
use girandole::{MapUpdates, RenderSettings, RendererOptions};
use girandole_core::glam::{Quat, Vec3};
use girandole_core::math::sequence;
use girandole_core::scene::builtin::shapes;
use girandole_core::scene::{
    ColorSpace, Filter, Material, MaterialId, Mesh, NodeId, Scene, Texture, TextureRef, Transform, View, Wrap,
};

pub fn tests() -> Vec<Test> {
    vec![("parts_of_maps_that_are_drawn_again_show_what_whole_maps_do", refreshed)]
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

/// Tori of all sizes, one of which comes close to the lamp, sieves, and a box that does not move.
fn tori(shift: f32) -> Scene {
    let mut scene = stage(12, 0.05, shift);
    let mut shelf = Mesh::default();
    shelf.add_box(Vec3::new(-0.3, 0.5, -1.2), Vec3::new(0.3, 0.6, -0.7), MaterialId(0));
    scene.add_object("shelf", shelf, Transform::IDENTITY);
    for index in 12..18 {
        let radius = 0.08 * (index - 11) as f32;
        let torus = shapes::torus(radius, 0.35 * radius, 40, 24, MaterialId(0));
        scene.add_object("torus", torus, place(index, shift));
        scene.objects.last_mut().expect("it was added").dynamic = true;
    }
    scene.textures.push(Texture {
        name: "checker".into(),
        width: 4,
        height: 4,
        texels: (0..16).map(|i| [255, 255, 255, if (i % 4 + i / 4) % 2 == 0 { 255 } else { 0 }]).collect(),
        color_space: ColorSpace::Srgb,
        wrap: [Wrap::Repeat; 2],
        filter: Filter::Nearest,
    });
    let sieve = scene.add_material(Material {
        base_color_texture: Some(TextureRef::new(0)),
        alpha_cutoff: Some(0.5),
        double_sided: true,
        ..Material::default()
    });
    for index in 18..21 {
        let mut mesh = Mesh::default();
        let corners = [(-0.3, -0.3), (-0.3, 0.3), (0.3, 0.3), (0.3, -0.3)].map(|(x, z)| Vec3::new(x, 0.0, z));
        mesh.add_polygon(&corners, sieve);
        scene.add_object("sieve", mesh, place(index, shift));
        scene.objects.last_mut().expect("it was added").dynamic = true;
    }
    scene
}

fn refreshed(context: &Context) {
    for map_size in [64, 200] {
        let options = RendererOptions { map_size: Some(map_size), ..Default::default() };
        let [mut renderer, mut other] = [(), ()].map(|()| context.renderer(options));
        let mut scene = tori(0.0);
        let nodes: Vec<NodeId> = scene.objects.iter().filter(|o| o.dynamic).map(|o| o.node).collect();
        scene.take_changes();
        renderer.open(&scene, &held(70, false)).expect("open");
        let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
        let all = RenderSettings { updates: MapUpdates::default(), ..RenderSettings::default() };
        let mut before = context.frame(&mut renderer, &view, SIZE, &all).pixels;
        let whole = context.wait(renderer.stats()).expect("stats").texels_drawn;
        for step in 1..=4 {
            // Some of them at a time, so that others are drawn in parts of maps; the largest comes close to the lamp.
            for (index, node) in (0..).zip(&nodes).filter(|(index, _)| index % 4 < step || *index == 17) {
                let place = match index {
                    17 => Transform::translation(Vec3::new(0.3, 2.9 - 0.2 * step as f32, 0.2)),
                    _ => place(index, 0.07 * step as f32),
                };
                scene.set_transform(*node, place).expect("a place");
            }
            let ([after, anew], stats) =
                updated(context, [&mut renderer, &mut other], (&mut scene, &view), &all);
            assert!(after == anew, "{map_size}: step {step}");
            // The controls: they move, and less than whole maps is drawn.
            let is_less = step > 1 || stats.texels_drawn < whole;
            assert!(after != before && stats.texels_drawn > 0 && is_less, "step {step}: {stats:?}");
            before = after;
        }
    }
}
