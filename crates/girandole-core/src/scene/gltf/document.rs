//! The container: GLB chunks, JSON, and the bytes of buffers and other resources.

use super::Parsed;
use super::budget::Budget;
use super::compression::{Compressed, Elements};
use crate::files;
use base64::Engine;
use gltf::json::{self, Asset, Root, Value};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

/// A parsed file and all its buffers.
pub(super) struct Document<'a> {
    pub root: Root,
    /// What is left out where something needs a buffer that cannot be read.
    buffers: Vec<Parsed<Arc<Cow<'a, [u8]>>>>,
    pub budget: Budget,
    compressed: Compressed,
    base: Option<&'a Path>,
    /// What was left out.
    pub warnings: Vec<String>,
}

/// A part of a buffer.
#[derive(Clone, Copy)]
pub(super) struct View<'d> {
    pub bytes: &'d [u8],
    /// Distance between elements where it is not their size.
    pub stride: Option<usize>,
}

impl<'a> Document<'a> {
    /// Splits a `.glb` or takes a `.gltf`, parses the JSON and collects the buffers.
    pub fn parse(bytes: &'a [u8], base: Option<&'a Path>) -> Parsed<Self> {
        let (text, blob) = split(bytes)?;
        let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
        let budget = Budget::new(bytes.len());
        budget.take_json(text)?;
        let parsed = json::deserialize::from_slice(text);
        let (root, warnings): (Root, _) = match parsed {
            Ok(root) => (root, Vec::new()),
            Err(error) => mended(text).ok_or_else(|| broken_json(text, &error))?,
        };
        // Later versions of the same number can be read, unless they say otherwise.
        let Asset { version, min_version, .. } = &root.asset;
        let needed = min_version.as_ref().unwrap_or(version);
        if !needed.starts_with("2.") || min_version.as_ref().is_some_and(|least| least != "2.0") {
            return Err(format!("it is glTF of version {}; convert it to version 2.0", shorten(needed)));
        }
        let compressed = Compressed::new(&root);
        let mut document = Self { root, buffers: Vec::new(), budget, compressed, base, warnings };
        // A file that many buffers name is read once.
        let mut read: BTreeMap<&str, Parsed<Arc<Cow<'a, [u8]>>>> = BTreeMap::new();
        for (index, buffer) in document.root.buffers.iter().enumerate() {
            let data = match &buffer.uri {
                Some(uri) => read
                    .entry(uri)
                    .or_insert_with(|| document.resource(uri).map(Arc::new))
                    .clone()
                    .map_err(|e| format!("its buffer {index} {e}")),
                None => Ok(Arc::new(Cow::Borrowed(if index == 0 { blob } else { &[] }))),
            };
            // A buffer without any data is legal where an extension compresses it; views into it are refused later.
            let wanted = buffer.byte_length.0;
            let is_whole = |data: &Arc<Cow<[u8]>>| {
                data.is_empty() && buffer.uri.is_none() || data.len() as u64 >= wanted
            };
            let data = data.and_then(|data| match is_whole(&data) {
                true => Ok(data),
                false => Err(format!(
                    "its buffer {index} should have {wanted} bytes and has {}; the file is cut off, fetch or export it again",
                    data.len()
                )),
            });
            document.buffers.push(data);
        }
        Ok(document)
    }

    /// The bytes of a buffer.
    pub fn buffer(&self, index: usize) -> Parsed<&[u8]> {
        let buffer = lookup(&self.buffers, index, "buffer")?;
        buffer.as_ref().map(|bytes| bytes.as_ref().as_ref()).map_err(Clone::clone)
    }

    /// The elements of an accessor whose primitive is compressed as a whole.
    pub fn compressed_elements(&self, accessor: usize) -> Option<Parsed<&Elements>> {
        self.compressed.accessor(self, accessor)
    }

