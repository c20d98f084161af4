//! Images, textures and samplers.

use super::budget::{Budget, DECODED_TEXEL, TEXEL};
use super::document::{lookup, shorten};
use super::ktx2::{self, Picture};
use super::{Importer, MAX_TEXELS, MAX_TEXTURE_SIDE, Parsed};
use crate::scene::{ColorSpace, Filter, Texture, TextureRef, Wrap};
use glam::{Affine2, Mat2, Vec2};
use gltf::json::extensions::texture::TextureTransform;
use gltf::json::texture::{MagFilter, MinFilter, WrappingMode};
use gltf::json::validation::Checked;
use std::borrow::Cow;
use std::io::Cursor;

/// Texture coordinates and the factors on them stay exact enough below this.
pub(super) const MAX_COORDINATE: f32 = 1e9;

/// What the parser makes of a texture without a picture of its own.
const NO_IMAGE: usize = u32::MAX as usize;

/// Extensions that name a picture of another format.
pub(super) const FORMATS: [&str; 2] = ["EXT_texture_webp", "KHR_texture_basisu"];

impl Importer<'_> {
    /// A use of a texture. `None` if the texture is left out.
    pub(super) fn texture_ref(
        &mut self,
        texture: usize,
        set: u32,
        transform: Option<&TextureTransform>,
        color_space: ColorSpace,
    ) -> Parsed<Option<TextureRef>> {
        let Some(index) = self.texture(texture, color_space)? else { return Ok(None) };
        let used = self.texture_use(texture, index, set, transform);
        self.or_without("texture", || format!("{texture}"), used)
    }

    fn texture_use(
        &mut self,
        texture: usize,
        index: u32,
        set: u32,
        transform: Option<&TextureTransform>,
    ) -> Parsed<TextureRef> {
        let mut set = transform.and_then(|t| t.tex_coord).unwrap_or(set);
        if set > 1 {
            self.scene
                .warn("texture coordinates beyond set 1 are not supported: set 0 is used instead".into());
            set = 0;
        }
        let transform = match transform {
            None => Affine2::IDENTITY,
            Some(t) => {
                let (offset, scale, angle) = (Vec2::from(t.offset.0), Vec2::from(t.scale.0), t.rotation.0);
                let size = offset.abs().max(scale.abs()).max_element();
                if !(offset.is_finite() && scale.is_finite() && angle.is_finite()) || size > MAX_COORDINATE {
                    return Err(format!(
                        "its texture {texture} is transformed by absurd numbers; export it again"
                    ));
                }
                let (sin, cos) = (libm::sinf(angle), libm::cosf(angle));
                let rotation = Mat2::from_cols(Vec2::new(cos, -sin), Vec2::new(sin, cos));
                Affine2::from_mat2_translation(rotation * Mat2::from_diagonal(scale), offset)
            }
        };
        Ok(TextureRef { texture: index, uv_set: set, transform })
    }

    /// Takes texels out of what a scene may have.
    pub(super) fn account_texels(&mut self, count: usize) -> Parsed<()> {
        self.document.budget.take(count, TEXEL)?;
        self.texels = self.texels.saturating_add(count);
        if self.texels > MAX_TEXELS {
            return Err(self.document.budget.refuse(format!(
                "its textures have more than {MAX_TEXELS} pixels together; scale them down"
            )));
        }
        Ok(())
    }

    /// Size and texels of an image.
    pub(super) fn image(&mut self, source: usize) -> Parsed<([u32; 2], Vec<[u8; 4]>)> {
        let image = lookup(&self.document.root.images, source, "image")?;
        let (shown, bytes) = match (&image.uri, image.buffer_view) {
            (Some(uri), _) if uri.starts_with("data:") => {
                (format!("image {source}"), self.document.resource(uri))
            }
            (Some(uri), _) => (format!("texture `{}`", shorten(uri)), self.document.resource(uri)),
            (None, Some(view)) => {
                (format!("image {source}"), self.document.view(view.value()).map(|v| Cow::Borrowed(v.bytes)))
            }
            (None, None) => (format!("image {source}"), Err("has neither a file nor data".into())),
        };
        let bytes = bytes.map_err(|e| format!("its {shown} {e}"))?;
        let (size, texels) = decode(&bytes, MAX_TEXELS - self.texels, &self.document.budget)
            .map_err(|e| format!("its {shown} {e}"))?;
        self.account_texels(texels.len())?;
        Ok((size, texels))
    }

    /// The scene's texture for one of the file's, read when it is first used; one that cannot be read is left out.
    fn texture(&mut self, index: usize, color_space: ColorSpace) -> Parsed<Option<u32>> {
        if let Some(&known) = self.textures.get(&(index, color_space)) {
            return Ok(known);
        }
        let read = self.read_texture(index, color_space);
        let json = self.document.root.textures.get(index);
        let name = || {
            let name = json.and_then(|t| t.name.as_ref());
            name.map_or_else(|| index.to_string(), |name| format!("`{name}`"))
        };
        let texture = self.or_without("texture", name, read)?.flatten();
        self.textures.insert((index, color_space), texture);
        Ok(texture)
    }

    fn read_texture(&mut self, index: usize, color_space: ColorSpace) -> Parsed<Option<u32>> {
        let root = &self.document.root;
        let json = lookup(&root.textures, index, "texture")?;
        // What every program reads comes first.
        let others = json.extensions.as_ref().map(|e| &e.others);
        let source = match json.source.value() {
            NO_IMAGE => others.and_then(|others| {
                FORMATS.iter().find_map(|format| others.get(*format)?.get("source")?.as_u64())
            }),
            source => Some(source as u64),
        };
        let Some(source) = source.and_then(|source| usize::try_from(source).ok()) else {
            self.scene.warn(match others.and_then(|others| others.keys().next()) {
                Some(extension) => {
                    let extension = shorten(extension);
                    format!(
                        "textures that exist only as {extension} are left out: convert them to PNG or JPEG"
                    )
                }
                None => "textures without images are left out".into(),
            });
            return Ok(None);
        };
        let image = lookup(&root.images, source, "image")?;
        let (size, texels) = self.image(source)?;
        let sampler = json.sampler.map(|sampler| lookup(&root.samplers, sampler.value(), "sampler"));
        let sampler = match sampler {
            Some(sampler) => self.or_without("sampler", || format!("of texture {index}"), sampler)?,
            None => None,
        };
        let wrap = |mode: Option<Checked<WrappingMode>>| match mode {
            Some(Checked::Valid(WrappingMode::ClampToEdge)) => Wrap::Clamp,
            Some(Checked::Valid(WrappingMode::MirroredRepeat)) => Wrap::Mirror,
            _ => Wrap::Repeat,
        };
        // Close up, what the file asks for when magnified; a nearest minification alone means nearest too.
        let filter = match (sampler.and_then(|s| s.mag_filter), sampler.and_then(|s| s.min_filter)) {
            (Some(Checked::Valid(MagFilter::Nearest)), _) => Filter::Nearest,
            (None, Some(Checked::Valid(MinFilter::Nearest))) => Filter::Nearest,
            _ => Filter::Linear,
        };
        let name = json.name.clone().or_else(|| image.name.clone());
        self.scene.textures.push(Texture {
            name: name.or_else(|| image.uri.as_deref().map(shorten)).unwrap_or_default(),
            width: size[0],
            height: size[1],
            texels,
            color_space,
            wrap: [wrap(sampler.map(|s| s.wrap_s)), wrap(sampler.map(|s| s.wrap_t))],
            filter,
        });
        Ok(Some((self.scene.textures.len() - 1) as u32))
    }
}

