//! The five rooms.

use super::{MovingObject, shapes, teapot};
use crate::scene::{
    Animation, Camera, Channel, Interpolation, Keyframes, Material, MaterialId, Mesh, ObjectId, Projection,
    Scene, Transform,
};
use crate::{Error, Result};
use glam::{Quat, Vec3, vec3};

const WHITE: Vec3 = Vec3::new(0.74, 0.73, 0.7);
const FLOOR: Vec3 = Vec3::new(0.5, 0.43, 0.35);
const WOOD: Vec3 = Vec3::new(0.5, 0.34, 0.21);
const GREY: Vec3 = Vec3::new(0.5, 0.5, 0.5);
const RED: Vec3 = Vec3::new(0.62, 0.08, 0.06);
const BLUE: Vec3 = Vec3::new(0.08, 0.14, 0.62);
const GREEN: Vec3 = Vec3::new(0.1, 0.45, 0.1);
const WARM: Vec3 = Vec3::new(1.0, 0.93, 0.82);
const OBJECT: Vec3 = Vec3::new(0.72, 0.7, 0.66);

/// Where the moving object comes by, besides where it stands.
const PATH_POINTS: usize = 7;

/// A scene in the making.
pub(super) struct Room {
    pub scene: Scene,
    pub half: Vec3,
    pub height: f32,
}

impl Room {
    /// A closed room: x in ±`half_x`, y from 0 to `height`, z in ±`half_z`. `walls` are −x, +x, −z, +z.
    pub fn new(name: &str, half_x: f32, height: f32, half_z: f32, walls: [Vec3; 4]) -> Self {
        let mut room = Self {
            scene: Scene { name: name.into(), ..Scene::default() },
            half: vec3(half_x, 0.0, half_z),
            height,
        };
        let (x, y, z) = (half_x, height, half_z);
        room.quad("floor", FLOOR, [vec3(-x, 0., -z), vec3(-x, 0., z), vec3(x, 0., z), vec3(x, 0., -z)]);
        room.quad("ceiling", WHITE, [vec3(-x, y, -z), vec3(x, y, -z), vec3(x, y, z), vec3(-x, y, z)]);
        let sides = [
            ("left wall", [vec3(-x, 0., z), vec3(-x, 0., -z), vec3(-x, y, -z), vec3(-x, y, z)]),
            ("right wall", [vec3(x, 0., -z), vec3(x, 0., z), vec3(x, y, z), vec3(x, y, -z)]),
            ("back wall", [vec3(-x, 0., -z), vec3(x, 0., -z), vec3(x, y, -z), vec3(-x, y, -z)]),
            ("front wall", [vec3(x, 0., z), vec3(-x, 0., z), vec3(-x, y, z), vec3(x, y, z)]),
        ];
        for ((name, corners), color) in sides.into_iter().zip(walls) {
            room.quad(name, color, corners);
        }
        room
    }

    pub fn diffuse(&mut self, color: Vec3) -> MaterialId {
        let known = self.scene.materials.iter().position(|m| m.base_color == color && !m.emits());
        known.map_or_else(
            || {
                let name = match color {
                    WHITE => "white",
                    FLOOR => "floor",
                    WOOD => "wood",
                    GREY => "grey",
                    RED => "red",
                    BLUE => "blue",
                    GREEN => "green",
                    OBJECT => "object",
                    _ => "colour",
                };
                self.scene.add_material(Material::diffuse(name, color))
            },
            MaterialId::from,
        )
    }

    pub fn add(&mut self, name: &str, mesh: Mesh, at: Vec3) -> ObjectId {
        self.scene.add_object(name, Mesh { name: name.into(), ..mesh }, Transform::translation(at))
    }

    fn quad(&mut self, name: &str, color: Vec3, corners: [Vec3; 4]) {
        let material = self.diffuse(color);
        let mut mesh = Mesh::default();
        mesh.add_polygon(&corners, material);
        self.add(name, mesh, Vec3::ZERO);
    }

