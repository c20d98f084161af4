//! OpenEXR pictures: which channels of which layer are colours, and where its pixels lie.

use super::canvas::Canvas;
use exr::meta::MetaData;
use exr::meta::header::Header;
use exr::prelude::{ReadChannels, ReadLayers, ReadSpecificChannel, Text};
use girandole_core::glam::Vec3;
use std::collections::BTreeMap;
use std::io::Cursor;

/// Largest number of bytes that the crate may have to unpack at a time.
const MOST_BLOCK: usize = 1 << 29;

/// The least that a block takes in a file: its place, and what it says of itself.
const LEAST_BLOCK: usize = 16;

/// What is to be read of a file.
pub(super) struct Choice {
    /// Pixels in x and y of the display window.
    pub width: usize,
    pub height: usize,
    /// Where the first pixel of the data window is in it.
    offset: [i64; 2],
    channels: Channels,
    /// What there is to say of it.
    pub notes: Vec<String>,
}

enum Channels {
    Color([Text; 3]),
    Gray(Text),
}

/// Chooses the colours of a file: R, G and B, as such before those of a layer with a name, else a luminance Y alone.
/// Checks that the file is as large as it claims, as far as that is seen from its header.
pub(super) fn choose(bytes: &[u8], most_pixels: usize) -> Result<Choice, String> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false)
        .map_err(|e| format!("it is no readable OpenEXR file ({e})"))?;
    let mut blocks = 0_usize;
    for header in &meta.headers {
        let display = header.shared_attributes.display_window.size;
        if header.layer_size.area() > most_pixels || display.area() > most_pixels {
            return Err(format!("it claims to have more than 2^{} pixels", most_pixels.ilog2()));
        }
        if header.max_block_byte_size() > MOST_BLOCK {
            return Err("it has blocks of more than half a gigabyte; save it in smaller ones".into());
        }
        blocks = blocks.saturating_add(header.chunk_count);
    }
    if blocks.saturating_mul(LEAST_BLOCK) > bytes.len() {
        return Err("it is cut off, or claims to be larger than it is; fetch or export it again".into());
    }
    let (header, channels, is_one_of_many) = choose_channels(&meta.headers)?;
    let window = header.shared_attributes.display_window;
    let position = header.own_attributes.layer_position;
    let offset = [position.0, position.1];
    let offset =
        [0, 1].map(|axis| i64::from(offset[axis]) - i64::from([window.position.0, window.position.1][axis]));
    let mut notes = Vec::new();
    if is_one_of_many {
        let used = match &channels {
            Channels::Color([red, ..]) => red,
            Channels::Gray(gray) => gray,
        };
        notes.push(format!("it has several layers: that of `{used}` is used"));
    }
    if header.shared_attributes.chromaticities.is_some_and(|c| !is_rec_709(&c)) {
        notes.push("its colours are of other primaries than Rec. 709: they are taken as they are".into());
    }
    Ok(Choice { width: window.size.width(), height: window.size.height(), offset, channels, notes })
}

