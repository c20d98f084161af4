//! What all examples share: a picture file.

use girandole::image::{Exposure, Image, Tonemap, to_srgb8};

/// Writes a picture, tone-mapped, as a PNG file.
pub fn write_png(path: &str, image: &Image) -> image::ImageResult<()> {
    let rgb = to_srgb8(image, Exposure::Auto.ev(image), Tonemap::Agx);
    image::save_buffer(path, &rgb, image.width, image.height, image::ColorType::Rgb8)
}