    /// Boxes as one object, each by its lowest corner and size; those that start at the floor have no bottom, those
    /// that end at the ceiling no top.
    pub fn boxes(&mut self, name: &str, color: Vec3, at: Vec3, yaw: f32, boxes: &[(Vec3, Vec3)]) {
        let material = self.diffuse(color);
        let mut mesh = Mesh { name: name.into(), ..Mesh::default() };
        for &(low, size) in boxes {
            let mut all = Mesh::default();
            all.add_box(low, low + size, material);
            for patch in &all.patches {
                let corners: Vec<Vec3> = patch.outline.iter().map(|&v| all.positions[v as usize]).collect();
                let level = |y: f32| corners.iter().all(|p| (p.y + at.y - y).abs() < 1e-6);
                if !level(0.0) && !level(self.height) {
                    mesh.add_polygon(&corners, material);
                }
            }
        }
        self.scene.add_object(name, mesh, Transform::rigid(about_y(yaw), at));
    }

    /// A table: plate and four legs, `size` over all, standing at `at`.
    fn table(&mut self, name: &str, color: Vec3, at: Vec3, yaw: f32, size: Vec3) {
        let (thick, leg) = (0.05, 0.07);
        let (x, z) = (size.x * 0.5, size.z * 0.5);
        let foot = vec3(leg, size.y - thick, leg);
        let mut boxes = vec![(vec3(-x, size.y - thick, -z), vec3(size.x, thick, size.z))];
        for (sx, sz) in [(-x + 0.04, -z + 0.04), (x - leg - 0.04, -z + 0.04)] {
            boxes.push((vec3(sx, 0.0, sz), foot));
            boxes.push((vec3(sx, 0.0, -sz - leg), foot));
        }
        self.boxes(name, color, at, yaw, &boxes);
    }

    /// A rectangular light in the ceiling, its face 4 cm below, in a white frame. `size` in metres, radiance in
    /// W/(sr·m²).
    pub fn light(&mut self, name: &str, center: [f32; 2], size: [f32; 2], radiance: Vec3) {
        let known = self.scene.materials.iter().position(|m| m.emission == radiance);
        let light = match known {
            Some(i) => i.into(),
            None => self.scene.add_material(Material::emitter("light", radiance)),
        };
        let white = self.diffuse(WHITE);
        let (x, z) = (size[0] * 0.5, size[1] * 0.5);
        let (top, low) = (self.height, self.height - 0.04);
        let corner = |sx: f32, sz: f32, y: f32| vec3(sx * x, y, sz * z);
        let ring = [(-1., -1.), (1., -1.), (1., 1.), (-1., 1.)];
        let mut face = Mesh::default();
        face.add_polygon(&ring.map(|(sx, sz)| corner(sx, sz, low)), light);
        let mut frame = Mesh::default();
        for (i, &(ax, az)) in ring.iter().enumerate() {
            let (bx, bz) = ring[(i + 1) % 4];
            let side = [corner(bx, bz, low), corner(ax, az, low), corner(ax, az, top), corner(bx, bz, top)];
            frame.add_polygon(&side, white);
        }
        let at = vec3(center[0], 0.0, center[1]);
        self.add(name, face, at);
        self.add(&format!("{name} frame"), frame, at);
    }

