//! Images, textures and samplers.

use super::budget::TEXEL;
use super::document::{lookup, shorten};
use super::{Importer, MAX_TEXELS, Parsed, picture};
use crate::scene::{ColorSpace, Filter, Texture, TextureRef, Wrap};
use glam::{Affine2, Mat2, Vec2};
use gltf::json::extensions::texture::TextureTransform;
use gltf::json::texture::{MagFilter, MinFilter, WrappingMode};
use gltf::json::validation::Checked;

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
        let shown = match &image.uri {
            Some(uri) if !uri.starts_with("data:") => format!("texture `{}`", shorten(uri)),
            _ => format!("image {source}"),
        };
        let bytes = self.document.image(image).map_err(|e| format!("its {shown} {e}"))?;
        let (size, texels) = picture::decode(&bytes, MAX_TEXELS - self.texels, &self.document.budget)
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
