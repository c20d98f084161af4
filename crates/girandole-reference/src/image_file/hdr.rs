//! Radiance pictures (`.hdr`, RGBE), as Radiance and other programs write them.
//!
//! 1. The header: lines up to an empty one, then one of the picture's size and orientation.
//! 2. Scanlines: runs of each channel, runs of pixels (the old way), or pixels.
//!
//! Worked example: the bytes 128, 64, 0, 129 are 128 · 2^(129 − 136) = 1, 0.5 and 0.

use super::canvas::Canvas;
use girandole_core::glam::Vec3;

/// Bytes of a header that are looked through.
const MOST_HEADER: usize = 1 << 16;

/// What a header says.
#[derive(Debug, PartialEq)]
pub(super) struct Header {
    pub width: u32,
    pub height: u32,
    /// Whether scanlines are columns.
    is_upright: bool,
    /// Whether x and y run the other way: to the left, and upwards.
    is_mirrored: [bool; 2],
    /// Radiance from pixels.
    factor: Vec3,
    /// Where the pixels begin.
    start: usize,
}

/// Reads the header. The magic word may be another one, or missing, and lines may end as on Windows.
pub(super) fn header(bytes: &[u8]) -> Result<Header, String> {
    let no_picture = || {
        "it is no readable Radiance file (it has no line of its size); fetch or export it again".to_owned()
    };
    let mut factor = Vec3::ONE;
    let mut at = 0;
    let mut is_known = bytes.starts_with(b"#?");
    loop {
        let rest = bytes.get(at..bytes.len().min(MOST_HEADER)).unwrap_or_default();
        let end = rest.iter().position(|&byte| byte == b'\n').ok_or_else(no_picture)?;
        let line = String::from_utf8_lossy(&rest[..end]);
        let line = line.trim();
        at += end + 1;
        if let Some((width, height, is_upright, is_mirrored)) = size(line) {
            if !is_known {
                return Err(no_picture());
            }
            let lines = if is_upright { width } else { height };
            // A line takes a pixel's bytes at least: no size can make us take more memory than the file deserves.
            if (bytes.len() - at) / 4 < lines as usize {
                return Err(cut_off(1, lines));
            }
            return Ok(Header { width, height, is_upright, is_mirrored, factor, start: at });
        }
        let Some((key, value)) = line.split_once('=') else { continue };
        let numbers = || value.split_whitespace().map_while(|word| word.parse::<f32>().ok());
        match key.trim() {
            "FORMAT" if value.trim() != "32-bit_rle_rgbe" => {
                let format: String = value.trim().chars().take(40).collect();
                return Err(format!(
                    "its pixels are `{format}`, and only 32-bit_rle_rgbe is read; save it as that"
                ));
            }
            "FORMAT" => is_known = true,
            // What pixels were multiplied by, each time.
            "EXPOSURE" => factor /= numbers().next().unwrap_or(1.0),
            "COLORCORR" => {
                let given: Vec<f32> = numbers().collect();
                if let [r, g, b] = given[..] {
                    factor /= Vec3::new(r, g, b);
                }
            }
            _ => {}
        }
        if !(factor.is_finite() && factor.min_element() > 0.0) {
            return Err("its exposure is no number above 0; correct its header".into());
        }
    }
}

fn cut_off(line: u32, lines: u32) -> String {
    format!("its pixels end or are broken in line {line} of {lines}; fetch or export it again")
}

/// Width, height, whether scanlines are columns, and what is mirrored.
fn size(line: &str) -> Option<(u32, u32, bool, [bool; 2])> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let [first, lines, second, length] = words[..] else { return None };
    let (lines, length) = (lines.parse::<u32>().ok()?, length.parse::<u32>().ok()?);
    let sign = |word: &str, axis: char| match word.strip_suffix(axis)? {
        "+" => Some(true),
        "-" => Some(false),
        _ => None,
    };
    let known = match (sign(first, 'Y'), sign(second, 'X')) {
        (Some(up), Some(right)) => (length, lines, false, [!right, up]),
        _ => (lines, length, true, [!sign(first, 'X')?, sign(second, 'Y')?]),
    };
    (known.0 > 0 && known.1 > 0).then_some(known)
}