    /// The moving object: largest extent `size` metres, standing on `at` and then, a second apart, on the points of a
    /// path that leads back there, while it turns about once.
    pub fn moving(
        &mut self,
        object: MovingObject,
        at: Vec3,
        yaw: f32,
        size: f32,
        path: [Vec3; PATH_POINTS],
    ) -> Result<()> {
        let (name, mut mesh, rotation) = match object {
            MovingObject::None => return Ok(()),
            // On edge, so that its hole is seen.
            MovingObject::Torus => {
                let half = std::f32::consts::FRAC_1_SQRT_2;
                let yaw = about_y(yaw);
                // about_y(yaw) · a quarter turn about x, written out.
                let q = Quat::from_xyzw(yaw.w * half, yaw.y * half, -yaw.y * half, yaw.w * half);
                ("torus", shapes::thesis_torus(MaterialId(0)), q)
            }
            MovingObject::Teapot => ("teapot", teapot(6, MaterialId(0)), about_y(yaw)),
            MovingObject::Balloon => ("balloon", shapes::balloon(MaterialId(0)), about_y(yaw)),
            MovingObject::Model(mesh) => ("model", *mesh, about_y(yaw)),
        };
        let material =
            if name == "balloon" { self.scene.add_material(rubber()) } else { self.diffuse(OBJECT) };
        for triangle in &mut mesh.triangles {
            triangle.material = material;
        }
        let bounds = |turn: Quat| {
            mesh.positions.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &p| {
                let p = (turn.as_dquat() * p.as_dvec3()).as_vec3();
                (low.min(p), high.max(p))
            })
        };
        let (low, high) = bounds(Quat::IDENTITY);
        let extent = (high - low).max_element();
        if !(extent.is_finite() && extent > 0.0) {
            return Err(Error::Invalid(
                "the object's model has no extent; give a mesh with at least one triangle".into(),
            ));
        }
        let scale = size / extent;
        let (low, high) = bounds(rotation);
        let center = (low + high) * 0.5;
        let translation = at - vec3(center.x, low.y, center.z) * scale;
        let local = Transform::Parts { translation, rotation, scale: Vec3::splat(scale) };
        let index = self.scene.add_object(name, mesh, local);
        self.scene.objects[index].dynamic = true;
        let (mut places, mut rotations) = (vec![translation], vec![rotation]);
        for (i, point) in (1..).zip(path) {
            let turn = about_y(360.0 * i as f32 / (PATH_POINTS + 1) as f32);
            places.push(point - turn * vec3(center.x, low.y, center.z) * scale);
            rotations.push(turn * rotation);
        }
        // Back to where it stands, through all of them without a jerk (Catmull-Rom).
        rotations.push(rotation);
        let count = places.len();
        let splines = (0..=count).flat_map(|i| {
            let speed = (places[(i + 1) % count] - places[(i + count - 1) % count]) * 0.5;
            [speed, places[i % count], speed]
        });
        let splines = splines.collect();
        let channel = |keyframes, interpolation| Channel {
            node: self.scene.objects[index].node,
            times: (0..=count).map(|i| i as f32).collect(),
            keyframes,
            interpolation,
        };
        let channels = vec![
            channel(Keyframes::Translation(splines), Interpolation::CubicSpline),
            channel(Keyframes::Rotation(rotations), Interpolation::Linear),
        ];
        self.scene.animations.push(Animation { name: "path".into(), channels });
        Ok(())
    }

    pub fn camera(&mut self, name: &str, eye: Vec3, target: Vec3, degrees: f32) {
        debug_assert!(eye.abs().x < self.half.x && eye.abs().z < self.half.z && eye.y < self.height);
        let node = self.scene.add_node(name, Transform::looking_at(eye, target));
        let projection = Projection::Perspective { yfov: degrees.to_radians() };
        self.scene.cameras.push(Camera { name: name.into(), node, projection, clip: Default::default() });
    }
}

/// Of a balloon.
fn rubber() -> Material {
    let color = vec3(0.72, 0.05, 0.04);
    Material { roughness: 0.22, specular: 0.5, ..Material::diffuse("red rubber", color) }
}

/// A rotation about +Y by degrees, the same on every machine.
pub(super) fn about_y(degrees: f32) -> Quat {
    let half = f64::from(degrees).to_radians() * 0.5;
    Quat::from_xyzw(0.0, libm::sin(half) as f32, 0.0, libm::cos(half) as f32)
}

