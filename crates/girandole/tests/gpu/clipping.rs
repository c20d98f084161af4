//! What a view cuts off is not drawn, and is in shadow maps.

use crate::common::{Context, Stage, Test, camera, exact, lamp, room};
use girandole::{RenderSettings, RendererOptions};
use girandole_core::glam::{Quat, Vec2, Vec3};
use girandole_core::image::Image;
use girandole_core::lights::LightSettings;
use girandole_core::scene::{ClipPlanes, Material, Mesh, Scene, Transform, View};

pub fn tests() -> Vec<Test> {
    vec![("what_views_cut_off_is_not_drawn", cut)]
}

const SIZE: [u32; 2] = [48, 36];

/// A room whose walls have two sides or only that to the room, with a pane in the middle that lets light through; seen from
/// outside.
fn stage(double_sided: bool) -> Stage {
    let mut scene = Scene::default();
    let wall = scene.add_material(Material { double_sided, ..Material::diffuse("wall", Vec3::splat(0.6)) });
    room(&mut scene, Vec3::new(4.0, 3.0, 5.0), wall, None);
    let pane = Material { blended: true, alpha: 0.5, ..Material::diffuse("pane", Vec3::new(0.8, 0.3, 0.2)) };
    let pane = scene.add_material(pane);
    let mut mesh = Mesh::default();
    let corners = [(-0.7, 0.4), (0.7, 0.4), (0.7, 1.8), (-0.7, 1.8)].map(|(x, y)| Vec3::new(x, y, 0.4));
    mesh.add_polygon(&corners, pane);
    scene.add_object("pane", mesh, Transform::IDENTITY);
    lamp(&mut scene, 0.8, 15.0, Quat::IDENTITY, Vec3::new(0.4, 2.98, 0.3));
    camera(&mut scene, Vec3::new(0.4, 1.6, 5.0), Vec3::new(0.0, 1.2, 0.0), 0.8);
    Stage::new(scene, &LightSettings { count: 60, bounces: 2, ..Default::default() })
}

fn difference(a: &Image, b: &Image) -> f32 {
    let squares: f32 = b.pixels.iter().map(|b| b.length_squared()).sum();
    a.pixels.iter().zip(&b.pixels).map(|(a, b)| (*a - *b).length_squared()).sum::<f32>() / squares
}

fn cut(context: &Context) {
    let [open, closed] = [false, true].map(stage);
    let perspective = open.view(0, SIZE);
    // So narrow that nothing of the room that is before the near plane is seen beside the wall.
    let half_extent = Vec2::new(1.2, 0.9);
    let parallel = View { orthographic: true, half_extent, ..perspective };
    let planes = [ClipPlanes { near: 3.0, ..ClipPlanes::NONE }, ClipPlanes { near: 3.0, far: 5.0 }];
    let mut renderer = context.loaded(&open, RendererOptions::default());
    let whole = |view| context.frame(&mut renderer, &view, SIZE, &exact());
    let expected = [perspective, parallel].map(whole);
    context.load(&mut renderer, &closed);
    for (view, expected) in [perspective, parallel].into_iter().zip(expected) {
        let mut frame = |clip| {
            let view = View { clip, ..view };
            let default = context.frame(&mut renderer, &view, SIZE, &RenderSettings::default());
            (context.frame(&mut renderer, &view, SIZE, &exact()), default, closed.oracle(&view, SIZE, 1))
        };
        // Cameras do not see backs of single-sided walls: the same picture.
        let (found, default, _) = frame(planes[0]);
        assert!(difference(&found, &expected) < 1e-6, "{}", difference(&found, &expected));
        assert!(difference(&default, &expected) < 0.01, "{}", difference(&default, &expected));
        let (walled, ..) = frame(ClipPlanes::NONE);
        assert!(difference(&walled, &expected) > 0.5, "the control");
        // Between both planes what the CPU engine sees: the pane, parts of side walls, and nothing of the wall behind.
        let (found, _, oracle) = frame(planes[1]);
        let black = |image: &Image| image.pixels.iter().filter(|p| **p == Vec3::ZERO).count() as i32;
        assert!(black(&found) > 100 && (black(&found) - black(&oracle)).abs() < 20, "{}", black(&found));
        assert!(difference(&found, &oracle) < 0.03, "{}", difference(&found, &oracle));
        assert!(black(&found) > black(&expected) + 50, "the control");
    }
}
