//! A ground for models that are seen in a studio: what stands on nothing seems to float.

use super::defaults::inside;
use super::{Environment, Geometry, Material, Mesh, NONE, Scene, Transform};
use crate::image::Image;
use crate::trace::SceneTracer;
use glam::{Vec2, Vec3, vec3};

/// Radius of the ground, in radii of what stands on it.
const EXTENT: f32 = 4.0;
const SEGMENTS: u32 = 48;
/// What is level within this share of the scene's size above its lowest point is a floor, where it is seen from
/// above in so many of the places that are looked at.
const FLOOR_HEIGHT: f32 = 0.02;
const FLOOR_SHARE: f32 = 0.08;
/// Places along either axis, on twice the scene's width: bounds leave out what is much larger than all else, as
/// floors may be.
const PLACES: u32 = 16;
/// How far below its lowest point a scene's ground is, in radii: faces of the two are not in the same place.
const GAP: f32 = 1e-4;

impl Scene {
    /// Puts a large matte ground under a scene in a [studio](Environment::studio) that has no floor of its own
    /// and is no closed room, and gives the dome below the horizon the ground's brightness, so that the ground
    /// has no edge. Whether it did.
    pub fn add_ground(&mut self) -> bool {
        let geometry = Geometry::new(self);
        let tracer = SceneTracer::of_all_surfaces(self, &geometry);
        let (low, high) = geometry.main_bounds();
        let radius = (high - low).length() * 0.5;
        if !(radius > 0.0 && radius.is_finite())
            || inside(&tracer).is_some()
            || has_floor(&tracer, [low, high])
        {
            return false;
        }
        let Some((environment, reflectance)) = self.environment.as_ref().and_then(grounded) else {
            return false;
        };
        let middle = geometry.origin.as_vec3() + (low + high) * 0.5;
        let height = geometry.origin.y as f32 + low.y - GAP * radius;
        let material = self.add_material(Material::diffuse("ground", Vec3::splat(reflectance)));
        let rim = |i: u32| {
            let (sin, cos) = super::builtin::shapes::turn(i, SEGMENTS);
            vec3(cos, 0.0, -sin) * (EXTENT * radius)
        };
        let mut mesh = Mesh { name: "ground".into(), ..Mesh::default() };
        mesh.add_polygon(&(0..SEGMENTS).map(rim).collect::<Vec<_>>(), material);
        self.add_object("ground", mesh, Transform::translation(vec3(middle.x, height, middle.z)));
        self.environment = Some(environment);
        true
    }
}

/// Whether there is a floor: what faces up at the scene's lowest point, and is not only the underside of a thing.
fn has_floor(tracer: &SceneTracer, [low, high]: [Vec3; 2]) -> bool {
    let size = high - low;
    let level = low.y + FLOOR_HEIGHT * size.max_element();
    let is_floor = |place: Vec2| {
        let from = vec3(low.x + size.x * place.x, high.y + size.max_element(), low.z + size.z * place.y);
        let hit = tracer.closest_hit(from, Vec3::NEG_Y, f32::INFINITY, NONE);
        hit.is_some_and(|hit| from.y - hit.t <= level && tracer.geometry().normal(hit.triangle).y.abs() > 0.9)
    };
    let at = |i: u32| 2.0 * (i as f32 + 0.5) / PLACES as f32 - 0.5;
    let places = (0..PLACES * PLACES).map(|i| Vec2::new(at(i % PLACES), at(i / PLACES)));
    let found = places.filter(|&place| is_floor(place)).count() as f32;
    found >= FLOOR_SHARE * (PLACES * PLACES) as f32
}

/// The environment with the same radiance in all directions below the horizon, which is that at the horizon, and
/// the reflectance by which a ground in its light has that radiance.
fn grounded(environment: &Environment) -> Option<(Environment, f32)> {
    let image = environment.map.image();
    let Image { width, height, pixels } = image;
    let row = |y: u32| &pixels[(y * width) as usize..((y + 1) * width) as usize];
    let mean = |row: &[Vec3]| row.iter().sum::<Vec3>() / row.len() as f32;
    // The soft lights reach down to it, but not before the camera.
    let horizon = row(height / 2).iter().map(|&p| crate::image::luminance(p)).fold(f32::INFINITY, f32::min);
    // Of a surface that faces up, row by row of the upper half.
    let edge = |y: u32| libm::sinf(std::f32::consts::PI * y as f32 / *height as f32);
    let irradiance = |y: u32| crate::image::luminance(mean(row(y))) * (edge(y + 1).powi(2) - edge(y).powi(2));
    let sum = std::f32::consts::PI * (0..height / 2).map(irradiance).sum::<f32>();
    let reflectance = std::f32::consts::PI * horizon / sum;
    if !(0.0..=0.95).contains(&reflectance) {
        return None;
    }
    let below = (height / 2 * width) as usize;
    let filled =
        pixels.iter().enumerate().map(|(i, &p)| if i < below { p } else { Vec3::splat(horizon) }).collect();
    let map = super::EnvironmentMap::of(Image { pixels: filled, ..*image });
    Some((Environment { map: map.into(), ..environment.clone() }, reflectance))
}
