//! The binary part: numbers and pictures, each in a view of its own.

use gltf::json::accessor::{ComponentType, GenericComponentType, Type};
use gltf::json::buffer::{Buffer, Target, View};
use gltf::json::validation::Checked::Valid;
use gltf::json::validation::USize64;
use gltf::json::{Accessor, Index, Root, Value};

/// Bytes, and the views of them.
#[derive(Default)]
pub(super) struct Buffers {
    bytes: Vec<u8>,
}

impl Buffers {
    /// Adds bytes, which begin where numbers of four bytes may.
    pub fn view(&mut self, root: &mut Root, bytes: &[u8], target: Option<Target>) -> Index<View> {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let start = self.bytes.len();
        self.bytes.extend_from_slice(bytes);
        root.push(View {
            buffer: Index::new(0),
            byte_length: USize64::from(bytes.len()),
            byte_offset: Some(USize64::from(start)),
            byte_stride: None,
            name: None,
            target: target.map(Valid),
            extensions: None,
            extras: None,
        })
    }

    /// Adds vectors of as many floats; with their least and greatest components where readers ask for them.
    pub fn floats<const N: usize>(
        &mut self,
        root: &mut Root,
        values: &[[f32; N]],
        kind: Type,
        with_bounds: bool,
    ) -> Index<Accessor> {
        let target = matches!(kind, Type::Vec2 | Type::Vec3 | Type::Vec4).then_some(Target::ArrayBuffer);
        let view = self.view(root, bytemuck::cast_slice(values.as_flattened()), target);
        let bound = |pick: fn(f32, f32) -> f32| {
            let first = values.first().copied().unwrap_or([0.0; N]);
            let bound =
                values.iter().fold(first, |bound, value| std::array::from_fn(|i| pick(bound[i], value[i])));
            Value::from(bound.to_vec())
        };
        let bounds = with_bounds.then(|| [bound(f32::min), bound(f32::max)]);
        let [min, max] = bounds.map_or([None, None], |[min, max]| [Some(min), Some(max)]);
        accessor(root, (view, values.len()), (ComponentType::F32, kind), [min, max])
    }

    /// Adds indices of vertices.
    pub fn indices(&mut self, root: &mut Root, indices: &[u32]) -> Index<Accessor> {
        let view = self.view(root, bytemuck::cast_slice(indices), Some(Target::ElementArrayBuffer));
        accessor(root, (view, indices.len()), (ComponentType::U32, Type::Scalar), [None, None])
    }

    /// Adds four joints a vertex.
    pub fn joints(&mut self, root: &mut Root, joints: &[[u16; 4]]) -> Index<Accessor> {
        let view = self.view(root, bytemuck::cast_slice(joints.as_flattened()), Some(Target::ArrayBuffer));
        accessor(root, (view, joints.len()), (ComponentType::U16, Type::Vec4), [None, None])
    }

    /// All bytes, as the buffer of the file.
    pub fn finish(self, root: &mut Root) -> Vec<u8> {
        let mut bytes = self.bytes;
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        let byte_length = USize64::from(bytes.len());
        root.push(Buffer { byte_length, name: None, uri: None, extensions: None, extras: None });
        bytes
    }
}

fn accessor(
    root: &mut Root,
    (view, count): (Index<View>, usize),
    (component, kind): (ComponentType, Type),
    [min, max]: [Option<Value>; 2],
) -> Index<Accessor> {
    root.push(Accessor {
        buffer_view: Some(view),
        byte_offset: None,
        count: USize64::from(count),
        component_type: Valid(GenericComponentType(component)),
        extensions: None,
        extras: None,
        type_: Valid(kind),
        min,
        max,
        name: None,
        normalized: false,
        sparse: None,
    })
}
