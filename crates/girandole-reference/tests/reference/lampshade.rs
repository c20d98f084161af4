//! A shade without thickness about a lamp: what its bright inside stands for lights nothing of its outside.

use crate::common::Stage;
use girandole_core::glam::{Vec2, Vec3, vec3};
use girandole_core::image::Image;
use girandole_core::lights::{Clamp, LightSet, LightSettings};
use girandole_core::scene::builtin::shapes;
use girandole_core::scene::{Camera, Geometry, Material, Mesh, Projection, Scene, Transform, View};
use girandole_core::trace::SceneTracer;
use girandole_reference::{OracleSettings, oracle};

const SIZE: [u32; 2] = [64, 64];

/// A room with a lamp in a shade of so many faces.
fn lamp(segments: u32) -> Scene {
    let mut stage = Stage::default();
    let white = stage.material(Material::diffuse("white", Vec3::splat(0.7)));
    let cloth =
        stage.material(Material { double_sided: true, ..Material::diffuse("cloth", Vec3::splat(0.7)) });
    let glow = stage.material(Material::emitter("glow", Vec3::splat(60.0)));
    stage.room(vec3(-2.0, 0.0, -2.0), vec3(2.0, 2.6, 2.0), white);
    let mut add = |name: &str, mesh: Mesh, up: f32| {
        stage.scene.add_object(name, mesh, Transform::translation(Vec3::Y * up));
    };
    add("shade", shapes::revolved(&[[0.2, 0.0], [0.12, 0.22]], segments, cloth), 1.0);
    add("bulb", shapes::sphere(0.04, 16, 8, glow), 1.11);
    let node = stage.scene.add_node("camera", Transform::looking_at(vec3(0.0, 1.3, 0.7), Vec3::Y * 1.1));
    let projection = Projection::Perspective { yfov: 0.7 };
    stage.scene.cameras.push(Camera { name: "camera".into(), node, projection, clip: Default::default() });
    stage.scene
}

/// Pixels that show the outside of the shade.
fn outside(scene: &Scene, tracer: &SceneTracer, view: &View) -> Vec<usize> {
    let geometry = tracer.geometry();
    let view = view.relative_to(geometry.origin);
    let is_outside = |i: &usize| {
        let at = Vec2::new((*i as u32 % SIZE[0]) as f32, (*i as u32 / SIZE[0]) as f32) + 0.5;
        let (origin, direction) = view.pixel_ray(at, SIZE);
        let hit = tracer.closest_visible(origin, direction).expect("a closed room");
        let s = geometry.surface(scene, hit.triangle, hit.barycentric, -direction.normalize());
        let object = geometry.triangles[hit.triangle as usize].object as usize;
        let place = s.position + geometry.origin.as_vec3();
        scene.objects[object].name == "shade" && s.geometric_normal.dot(place.with_y(0.0)) > 0.0
    };
    (0..(SIZE[0] * SIZE[1]) as usize).filter(is_outside).collect()
}

#[test]
fn the_inside_of_a_shade_does_not_light_its_outside() {
    for (segments, count) in [(12, 300), (48, 300), (48, 4096)] {
        let scene = lamp(segments);
        let geometry = Geometry::new(&scene);
        let tracer = SceneTracer::new(&scene, &geometry);
        let view = View::new(&scene, &scene.cameras[0], 1.0);
        let outside = outside(&scene, &tracer, &view);
        let lights = LightSettings { count, bounces: 4, ..LightSettings::default() };
        let set = LightSet::sample_for(&scene, &geometry, &lights, &[view]).expect("light");
        let brightness = |clamp| {
            let settings = OracleSettings { clamp, ..OracleSettings::default() };
            let picture: Image = oracle(&tracer, &set, &view, SIZE, &settings, &|_| {});
            let sum: f32 = outside.iter().map(|&i| picture.pixels[i].element_sum()).sum();
            sum / outside.len() as f32
        };
        // Samples as points have no part that sticks out. Nothing that they light is near enough for more to differ.
        let (found, right) = (brightness(Clamp::Own), brightness(Clamp::Off));
        println!("{segments} faces, {count} samples: {found} for {right}");
        assert!(outside.len() > 1000 && right > 0.0);
        assert!((found / right - 1.0).abs() < 0.02, "{segments} faces, {count} samples: {found} for {right}");
    }
}
