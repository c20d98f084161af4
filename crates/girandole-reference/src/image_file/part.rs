//! Parts of pictures in OpenEXR files: pixels as they are, and sums of several pictures beside their mean.

use super::{MAX_PICTURE, broken, open_exr, write_channels};
use crate::{PictureSum, Provenance};
use exr::prelude::{AnyChannel, FlatSamples, ReadChannels, ReadLayers};
use girandole_core::glam::Vec3;
use girandole_core::image::Image;
use girandole_core::{Result, files};
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

/// The channels of colour.
const COLORS: [&str; 3] = ["R", "G", "B"];
/// 32-bit words of a sum, the lowest first.
const WORDS: usize = 4;

/// A part of a picture, as a file holds it.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Linear radiance; the mean, where it is of several pictures.
    pub image: Image,
    /// The share of each pixel that is covered, by which radiance is multiplied.
    pub coverage: Option<Vec<f32>>,
    /// Of several pictures.
    pub sum: Option<PictureSum>,
}

/// Writes the mean of several pictures, as [`write_exr_with`](super::write_exr_with) writes a picture, and with it what others need to
/// add more: the sums, as four words a channel (`sum.R.0`, the lowest, to `sum.B.3`), and the squared differences from the mean
/// (`deviation.R`, `G`, `B`).
///
/// # Errors
/// [`Error::Write`](girandole_core::Error::Write); [`Error::Invalid`](girandole_core::Error::Invalid) for pictures without pixels, or
/// with other ones than `coverage`.
pub fn write_sum(
    path: &Path,
    sum: &PictureSum,
    coverage: Option<&[f32]>,
    made_by: &Provenance,
) -> Result<()> {
    let mut more = Vec::new();
    for (axis, color) in COLORS.iter().enumerate() {
        for word in 0..WORDS {
            let words = sum.sums.iter().map(|sums| (sums[axis] >> (32 * word)) as u32).collect();
            more.push(AnyChannel::new(format!("sum.{color}.{word}").as_str(), FlatSamples::U32(words)));
        }
        let deviations = sum.deviations.iter().map(|deviation| deviation[axis] as f32).collect();
        more.push(AnyChannel::new(format!("deviation.{color}").as_str(), FlatSamples::F32(deviations)));
    }
    write_channels(path, &sum.mean(), coverage, more, Some(made_by))
}

/// Reads what [`write_exr_with`](super::write_exr_with) or [`write_sum`] wrote, the latter of `count` pictures.
///
/// # Errors
/// [`Error::Read`](girandole_core::Error::Read), or [`Error::Broken`](girandole_core::Error::Broken) with what is wrong with the file.
pub fn read_part(path: &Path, count: Option<u32>) -> Result<Part> {
    let bytes = files::read(path)?;
    let read = || {
        open_exr::choose(&bytes, MAX_PICTURE)?;
        let image = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .from_buffered(Cursor::new(&bytes))
            .map_err(|e| format!("its pixels cannot be read ({e})"))?;
        let size = image.layer_data.size;
        let channels = image.layer_data.channel_data.list.into_iter();
        let channels = Channels(channels.map(|c| (c.name.to_string(), c.sample_data)).collect());
        channels.part([size.width() as u32, size.height() as u32], count)
    };
    read().map_err(|reason| broken(path, reason))
}

/// The channels of a file, by name.
struct Channels(BTreeMap<String, FlatSamples>);

impl Channels {
    fn part(&self, [width, height]: [u32; 2], count: Option<u32>) -> std::result::Result<Part, String> {
        let [r, g, b] = [self.floats("R")?, self.floats("G")?, self.floats("B")?];
        let pixels = (0..r.len()).map(|i| Vec3::new(r[i], g[i], b[i])).collect();
        let coverage = self.0.contains_key("A").then(|| self.floats("A")).transpose()?;
        let sum = count.map(|count| self.sum([width, height], count)).transpose()?;
        Ok(Part { image: Image { width, height, pixels }, coverage: coverage.map(<[f32]>::to_vec), sum })
    }

    fn sum(&self, [width, height]: [u32; 2], count: u32) -> std::result::Result<PictureSum, String> {
        let mut sum = PictureSum { count, ..PictureSum::new(width, height) };
        for (axis, color) in COLORS.iter().enumerate() {
            for word in 0..WORDS {
                let words = self.words(&format!("sum.{color}.{word}"))?;
                for (sums, &bits) in sum.sums.iter_mut().zip(words) {
                    sums[axis] |= i128::from(bits) << (32 * word);
                }
            }
            let deviations = self.floats(&format!("deviation.{color}"))?;
            for (deviation, &value) in sum.deviations.iter_mut().zip(deviations) {
                deviation[axis] = value.into();
            }
        }
        Ok(sum)
    }

    fn floats(&self, name: &str) -> std::result::Result<&[f32], String> {
        match self.0.get(name) {
            Some(FlatSamples::F32(values)) => Ok(values),
            _ => Err(format!("it has no channel {name} of 32-bit floats, as parts of pictures have")),
        }
    }

    fn words(&self, name: &str) -> std::result::Result<&[u32], String> {
        match self.0.get(name) {
            Some(FlatSamples::U32(values)) => Ok(values),
            _ => Err(format!("it has no channel {name} of 32-bit words, as sums of light sets have")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_come_back_to_the_bit() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("part.exr");
        let mut sum = PictureSum::new(3, 2);
        for value in [0.25_f32, 1e-9, 3e7] {
            let pixels = (0..6).map(|i| Vec3::new(value, -value * i as f32, 0.1)).collect();
            assert!(sum.add(&Image { width: 3, height: 2, pixels }));
        }
        let made_by = Provenance([("sets".into(), "0..2".into())].into());
        let coverage = [0.0, 0.5, 1.0, 1.0, 0.25, 0.0];
        write_sum(&path, &sum, Some(&coverage), &made_by).expect("it is written");
        let part = read_part(&path, Some(3)).expect("it is read");
        let found = part.sum.expect("a sum");
        assert_eq!((found.count, &found.sums), (3, &sum.sums));
        assert_eq!(found.mean(), sum.mean());
        let [a, b] = [&found, &sum].map(|sum| sum.relative_error().expect("of three"));
        assert!((a - b).abs() < 1e-6 * b, "{a} {b}");
        assert_eq!((part.image, part.coverage.as_deref()), (sum.mean(), Some(&coverage[..])));
        // It is a picture to everybody else.
        assert_eq!(super::super::read(&path).expect("a picture"), sum.mean());
        assert_eq!(Provenance::read(&path).expect("it is read"), Some(made_by));
    }

    #[test]
    fn pictures_are_parts_without_sums() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("picture.exr");
        let image = Image { width: 2, height: 1, pixels: vec![Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO] };
        super::super::write_exr(&path, &image).expect("it is written");
        let part = read_part(&path, None).expect("it is read");
        assert_eq!(part, Part { image, coverage: None, sum: None });
        let error = read_part(&path, Some(2)).expect_err("no sums").to_string();
        assert!(error.contains("sum.R.0"), "{error}");
        let bytes = std::fs::read(&path).expect("bytes");
        std::fs::write(&path, &bytes[..bytes.len() - 5]).expect("it is cut off");
        assert!(read_part(&path, None).is_err());
    }
}