/// Decodes a picture that comes with no glTF file, as below.
pub(in crate::scene) fn decode_alone(bytes: &[u8], texels: usize) -> Parsed<Picture> {
    decode(bytes, texels, &Budget::new(bytes.len()))
}

/// Decodes a PNG, JPEG, WebP or Basis Universal picture to 8-bit RGBA; at most so many texels.
fn decode(bytes: &[u8], texels: usize, budget: &Budget) -> Parsed<Picture> {
    if bytes.starts_with(ktx2::IDENTIFIER) {
        return ktx2::decode(bytes, texels, budget);
    }
    if bytes.starts_with(&[0xff, 0xd8]) && !has_end(bytes) {
        return Err("is cut off; fetch or save it again".into());
    }
    // The header first: the size decides whether the rest is looked at.
    let (width, height) = reader(bytes)?.into_dimensions().map_err(undecodable)?;
    check_size([width, height], texels).map_err(|e| budget.refuse(e))?;
    let count = width as usize * height as usize;
    budget.take(count, DECODED_TEXEL)?;
    let pixels = decode_sized(bytes, [width, height]);
    budget.give_back(count, DECODED_TEXEL);
    Ok(([width, height], pixels?))
}

/// Decodes a picture of this size.
fn decode_sized(bytes: &[u8], [width, height]: [u32; 2]) -> Parsed<Vec<[u8; 4]>> {
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(MAX_TEXTURE_SIDE);
    limits.max_image_height = Some(MAX_TEXTURE_SIDE);
    limits.max_alloc = Some(1 << 30);
    let mut reader = reader(bytes)?;
    reader.limits(limits);
    let pixels = reader.decode().map_err(undecodable)?.into_rgba8();
    if pixels.dimensions() != (width, height) {
        return Err("has no pixels; save it again".into());
    }
    Ok(pixels.as_raw().as_chunks().0.to_vec())
}

