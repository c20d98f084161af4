//! Compressed geometry: buffer views by `EXT_meshopt_compression` and `KHR_meshopt_compression`, primitives by
//! `KHR_draco_mesh_compression`. Each is decompressed when it is first read.

use super::document::{Document, lookup};
use super::{MAX_TRIANGLES, MAX_VERTICES, Parsed};
use draco_core::{DataType, DecodeLimits, DecoderBuffer, FaceIndex, MeshDecoder, PointAttribute, PointIndex};
use gltf::json::accessor::ComponentType;
use gltf::json::mesh::Primitive;
use gltf::json::validation::Checked;
use gltf::json::{Root, Value, buffer};
use meshoptimizer_rs::codec;
use meshoptimizer_rs::{Limits, Workspace};
use std::collections::BTreeMap;
use std::sync::OnceLock;

/// The extension's name.
pub(super) const DRACO: &str = "KHR_draco_mesh_compression";
/// Both names of the same format, of which the second has more of it.
pub(super) const MESHOPT: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// A block of 8192 bytes takes one at least (meshoptimizer, vertexcodec.cpp).
const MAX_RATIO: usize = 8192;

/// What is compressed in a file, and what it became.
#[derive(Default)]
pub(super) struct Compressed {
    views: BTreeMap<usize, OnceLock<Parsed<Vec<u8>>>>,
    primitives: BTreeMap<usize, OnceLock<Parsed<BTreeMap<Part, Elements>>>>,
    /// By accessor: the buffer view of its primitive, and which part of that it is.
    accessors: BTreeMap<usize, (usize, Part)>,
}

/// A part of a compressed primitive.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Part {
    Indices,
    /// The attribute of this id.
    Attribute(u32),
}

/// Elements without gaps.
pub(super) struct Elements {
    pub bytes: Vec<u8>,
    pub component: ComponentType,
    pub components: usize,
    pub count: usize,
}

impl Compressed {
    /// Finds what is compressed and has no other data.
    pub fn new(root: &Root) -> Self {
        let mut result = Self::default();
        for (index, view) in root.buffer_views.iter().enumerate() {
            if meshopt(view).is_some() {
                result.views.insert(index, OnceLock::new());
            }
        }
        let primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
        for (primitive, draco) in primitives.filter_map(|p| Some((p, draco(p)?))) {
            // One that is not named is none that exists.
            let view = number(draco, "bufferView").unwrap_or(usize::MAX);
            let mut add = |accessor: usize, part| {
                if root.accessors.get(accessor).is_some_and(|a| a.buffer_view.is_none()) {
                    result.primitives.entry(view).or_default();
                    result.accessors.insert(accessor, (view, part));
                }
            };
            if let Some(indices) = primitive.indices {
                add(indices.value(), Part::Indices);
            }
            let ids = draco.get("attributes");
            for (semantic, accessor) in &primitive.attributes {
                let Checked::Valid(semantic) = semantic else { continue };
                let id = ids.and_then(|ids| ids.get(semantic.to_string())?.as_u64());
                if let Some(id) = id.and_then(|id| u32::try_from(id).ok()) {
                    add(accessor.value(), Part::Attribute(id));
                }
            }
        }
        result
    }

    /// The bytes of a buffer view that meshopt compressed.
    pub fn view(&self, document: &Document<'_>, index: usize) -> Option<Parsed<&[u8]>> {
        let decompress = || {
            let view = lookup(&document.root.buffer_views, index, "buffer view")?;
            decompress_view(document, meshopt(view).unwrap_or(&Value::Null))
        };
        let view = self.views.get(&index)?.get_or_init(decompress).as_deref();
        Some(view.map_err(|e| format!("its compressed buffer view {index} {e}")))
    }

    /// The elements of an accessor of a primitive that Draco compressed.
    pub fn accessor(&self, document: &Document<'_>, index: usize) -> Option<Parsed<&Elements>> {
        let (view, part) = self.accessors.get(&index)?;
        let decompress = || {
            // What the decoder holds meanwhile is a few times what comes out.
            let parts = decompress_primitive(document.view(*view)?.bytes, document.budget.left() / 4)?;
            document.budget.take(parts.values().map(|part| part.bytes.len()).sum(), 1)?;
            Ok(parts)
        };
        let parts = self.primitives.get(view)?.get_or_init(decompress);
        Some(match parts {
            Ok(parts) => {
                parts.get(part).ok_or_else(|| "is no part of its compressed primitive; export again".into())
            }
            Err(e) => Err(format!("is in a compressed primitive, which {e}")),
        })
    }
}

fn meshopt(view: &buffer::View) -> Option<&Value> {
    let others = &view.extensions.as_ref()?.others;
    MESHOPT.iter().find_map(|name| others.get(*name))
}

fn draco(primitive: &Primitive) -> Option<&Value> {
    primitive.extensions.as_ref()?.others.get(DRACO)
}