/// Figure 5-1, left: two large rectangular lights, so shadows are very soft.
pub(super) fn area_lights(object: MovingObject) -> Result<Scene> {
    let mut room = Room::new("area-lights", 4.0, 3.0, 3.0, [WHITE; 4]);
    room.light("left light", [-1.9, -0.3], [2.0, 1.4], WARM * 6.0);
    room.light("right light", [1.9, -0.3], [2.0, 1.4], WARM * 6.0);
    room.table("bench", WOOD, vec3(-1.9, 0.0, -1.5), 12.0, vec3(1.7, 0.5, 0.6));
    let pedestal = |h: f32, w: f32| [(vec3(-w, 0.0, -w), vec3(2.0 * w, h, 2.0 * w))];
    room.boxes("tall pedestal", GREY, vec3(0.1, 0.0, -1.2), 20.0, &pedestal(1.05, 0.2));
    room.boxes("low pedestal", GREY, vec3(1.5, 0.0, -0.5), -15.0, &pedestal(0.55, 0.28));
    room.boxes("cube", RED, vec3(-1.2, 0.0, 0.5), 30.0, &pedestal(0.45, 0.22));
    room.boxes(
        "shelf",
        WOOD,
        vec3(2.9, 0.0, -2.78),
        0.0,
        &[
            (vec3(-0.75, 0.0, -0.18), vec3(0.04, 1.9, 0.36)),
            (vec3(0.71, 0.0, -0.18), vec3(0.04, 1.9, 0.36)),
            (vec3(-0.71, 0.3, -0.18), vec3(1.42, 0.04, 0.36)),
            (vec3(-0.71, 0.85, -0.18), vec3(1.42, 0.04, 0.36)),
            (vec3(-0.71, 1.4, -0.18), vec3(1.42, 0.04, 0.36)),
            (vec3(-0.71, 1.86, -0.18), vec3(1.42, 0.04, 0.36)),
        ],
    );
    let object_material = room.diffuse(OBJECT);
    let blue = room.diffuse(BLUE);
    room.add("sphere", shapes::sphere(0.26, 32, 16, object_material), vec3(0.1, 1.31, -1.2));
    room.add("ball", shapes::sphere(0.2, 28, 14, blue), vec3(-2.3, 0.7, -1.45));
    room.add("drum", shapes::cylinder(0.22, 0.5, 28, object_material), vec3(2.55, 0.0, 0.6));
    let path = [
        vec3(1.9, 1.0, 0.4),
        vec3(0.8, 1.2, 1.0),
        vec3(-0.6, 1.0, 1.1),
        vec3(-2.4, 0.9, 0.9),
        vec3(-3.0, 1.1, -0.3),
        vec3(-1.7, 1.3, -0.5),
        vec3(0.2, 1.3, -0.2),
    ];
    room.moving(object, vec3(1.5, 0.551, -0.5), 35.0, 0.6, path)?;
    room.camera("area-lights", vec3(-0.5, 1.55, 2.9), vec3(0.1, 1.1, -1.0), 66.0);
    room.camera("corner", vec3(3.7, 2.0, 2.7), vec3(-0.6, 0.5, -1.0), 55.0);
    room.camera("pedestals", vec3(0.3, 1.2, 1.7), vec3(0.8, 0.6, -1.0), 50.0);
    Ok(room.scene)
}