/// The header, its colours, and whether there are others.
fn choose_channels(headers: &[Header]) -> Result<(&Header, Channels, bool), String> {
    // Whether of a layer with a name.
    let mut colors: Vec<(bool, &Header, [Text; 3])> = Vec::new();
    let mut grays: Vec<(bool, &Header, Text)> = Vec::new();
    let mut has_chroma = false;
    for header in headers.iter().filter(|header| !header.deep) {
        let mut layers: BTreeMap<String, BTreeMap<String, Text>> = BTreeMap::new();
        for channel in &header.channels.list {
            let name = channel.name.to_string();
            let (layer, last) = name.rsplit_once('.').unwrap_or(("", &name));
            layers.entry(layer.into()).or_default().insert(last.to_ascii_lowercase(), channel.name.clone());
        }
        for (layer, channels) in &layers {
            let is_layer = !layer.is_empty();
            let one = |name: &str| channels.get(name).cloned();
            let triple = [["r", "g", "b"], ["red", "green", "blue"]].iter().find_map(|names| {
                let [r, g, b] = names.map(one);
                Some([r?, g?, b?])
            });
            if let Some(triple) = triple {
                colors.push((is_layer, header, triple));
            } else if channels.contains_key("ry") || channels.contains_key("by") {
                has_chroma = true;
            } else if let Some(gray) = one("y")
                && !channels.contains_key("x")
            {
                grays.push((is_layer, header, gray));
            }
        }
    }
    // Stable: of the same kind the first.
    colors.sort_by_key(|(is_layer, _, names)| (*is_layer, !is_beauty(&names[0])));
    grays.sort_by_key(|(is_layer, ..)| *is_layer);
    let is_one_of_many = colors.len() > 1 && colors[0].0 == colors[1].0;
    if let Some((_, header, names)) = colors.into_iter().next() {
        return Ok((header, Channels::Color(names), is_one_of_many));
    }
    if has_chroma {
        return Err("it has luminance and chroma (Y, RY, BY); save it with the channels R, G and B".into());
    }
    if let Some((_, header, name)) = grays.into_iter().next() {
        return Ok((header, Channels::Gray(name), false));
    }
    let found: Vec<String> =
        headers.iter().flat_map(|h| &h.channels.list).map(|c| c.name.to_string()).take(12).collect();
    Err(format!("it needs the channels R, G and B, or Y, but has {}", found.join(", ")))
}

/// Whether a channel is of the layer that is the picture as a whole, by the names that renderers give it.
fn is_beauty(name: &Text) -> bool {
    let name = name.to_string().to_ascii_lowercase();
    ["combined", "beauty", "rgba", "composite"].iter().any(|word| name.contains(word))
}

fn is_rec_709(chromaticities: &exr::meta::attribute::Chromaticities) -> bool {
    let ours = super::chromaticities();
    let is_near =
        |a: exr::math::Vec2<f32>, b: exr::math::Vec2<f32>| (a.0 - b.0).abs().max((a.1 - b.1).abs()) < 0.005;
    is_near(chromaticities.red, ours.red)
        && is_near(chromaticities.green, ours.green)
        && is_near(chromaticities.blue, ours.blue)
        && is_near(chromaticities.white, ours.white)
}

impl Choice {
    /// Reads the pixels of the data window to where they lie in the display window; beyond it there is nothing, and in
    /// it, where there are none, black.
    pub fn read(self, bytes: &[u8], canvas: Canvas, progress: &dyn Fn(f32)) -> Result<Canvas, String> {
        let [left, top] = self.offset;
        let put = move |canvas: &mut Option<Canvas>, at: exr::math::Vec2<usize>, pixel: Vec3| {
            if let Some(canvas) = canvas {
                canvas.put(left + at.x() as i64, top + at.y() as i64, pixel);
            }
        };
        // The crate asks for a place once it knows the size, from a function that it may call again.
        let canvas = std::cell::RefCell::new(Some(canvas));
        let reader = || exr::prelude::read().no_deep_data().largest_resolution_level().specific_channels();
        let on_progress = |done: f64| progress(done as f32);
        let read = match self.channels {
            Channels::Color([r, g, b]) => reader()
                .required(r)
                .required(g)
                .required(b)
                .collect_pixels(
                    move |_, _| canvas.borrow_mut().take(),
                    move |canvas, at, (r, g, b): (f32, f32, f32)| put(canvas, at, Vec3::new(r, g, b)),
                )
                .first_valid_layer()
                .all_attributes()
                .on_progress(on_progress)
                .from_buffered(Cursor::new(bytes))
                .map(|image| image.layer_data.channel_data.pixels),
            Channels::Gray(name) => reader()
                .required(name)
                .collect_pixels(
                    move |_, _| canvas.borrow_mut().take(),
                    move |canvas, at, (y,): (f32,)| put(canvas, at, Vec3::splat(y)),
                )
                .first_valid_layer()
                .all_attributes()
                .on_progress(on_progress)
                .from_buffered(Cursor::new(bytes))
                .map(|image| image.layer_data.channel_data.pixels),
        };
        let unreadable = |e: exr::error::Error| format!("its pixels cannot be read ({e})");
        read.map_err(unreadable)?.ok_or_else(|| "its pixels cannot be read".into())
    }
}
