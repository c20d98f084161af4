//! A living room by daylight and lamps: a sofa before a coloured wall, a low table on a rug, a lantern, a floor
//! lamp, a plant.
//!
//! Daylight comes from panes that emit what is seen behind a window: light samples lie on them as on any lamp.

mod furniture;
mod shell;
mod textures;

use super::rooms::{Room, about_y};
use super::{MovingObject, shapes};
use crate::Result;
use crate::scene::{
    ColorSpace, Filter, Material, MaterialId, Mesh, Scene, Texture, TextureRef, Transform, Wrap,
};
use glam::{Quat, Vec3, vec3};

/// Half of the width, the height, and where the back and the front wall are.
const HALF: f32 = 3.0;
const HEIGHT: f32 = 2.7;
const BACK: f32 = -2.4;
const FRONT: f32 = 2.9;
/// Of the windows, W/(sr·m²).
const DAYLIGHT: f32 = 11.0;
/// Top of the rug, of the low table and of the sideboard.
const RUG: f32 = 0.0115;
const TABLE: f32 = 0.4125;
const SIDEBOARD: f32 = 0.6305;

/// Materials by what they are on.
struct Palette {
    floor: MaterialId,
    white: MaterialId,
    trim: MaterialId,
    accent: MaterialId,
    curtain: MaterialId,
    sky: MaterialId,
    cream: MaterialId,
    teal: MaterialId,
    mustard: MaterialId,
    walnut: MaterialId,
    brass: MaterialId,
    black: MaterialId,
    rug: MaterialId,
    rug_edge: MaterialId,
    porcelain: MaterialId,
    glass: MaterialId,
    leaf: MaterialId,
    shade: MaterialId,
    paper: MaterialId,
    pictures: [MaterialId; 2],
    books: [MaterialId; 7],
}

impl Room {
    fn glossy(&mut self, name: &str, color: [f32; 3], roughness: f32) -> MaterialId {
        self.scene.add_material(Material {
            roughness,
            specular: 0.5,
            ..Material::diffuse(name, color.into())
        })
    }

    fn matte(&mut self, name: &str, color: [f32; 3]) -> MaterialId {
        self.scene.add_material(Material::diffuse(name, color.into()))
    }