/// Figure 5-1, centre: a table with an object on it between a blue and a red wall.
pub(super) fn table(object: MovingObject) -> Result<Scene> {
    let mut room = Room::new("table", 3.5, 3.0, 3.0, [BLUE, RED, WHITE, WHITE]);
    room.light("light", [0.2, -0.2], [1.6, 1.0], WARM * 15.0);
    room.table("table", WOOD, vec3(0.0, 0.0, -0.6), 8.0, vec3(2.0, 0.75, 1.1));
    room.boxes(
        "books",
        GREY,
        vec3(-0.62, 0.7505, -0.75),
        25.0,
        &[
            (vec3(-0.15, 0.0, -0.11), vec3(0.3, 0.05, 0.22)),
            (vec3(-0.13, 0.0505, -0.1), vec3(0.25, 0.04, 0.2)),
        ],
    );
    let white = room.diffuse(WHITE);
    room.add("cup", shapes::cylinder(0.05, 0.12, 24, white), vec3(0.7, 0.7505, -0.3));
    room.table("left stool", WOOD, vec3(-1.75, 0.0, -0.35), 35.0, vec3(0.42, 0.45, 0.42));
    room.table("right stool", WOOD, vec3(1.65, 0.0, -1.1), -20.0, vec3(0.42, 0.45, 0.42));
    room.boxes(
        "sideboard",
        WHITE,
        vec3(-1.6, 0.0, -2.75),
        0.0,
        &[(vec3(-0.9, 0.0, -0.22), vec3(1.8, 0.7, 0.44))],
    );
    let path = [
        vec3(0.8, 1.1, -0.3),
        vec3(2.1, 1.0, 0.3),
        vec3(1.5, 0.8, 1.1),
        vec3(0.0, 0.8, 0.9),
        vec3(-1.5, 0.8, 0.9),
        vec3(-2.4, 1.0, -0.1),
        vec3(-1.0, 1.2, -0.4),
    ];
    room.moving(object, vec3(0.05, 0.751, -0.6), 35.0, 0.6, path)?;
    room.camera("table", vec3(0.5, 1.65, 2.85), vec3(-0.02, 0.8, -0.7), 52.0);
    room.camera("close", vec3(1.2, 1.35, 0.9), vec3(0.0, 0.88, -0.6), 45.0);
    room.camera("red-wall", vec3(-3.1, 1.7, 1.6), vec3(0.6, 0.8, -0.7), 52.0);
    Ok(room.scene)
}

/// Figure 5-1, right, and 5-9: four pillars and a green wall; one pillar stands in the foreground.
pub(super) fn pillars(object: MovingObject) -> Result<Scene> {
    let mut room = Room::new("pillars", 4.0, 3.2, 3.2, [GREEN, WHITE, WHITE, WHITE]);
    room.light("light", [0.0, 0.0], [1.8, 1.2], WARM * 14.0);
    for (i, (x, z)) in [(-1.6, -1.3), (1.6, -1.3), (-1.6, 1.3), (1.6, 1.3)].into_iter().enumerate() {
        let (name, at) = (format!("pillar {}", i + 1), vec3(x, 0.0, z));
        let shaft = vec3(0.4, room.height, 0.4);
        room.boxes(&name, WHITE, at, 0.0, &[(vec3(-0.2, 0.0, -0.2), shaft)]);
    }
    room.boxes("plinth", GREY, vec3(-0.2, 0.0, -0.1), 25.0, &[(vec3(-0.4, 0.0, -0.4), vec3(0.8, 0.4, 0.8))]);
    room.boxes("bench", WOOD, vec3(0.0, 0.0, -2.7), 0.0, &[(vec3(-1.2, 0.0, -0.2), vec3(2.4, 0.42, 0.4))]);
    let path = [
        vec3(1.0, 0.8, 0.3),
        vec3(2.6, 0.5, 0.3),
        vec3(1.2, 1.0, -0.3),
        vec3(0.0, 1.2, -0.9),
        vec3(-1.2, 1.0, -0.2),
        vec3(-2.9, 0.6, 0.0),
        vec3(-1.3, 0.7, 0.3),
    ];
    room.moving(object, vec3(-0.2, 0.401, -0.1), 30.0, 0.7, path)?;
    room.camera("pillars", vec3(1.2, 1.65, 3.0), vec3(-0.35, 0.95, -0.6), 60.0);
    room.camera("foreground", vec3(2.05, 1.5, 2.1), vec3(1.1, 1.1, 0.2), 60.0);
    room.camera("green-wall", vec3(2.9, 1.5, -0.2), vec3(-2.0, 0.9, -0.2), 55.0);
    Ok(room.scene)
}

