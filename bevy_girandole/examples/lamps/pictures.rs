//! Files of pictures.

use crate::Failure;
use bevy::asset::RenderAssetUsages;
use bevy::image::Image;
use bevy::render::render_resource::{Extent3d, TextureDimension, TextureFormat};
use half::f16;
use std::path::Path;

/// Writes 8-bit texels as they are.
pub fn write_png(path: &Path, bytes: Vec<u8>, size: [u32; 2]) -> Result<(), Failure> {
    let rows = rows(&bytes, size, 4).flatten().copied().collect();
    let extent = Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 };
    let usage = RenderAssetUsages::MAIN_WORLD;
    let image = Image::new(extent, TextureDimension::D2, rows, TextureFormat::Rgba8UnormSrgb, usage);
    Ok(image.try_into_dynamic()?.to_rgb8().save(path)?)
}

/// Writes 16-bit floats, divided by the exposure, as an uncompressed OpenEXR file.
pub fn write_exr(path: &Path, bytes: &[u8], size: [u32; 2], exposure: f32) -> Result<(), Failure> {
    let [width, height] = size;
    let mut file: Vec<u8> = vec![0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0];
    let mut attribute = |name: &str, kind: &str, value: &[u8]| {
        for text in [name, kind] {
            file.extend_from_slice(text.as_bytes());
            file.push(0);
        }
        file.extend_from_slice(&(value.len() as u32).to_le_bytes());
        file.extend_from_slice(value);
    };
    let words = |words: &[u32]| words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<u8>>();
    // Each channel: its name, 2 for 32-bit floats, not perceptual, every pixel.
    let channel = |name: u8| [vec![name, 0], words(&[2, 0, 1, 1])].concat();
    let window = words(&[0, 0, width - 1, height - 1]);
    let one = 1.0f32.to_le_bytes();
    attribute("channels", "chlist", &[channel(b'B'), channel(b'G'), channel(b'R'), vec![0]].concat());
    attribute("compression", "compression", &[0]);
    attribute("dataWindow", "box2i", &window);
    attribute("displayWindow", "box2i", &window);
    attribute("lineOrder", "lineOrder", &[0]);
    attribute("pixelAspectRatio", "float", &one);
    attribute("screenWindowCenter", "v2f", &[0; 8]);
    attribute("screenWindowWidth", "float", &one);
    file.push(0);
    let line = 12 * width;
    let first = file.len() as u64 + 8 * u64::from(height);
    for row in 0..height {
        file.extend_from_slice(&(first + u64::from(row) * u64::from(8 + line)).to_le_bytes());
    }
    for (row, texels) in (0..height).zip(rows(bytes, size, 8)) {
        file.extend(words(&[row, line]));
        for channel in [2, 1, 0] {
            for texel in texels.chunks_exact(8) {
                let value = f16::from_le_bytes([texel[2 * channel], texel[2 * channel + 1]]);
                file.extend_from_slice(&(value.to_f32() / exposure).to_le_bytes());
            }
        }
    }
    Ok(std::fs::write(path, file)?)
}

/// Rows without what pads them.
fn rows(bytes: &[u8], [width, height]: [u32; 2], texel: usize) -> impl Iterator<Item = &[u8]> {
    let padded = bytes.len() / height.max(1) as usize;
    bytes.chunks_exact(padded.max(1)).map(move |row| &row[..width as usize * texel])
}