    /// The bytes of a buffer view, decompressed.
    pub fn view(&self, index: usize) -> Parsed<View<'_>> {
        let view = lookup(&self.root.buffer_views, index, "buffer view")?;
        let stride = view.byte_stride.map(|s| s.0);
        if let Some(bytes) = self.compressed.view(self, index) {
            return Ok(View { bytes: bytes?, stride });
        }
        let buffer = self.buffer(view.buffer.value())?;
        let start = view.byte_offset.unwrap_or_default().0;
        let end = start.checked_add(view.byte_length.0);
        let bytes = end
            .and_then(|end| buffer.get(usize::try_from(start).ok()?..usize::try_from(end).ok()?))
            .ok_or_else(|| {
                format!(
                    "its buffer view {index} reaches beyond the {} bytes of buffer {}; the file is cut off or was \
                     edited, export it again",
                    buffer.len(),
                    view.buffer.value()
                )
            })?;
        Ok(View { bytes, stride })
    }

    /// The bytes of a picture.
    pub fn image(&self, image: &json::Image) -> Parsed<Cow<'_, [u8]>> {
        match (&image.uri, image.buffer_view) {
            (Some(uri), _) => self.resource(uri),
            (None, Some(view)) => Ok(Cow::Borrowed(self.view(view.value())?.bytes)),
            (None, None) => Err("has neither a file nor data".into()),
        }
    }

    /// Has the page decode all pictures. An error until it has.
    #[cfg(target_family = "wasm")]
    pub fn ask_for_pictures(&self) -> Parsed<()> {
        let pictures = self.root.images.iter().filter_map(|image| self.image(image).ok());
        let is_waiting =
            |bytes: &Cow<[u8]>| !super::picture::is_ours(bytes) && !files::pictures::is_decoded(bytes);
        match pictures.filter(is_waiting).count() {
            0 => Ok(()),
            waiting => Err(format!("it waits for {waiting} pictures to be decoded")),
        }
    }

    /// The bytes that a URI stands for: a `data:` URI, or a file beside the glTF file.
    pub fn resource(&self, uri: &str) -> Parsed<Cow<'a, [u8]>> {
        if let Some(data) = uri.strip_prefix("data:") {
            let (_, data) = data
                .split_once(";base64,")
                .ok_or("is a `data:` URI without `;base64,`; export the file with embedded data again")?;
            let lenient = base64::engine::GeneralPurposeConfig::new()
                .with_decode_padding_mode(base64::engine::DecodePaddingMode::Indifferent);
            return base64::engine::GeneralPurpose::new(&base64::alphabet::STANDARD, lenient)
                .decode(data)
                .map(Cow::Owned)
                .map_err(|e| format!("has broken base64 data ({e}); export the file again"));
        }
        let name = percent_encoding::percent_decode_str(uri)
            .decode_utf8()
            .map_err(|_| format!("has the URI `{}`, which is not UTF-8", shorten(uri)))?;
        let shown = shorten(&name);
        if name.contains("://") {
            return Err(format!("is at `{shown}`; fetch it, put it beside the glTF file and name it there"));
        }
        let Some(base) = self.base else {
            return Err(format!(
                "is in the file `{shown}`, and there is no folder to look in; load it from a path instead"
            ));
        };
        let relative = PathBuf::from(name.replace('\\', "/"));
        if relative.components().any(|c| matches!(c, Component::Prefix(_) | Component::RootDir)) {
            return Err(format!("has the absolute path `{shown}`; name the file relative to the glTF file"));
        }
        let path = base.join(relative);
        if path.exists() && !path.is_file() {
            return Err(format!("is `{shown}`, which is not a file"));
        }
        let bytes = files::bytes(&path).map_err(|e| {
            format!("is in the file `{shown}`, which cannot be read ({e}); put it beside the glTF file")
        })?;
        self.budget.grow(bytes.len());
        Ok(Cow::Owned(bytes))
    }
}

/// The element of a list that the file refers to.
pub(super) fn lookup<'l, T>(list: &'l [T], index: usize, what: &str) -> Parsed<&'l T> {
    list.get(index).ok_or_else(|| {
        format!("it refers to {what} {index} of {}; the file is inconsistent, export it again", list.len())
    })
}

