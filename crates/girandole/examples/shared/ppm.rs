//! What all examples share: a picture file.

use girandole::core::image::Image;
use girandole::core::tonemap::{Exposure, Tonemap, to_srgb8};

/// Writes a picture, tone-mapped, as a PPM file.
pub fn write_ppm(path: &str, image: &Image) -> std::io::Result<()> {
    let mut file = format!("P6 {} {} 255\n", image.width, image.height).into_bytes();
    file.extend(to_srgb8(image, Exposure::Auto.ev(image), Tonemap::Agx));
    std::fs::write(path, file)
}
