//! Pictures: PNG, JPEG, WebP and Basis Universal. In browsers, the page decodes the first three, as it does those of its own, beside
//! everything else; a pixel may differ by a step there where the format leaves that open.

use super::budget::{Budget, DECODED_TEXEL};
use super::{MAX_TEXELS, MAX_TEXTURE_SIDE, Parsed, ktx2};
#[cfg(target_family = "wasm")]
use crate::files::pictures as decoder;

/// Size and texels of a picture.
pub(super) type Picture = ([u32; 2], Vec<[u8; 4]>);

/// Decodes a picture that comes with no glTF file, as below.
pub(in crate::scene) fn decode_alone(bytes: &[u8], texels: usize) -> Parsed<Picture> {
    decode(bytes, texels, &Budget::new(bytes.len()))
}

/// Decodes a PNG, JPEG, WebP or Basis Universal picture to 8-bit RGBA; at most so many texels.
pub(super) fn decode(bytes: &[u8], texels: usize, budget: &Budget) -> Parsed<Picture> {
    if is_ours(bytes) {
        return ktx2::decode(bytes, texels, budget);
    }
    if bytes.starts_with(&[0xff, 0xd8]) && !has_end(bytes) {
        return Err("is cut off; fetch or save it again".into());
    }
    // The header first: the size decides whether the rest is looked at.
    let size @ [width, height] = decoder::size(bytes).map_err(undecodable)?;
    check_size(size, texels).map_err(|e| budget.refuse(e))?;
    let count = width as usize * height as usize;
    budget.take(count, DECODED_TEXEL)?;
    let pixels = decoder::texels(bytes);
    budget.give_back(count, DECODED_TEXEL);
    let pixels = pixels.map_err(undecodable)?;
    if pixels.len() != count {
        return Err("has no pixels; save it again".into());
    }
    Ok((size, pixels))
}

/// Whether this crate decodes it itself.
pub(super) fn is_ours(bytes: &[u8]) -> bool {
    bytes.starts_with(ktx2::IDENTIFIER)
}

fn undecodable(error: impl std::fmt::Display) -> String {
    format!("cannot be decoded ({error}); save it as PNG or JPEG again")
}

/// This crate's decoder.
#[cfg(not(target_family = "wasm"))]
mod decoder {
    use super::MAX_TEXTURE_SIDE;
    use image::{ImageReader, ImageResult, Limits};
    use std::io::Cursor;

    pub fn size(bytes: &[u8]) -> ImageResult<[u32; 2]> {
        Ok(reader(bytes)?.into_dimensions()?.into())
    }

    pub fn texels(bytes: &[u8]) -> ImageResult<Vec<[u8; 4]>> {
        let mut limits = Limits::default();
        limits.max_image_width = Some(MAX_TEXTURE_SIDE);
        limits.max_image_height = Some(MAX_TEXTURE_SIDE);
        limits.max_alloc = Some(1 << 30);
        let mut reader = reader(bytes)?;
        reader.limits(limits);
        Ok(reader.decode()?.into_rgba8().as_raw().as_chunks().0.to_vec())
    }

    fn reader(bytes: &[u8]) -> ImageResult<ImageReader<Cursor<&[u8]>>> {
        Ok(ImageReader::new(Cursor::new(bytes)).with_guessed_format()?)
    }
}

/// Whether the data of a JPEG, segment after segment, lead to the marker of its end.
fn has_end(bytes: &[u8]) -> bool {
    const START_OF_SCAN: u8 = 0xda;
    const END: u8 = 0xd9;
    let mut at = 2;
    while let Some(&[0xff, marker]) = bytes.get(at..at + 2).and_then(|pair| pair.first_chunk()) {
        match marker {
            END => return true,
            // Fill bytes, and markers alone.
            0xff => at += 1,
            0x01 | 0xd0..=0xd7 => at += 2,
            _ => {
                let Some(&length) = bytes.get(at + 2..at + 4).and_then(|pair| pair.first_chunk()) else {
                    return false;
                };
                at += 2 + usize::from(u16::from_be_bytes(length)).max(2);
                if marker == START_OF_SCAN {
                    // Where a byte of 255 is no data.
                    let rest = bytes.get(at..).unwrap_or_default();
                    let next = |pair: &[u8]| pair[0] == 0xff && !matches!(pair[1], 0 | 0xd0..=0xd7);
                    let Some(skipped) = rest.windows(2).position(next) else { return false };
                    at += skipped;
                }
            }
        }
    }
    false
}

/// That a picture is of a possible size, and of `budget` texels at most.
pub(super) fn check_size([width, height]: [u32; 2], budget: usize) -> Parsed<()> {
    if width == 0 || height == 0 {
        return Err("has no pixels; save it again".into());
    }
    if width > MAX_TEXTURE_SIDE || height > MAX_TEXTURE_SIDE {
        return Err(format!(
            "is {width} × {height} pixels large; scale it down to {MAX_TEXTURE_SIDE} × {MAX_TEXTURE_SIDE} at most"
        ));
    }
    if width as usize * height as usize > budget {
        return Err(format!(
            "and those before it have more than {MAX_TEXELS} pixels together; scale them down"
        ));
    }
    Ok(())
}
