//! Textures as PNG pictures, and how materials use them.

use super::{Exporter, named};
use crate::scene::{ColorSpace, Filter, Texture, TextureRef, Wrap};
use crate::tonemap::{srgb_decode, srgb_encode};
use crate::{Error, Result};
use glam::{Affine2, Vec2};
use gltf::json::extensions::texture::{
    TextureTransform, TextureTransformOffset, TextureTransformRotation, TextureTransformScale,
};
use gltf::json::image::MimeType;
use gltf::json::texture::{Info, MagFilter, MinFilter, Sampler, WrappingMode};
use gltf::json::validation::Checked::Valid;
use gltf::json::{self, Image, Index};

impl Exporter<'_> {
    /// A use of a texture whose bytes are read in this way.
    pub(super) fn info(&mut self, used: TextureRef, space: ColorSpace) -> Result<Info> {
        let texture_transform = self.transform(&used.transform);
        let extensions = texture_transform.map(|transform| json::extensions::texture::Info {
            texture_transform: Some(transform),
            ..Default::default()
        });
        Ok(Info {
            index: self.texture(used.texture, space)?,
            tex_coord: used.uv_set,
            extensions,
            extras: None,
        })
    }

    pub(super) fn texture(&mut self, index: u32, space: ColorSpace) -> Result<Index<json::Texture>> {
        if let Some(known) = self.textures.get(&(index, space)) {
            return Ok(*known);
        }
        let Some(texture) = self.scene.textures.get(index as usize) else {
            return Err(Error::Invalid(format!("a material has texture {index}, which does not exist")));
        };
        let bytes = png(&self.texels(texture, space), [texture.width, texture.height])?;
        let view = self.buffers.view(&mut self.root, &bytes, None);
        let image = self.root.push(Image {
            buffer_view: Some(view),
            mime_type: Some(MimeType("image/png".into())),
            name: named(&texture.name),
            uri: None,
            extensions: None,
            extras: None,
        });
        let [wrap_s, wrap_t] = texture.wrap.map(|wrap| {
            Valid(match wrap {
                Wrap::Repeat => WrappingMode::Repeat,
                Wrap::Mirror => WrappingMode::MirroredRepeat,
                Wrap::Clamp => WrappingMode::ClampToEdge,
            })
        });
        let (mag, min) = match texture.filter {
            Filter::Linear => (MagFilter::Linear, MinFilter::LinearMipmapLinear),
            Filter::Nearest => (MagFilter::Nearest, MinFilter::NearestMipmapLinear),
        };
        let sampler = self.root.push(Sampler {
            mag_filter: Some(Valid(mag)),
            min_filter: Some(Valid(min)),
            wrap_s,
            wrap_t,
            ..Sampler::default()
        });
        let written = self.root.push(json::Texture {
            name: named(&texture.name),
            sampler: Some(sampler),
            source: image,
            extensions: None,
            extras: None,
        });
        self.textures.insert((index, space), written);
        Ok(written)
    }

    /// A texture's texels, in bytes that are read in this way: glTF decides that by what a texture is used for.
    fn texels(&mut self, texture: &Texture, space: ColorSpace) -> Vec<[u8; 4]> {
        let convert = match (texture.color_space, space) {
            (ColorSpace::Srgb, ColorSpace::Linear) => srgb_decode,
            (ColorSpace::Linear, ColorSpace::Srgb) => srgb_encode,
            _ => return texture.texels.clone(),
        };
        let name = &texture.name;
        self.leave_out(format!("some of the levels of texture `{name}`, which glTF reads by another curve"));
        let byte = |x: u8| (convert(f32::from(x) / 255.0) * 255.0).round() as u8;
        texture.texels.iter().map(|&[r, g, b, a]| [byte(r), byte(g), byte(b), a]).collect()
    }

    /// `KHR_texture_transform`, where coordinates are not taken as they are.
    pub(super) fn transform(&mut self, transform: &Affine2) -> Option<TextureTransform> {
        if *transform == Affine2::IDENTITY {
            return None;
        }
        let [x, y] = [transform.matrix2.x_axis, transform.matrix2.y_axis];
        let (angle, scale) = if x.y == 0.0 && y.x == 0.0 {
            (0.0, Vec2::new(x.x, y.y))
        } else {
            let angle = libm::atan2f(-x.y, x.x);
            (angle, Vec2::new(x.length(), y.dot(Vec2::new(libm::sinf(angle), libm::cosf(angle)))))
        };
        // What is left of the second axis is a shear.
        if angle != 0.0 && x.dot(y).abs() > 1e-5 * x.length() * y.length() {
            self.leave_out("the shear of texture coordinates".into());
        }
        self.extensions.insert("KHR_texture_transform");
        Some(TextureTransform {
            offset: TextureTransformOffset(transform.translation.into()),
            rotation: TextureTransformRotation(angle),
            scale: TextureTransformScale(scale.into()),
            tex_coord: None,
            extras: None,
        })
    }
}

fn png(texels: &[[u8; 4]], [width, height]: [u32; 2]) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgba);
    let written = encoder.write_header().and_then(|mut png| png.write_image_data(texels.as_flattened()));
    written.map_err(|error| Error::Invalid(format!("a texture cannot be written: {error}")))?;
    Ok(bytes)
}
