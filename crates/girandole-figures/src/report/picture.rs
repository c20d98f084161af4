//! Pictures of a report.

use girandole_core::glam::Vec3;
use girandole_core::image::{Image, Region};
use girandole_core::tonemap::{Exposure, Tonemap, to_srgb8};

/// A picture with what is written below it.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Of its file, without folder and ending, and different from the figure's others.
    pub name: String,
    /// What is written below it.
    pub caption: String,
    /// Pixels in x and y.
    pub size: [u32; 2],
    /// Three bytes a pixel, sRGB.
    pub rgb: Vec<u8>,
}

impl Picture {
    /// Of radiance, exposed by itself.
    pub fn new(name: &str, caption: &str, image: &Image) -> Self {
        Self::exposed(name, caption, image, Exposure::Auto.ev(image))
    }

    /// Of radiance, exposed as given (stops), so that pictures can be compared.
    pub fn exposed(name: &str, caption: &str, image: &Image, ev: f32) -> Self {
        Self {
            name: name.into(),
            caption: caption.into(),
            size: [image.width, image.height],
            rgb: to_srgb8(image, ev, Tonemap::Agx),
        }
    }

    /// Of colours between 0 and 1, without a tone curve.
    pub fn of_colors(name: &str, caption: &str, image: &Image) -> Self {
        Self { rgb: to_srgb8(image, 0.0, Tonemap::None), ..Self::exposed(name, caption, image, 0.0) }
    }
}

/// A part of a picture, each pixel as a square of `factor` pixels.
pub fn magnified(image: &Image, region: Region, factor: u32) -> Image {
    let [width, height] = region.size.map(|side| side * factor);
    let pixel = |i: u32| -> Vec3 {
        let (x, y) = (region.first[0] + i % width / factor, region.first[1] + i / width / factor);
        image.pixels[(y * image.width + x) as usize]
    };
    Image { width, height, pixels: (0..width * height).map(pixel).collect() }
}
