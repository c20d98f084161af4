//! Light from all around by `EXT_lights_image_based`: the sharpest of the cube maps, as a picture by latitude and longitude. Its
//! irradiance coefficients and blurred maps are what light samples make of that.

use super::document::lookup;
use super::{Importer, Parsed};
use crate::image::Image;
use crate::scene::Environment;
use crate::scene::environment::pixel_direction;
use crate::tonemap::srgb_decode;
use glam::{Quat, Vec2, Vec3};
use serde::Deserialize;

pub(super) const NAME: &str = "EXT_lights_image_based";

/// Widest picture that is made.
const MAX_WIDTH: u32 = 4096;

/// Bytes of a pixel of it, with what it is sampled by.
const ENVIRONMENT_PIXEL: u64 = 40;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Light {
    #[serde(default = "one")]
    intensity: f32,
    #[serde(default)]
    rotation: Quat,
    /// Images by level and face: +X, −X, +Y, −Y, +Z, −Z.
    specular_images: Vec<[usize; 6]>,
}

fn one() -> f32 {
    1.0
}

/// A face: its side in pixels, and their radiance.
struct Face {
    side: u32,
    pixels: Vec<Vec3>,
}

impl Importer<'_> {
    /// Puts the light that the scene names around it; one that is broken is left out.
    pub(super) fn read_image_based_light(&mut self) -> Parsed<()> {
        let read = self.image_based_light();
        let environment = self.or_without("the light all around", || format!("({NAME})"), read)?;
        self.scene.environment = environment.flatten();
        Ok(())
    }

    fn image_based_light(&mut self) -> Parsed<Option<Environment>> {
        let root = &self.document.root;
        let scene = root.scene.map_or(0, |scene| scene.value());
        let used = root.scenes.get(scene).and_then(|scene| scene.extensions.as_ref()?.others.get(NAME));
        let Some(index) = used.and_then(|used| used.get("light")?.as_u64()) else { return Ok(None) };
        let lights = root.extensions.as_ref().and_then(|e| e.others.get(NAME)?.get("lights")?.as_array());
        let light = lookup(lights.map_or(&[][..], Vec::as_slice), index as usize, "image-based light")?;
        let light: Light = serde_json::from_value(light.clone()).map_err(|e| e.to_string())?;
        let rotation = light.rotation.normalize();
        if !(light.intensity >= 0.0 && light.intensity.is_finite() && rotation.is_finite()) {
            return Err("its intensity or its rotation is no number".into());
        }
        let sharpest = light.specular_images.first().ok_or("it has no images")?;
        let mut faces = Vec::new();
        for &image in sharpest {
            let ([width, height], texels) = self.image(image)?;
            if width != height {
                return Err(format!("its image {image} is not square"));
            }
            self.document.budget.take(texels.len(), size_of::<Vec3>() as u64)?;
            // RGBD: what is divided by alpha may be brighter than white.
            let radiance = |[r, g, b, a]: [u8; 4]| {
                let decode = |byte: u8| srgb_decode(f32::from(byte) / 255.0);
                Vec3::new(decode(r), decode(g), decode(b)) * (255.0 / f32::from(a.max(1)))
            };
            faces.push(Face { side: width, pixels: texels.into_iter().map(radiance).collect() });
        }
        let width = faces.iter().map(|face| face.side * 4).max().unwrap_or(4).clamp(2, MAX_WIDTH);
        let size = [width, width / 2];
        self.account_texels((size[0] * size[1]) as usize)?;
        self.document.budget.take((size[0] * size[1]) as usize, ENVIRONMENT_PIXEL)?;
        let to_light = rotation.inverse();
        let pixel = |i: u32| sample(&faces, to_light * pixel_direction(i, size).as_vec3());
        let pixels = (0..size[0] * size[1]).map(pixel).collect();
        let environment = Environment::new(Image { width: size[0], height: size[1], pixels });
        let environment = environment.map_err(|error| error.to_string())?;
        Ok(Some(Environment { strength: light.intensity, ..environment }))
    }
}

/// The radiance from a direction. Faces are what a camera sees that looks at their middle, top up (towards −Z above, +Z below).
fn sample(faces: &[Face], direction: Vec3) -> Vec3 {
    let axis = direction.abs().max_position();
    let is_negative = direction[axis] < 0.0;
    let Vec3 { x, y, z } = direction / direction[axis].abs();
    let (right, down) = match (axis, is_negative) {
        (0, false) => (z, -y),
        (0, true) => (-z, -y),
        (1, false) => (-x, z),
        (1, true) => (-x, -z),
        (2, false) => (-x, -y),
        _ => (x, -y),
    };
    let face = &faces[2 * axis + usize::from(is_negative)];
    let last = (face.side - 1) as f32;
    let at =
        ((Vec2::new(right, down) * 0.5 + 0.5) * face.side as f32 - 0.5).clamp(Vec2::ZERO, Vec2::splat(last));
    let corner = at.floor();
    let pixel = |shift: Vec2| {
        let p = (corner + shift).min(Vec2::splat(last));
        face.pixels[(p.y as u32 * face.side + p.x as u32) as usize]
    };
    let f = at - corner;
    let top = pixel(Vec2::ZERO).lerp(pixel(Vec2::X), f.x);
    top.lerp(pixel(Vec2::Y).lerp(pixel(Vec2::ONE), f.x), f.y)
}