/// Figure 5-10: a large grey block shades an object beside it, which only indirect light reaches.
pub(super) fn block(object: MovingObject) -> Result<Scene> {
    let mut room = Room::new("block", 3.5, 3.0, 3.0, [WHITE, RED, WHITE, WHITE]);
    room.light("light", [-2.1, -0.4], [1.2, 1.8], WARM * 18.0);
    block_and_plinth(&mut room);
    let path = [
        vec3(1.6, 0.5, 1.2),
        vec3(-0.2, 0.6, 1.8),
        vec3(-1.9, 0.6, 1.0),
        vec3(-2.2, 0.5, -0.6),
        vec3(-1.2, 0.8, -2.2),
        vec3(0.4, 0.9, -2.3),
        vec3(1.7, 0.6, -1.2),
    ];
    room.moving(object, vec3(1.35, 0.001, 0.1), 150.0, 0.8, path)?;
    room.camera("block", vec3(1.9, 1.6, 2.9), vec3(0.35, 0.65, -0.6), 55.0);
    room.camera("lit-side", vec3(-3.0, 1.7, 2.7), vec3(0.0, 0.7, -0.4), 55.0);
    room.camera("close", vec3(2.4, 0.9, 1.7), vec3(1.1, 0.35, 0.0), 48.0);
    Ok(room.scene)
}

fn block_and_plinth(room: &mut Room) {
    room.boxes("block", GREY, vec3(-0.25, 0.0, -0.3), 10.0, &[(vec3(-0.45, 0.0, -1.1), vec3(0.9, 1.9, 2.2))]);
    room.boxes("chest", WOOD, vec3(2.6, 0.0, -2.4), 0.0, &[(vec3(-0.6, 0.0, -0.3), vec3(1.2, 0.6, 0.6))]);
}

/// Figure 6-1: two halves joined by a narrow gap; the light is in one, the object in the other.
pub(super) fn gap(object: MovingObject) -> Result<Scene> {
    let mut room = Room::new("gap", 4.0, 3.0, 3.0, [WHITE, WHITE, WHITE, WHITE]);
    room.light("light", [-1.8, -0.2], [1.8, 1.8], WARM * 40.0);
    // A wall 0.2 m thick from back to front, open for 0.6 m over its whole height.
    let (x, h, z) = (0.1, room.height, room.half.z);
    let (near, far) = (0.15, -0.45);
    for (name, from, to) in [("back part", -z, far), ("front part", near, z)] {
        let material = room.diffuse(WHITE);
        let mut mesh = Mesh::default();
        let side = |x: f32, a: f32, b: f32| [vec3(x, 0., a), vec3(x, 0., b), vec3(x, h, b), vec3(x, h, a)];
        mesh.add_polygon(&side(-x, from, to), material);
        mesh.add_polygon(&side(x, to, from), material);
        let end = |z: f32, a: f32, b: f32| [vec3(a, 0., z), vec3(b, 0., z), vec3(b, h, z), vec3(a, h, z)];
        mesh.add_polygon(&if to == far { end(far, -x, x) } else { end(near, x, -x) }, material);
        room.add(&format!("dividing wall, {name}"), mesh, Vec3::ZERO);
    }
    room.boxes("cabinet", WOOD, vec3(-3.6, 0.0, 1.2), 0.0, &[(vec3(-0.3, 0.0, -0.7), vec3(0.6, 1.1, 1.4))]);
    room.boxes("plinth", GREY, vec3(1.7, 0.0, -0.6), 20.0, &[(vec3(-0.35, 0.0, -0.35), vec3(0.7, 0.5, 0.7))]);
    let path = [
        vec3(2.6, 0.8, -1.0),
        vec3(2.9, 0.6, 0.1),
        vec3(2.6, 0.5, 1.2),
        vec3(1.2, 0.7, 1.6),
        vec3(0.7, 0.8, 0.6),
        vec3(0.65, 0.9, -0.2),
        vec3(0.9, 0.8, -1.2),
    ];
    room.moving(object, vec3(1.7, 0.501, -0.6), 30.0, 0.65, path)?;
    room.camera("gap", vec3(3.2, 1.6, 2.8), vec3(1.3, 0.85, -1.0), 58.0);
    room.camera("through", vec3(3.6, 1.5, -0.3), vec3(0.0, 1.1, -0.1), 60.0);
    room.camera("lit-half", vec3(-3.6, 1.6, -2.7), vec3(-0.6, 0.9, 0.4), 60.0);
    Ok(room.scene)
}
