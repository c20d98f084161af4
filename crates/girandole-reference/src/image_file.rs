//! Pictures in files. Files are written whole or not at all.

mod canvas;
mod hdr;
mod open_exr;
mod part;

use crate::provenance::{self, Provenance};
use canvas::Canvas;
use exr::prelude::{AnyChannel, AnyChannels, FlatSamples, SmallVec, WritableImage};
use girandole_core::glam::Vec3;
use girandole_core::image::Image;
use girandole_core::tonemap::srgb_decode;
use girandole_core::{Error, Result, files};
use std::io::Cursor;
use std::path::Path;

pub use part::{Part, read_part, write_sum};

/// Largest number of pixels of light from all directions that a file's header may claim; of so many, means are kept.
const MAX_PIXELS: usize = 1 << 28;
/// The same of a picture, which is kept as it is: 8192 × 8192.
const MAX_PICTURE: usize = 1 << 26;

/// Reads a picture by the ending of its name: `.exr` as [`read_exr`], `.png` as [`read_png`].
///
/// # Errors
/// Those of the two, and [`Error::Broken`] for another ending.
pub fn read(path: &Path) -> Result<Image> {
    match path.extension().map(|e| e.to_ascii_lowercase()) {
        Some(e) if e == "exr" => read_exr(path),
        Some(e) if e == "png" => read_png(path),
        _ => Err(broken(path, "pictures are read from .exr and .png files")),
    }
}