/// Reads all pixels; `progress` is told the share that is done.
pub(super) fn read(
    bytes: &[u8],
    header: &Header,
    canvas: &mut Canvas,
    progress: &dyn Fn(f32),
) -> Result<(), String> {
    let Header { width, height, is_upright, is_mirrored, factor, start } = *header;
    let (lines, length) = if is_upright { (width, height) } else { (height, width) };
    let mut rest = &bytes[start..];
    let mut scanline = Vec::new();
    // 2^(e − 136) of each exponent.
    let scales: Vec<f64> =
        (0..256).map(|e| if e == 0 { 0.0 } else { libm::exp2(f64::from(e - 136)) }).collect();
    for line in 0..lines {
        read_scanline(&mut rest, length as usize, &mut scanline).ok_or_else(|| cut_off(line + 1, lines))?;
        for (i, &[r, g, b, e]) in (0_u32..).zip(&scanline) {
            let [r, g, b] = [r, g, b].map(|mantissa| (f64::from(mantissa) * scales[usize::from(e)]) as f32);
            let (x, y) = if is_upright { (line, i) } else { (i, line) };
            let x = if is_mirrored[0] { width - 1 - x } else { x };
            let y = if is_mirrored[1] { height - 1 - y } else { y };
            canvas.put(x.into(), y.into(), Vec3::new(r, g, b) * factor);
        }
        if line % 64 == 0 {
            progress(line as f32 / lines as f32);
        }
    }
    Ok(())
}

/// One scanline, of any kind. None where the bytes end or are no scanline.
fn read_scanline(rest: &mut &[u8], length: usize, pixels: &mut Vec<[u8; 4]>) -> Option<()> {
    pixels.clear();
    let start = *rest.first_chunk::<4>()?;
    let claimed = usize::from(start[2]) << 8 | usize::from(start[3]);
    let is_by_channel = start[0] == 2 && start[1] == 2 && start[2] < 128 && (8..32768).contains(&length);
    if !is_by_channel {
        return read_pixels(rest, length, pixels);
    }
    if claimed != length {
        return None;
    }
    *rest = &rest[4..];
    pixels.resize(length, [0; 4]);
    for channel in 0..4 {
        let mut at = 0;
        while at < length {
            let (&count, after) = rest.split_first()?;
            let (run, is_same) =
                if count > 128 { (usize::from(count) - 128, true) } else { (count.into(), false) };
            let slots = pixels.get_mut(at..at + run).filter(|slots| !slots.is_empty())?;
            let values = after.get(..if is_same { 1 } else { run })?;
            for (i, slot) in slots.iter_mut().enumerate() {
                slot[channel] = values[if is_same { 0 } else { i }];
            }
            *rest = &after[values.len()..];
            at += run;
        }
    }
    Some(())
}

/// Pixels one by one; 1, 1, 1, n repeats the last one n times, and what follows at once counts 256 times as much.
fn read_pixels(rest: &mut &[u8], length: usize, pixels: &mut Vec<[u8; 4]>) -> Option<()> {
    let mut shift = 0;
    while pixels.len() < length {
        let (&pixel, after) = rest.split_first_chunk::<4>()?;
        *rest = after;
        if pixel[..3] == [1, 1, 1] {
            let last = *pixels.last()?;
            let count = usize::from(pixel[3]).checked_shl(shift)?;
            shift += 8;
            if shift > 32 || count > length - pixels.len() {
                return None;
            }
            pixels.resize(pixels.len() + count, last);
        } else {
            pixels.push(pixel);
            shift = 0;
        }
    }
    Some(())
}
