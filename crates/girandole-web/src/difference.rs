//! How far two pictures are apart.

use anyhow::{Context, Result, ensure};
use std::io::Cursor;

/// A picture of 8 bits a channel, without its transparency.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Row by row from the top.
    pub pixels: Vec<[u8; 3]>,
}

/// Differences of all red, green and blue values of two pictures, 0 to 255.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Their mean.
    pub mean: f64,
    /// The share of values, 0 to 1, that are more than 2 apart.
    pub share_beyond_2: f64,
    /// The largest.
    pub max: u8,
}

impl Picture {
    /// Of a PNG file.
    pub fn decode(png: &[u8]) -> Result<Self> {
        let mut decoder = png::Decoder::new(Cursor::new(png));
        decoder.set_transformations(png::Transformations::normalize_to_color8());
        let mut reader = decoder.read_info().context("this is no PNG file")?;
        let bytes = reader.output_buffer_size().context("the picture is too large")?;
        let mut buffer = vec![0; bytes];
        let info = reader.next_frame(&mut buffer).context("the PNG file is broken")?;
        let channels = info.color_type.samples();
        let pixels = buffer[..info.buffer_size()]
            .chunks_exact(channels)
            .map(|values| if channels < 3 { [values[0]; 3] } else { [values[0], values[1], values[2]] })
            .collect();
        Ok(Self { size: [info.width, info.height], pixels })
    }

    /// The top left corner of so many pixels, if it has them.
    pub fn cut(&self, [width, height]: [u32; 2]) -> Option<Self> {
        if width > self.size[0] || height > self.size[1] {
            return None;
        }
        let rows = self.pixels.chunks_exact(self.size[0] as usize).take(height as usize);
        let pixels = rows.flat_map(|row| &row[..width as usize]).copied().collect();
        Some(Self { size: [width, height], pixels })
    }

    /// As a PNG file.
    pub fn encode(&self) -> Result<Vec<u8>> {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, self.size[0], self.size[1]);
        encoder.set_color(png::ColorType::Rgb);
        encoder.write_header()?.write_image_data(self.pixels.as_flattened())?;
        Ok(file)
    }

    /// A pixel, if it is in the picture.
    pub fn pixel(&self, [x, y]: [u32; 2]) -> Option<[u8; 3]> {
        let [width, height] = self.size;
        (x < width && y < height).then(|| self.pixels[(y * width + x) as usize])
    }
}

/// Of two PNG files of the same size.
pub fn difference(a: &[u8], b: &[u8]) -> Result<Difference> {
    let (a, b) = (Picture::decode(a)?, Picture::decode(b)?);
    let [[width, height], [other_width, other_height]] = [a.size, b.size];
    ensure!(
        a.size == b.size,
        "the pictures differ in size: {width} × {height} and {other_width} × {other_height} pixels"
    );
    let values = |picture: Picture| picture.pixels.into_iter().flatten();
    let differences: Vec<u8> = values(a).zip(values(b)).map(|(a, b)| a.abs_diff(b)).collect();
    let count = differences.len().max(1) as f64;
    Ok(Difference {
        mean: differences.iter().map(|d| f64::from(*d)).sum::<f64>() / count,
        share_beyond_2: differences.iter().filter(|d| **d > 2).count() as f64 / count,
        max: differences.iter().copied().max().unwrap_or(0),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn png(size: [u32; 2], color: png::ColorType, bytes: &[u8]) -> Vec<u8> {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, size[0], size[1]);
        encoder.set_color(color);
        let mut writer = encoder.write_header().expect("a header");
        writer.write_image_data(bytes).expect("pixels");
        writer.finish().expect("a file");
        file
    }

    #[test]
    fn a_picture_is_not_apart_from_itself() {
        let a = png([2, 1], png::ColorType::Rgb, &[0, 1, 2, 253, 254, 255]);
        assert_eq!(
            difference(&a, &a).expect("one size"),
            Difference { mean: 0.0, share_beyond_2: 0.0, max: 0 }
        );
    }

    #[test]
    fn differences_are_counted_whatever_their_sign() {
        let a = png([2, 1], png::ColorType::Rgb, &[10, 10, 10, 10, 10, 10]);
        let b = png([2, 1], png::ColorType::Rgb, &[8, 12, 10, 0, 13, 10]);
        let found = difference(&a, &b).expect("one size");
        assert_eq!(found.max, 10);
        assert!((found.mean - 17.0 / 6.0).abs() < 1e-12, "{found:?}");
        assert!((found.share_beyond_2 - 2.0 / 6.0).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn transparency_does_not_count_and_grey_is_three_values() {
        let rgb = png([1, 1], png::ColorType::Rgb, &[7, 7, 7]);
        let rgba = png([1, 1], png::ColorType::Rgba, &[7, 7, 7, 0]);
        let grey = png([1, 1], png::ColorType::Grayscale, &[7]);
        assert_eq!(difference(&rgb, &rgba).expect("one size").max, 0);
        assert_eq!(difference(&rgb, &grey).expect("one size").max, 0);
        assert_eq!(Picture::decode(&rgb).expect("a picture").pixel([0, 0]), Some([7; 3]));
        assert_eq!(Picture::decode(&rgb).expect("a picture").pixel([1, 0]), None);
    }

    #[test]
    fn other_sizes_and_other_files_are_errors() {
        let a = png([2, 1], png::ColorType::Rgb, &[0; 6]);
        let b = png([1, 2], png::ColorType::Rgb, &[0; 6]);
        assert!(difference(&a, &b).expect_err("sizes").to_string().contains("2 × 1 and 1 × 2"));
        assert!(difference(&a, b"no picture").is_err());
    }
}