fn number(json: &Value, name: &str) -> Parsed<usize> {
    let value = json.get(name).and_then(Value::as_u64).and_then(|n| usize::try_from(n).ok());
    value.ok_or_else(|| format!("has no `{name}`; export the file again"))
}

fn decompress_view(document: &Document<'_>, json: &Value) -> Parsed<Vec<u8>> {
    let [buffer, length, count, stride] =
        ["buffer", "byteLength", "count", "byteStride"].map(|name| number(json, name));
    let (length, count, stride) = (length?, count?, stride?);
    let offset = if json.get("byteOffset").is_some() { number(json, "byteOffset")? } else { 0 };
    let source = document.buffer(buffer?)?.get(offset..offset.saturating_add(length));
    let source = source.ok_or("reaches beyond its buffer; the file is cut off, fetch or export it again")?;
    let size = count.saturating_mul(stride);
    if size / MAX_RATIO > source.len() {
        return Err(format!("promises {size} bytes in {}; export the file again", source.len()));
    }
    // The decoder has a copy of its own.
    document.budget.take(size, 2)?;
    let max_bytes = usize::try_from(document.budget.left()).unwrap_or(usize::MAX).saturating_add(size);
    let mut workspace = Workspace::new(Limits { max_bytes, ..Limits::default() });
    let broken = |e| format!("cannot be decompressed ({e}); export the file again");
    let filter = json.get("filter").and_then(Value::as_str).unwrap_or("NONE");
    let mut bytes = match json.get("mode").and_then(Value::as_str) {
        Some("ATTRIBUTES") => codec::decode_vertex_buffer(count, stride, source, &mut workspace),
        Some("TRIANGLES") => codec::decode_index_buffer(count, stride, source, &mut workspace),
        Some("INDICES") => codec::decode_index_sequence(count, stride, source, &mut workspace),
        _ => return Err("has an unknown mode; export the file again".into()),
    }
    .map_err(broken)?;
    let undo = match filter {
        "NONE" => return Ok(bytes),
        "OCTAHEDRAL" => codec::decode_filter_oct,
        "QUATERNION" => codec::decode_filter_quat,
        "EXPONENTIAL" => codec::decode_filter_exp,
        "COLOR" => codec::decode_filter_color,
        _ => return Err("has an unknown filter; export the file again".into()),
    };
    undo(&mut bytes, count, stride, &mut workspace).map_err(broken)?;
    Ok(bytes)
}

fn decompress_primitive(bytes: &[u8], limit: u64) -> Parsed<BTreeMap<Part, Elements>> {
    let limits = DecodeLimits::default()
        .with_max_points(MAX_VERTICES as u64)
        .with_max_faces(MAX_TRIANGLES as u64)
        .with_max_decoded_bytes(limit);
    let mut mesh = draco_core::Mesh::new();
    MeshDecoder::new()
        .decode(&mut DecoderBuffer::new(bytes).with_limits(limits), &mut mesh)
        .map_err(|e| format!("cannot be decompressed ({e}); export the file again"))?;
    let faces = (0..mesh.num_faces()).flat_map(|i| mesh.face(FaceIndex(i as u32)));
    let indices = Elements {
        bytes: faces.flat_map(|point| point.0.to_le_bytes()).collect(),
        component: ComponentType::U32,
        components: 1,
        count: 3 * mesh.num_faces(),
    };
    let mut parts = BTreeMap::from([(Part::Indices, indices)]);
    for id in 0..mesh.num_attributes() {
        let attribute = mesh.try_attribute(id).map_err(|e| format!("is inconsistent ({e})"))?;
        if let Some(elements) = elements(attribute, mesh.num_points()) {
            parts.insert(Part::Attribute(attribute.unique_id()), elements);
        }
    }
    Ok(parts)
}

/// An attribute's values at all points; what is missing is zero. `None` for types that glTF does not have.
fn elements(attribute: &PointAttribute, points: usize) -> Option<Elements> {
    let component = match attribute.data_type() {
        DataType::Int8 => ComponentType::I8,
        DataType::Uint8 => ComponentType::U8,
        DataType::Int16 => ComponentType::I16,
        DataType::Uint16 => ComponentType::U16,
        DataType::Uint32 => ComponentType::U32,
        DataType::Float32 => ComponentType::F32,
        _ => return None,
    };
    let components = usize::from(attribute.num_components());
    let size = components * component.size();
    let stride = usize::try_from(attribute.byte_stride()).ok()?;
    let data = attribute.buffer().data();
    let mut bytes = Vec::with_capacity(points * size);
    for point in 0..points {
        let start = (attribute.mapped_index(PointIndex(point as u32)).0 as usize).checked_mul(stride);
        let value = start.and_then(|start| data.get(start..start.checked_add(size)?));
        match value {
            Some(value) => bytes.extend_from_slice(value),
            None => bytes.resize(bytes.len() + size, 0),
        }
    }
    Some(Elements { bytes, component, components, count: points })
}