/// JSON and binary chunk.
fn split(bytes: &[u8]) -> Parsed<(&[u8], &[u8])> {
    if bytes.is_empty() {
        return Err("it is empty; fetch or export it again".into());
    }
    if !bytes.starts_with(b"glTF") {
        let start = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        if start.iter().find(|b| !b.is_ascii_whitespace()) != Some(&b'{') {
            return Err("it is not a glTF file: it starts with neither `glTF` nor `{`".into());
        }
        return Ok((bytes, &[]));
    }
    let word =
        |at: usize| -> Option<u32> { Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?)) };
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err(format!("it ends after {} bytes; fetch or export it again", bytes.len()));
    };
    if version != 2 {
        return Err(format!("it is binary glTF of version {version}; convert it to version 2"));
    }
    let chunks = bytes.get(..length as usize).ok_or_else(|| {
        format!("it ends after {} of {length} bytes; fetch or export it again", bytes.len())
    })?;
    if chunks.len() < 20 {
        return Err("its header promises less than a JSON chunk; export it again".into());
    }
    let broken = |e: &dyn std::fmt::Display| format!("its chunks are broken ({e}); fetch or export it again");
    match gltf::Glb::from_slice(chunks) {
        Ok(gltf::Glb { json: Cow::Borrowed(text), bin: None, .. }) => Ok((text, &[])),
        Ok(gltf::Glb { json: Cow::Borrowed(text), bin: Some(Cow::Borrowed(blob)), .. }) => Ok((text, blob)),
        Ok(_) => Err(broken(&"unexpected copy")),
        Err(gltf::Error::Binary(e)) => Err(broken(&e)),
        Err(e) => Err(broken(&e)),
    }
}

/// What is valid glTF, but more than the parser knows of: scenes without nodes, and animations of what are no nodes
/// (`KHR_animation_pointer`), which are left out; and lights without a type. `None` where that is not what is wrong.
fn mended(text: &[u8]) -> Option<(Root, Vec<String>)> {
    let mut value = json::deserialize::from_slice::<Value>(text).ok()?;
    let lights = "/extensions/KHR_lights_punctual/lights";
    for light in value.pointer_mut(lights).and_then(Value::as_array_mut).into_iter().flatten() {
        // Named as one of an unknown type later.
        light.as_object_mut()?.entry("type").or_insert_with(|| "none".into());
    }
    for scene in value.get_mut("scenes").and_then(Value::as_array_mut).into_iter().flatten() {
        let scene = scene.as_object_mut()?;
        scene.entry("nodes").or_insert_with(|| Value::Array(Vec::new()));
    }
    let mut warnings = Vec::new();
    for animation in value.get_mut("animations").and_then(Value::as_array_mut).into_iter().flatten() {
        let channels = animation.get_mut("channels").and_then(Value::as_array_mut)?;
        let count = channels.len();
        channels.retain(|channel| channel.get("target").is_some_and(|target| target.get("node").is_some()));
        if channels.len() < count {
            warnings.push("animations of anything but nodes are left out".to_owned());
        }
    }
    warnings.dedup();
    // By way of text: a second deserializer, of values, takes a tenth of a megabyte of each web page.
    let text = serde_json::to_vec(&value).ok()?;
    Some((json::deserialize::from_slice(&text).ok()?, warnings))
}

/// Why the JSON cannot be read; old versions fail somewhere in the middle, so they are looked for first.
fn broken_json(text: &[u8], error: &json::Error) -> String {
    let value = json::deserialize::from_slice::<Value>(text).ok();
    let version = value.as_ref().and_then(|v| v.get("asset")?.get("version")?.as_str());
    match version {
        Some(version) if !version.starts_with("2.") => {
            format!("it is glTF of version {}; convert it to version 2.0", shorten(version))
        }
        None if value.is_some() => "it is JSON, but not a glTF file: it has no `asset.version`".into(),
        _ => format!("its JSON is broken ({error}); export it again"),
    }
}

/// At most 80 characters of a name from a file.
pub(super) fn shorten(name: &str) -> String {
    shortened(name, 80)
}

/// At most so many characters.
pub(super) fn shortened(text: &str, most: usize) -> String {
    let mut short: String = text.chars().take(most).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    short
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_many_buffers_name_is_read_once() {
        let uri =
            |data: &str| format!(r#"{{"byteLength":3,"uri":"data:application/octet-stream;base64,{data}"}}"#);
        let (same, other) = (uri("AAAA"), uri("AAAB"));
        let text = format!(r#"{{"asset":{{"version":"2.0"}},"buffers":[{same},{other},{same}]}}"#);
        let document = Document::parse(text.as_bytes(), None).expect("a document");
        let [a, b, c] = [0, 1, 2].map(|i| document.buffers[i].as_ref().expect("data"));
        assert!(Arc::ptr_eq(a, c) && !Arc::ptr_eq(a, b));
        assert!(a[..] == [0, 0, 0] && b[..] == [0, 0, 1]);
    }
}