    /// A texture of this size, sRGB from 0 to 1 by texel from the top left.
    fn texture(
        &mut self,
        name: &str,
        [width, height]: [u32; 2],
        color: impl Fn(f32, f32) -> Vec3,
    ) -> TextureRef {
        let byte = |x: f32| (x.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        let texel = |i: u32| {
            let c = color((i % width) as f32, (i / width) as f32);
            [byte(c.x), byte(c.y), byte(c.z), 255]
        };
        self.scene.textures.push(Texture {
            name: name.into(),
            width,
            height,
            texels: (0..width * height).map(texel).collect(),
            color_space: ColorSpace::Srgb,
            wrap: [Wrap::Repeat; 2],
            filter: Filter::Linear,
        });
        TextureRef::new(self.scene.textures.len() as u32 - 1)
    }

    fn textured(&mut self, name: &str, texture: TextureRef) -> MaterialId {
        let base_color_texture = Some(texture);
        self.scene.add_material(Material { base_color_texture, ..Material::diffuse(name, Vec3::ONE) })
    }

    fn luminous(&mut self, name: &str, emission: Vec3, texture: TextureRef) -> MaterialId {
        let emission_texture = Some(texture);
        self.scene.add_material(Material { emission_texture, ..Material::emitter(name, emission) })
    }

    fn put(&mut self, name: &str, mesh: Mesh, at: Vec3) {
        self.put_turned(name, mesh, at, Quat::IDENTITY);
    }

    fn put_turned(&mut self, name: &str, mesh: Mesh, at: Vec3, turned: Quat) {
        self.scene.add_object(name, Mesh { name: name.into(), ..mesh }, Transform::rigid(turned, at));
    }
}

impl Palette {
    fn new(room: &mut Room) -> Self {
        let planks = room.texture("planks", [512, 512], textures::planks);
        let rug = room.texture("rug", [192, 128], textures::rug);
        let pictures = [
            room.texture("sun", [96, 128], textures::sun),
            room.texture("discs", [96, 128], textures::discs),
        ];
        let sky = room.texture("sky", [128, 128], textures::sky);
        let [ribs, glow] =
            [room.texture("ribs", [4, 128], textures::ribs), room.texture("glow", [4, 64], textures::glow)];
        let floor = room.textured("oak planks", planks);
        let floor_finish = &mut room.scene.materials[floor];
        (floor_finish.roughness, floor_finish.specular) = (0.38, 0.5);
        let brass = room.glossy("brass", [0.83, 0.62, 0.3], 0.28);
        room.scene.materials[brass].metallic = 1.0;
        let leaf = room.glossy("leaf", [0.13, 0.3, 0.09], 0.5);
        let shade = room.luminous("lamp shade", vec3(5.0, 3.3, 1.8), glow);
        for thin in [leaf, shade] {
            room.scene.materials[thin].double_sided = true;
        }
        let spines = [
            [0.55, 0.16, 0.12],
            [0.15, 0.25, 0.36],
            [0.75, 0.66, 0.48],
            [0.2, 0.33, 0.24],
            [0.66, 0.42, 0.16],
            [0.8, 0.78, 0.72],
            [0.12, 0.12, 0.14],
        ];
        Self {
            floor,
            brass,
            leaf,
            shade,
            white: room.matte("white", [0.83, 0.81, 0.77]),
            trim: room.glossy("white paint", [0.85, 0.84, 0.81], 0.5),
            accent: room.matte("terracotta", [0.6, 0.27, 0.17]),
            curtain: room.matte("linen", [0.84, 0.81, 0.75]),
            sky: room.luminous("daylight", Vec3::splat(DAYLIGHT), sky),
            cream: room.matte("cream", [0.78, 0.73, 0.64]),
            teal: room.matte("teal", [0.1, 0.3, 0.34]),
            mustard: room.matte("mustard", [0.74, 0.48, 0.12]),
            walnut: room.glossy("walnut", [0.36, 0.21, 0.12], 0.45),
            black: room.glossy("black", [0.045, 0.045, 0.05], 0.45),
            rug: room.textured("rug", rug),
            rug_edge: room.matte("rug edge", [0.7, 0.66, 0.6]),
            porcelain: room.glossy("porcelain", [0.86, 0.86, 0.84], 0.18),
            glass: room.glossy("glazed green", [0.2, 0.42, 0.4], 0.12),
            paper: room.luminous("paper", vec3(2.5, 2.0, 1.4), ribs),
            pictures: pictures.map(|picture| room.textured("picture", picture)),
            books: spines.map(|color| room.glossy("book", color, 0.6)),
        }
    }
}

/// The room with what moves in it.
pub(super) fn build(object: MovingObject) -> Result<Scene> {
    let scene = Scene { name: "living-room".into(), ..Scene::default() };
    let mut room = Room { scene, half: vec3(HALF, 0.0, FRONT), height: HEIGHT };
    let palette = Palette::new(&mut room);
    shell::add(&mut room, &palette);
    furniture::add(&mut room, &palette);
    let path = [
        vec3(0.7, 0.9, 0.3),
        vec3(1.5, 1.1, -0.3),
        vec3(1.2, 1.2, -1.0),
        vec3(0.2, 1.15, -1.1),
        vec3(-0.9, 1.1, -0.8),
        vec3(-1.6, 0.9, 0.0),
        vec3(-1.0, 0.9, 0.7),
    ];
    let size = if matches!(object, MovingObject::Balloon) { 0.8 } else { 0.32 };
    room.moving(object, vec3(-0.12, TABLE + 0.001, 0.2), 35.0, size, path)?;
    room.camera("living-room", vec3(2.45, 1.42, 2.62), vec3(-0.55, 0.92, -1.0), 52.0);
    room.camera("sofa", vec3(1.2, 1.2, 1.6), vec3(-0.4, 0.7, -1.5), 45.0);
    room.camera("windows", vec3(2.6, 1.6, -1.2), vec3(-2.0, 1.0, 0.6), 55.0);
    Ok(room.scene)
}

/// A rotation by degrees about +X, then about +Y.
fn tilted(pitch: f32, yaw: f32) -> Quat {
    let half = f64::from(pitch).to_radians() * 0.5;
    about_y(yaw) * Quat::from_xyzw(libm::sin(half) as f32, 0.0, 0.0, libm::cos(half) as f32)
}

/// Boxes by their lowest corners and sizes, as patches; `hidden` says which faces nobody sees, by where they face.
fn boxes(boxes: &[(Vec3, Vec3)], material: MaterialId, hidden: impl Fn(Vec3, Vec3) -> bool) -> Mesh {
    let mut mesh = Mesh::default();
    for &(low, size) in boxes {
        let mut all = Mesh::default();
        all.add_box(low, low + size, material);
        for patch in &all.patches {
            let corners: Vec<Vec3> = patch.outline.iter().map(|&v| all.positions[v as usize]).collect();
            let middle = corners.iter().sum::<Vec3>() / 4.0;
            if !hidden(middle, all.normals[patch.outline[0] as usize]) {
                mesh.add_polygon(&corners, material);
            }
        }
    }
    mesh
}

/// All faces are seen.
fn none(_: Vec3, _: Vec3) -> bool {
    false
}

/// A number from 0 to 1 for each of the numbers: what looks like chance.
fn chance(a: u32, b: u32, c: u32) -> f32 {
    let mut x = a.wrapping_mul(0x9e37_79b1) ^ b.wrapping_mul(0x85eb_ca77) ^ c.wrapping_mul(0xc2b2_ae3d);
    x = (x ^ x >> 15).wrapping_mul(0x2c1b_3c6d);
    x = (x ^ x >> 12).wrapping_mul(0x297a_2d39);
    (x ^ x >> 15) as f32 / u32::MAX as f32
}

/// Sine and cosine of degrees, the same on every machine.
fn sin_cos(degrees: f32) -> (f32, f32) {
    let angle = f64::from(degrees).to_radians();
    (libm::sin(angle) as f32, libm::cos(angle) as f32)
}
