//! Records in buffers of words. Several kinds of them share a buffer, so that a pass needs no more than eight; shaders
//! get a `struct` and the functions that read and write it, made from the same list of fields.
//!
//! `LeafRange`, for instance, becomes `struct LeafRange`, `const LEAF_RANGE_WORDS`, a constant for the offset of each
//! field such as `LEAF_RANGE_SHADOWED`, `leaf_range_at(at)` and `set_leaf_range(at, value)`.

use bytemuck::{Pod, Zeroable};
use std::fmt::Write as _;

/// What a shader is told of a record.
pub(crate) struct Record {
    name: &'static str,
    /// `name` as functions have it.
    pub snake: &'static str,
    /// The buffer that it is in.
    buffer: &'static str,
    access: Access,
    words: usize,
    /// Name and type of each field.
    fields: &'static [(&'static str, &'static str)],
}

/// How a shader gets at words.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Access {
    /// As an array.
    Plain,
    /// As an array of atomics.
    Atomic,
    /// By a function.
    Call,
}

macro_rules! record {
    ($(#[$meta:meta])* $name:ident as $snake:ident in $buffer:literal: $access:ident { $($(#[$doc:meta])* $field:ident: $kind:ident),* $(,)? }) => {
        $(#[$meta])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
        pub(crate) struct $name {
            $($(#[$doc])* pub $field: record!(@ $kind)),*
        }

        impl $name {
            /// Words of one.
            pub const WORDS: usize = size_of::<Self>() / 4;
            const RECORD: Record = Record {
                name: stringify!($name),
                snake: stringify!($snake),
                buffer: $buffer,
                access: Access::$access,
                words: Self::WORDS,
                fields: &[$((stringify!($field), stringify!($kind))),*],
            };
        }
    };
    (@ u32) => { u32 };
    (@ vec3f) => { [f32; 3] };
    (@ vec4f) => { [f32; 4] };
}

record! {
    /// The grid over a patch by which pixels find their leaf.
    ReceiverGrid as receiver_grid in "receivers": Plain {
        origin: vec3f,
        columns: u32,
        axis_u: vec3f,
        rows: u32,
        axis_v: vec3f,
        /// First cell of the front and of the back.
        front: u32,
        back: u32,
    }
}

record! {
    /// A leaf receiver: its light map, and the rectangle that the map covers.
    LeafRecord as leaf_record in "light_lists": Plain {
        /// First texel, or [`NONE`](crate::shader_constants::NONE).
        light_map: u32,
        /// Texel from position: dot products with (x, y, z, 1).
        texel_u: vec4f,
        texel_v: vec4f,
        corner: vec3f,
        across: vec3f,
        up: vec3f,
        normal: vec3f,
        /// Which of the dynamic objects it is on, or [`NONE`](crate::shader_constants::NONE).
        mover: u32,
        /// Whether it is part of a patch that is split along u (1) and v (2).
        split: u32,
    }
}

record! {
    /// The list of a leaf and batch of lights: where each of its seven parts begins in `light_lists`, in entries of half a word, see
    /// `gpu_scene/receivers/mod.rs`.
    LeafRange as leaf_range in "light_lists": Plain {
        mapped_unshadowed: u32,
        unshadowed: u32,
        near_unshadowed: u32,
        near_shadowed: u32,
        jointed: u32,
        shadowed: u32,
        mapped_shadowed: u32,
        end: u32,
    }
}

record! {
    /// A point to shade: its pixel in the band, its leaf, and its index among the points of that leaf.
    ShadePoint as shade_point in "shade_list.words": Atomic {
        pixel: u32,
        leaf: u32,
        rank: u32,
    }
}

record! {
    /// A set of receivers with a set of lights, for multipass shading.
    Element as element in "elements": Plain {
        members_at: u32,
        member_count: u32,
        lights_at: u32,
        light_count: u32,
        /// Of a pass.
        vertices: u32,
        /// Vertices of all elements before it.
        first_vertex: u32,
    }
}

record! {
    /// A leaf of an element, and the chunks of the element's leaves before it.
    Member as member in "elements": Plain {
        leaf: u32,
        chunks_before: u32,
    }
}

record! {
    /// An entry of the directory of textures.
    TextureEntry as texture_entry in "texel_word": Call {
        /// First word of level 0.
        offset: u32,
        /// Width, and height << 16.
        extent: u32,
        levels: u32,
        /// Bit 0 sRGB, bit 1 nearest, bits 2-3 wrap u, bits 4-5 wrap v (0 repeat, 1 mirror, 2 clamp).
        flags: u32,
    }
}

record! {
    /// Where things are in `stale_maps`, see `passes/stale_maps.rs`: it is the first of them.
    StaleMapsHeader as stale_maps_header in "stale_maps": Plain {
        /// Boxes about groups of clusters.
        groups_at: u32,
        groups: u32,
        /// The first group of dynamic objects; those of static ones come before.
        first_moving: u32,
        /// Boxes about clusters.
        clusters_at: u32,
        /// Triangles, cluster by cluster, as the geometry has them.
        triangles_at: u32,
    }
}

record! {
    /// The texels of a light's map that are stale: from the first column and row up to before the last.
    StalePart as stale_part in "stale_maps": Plain {
        first_column: u32,
        first_row: u32,
        end_column: u32,
        end_row: u32,
        /// The first of the places that dynamic objects have in the map, or [`NONE`](crate::shader_constants::NONE).
        previous_row: u32,
    }
}

record! {
    /// A box about occluders.
    OccluderBox as occluder_box in "stale_maps": Plain {
        center: vec3f,
        half_extent: vec3f,
    }
}

/// All of them.
pub(crate) const RECORDS: [Record; 10] = [
    TextureEntry::RECORD,
    ReceiverGrid::RECORD,
    LeafRecord::RECORD,
    LeafRange::RECORD,
    ShadePoint::RECORD,
    Element::RECORD,
    Member::RECORD,
    StaleMapsHeader::RECORD,
    StalePart::RECORD,
    OccluderBox::RECORD,
];

impl Record {
    /// The `struct`, and the constants.
    pub fn declaration(&self) -> String {
        let upper = self.snake.to_uppercase();
        let mut text = format!("struct {} {{\n", self.name);
        let mut constants = String::new();
        let mut offset = 0;
        for (field, kind) in self.fields {
            let _ = writeln!(text, "  {field}: {kind},");
            let _ = writeln!(constants, "const {upper}_{} = {offset}u;", field.to_uppercase());
            offset += words_of(kind);
        }
        format!("{text}}}\n{constants}const {upper}_WORDS = {}u;\n", self.words)
    }

    /// The function that reads one.
    pub fn reader(&self) -> String {
        let mut at = 0;
        let mut word = || {
            let (buffer, index) = (self.buffer, at);
            at += 1;
            match self.access {
                Access::Plain => format!("{buffer}[at + {index}u]"),
                Access::Atomic => format!("atomicLoad(&{buffer}[at + {index}u])"),
                Access::Call => format!("{buffer}(at + {index}u)"),
            }
        };
        let fields: Vec<String> = self
            .fields
            .iter()
            .map(|(_, kind)| {
                let words: Vec<String> = (0..words_of(kind)).map(|_| word()).collect();
                match words.len() {
                    1 => words.concat(),
                    n => format!("bitcast<{kind}>(vec{n}u({}))", words.join(", ")),
                }
            })
            .collect();
        let (name, snake) = (self.name, self.snake);
        format!("fn {snake}_at(at: u32) -> {name} {{\n  return {name}({});\n}}\n", fields.join(",\n    "))
    }

    /// The function that writes one.
    pub fn writer(&self) -> String {
        let mut text = format!("fn set_{}(at: u32, value: {}) {{\n", self.snake, self.name);
        let mut at = 0;
        for (field, kind) in self.fields {
            for component in 0..words_of(kind) {
                let index = format!("{}[at + {at}u]", self.buffer);
                let value = match words_of(kind) {
                    1 => format!("value.{field}"),
                    _ => format!("bitcast<u32>(value.{field}[{component}u])"),
                };
                let _ = if self.access == Access::Atomic {
                    writeln!(text, "  atomicStore(&{index}, {value});")
                } else {
                    writeln!(text, "  {index} = {value};")
                };
                at += 1;
            }
        }
        text + "}\n"
    }
}

fn words_of(kind: &str) -> usize {
    match kind {
        "vec3f" => 3,
        "vec4f" => 4,
        _ => 1,
    }
}