fn reader(bytes: &[u8]) -> Parsed<image::ImageReader<Cursor<&[u8]>>> {
    let reader = image::ImageReader::new(Cursor::new(bytes)).with_guessed_format();
    reader.map_err(|e| undecodable(image::ImageError::IoError(e)))
}

fn undecodable(error: image::ImageError) -> String {
    format!("cannot be decoded ({error}); save it as PNG or JPEG again")
}

/// Whether the data of a JPEG, segment after segment, lead to the marker of its end.
fn has_end(bytes: &[u8]) -> bool {
    const START_OF_SCAN: u8 = 0xda;
    const END: u8 = 0xd9;
    let mut at = 2;
    while let Some(&[0xff, marker]) = bytes.get(at..at + 2).and_then(|pair| pair.first_chunk()) {
        match marker {
            END => return true,
            // Fill bytes, and markers alone.
            0xff => at += 1,
            0x01 | 0xd0..=0xd7 => at += 2,
            _ => {
                let Some(&length) = bytes.get(at + 2..at + 4).and_then(|pair| pair.first_chunk()) else {
                    return false;
                };
                at += 2 + usize::from(u16::from_be_bytes(length)).max(2);
                if marker == START_OF_SCAN {
                    // Where a byte of 255 is no data.
                    let rest = bytes.get(at..).unwrap_or_default();
                    let next = |pair: &[u8]| pair[0] == 0xff && !matches!(pair[1], 0 | 0xd0..=0xd7);
                    let Some(skipped) = rest.windows(2).position(next) else { return false };
                    at += skipped;
                }
            }
        }
    }
    false
}

/// That a picture is of a possible size, and of `budget` texels at most.
pub(super) fn check_size([width, height]: [u32; 2], budget: usize) -> Parsed<()> {
    if width == 0 || height == 0 {
        return Err("has no pixels; save it again".into());
    }
    if width > MAX_TEXTURE_SIDE || height > MAX_TEXTURE_SIDE {
        return Err(format!(
            "is {width} × {height} pixels large; scale it down to {MAX_TEXTURE_SIDE} × {MAX_TEXTURE_SIDE} at most"
        ));
    }
    if width as usize * height as usize > budget {
        return Err(format!(
            "and those before it have more than {MAX_TEXELS} pixels together; scale them down"
        ));
    }
    Ok(())
}
