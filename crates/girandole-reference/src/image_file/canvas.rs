//! Where the pixels of a file are put: the picture as it is, or light from all directions.

use girandole_core::glam::Vec3;
use girandole_core::image::Image;

/// Pixels across and up of light from all directions that are kept: more are seen in no picture.
pub(super) const MOST: [u32; 2] = [8192, 4096];

/// A picture that is being read.
pub(super) struct Canvas {
    image: Image,
    /// Column and row of the picture for each of the file's.
    places: [Vec<u32>; 2],
    /// Whether pixels are light, which is finite and not negative.
    is_light: bool,
    replaced: u64,
}

impl Canvas {
    /// For pixels as they are.
    pub fn exact(width: u32, height: u32) -> Self {
        Self::new([width, height], [width, height], false)
    }

    /// For light: means of pixels where there are too many, and other values in place of those that are none.
    pub fn light(width: u32, height: u32) -> Self {
        let is_large = width > MOST[0] || height > MOST[1];
        Self::new([width, height], if is_large { MOST } else { [width, height] }, true)
    }

    fn new(file: [u32; 2], kept: [u32; 2], is_light: bool) -> Self {
        let place =
            |i: u32, axis: usize| (u64::from(i) * u64::from(kept[axis]) / u64::from(file[axis])) as u32;
        let places = [0, 1].map(|axis| (0..file[axis]).map(|i| place(i, axis)).collect());
        Self { image: Image::new(kept[0], kept[1]), places, is_light, replaced: 0 }
    }

    /// Puts a pixel; what is not on the canvas is left out.
    pub fn put(&mut self, x: i64, y: i64, mut pixel: Vec3) {
        let place = |i: i64, axis: usize| self.places[axis].get(usize::try_from(i).ok()?).copied();
        let (Some(x), Some(y)) = (place(x, 0), place(y, 1)) else { return };
        if self.is_light && !(pixel.is_finite() && pixel.min_element() >= 0.0) {
            self.replaced += 1;
            // What has no end is known once all else is.
            pixel = pixel.max(Vec3::ZERO);
            pixel = Vec3::from(pixel.to_array().map(|x| if x.is_nan() { 0.0 } else { x }));
        }
        self.image.pixels[(y * self.image.width + x) as usize] += pixel;
    }

    /// The picture, and how many of the file's pixels were no light.
    pub fn finish(self) -> (Image, u64) {
        let Self { mut image, places: [columns, rows], replaced, .. } = self;
        let counts = |places: &[u32], kept: u32| {
            let mut counts = vec![0_u32; kept as usize];
            places.iter().for_each(|&place| counts[place as usize] += 1);
            counts
        };
        let (columns, rows) = (counts(&columns, image.width), counts(&rows, image.height));
        if columns.iter().chain(&rows).any(|&count| count > 1) {
            for (i, pixel) in image.pixels.iter_mut().enumerate() {
                *pixel /= (columns[i % columns.len()] * rows[i / columns.len()]) as f32;
            }
        }
        if replaced > 0 {
            let finite = image.pixels.iter().flat_map(|p| p.to_array()).filter(|x| x.is_finite());
            let most = finite.fold(0.0, f32::max);
            for pixel in image.pixels.iter_mut().filter(|pixel| !pixel.is_finite()) {
                *pixel = pixel.min(Vec3::splat(most));
            }
        }
        (image, replaced)
    }
}
