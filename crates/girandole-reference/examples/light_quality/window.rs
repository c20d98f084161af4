//! A room that light from infinitely far away comes into through a window alone; by itself, or one of a building's.

use girandole_core::glam::{DVec3, Vec3, vec3};
use girandole_core::image::Image;
use girandole_core::scene::{
    Camera, Environment, Geometry, Material, MaterialId, Mesh, Projection, Scene, Sky, Transform,
};
use girandole_reference::Opening;

/// Half of the room's floor, and its height, m.
const HALF: [f32; 2] = [2.0, 2.5];
const HEIGHT: f32 = 2.7;
const WALL: f32 = 0.15;
/// From where to where the window goes, up and along its wall, m.
const WINDOW: [[f32; 2]; 2] = [[0.9, 2.2], [-0.8, 0.8]];
/// Rooms behind one another, above one another and side by side.
const ROOMS: [i32; 3] = [2, 3, 4];

/// A clear sky with the sun behind the house.
pub fn sky() -> Environment {
    let sky = Sky { azimuth: 1.2, ..Sky::default() };
    Environment::sky(&sky).expect("a sky")
}

/// Brighter above, and to one side.
pub fn gradient() -> Environment {
    let pixel = |i: u32| {
        let (x, y) = ((i % 64) as f32 / 64.0, (i / 64) as f32 / 32.0);
        vec3(1.2 - y, 1.0 - y * y, 0.3 + x) * 8.0
    };
    let map = Image { width: 64, height: 32, pixels: (0..64 * 32).map(pixel).collect() };
    Environment { rotation: 0.4, ..Environment::new(map).expect("an environment") }
}

/// The room, with so much of a building about it as there is in all, and what it is lit by.
pub fn room(in_building: bool, environment: Environment) -> Scene {
    let mut scene = Scene::default();
    scene.environment = Some(environment);
    let white = scene.add_material(Material::diffuse("white", Vec3::splat(0.75)));
    let red = scene.add_material(Material::diffuse("red", vec3(0.6, 0.2, 0.12)));
    let wood = scene.add_material(Material::diffuse("wood", vec3(0.5, 0.35, 0.22)));
    let [x, z] = HALF;
    let [[bottom, top], [left, right]] = WINDOW;
    let (low, high) = (vec3(-x - WALL, 0.0, -z - WALL), vec3(x + WALL, HEIGHT, z + WALL));
    let walls = [
        (vec3(low.x, -WALL, low.z), vec3(high.x, 0.0, high.z), wood),
        (vec3(low.x, HEIGHT, low.z), vec3(high.x, HEIGHT + WALL, high.z), white),
        (vec3(x, 0.0, low.z), high, white),
        (vec3(-x, 0.0, low.z), vec3(x, HEIGHT, -z), red),
        (vec3(-x, 0.0, z), vec3(x, HEIGHT, high.z), white),
        (low, vec3(-x, bottom, high.z), white),
        (vec3(low.x, top, low.z), vec3(-x, HEIGHT, high.z), white),
        (vec3(low.x, bottom, low.z), vec3(-x, top, left), white),
        (vec3(low.x, bottom, right), vec3(-x, top, high.z), white),
    ];
    let things = [
        (vec3(-0.9, 0.68, -0.7), vec3(0.3, 0.74, 0.5), wood),
        (vec3(-0.8, 0.0, -0.6), vec3(-0.7, 0.68, 0.4), wood),
        (vec3(0.1, 0.0, -0.6), vec3(0.2, 0.68, 0.4), wood),
        (vec3(0.4, 0.0, -2.4), vec3(1.2, 1.6, -1.9), white),
    ];
    let mut add = |boxes: &[(Vec3, Vec3, MaterialId)], at: Transform| {
        for &(low, high, material) in boxes {
            let mut mesh = Mesh::default();
            mesh.add_box(low, high, material);
            scene.add_object("", mesh, at);
        }
    };
    add(&things, Transform::IDENTITY);
    let [behind, above, beside] = if in_building { ROOMS } else { [1; 3] };
    for (i, j, k) in
        (0..behind).flat_map(|i| (0..above).flat_map(move |j| (0..beside).map(move |k| (i, j, k))))
    {
        // Windows of both rows of rooms look outwards.
        let turn = if i == 0 { Vec3::ONE } else { vec3(-1.0, 1.0, 1.0) };
        let at = vec3(i as f32 * 2.0 * high.x, (j - above / 2) as f32 * (HEIGHT + 2.0 * WALL), 0.0)
            + Vec3::Z * ((k - beside / 2) as f32 * 2.0 * high.z);
        let of_room = walls.map(|(low, high, material)| {
            let (a, b) = (low * turn, high * turn);
            (a.min(b), a.max(b), material)
        });
        add(&of_room, Transform::translation(at));
    }
    let from = vec3(1.6, 1.5, 2.1);
    let node = scene.add_node("camera", Transform::looking_at(from, vec3(-1.2, 1.0, -1.6)));
    scene.cameras.push(Camera {
        name: "camera".into(),
        node,
        projection: Projection::Perspective { yfov: 1.0 },
        clip: Default::default(),
    });
    scene
}

/// Its window.
pub fn opening(geometry: &Geometry) -> Opening {
    let corner = DVec3::new(f64::from(-HALF[0] - WALL), f64::from(WINDOW[0][0]), f64::from(WINDOW[1][0]));
    Opening {
        corner: (corner - geometry.origin).as_vec3(),
        sides: [Vec3::Y * (WINDOW[0][1] - WINDOW[0][0]), Vec3::Z * (WINDOW[1][1] - WINDOW[1][0])],
    }
}
