//! Bevy's images in Girandole's terms.

use bevy::image::{Image, ImageAddressMode, ImageFilterMode, ImageSampler, ImageSamplerDescriptor};
use bevy::render::render_resource::TextureFormat;
use girandole_core::scene::{ColorSpace, Filter, Texture, Wrap};

/// A texture of an image's largest level. With `flips_green`, of a normal map whose y points down.
///
/// # Errors
/// The second half of a sentence about an image that cannot be taken.
pub fn convert(image: &Image, flips_green: bool) -> Result<Texture, String> {
    let data = image.data.as_deref().ok_or(
        "has left the main world; load it with RenderAssetUsages::default(), which keeps its texels there",
    )?;
    let (width, height) = (image.width(), image.height());
    let format = image.texture_descriptor.format;
    let (bytes, color_space) = match format {
        TextureFormat::Rgba8UnormSrgb | TextureFormat::Bgra8UnormSrgb => (4, ColorSpace::Srgb),
        TextureFormat::Rgba8Unorm | TextureFormat::Bgra8Unorm => (4, ColorSpace::Linear),
        TextureFormat::Rg8Unorm => (2, ColorSpace::Linear),
        TextureFormat::R8Unorm => (1, ColorSpace::Linear),
        _ => return Err(format!("has the format {format:?}; convert it to Rgba8Unorm or Rgba8UnormSrgb")),
    };
    let swaps = matches!(format, TextureFormat::Bgra8Unorm | TextureFormat::Bgra8UnormSrgb);
    let count = width as usize * height as usize;
    if count == 0 || data.len() < count * bytes {
        return Err("has no texels; fill it".into());
    }
    let texel = |texel: &[u8]| {
        let [mut r, mut g, mut b, a] = match *texel {
            [r, g, b, a] => [r, g, b, a],
            [r, g] => [r, g, 0, 255],
            [r] => [r, 0, 0, 255],
            _ => [0; 4],
        };
        if swaps {
            (r, b) = (b, r);
        }
        if flips_green {
            g = 255 - g;
        }
        if flips_green && bytes == 2 {
            b = 255;
        }
        [r, g, b, a]
    };
    let sampler = match &image.sampler {
        ImageSampler::Descriptor(descriptor) => descriptor,
        ImageSampler::Default => &ImageSamplerDescriptor::default(),
    };
    let filter = match sampler.mag_filter {
        ImageFilterMode::Nearest => Filter::Nearest,
        ImageFilterMode::Linear => Filter::Linear,
    };
    Ok(Texture {
        name: String::new(),
        width,
        height,
        texels: data.chunks_exact(bytes).take(count).map(texel).collect(),
        color_space,
        wrap: [sampler.address_mode_u, sampler.address_mode_v].map(wrap),
        filter,
    })
}

fn wrap(mode: ImageAddressMode) -> Wrap {
    match mode {
        ImageAddressMode::Repeat => Wrap::Repeat,
        ImageAddressMode::MirrorRepeat => Wrap::Mirror,
        ImageAddressMode::ClampToEdge | ImageAddressMode::ClampToBorder => Wrap::Clamp,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::asset::RenderAssetUsages;
    use bevy::render::render_resource::{Extent3d, TextureDimension};

    fn image(format: TextureFormat, data: Vec<u8>) -> Image {
        let size = Extent3d { width: 2, height: 1, depth_or_array_layers: 1 };
        Image::new(size, TextureDimension::D2, data, format, RenderAssetUsages::default())
    }

    #[test]
    fn texels_keep_their_channels_and_their_colour_space() {
        let bgra = image(TextureFormat::Bgra8UnormSrgb, vec![1, 2, 3, 4, 5, 6, 7, 8]);
        let texture = convert(&bgra, false).unwrap();
        assert_eq!(texture.texels, [[3, 2, 1, 4], [7, 6, 5, 8]]);
        assert_eq!(texture.color_space, ColorSpace::Srgb);
        // Bevy's own default.
        assert_eq!(texture.wrap, [Wrap::Clamp; 2]);
        let grey = convert(&image(TextureFormat::R8Unorm, vec![9, 10]), false).unwrap();
        assert_eq!((grey.texels[1], grey.color_space), ([10, 0, 0, 255], ColorSpace::Linear));
    }

    #[test]
    fn a_normal_map_is_turned_over() {
        let map = image(TextureFormat::Rgba8Unorm, vec![128, 200, 255, 255, 128, 0, 255, 255]);
        assert_eq!(convert(&map, true).unwrap().texels, [[128, 55, 255, 255], [128, 255, 255, 255]]);
    }

    #[test]
    fn other_formats_are_refused_with_a_sentence() {
        let floats = image(TextureFormat::Rgba16Float, vec![0; 16]);
        assert!(convert(&floats, false).unwrap_err().contains("Rgba8UnormSrgb"));
    }
}
