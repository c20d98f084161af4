//! Spheres of metal and of plastic in two rows, from smooth to rough.

use girandole_core::glam::{Vec2, Vec3};
use girandole_core::image::Image;
use girandole_core::scene::builtin::shapes;
use girandole_core::scene::{Environment, Material, Mesh, Scene, Sky, Transform, View};

/// Of the spheres from left to right.
pub const ROUGHNESS: [f32; 8] = [0.05, 0.1, 0.15, 0.2, 0.3, 0.45, 0.7, 1.0];

/// What they lie in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surroundings {
    /// On a floor, under a sky that changes slowly.
    Gradient,
    /// On a floor, under a clear sky with its sun.
    Sky,
    /// In a closed room with a lamp.
    Room,
}

/// Brighter above, and to one side.
pub fn gradient() -> Environment {
    let pixel = |i: u32| {
        let (x, y) = ((i % 64) as f32 / 64.0, (i / 64) as f32 / 32.0);
        Vec3::new(1.2 - y, 1.0 - y * y, 0.3 + x)
    };
    let map = Image { width: 64, height: 32, pixels: (0..64 * 32).map(pixel).collect() };
    Environment { rotation: 0.4, ..Environment::new(map).expect("an environment") }
}

/// Two rows of spheres, and the view of them; their objects come first, those of metal before those of plastic. Pictures of it are 4 by 1.
pub fn spheres(surroundings: Surroundings) -> (Scene, View) {
    let mut scene = Scene::default();
    for is_metal in [true, false] {
        for (i, roughness) in ROUGHNESS.into_iter().enumerate() {
            let metal = Material { metallic: 1.0, ..Material::diffuse("metal", Vec3::new(0.95, 0.75, 0.45)) };
            let plastic = Material::diffuse("plastic", Vec3::new(0.15, 0.3, 0.6));
            let material = if is_metal { metal } else { plastic };
            let material = scene.add_material(Material { roughness, specular: 1.0, ..material });
            let mut sphere = shapes::sphere(0.5, 64, 32, material);
            // Beside metal there is plastic, and the other way round.
            let is_in_front = is_metal == (i % 2 == 0);
            let at = Vec3::new((i as f32 - 3.5) * 1.5, 0.5, if is_in_front { 0.9 } else { -0.9 });
            sphere.positions.iter_mut().for_each(|p| *p += at);
            scene.add_object("sphere", sphere, Transform::IDENTITY);
        }
    }
    let is_room = surroundings == Surroundings::Room;
    let white = scene.add_material(Material::diffuse("white", Vec3::splat(if is_room { 0.7 } else { 0.25 })));
    let red = scene.add_material(Material::diffuse("red", Vec3::new(0.7, 0.2, 0.15)));
    let mut quad = |corner: Vec3, u: Vec3, v: Vec3, material| {
        let mut mesh = Mesh::default();
        mesh.add_polygon(&[corner, corner + u, corner + u + v, corner + v], material);
        scene.add_object("wall", mesh, Transform::IDENTITY);
    };
    let (low, high) = (Vec3::new(-7.0, 0.0, -3.0), Vec3::new(7.0, 4.0, 10.0));
    let size = high - low;
    let [x, y, z] = [Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z];
    let depth = if is_room { z } else { Vec3::Z * 6.0 };
    quad(low, depth, x, white);
    if is_room {
        quad(high, -x, -z, white);
        quad(low, x, y, white);
        quad(high, -y, -x, white);
        quad(low, y, z, red);
        quad(high, -z, -y, white);
        let lamp = scene.add_material(Material::emitter("lamp", Vec3::new(12.0, 11.0, 9.0)));
        let mut mesh = Mesh::default();
        let corner = Vec3::new(-2.5, 3.95, 1.0);
        let (u, v) = (Vec3::X * 3.0, Vec3::Z * 2.0);
        mesh.add_polygon(&[corner, corner + u, corner + u + v, corner + v], lamp);
        scene.add_object("lamp", mesh, Transform::IDENTITY);
    }
    scene.environment = match surroundings {
        Surroundings::Gradient => Some(gradient()),
        Surroundings::Sky => Some(Environment::sky(&Sky::default()).expect("a sky")),
        Surroundings::Room => None,
    };
    let eye = Vec3::new(0.0, 3.4, 9.0);
    let forward = (Vec3::new(0.0, 0.35, 0.0) - eye).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let view = View {
        eye: eye.as_dvec3(),
        right,
        up: right.cross(forward),
        forward,
        half_extent: Vec2::new(0.66, 0.165),
        center: Vec2::ZERO,
        orthographic: false,
        depth: None,
        clip: Default::default(),
    };
    (scene, view)
}