/// Reads light from all directions, a picture twice as wide as high (or one pixel): `.exr`, or `.hdr` (Radiance,
/// RGBE). Linear Rec. 709 by the formats' conventions. Of more than 8192 × 4096 pixels, means are taken. Pixels that
/// are no light are replaced: negative ones and those that are no numbers by black, infinite ones by the largest that
/// is not.
///
/// `progress` is told the share that is done, 0 to 1. The sentences are about what was replaced or chosen.
///
/// # Errors
/// [`Error::Read`], or [`Error::Broken`] with what is wrong with the file.
pub fn read_environment(path: &Path, progress: &dyn Fn(f32)) -> Result<(Image, Vec<String>)> {
    let extension = path.extension().map(|e| e.to_ascii_lowercase()).unwrap_or_default();
    if extension != "exr" && extension != "hdr" {
        return Err(broken(path, "radiance is read from .exr and .hdr files"));
    }
    let bytes = files::read(path)?;
    let canvas = |width: usize, height: usize| {
        if width.saturating_mul(height) > MAX_PIXELS {
            return Err("it claims to have more than 2^28 pixels".to_owned());
        }
        if width != 2 * height && (width, height) != (1, 1) {
            return Err(format!(
                "it is {width} × {height} pixels; give a picture of all directions, twice as wide as high"
            ));
        }
        Ok(Canvas::light(width as u32, height as u32))
    };
    let read = || -> std::result::Result<(Canvas, Vec<String>), String> {
        if extension == "hdr" {
            let header = hdr::header(&bytes)?;
            let mut canvas = canvas(header.width as usize, header.height as usize)?;
            hdr::read(&bytes, &header, &mut canvas, progress)?;
            return Ok((canvas, Vec::new()));
        }
        let mut choice = open_exr::choose(&bytes, MAX_PIXELS)?;
        let notes = std::mem::take(&mut choice.notes);
        let canvas = canvas(choice.width, choice.height)?;
        Ok((choice.read(&bytes, canvas, progress)?, notes))
    };
    let (canvas, mut notes) = read().map_err(|reason| broken(path, reason))?;
    let (image, replaced) = canvas.finish();
    if replaced > 0 {
        let pixels = if replaced == 1 { "pixel" } else { "pixels" };
        notes.push(format!("{replaced} {pixels} are negative, infinite or no numbers: they are replaced"));
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    Ok((image, notes.into_iter().map(|note| format!("{name}: {note}")).collect()))
}

/// Reads the channels R, G and B (half, float or integer, in any order) as they are, those of a layer where there are
/// no others, or Y alone: linear Rec. 709 by OpenEXR's convention. The picture is the display window; where the data
/// window has no pixels, it is black. Further channels are ignored.
///
/// # Errors
/// [`Error::Read`], or [`Error::Broken`] with what is wrong with the file.
pub fn read_exr(path: &Path) -> Result<Image> {
    let bytes = files::read(path)?;
    let read = || {
        let choice = open_exr::choose(&bytes, MAX_PICTURE)?;
        let canvas = Canvas::exact(choice.width as u32, choice.height as u32);
        choice.read(&bytes, canvas, &|_| {})
    };
    Ok(read().map_err(|reason| broken(path, reason))?.finish().0)
}

/// Writes a picture as 32-bit float RGB, lossless: linear Rec. 709, the same bytes each time.
///
/// # Errors
/// [`Error::Write`]; [`Error::Invalid`] for a picture without pixels.
pub fn write_exr(path: &Path, image: &Image) -> Result<()> {
    write_exr_with(path, image, None, None)
}

/// The same with the share of each pixel that is covered as channel A, by which radiance is multiplied already, as OpenEXR has it; and with
/// what the picture was made by.
///
/// # Errors
/// [`Error::Write`]; [`Error::Invalid`] for a picture without pixels, or with other ones than `coverage`.
pub fn write_exr_with(
    path: &Path,
    image: &Image,
    coverage: Option<&[f32]>,
    made_by: Option<&Provenance>,
) -> Result<()> {
    write_channels(path, image, coverage, Vec::new(), made_by)
}

/// The same with more channels, of as many pixels.
fn write_channels(
    path: &Path,
    image: &Image,
    coverage: Option<&[f32]>,
    more: Vec<AnyChannel<FlatSamples>>,
    made_by: Option<&Provenance>,
) -> Result<()> {
    check_size(image.width, image.height, image.pixels.len(), 1)?;
    let channel = |name: &str, samples: Vec<f32>| AnyChannel::new(name, FlatSamples::F32(samples));
    let of_pixels = |axis: usize| image.pixels.iter().map(|p| p[axis]).collect();
    let mut channels: SmallVec<[_; 4]> =
        ["R", "G", "B"].iter().zip(0..).map(|(name, axis)| channel(name, of_pixels(axis))).collect();
    if let Some(coverage) = coverage {
        check_size(image.width, image.height, coverage.len(), 1)?;
        channels.push(channel("A", coverage.to_vec()));
    }
    channels.extend(more);
    let size = (image.width as usize, image.height as usize);
    let mut file = exr::image::Image::from_channels(size, AnyChannels::sort(channels));
    file.attributes.chromaticities = Some(chromaticities());
    file.attributes.other.extend(made_by.and_then(provenance::attribute));
    let mut bytes = Cursor::new(Vec::new());
    let written = file.write().non_parallel().to_buffered(&mut bytes);
    written.map_err(|e| write_error(path, std::io::Error::other(e)))?;
    files::write(path, bytes.get_ref())
}

/// Primaries and white point of Rec. 709.
fn chromaticities() -> exr::meta::attribute::Chromaticities {
    let chromaticity = |x, y| exr::math::Vec2(x, y);
    exr::meta::attribute::Chromaticities {
        red: chromaticity(0.64, 0.33),
        green: chromaticity(0.3, 0.6),
        blue: chromaticity(0.15, 0.06),
        white: chromaticity(0.3127, 0.329),
    }
}

/// Reads a PNG of 8 or 16 bits a channel and decodes its sRGB transfer to linear Rec. 709. Alpha is ignored.
///
/// # Errors
/// [`Error::Read`], or [`Error::Broken`] with what is wrong with the file.
pub fn read_png(path: &Path) -> Result<Image> {
    let bytes = files::read(path)?;
    let decoded = image::ImageReader::with_format(Cursor::new(&bytes), image::ImageFormat::Png)
        .decode()
        .map_err(|e| broken(path, format!("it is no readable PNG file ({e})")))?
        .into_rgb32f();
    let pixels = decoded.pixels().map(|p| Vec3::from(p.0.map(srgb_decode))).collect();
    Ok(Image { width: decoded.width(), height: decoded.height(), pixels })
}

/// Writes `width × height` pixels of 8-bit sRGB, rows from the top down.
///
/// # Errors
/// [`Error::Write`]; [`Error::Invalid`] if the bytes are not three a pixel, or none.
pub fn write_png(path: &Path, width: u32, height: u32, rgb8: &[u8]) -> Result<()> {
    write_png_with(path, [width, height], Pixels::Rgb(rgb8), None)
}

/// Pixels of 8 bits a channel, sRGB.
#[derive(Clone, Copy, Debug)]
pub enum Pixels<'a> {
    /// Three bytes each.
    Rgb(&'a [u8]),
    /// Four, with alpha, by which colours are not multiplied, as PNG has it.
    Rgba(&'a [u8]),
}

/// Writes pixels, rows from the top down, with what the picture was made by.
///
/// # Errors
/// [`Error::Write`]; [`Error::Invalid`] for another number of bytes, or none.
pub fn write_png_with(
    path: &Path,
    [width, height]: [u32; 2],
    pixels: Pixels,
    made_by: Option<&Provenance>,
) -> Result<()> {
    let (bytes, color, channels) = match pixels {
        Pixels::Rgb(bytes) => (bytes, png::ColorType::Rgb, 3),
        Pixels::Rgba(bytes) => (bytes, png::ColorType::Rgba, 4),
    };
    check_size(width, height, bytes.len(), channels)?;
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(color);
    encoder.set_compression(png::Compression::Fast);
    encoder.set_filter(png::Filter::Adaptive);
    let written = made_by
        .map_or(Ok(()), |made_by| encoder.add_text_chunk(provenance::NAME.into(), made_by.to_json()))
        .and_then(|()| encoder.write_header())
        .and_then(|mut writer| {
            writer.write_image_data(bytes)?;
            writer.finish()
        });
    written.map_err(|e| write_error(path, std::io::Error::other(e)))?;
    files::write(path, &file)
}

fn check_size(width: u32, height: u32, have: usize, per_pixel: usize) -> Result<()> {
    let want = width as usize * height as usize * per_pixel;
    if want == have && have > 0 {
        return Ok(());
    }
    Err(Error::Invalid(format!("a picture of {width}×{height} cannot be written from {have} values")))
}

fn broken(path: &Path, reason: impl Into<String>) -> Error {
    Error::Broken { path: path.into(), reason: reason.into() }
}

fn write_error(path: &Path, source: std::io::Error) -> Error {
    Error::Write { path: path.into(), source }
}
