//! Reading typed elements out of buffers.
//!
//! The `gltf` crate's own readers index without checks and take quantised positions for floats, so elements are read
//! here: everything that can be wrong is refused when an [`Accessor`] is made, and reading an element cannot fail.

use super::document::{Document, lookup};
use super::{Parsed, compression};
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::validation::Checked;

/// Elements of an accessor that no buffer backs (all zero but for sparse ones): more than this is an attack.
const MAX_UNBACKED: usize = 1 << 20;

/// A checked accessor: any index below `count` can be read.
pub(super) struct Accessor<'d> {
    pub count: usize,
    pub kind: Type,
    pub component: ComponentType,
    base: Option<Elements<'d>>,
    normalized: bool,
    /// Ascending indices, and the values that replace the base's there.
    sparse: Option<(Vec<u32>, Elements<'d>)>,
}

/// Evenly spaced elements that lie within `bytes`.
#[derive(Clone, Copy)]
struct Elements<'d> {
    bytes: &'d [u8],
    stride: usize,
}

impl<'d> Elements<'d> {
    fn new(
        document: &'d Document<'_>,
        view: usize,
        offset: u64,
        count: usize,
        size: usize,
        sparse: bool,
    ) -> Parsed<Self> {
        let view = document.view(view)?;
        let stride = if sparse { size } else { view.stride.unwrap_or(size) };
        if stride < size {
            return Err(format!(
                "has a stride of {stride} bytes for elements of {size}; export the file again"
            ));
        }
        let start = usize::try_from(offset).unwrap_or(usize::MAX);
        let length = count.saturating_sub(1).checked_mul(stride).and_then(|l| l.checked_add(size));
        let end = length.and_then(|l| start.checked_add(l));
        let bytes = if count == 0 { Some(&[][..]) } else { end.and_then(|end| view.bytes.get(start..end)) };
        let bytes = bytes.ok_or_else(|| {
            format!(
                "has {count} elements, more than the {} bytes of its buffer view hold; the file is cut off or was \
                 edited, export it again",
                view.bytes.len()
            )
        })?;
        Ok(Self { bytes, stride })
    }

    fn component(&self, index: usize, component: usize, kind: ComponentType) -> f64 {
        let at = index * self.stride + component * kind.size();
        let byte = |i: usize| self.bytes.get(at + i).copied().unwrap_or(0);
        match kind {
            ComponentType::I8 => f64::from(byte(0) as i8),
            ComponentType::U8 => f64::from(byte(0)),
            ComponentType::I16 => f64::from(i16::from_le_bytes([byte(0), byte(1)])),
            ComponentType::U16 => f64::from(u16::from_le_bytes([byte(0), byte(1)])),
            ComponentType::U32 => f64::from(u32::from_le_bytes([byte(0), byte(1), byte(2), byte(3)])),
            ComponentType::F32 => f64::from(f32::from_le_bytes([byte(0), byte(1), byte(2), byte(3)])),
        }
    }
}

impl<'d> Accessor<'d> {
    /// Checks accessor `index` and makes it readable.
    pub fn new(document: &'d Document<'_>, index: usize) -> Parsed<Self> {
        let json = lookup(&document.root.accessors, index, "accessor")?;
        let accessor = match document.compressed_elements(index) {
            Some(elements) => elements.and_then(|elements| Self::compressed(elements, json)),
            None => Self::checked(document, json),
        };
        accessor.map_err(|e| format!("its accessor {index} {e}"))
    }

    /// What was compressed says of itself what it is, and how much.
    fn compressed(elements: &'d compression::Elements, json: &gltf::json::Accessor) -> Parsed<Self> {
        let &compression::Elements { component, components, count, .. } = elements;
        let Checked::Valid(kind) = json.type_ else {
            return Err("has an unknown type; export the file again".into());
        };
        if components != kind.multiplicity() {
            return Err(format!(
                "is of type {kind:?}, but has {components} components; export the file again"
            ));
        }
        let base = Elements { bytes: &elements.bytes, stride: components * component.size() };
        Ok(Self { count, kind, component, base: Some(base), normalized: json.normalized, sparse: None })
    }

    fn checked(document: &'d Document<'_>, json: &gltf::json::Accessor) -> Parsed<Self> {
        let (Checked::Valid(kind), Checked::Valid(component)) = (json.type_, json.component_type) else {
            return Err("has an unknown type; export the file again".into());
        };
        let component = component.0;
        let size = kind.multiplicity() * component.size();
        let count = usize::try_from(json.count.0)
            .ok()
            .filter(|&c| u32::try_from(c).is_ok())
            .ok_or_else(|| format!("has {} elements, more than 32-bit indices reach", json.count.0))?;
        let base = match json.buffer_view {
            Some(view) => {
                let offset = json.byte_offset.unwrap_or_default().0;
                Some(Elements::new(document, view.value(), offset, count, size, false)?)
            }
            None if count > MAX_UNBACKED => {
                return Err(format!("has {count} elements without data; export the file again"));
            }
            None => None,
        };
        let sparse = match &json.sparse {
            None => None,
            Some(sparse) => {
                let length = usize::try_from(sparse.count.0).unwrap_or(usize::MAX);
                let Checked::Valid(index_type) = sparse.indices.component_type else {
                    return Err("has sparse indices of an unknown type; export the file again".into());
                };
                let (view, offset) = (sparse.indices.buffer_view.value(), sparse.indices.byte_offset.0);
                let indices = Elements::new(document, view, offset, length, index_type.0.size(), true)?;
                let indices: Vec<u32> =
                    (0..length).map(|i| indices.component(i, 0, index_type.0) as u32).collect();
                let ascending = indices.windows(2).all(|w| w[0] < w[1]);
                if !ascending || indices.last().is_some_and(|&i| i as usize >= count) {
                    return Err(
                        "has sparse indices out of order or out of range; export the file again".into()
                    );
                }
                let (view, offset) = (sparse.values.buffer_view.value(), sparse.values.byte_offset.0);
                Some((indices, Elements::new(document, view, offset, length, size, true)?))
            }
        };
        Ok(Self { count, kind, component, base, normalized: json.normalized, sparse })
    }

    /// The accessor, if its elements are of this type.
    pub fn of(self, kind: Type, what: &str) -> Parsed<Self> {
        if self.kind == kind {
            return Ok(self);
        }
        Err(format!("its {what} are of type {:?} instead of {kind:?}; export the file again", self.kind))
    }

    fn raw(&self, index: usize, component: usize) -> f64 {
        if let Some((indices, values)) = &self.sparse
            && let Ok(at) = indices.binary_search(&(index as u32))
        {
            return values.component(at, component, self.component);
        }
        self.base.map_or(0.0, |base| base.component(index, component, self.component))
    }

    /// The first `N` components of an element, normalised integers as fractions.
    pub fn get<const N: usize>(&self, index: usize) -> [f32; N] {
        let scale = match self.component {
            _ if !self.normalized => 1.0,
            ComponentType::I8 => 127.0,
            ComponentType::U8 => 255.0,
            ComponentType::I16 => 32767.0,
            ComponentType::U16 => 65535.0,
            ComponentType::U32 | ComponentType::F32 => 1.0,
        };
        std::array::from_fn(|c| {
            let value = self.raw(index, c);
            (if scale > 1.0 { (value / scale).max(-1.0) } else { value }) as f32
        })
    }

    /// An element as an unsigned integer.
    pub fn index(&self, index: usize) -> u32 {
        self.raw(index, 0) as u32
    }
}
