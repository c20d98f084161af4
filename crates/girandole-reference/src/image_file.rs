//! Pictures in files. Files are written whole or not at all.

use exr::prelude::{ReadChannels, ReadLayers, ReadSpecificChannel, SpecificChannels, WritableImage};
use girandole_core::glam::Vec3;
use girandole_core::image::Image;
use girandole_core::tonemap::srgb_decode;
use girandole_core::{Error, Result, files};
use std::io::Cursor;
use std::path::Path;

/// Largest number of pixels that a file's header may claim.
const MAX_PIXELS: usize = 1 << 28;

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

/// Reads radiance: `.exr` as [`read_exr`], `.hdr` as [`read_hdr`].
///
/// # Errors
/// Those of the two, and [`Error::Broken`] for another ending.
pub fn read_radiance(path: &Path) -> Result<Image> {
    match path.extension().map(|e| e.to_ascii_lowercase()) {
        Some(e) if e == "exr" => read_exr(path),
        Some(e) if e == "hdr" => read_hdr(path),
        _ => Err(broken(path, "radiance is read from .exr and .hdr files")),
    }
}

/// Reads a Radiance picture (`.hdr`, RGBE) as it is: linear Rec. 709 by convention.
///
/// # Errors
/// [`Error::Read`], or [`Error::Broken`] with what is wrong with the file.
pub fn read_hdr(path: &Path) -> Result<Image> {
    let bytes = files::read(path)?;
    let unreadable = |e| broken(path, format!("it is no readable Radiance file ({e})"));
    let decoder = image::codecs::hdr::HdrDecoder::new(Cursor::new(&bytes)).map_err(unreadable)?;
    let (width, height) = image::ImageDecoder::dimensions(&decoder);
    if width as usize * height as usize > MAX_PIXELS {
        return Err(broken(path, "it claims to have more than 2^28 pixels"));
    }
    let decoded = image::DynamicImage::from_decoder(decoder).map_err(unreadable)?.into_rgb32f();
    let pixels = decoded.pixels().map(|p| Vec3::from(p.0)).collect();
    Ok(Image { width, height, pixels })
}

/// Reads the channels R, G and B (half, float or integer, in any order) of the first layer that has them, as they
/// are: linear Rec. 709 by OpenEXR's convention. Further channels are ignored.
///
/// # Errors
/// [`Error::Read`], or [`Error::Broken`] with what is wrong with the file.
pub fn read_exr(path: &Path) -> Result<Image> {
    let bytes = files::read(path)?;
    let meta = exr::meta::MetaData::read_from_buffered(Cursor::new(&bytes), false)
        .map_err(|e| broken(path, format!("it is no readable OpenEXR file ({e})")))?;
    let names = |header: &exr::meta::header::Header| -> Vec<String> {
        header.channels.list.iter().map(|c| c.name.to_string()).collect()
    };
    let has_rgb = |header: &exr::meta::header::Header| {
        let names = names(header);
        ["R", "G", "B"].iter().all(|c| names.iter().any(|n| n == c))
    };
    if !meta.headers.iter().any(has_rgb) {
        let found: Vec<String> = meta.headers.iter().flat_map(names).collect();
        let found = found.join(", ");
        return Err(broken(path, format!("it needs the channels R, G and B, but has {found}")));
    }
    if meta.headers.iter().any(|h| h.layer_size.area() > MAX_PIXELS) {
        return Err(broken(path, "it claims to have more than 2^28 pixels"));
    }
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .required("R")
        .required("G")
        .required("B")
        .collect_pixels(
            |size, _| Image::new(size.width() as u32, size.height() as u32),
            |image, at, (r, g, b): (f32, f32, f32)| {
                image.pixels[at.y() * image.width as usize + at.x()] = Vec3::new(r, g, b);
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(&bytes))
        .map_err(|e| broken(path, format!("its pixels cannot be read ({e})")))?;
    Ok(image.layer_data.channel_data.pixels)
}

/// Writes a picture as 32-bit float RGB, lossless: linear Rec. 709, the same bytes each time.
///
/// # Errors
/// [`Error::Write`]; [`Error::Invalid`] for a picture without pixels.
pub fn write_exr(path: &Path, image: &Image) -> Result<()> {
    check_size(image.width, image.height, image.pixels.len(), 1)?;
    let width = image.width as usize;
    let channels = SpecificChannels::rgb(|at: exr::math::Vec2<usize>| {
        let p = image.pixels[at.y() * width + at.x()];
        (p.x, p.y, p.z)
    });
    let mut file = exr::image::Image::from_channels((width, image.height as usize), channels);
    file.attributes.chromaticities = Some(chromaticities());
    let mut bytes = Cursor::new(Vec::new());
    let written = file.write().non_parallel().to_buffered(&mut bytes);
    written.map_err(|e| write_error(path, std::io::Error::other(e)))?;
    files::write(path, bytes.get_ref())
}

/// The same with the share of each pixel that is covered as channel A, by which radiance is multiplied already, as OpenEXR has it.
///
/// # Errors
/// [`Error::Write`]; [`Error::Invalid`] for a picture without pixels, or with other ones than `coverage`.
pub fn write_exr_with_alpha(path: &Path, image: &Image, coverage: &[f32]) -> Result<()> {
    check_size(image.width, image.height, image.pixels.len(), 1)?;
    check_size(image.width, image.height, coverage.len(), 1)?;
    let width = image.width as usize;
    let channels = SpecificChannels::rgba(|at: exr::math::Vec2<usize>| {
        let i = at.y() * width + at.x();
        let p = image.pixels[i];
        (p.x, p.y, p.z, coverage[i])
    });
    let mut file = exr::image::Image::from_channels((width, image.height as usize), channels);
    file.attributes.chromaticities = Some(chromaticities());
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
    check_size(width, height, rgb8.len(), 3)?;
    write_bytes(path, [width, height], rgb8, image::ExtendedColorType::Rgb8)
}

/// The same with alpha, by which colours are not multiplied, as PNG has it.
///
/// # Errors
/// [`Error::Write`]; [`Error::Invalid`] if the bytes are not four a pixel, or none.
pub fn write_png_with_alpha(path: &Path, width: u32, height: u32, rgba8: &[u8]) -> Result<()> {
    check_size(width, height, rgba8.len(), 4)?;
    write_bytes(path, [width, height], rgba8, image::ExtendedColorType::Rgba8)
}

fn write_bytes(
    path: &Path,
    [width, height]: [u32; 2],
    pixels: &[u8],
    color: image::ExtendedColorType,
) -> Result<()> {
    use image::ImageEncoder;
    let mut bytes = Vec::new();
    image::codecs::png::PngEncoder::new(&mut bytes)
        .write_image(pixels, width, height, color)
        .map_err(|e| write_error(path, std::io::Error::other(e)))?;
    files::write(path, &bytes)
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
