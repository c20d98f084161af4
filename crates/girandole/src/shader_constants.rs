//! Numbers that both sides use, declared once: every shader starts with them as `const` declarations.

use girandole_core::brdf;
use girandole_core::lights::{LOBE_SLOPE, Rectangle, SPREAD};
use girandole_core::scene::PrefilteredEnvironment;

/// Places of dynamic objects in stale maps, as many as a uniform buffer of 64 KiB holds.
pub(crate) const MAX_PREVIOUS_TRANSFORMS: u32 = 1365;
/// Shadow maps: texels across a block, which is drawn as a whole (faces of a cube are a quarter of its map); blocks across what a workgroup
/// merges, and of a large triangle's box that one looks at; clusters that one looks at; large triangles that one keeps at once; texels of a
/// part for each large triangle that it has room for, and words of one; words before the counts of lists.
pub(crate) const MAP_BLOCK: u32 = 8;
pub(crate) const MAP_ACROSS: u32 = 8;
pub(crate) const MAP_SLICE: u32 = 512;
pub(crate) const MAP_CLUSTERS: u32 = 64;
pub(crate) const MAP_KEPT: u32 = 128;
pub(crate) const MAP_LISTED: u32 = 8;
pub(crate) const LISTED_WORDS: u32 = 3;
pub(crate) const MAP_LISTS_HEAD: u32 = 4;
/// Sizes of shadow maps that there may be, and what stands for the place of a light without a map.
pub(crate) const MAP_SIZES: u32 = 16;
pub(crate) const NO_MAP: u32 = 0x00f0_0000;
/// Texels across the texture that holds hierarchies for rays.
pub(crate) const RAY_COLUMNS: u32 = 4096;
/// Flags of its triangles: they emit; they have an alpha mask.
pub(crate) const RAY_EMITS: u32 = 1;
pub(crate) const RAY_MASKED: u32 = 2;
/// Levels that hierarchies over objects and of meshes may have, and groups of nodes and boxes that wait while a ray is followed: of each
/// level one at most, of the lowest of all none.
pub(crate) const RAY_UPPER_DEPTH: u32 = 6;
pub(crate) const RAY_LOWER_DEPTH: u32 = 11;
pub(crate) const RAY_STACK: u32 = RAY_UPPER_DEPTH + RAY_LOWER_DEPTH - 1;
/// Lights are summed in groups of this many; batches are whole groups.
pub(crate) const GROUP: u32 = 128;
/// Most lights in a batch: 32 KiB of a uniform buffer, of which WebGPU binds 64.
pub(crate) const BATCH: u32 = 512;
/// Points of one leaf that are shaded together.
pub(crate) const CHUNK: u32 = 2;
/// Invocations of a workgroup, where they lie in a row; and across one that covers a square of pixels.
pub(crate) const WORKGROUP: u32 = 64;
pub(crate) const TILE: u32 = 8;
/// Lanes that share a point in cooperative shading.
pub(crate) const LANES: u32 = 16;
/// Neighbouring pixels of an invocation where edges are interpolated in runs; no more than 32.
pub(crate) const EDGE_RUN: u32 = 8;
/// Workgroups in x of dispatches that may have more than the 65535 that WebGPU allows.
pub(crate) const GROUPS_PER_ROW: u32 = 32768;
/// Texels across a light map.
pub(crate) const SIDE: u32 = 9;
/// Rows of the tally: steps of 1, 2, 4 and 8 pixels, and further samples at edges.
pub(crate) const TALLY_ROWS: u32 = 5;
/// In `receivers`: the triangle belongs to a cluster of a mesh.
pub(crate) const CLUSTERED: u32 = 1 << 31;
/// Bit of a surface id: normals vary.
pub(crate) const CURVED: u32 = 1 << 23;
/// Bit of a surface id: what light samples show of its reflection cannot be interpolated.
pub(crate) const SHINY: u32 = 1 << 22;
/// Flags of materials: vertices' colours multiply their base colour; they are unlit; they are seen from both sides; light passes
/// them, and what alpha leaves free is not there.
pub(crate) const VERTEX_COLORED: u32 = 1;
pub(crate) const UNLIT: u32 = 2;
pub(crate) const DOUBLE_SIDED: u32 = 4;
pub(crate) const TRANSPARENT: u32 = 8;
pub(crate) const BLENDED: u32 = 16;
/// Profiles of lights.
pub(crate) const COSINE: u32 = 0;
pub(crate) const HEMISPHERE: u32 = 1;
pub(crate) const SPOT: u32 = 2;
pub(crate) const DIRECTIONAL: u32 = 3;
pub(crate) const DISTANT: u32 = 4;
/// Share of a map of parallel light, across, that shows what most of what is seen lies in.
pub(crate) const CORE: f32 = 0.5;
/// Columns and rows of the texture array that holds the texels of all textures.
pub(crate) const TEXEL_COLUMNS: u32 = 4096;
pub(crate) const TEXEL_ROWS: u32 = 4096;
/// Parts of a list of lights, see `gpu_scene/receivers/mod.rs`; `NO_PART`: the light does not light the leaf.
pub(crate) const MAPPED_UNSHADOWED: u32 = 0;
pub(crate) const UNSHADOWED: u32 = 1;
pub(crate) const NEAR_UNSHADOWED: u32 = 2;
pub(crate) const NEAR_SHADOWED: u32 = 3;
pub(crate) const JOINTED: u32 = 4;
pub(crate) const SHADOWED: u32 = 5;
pub(crate) const MAPPED_SHADOWED: u32 = 6;
pub(crate) const NO_PART: u32 = 7;
/// What an update of a light map does with the lights that it names.
pub(crate) const ADDS: u32 = 0;
pub(crate) const TAKES_AWAY: u32 = 1;
pub(crate) const REPLACES: u32 = 2;
/// Parameterisations of shadow maps, as `ShadowMap` orders them.
pub(crate) const OCTAHEDRAL: u32 = 0;
pub(crate) const PARABOLIC: u32 = 1;
pub(crate) const CUBE: u32 = 2;
/// Tone curves.
pub(crate) const AGX: u32 = 0;
pub(crate) const ACES: u32 = 1;
pub(crate) const NO_CURVE: u32 = 2;
/// Bins of the histogram of luminance.
pub(crate) const HISTOGRAM_BINS: u32 = 256;
/// In place of a bound on the geometric factor: that of each light; none. The largest number of all, in decimals, is one too large for
/// compilers that read more digits than it has.
pub(crate) const OWN_CLAMP: f32 = 0.0;
pub(crate) const MAX_CLAMP: f32 = 3.4e38;
/// In place of an index: none.
pub(crate) const NONE: u32 = girandole_core::scene::NONE;

const _: () = assert!(BATCH.is_multiple_of(GROUP), "batches are whole groups");
const _: () = assert!((SIDE * SIDE).is_multiple_of(3), "a lane of light_maps.wgsl has three texels");
const _: () =
    assert!(GROUP == 4 * 32, "the lights of a group have a bit each in the four words of `deferred`");
const _: () = assert!(EDGE_RUN <= 32, "the pixels of a run have a bit each in a word");
const _: () = assert!(RAY_STACK == 16, "eight registers hold two groups each");
const _: () = assert!(WORKGROUP.is_multiple_of(LANES), "workgroups hold whole points");

macro_rules! declarations {
    ($($name:ident),*) => {
        [$(format!("const {} = {:#x}u;\n", stringify!($name), $name)),*].concat()
    };
}

/// The same numbers in WGSL.
pub(crate) fn declarations() -> String {
    const TALLY_EDGE_ROW: u32 = TALLY_ROWS - 1;
    let [near, far] = Rectangle::NEAR;
    declarations!(
        GROUP,
        BATCH,
        MAX_PREVIOUS_TRANSFORMS,
        MAP_BLOCK,
        MAP_ACROSS,
        MAP_SLICE,
        MAP_CLUSTERS,
        MAP_KEPT,
        MAP_LISTED,
        LISTED_WORDS,
        MAP_LISTS_HEAD,
        MAP_SIZES,
        NO_MAP,
        RAY_COLUMNS,
        RAY_EMITS,
        RAY_MASKED,
        RAY_STACK,
        CHUNK,
        WORKGROUP,
        TILE,
        LANES,
        EDGE_RUN,
        GROUPS_PER_ROW,
        SIDE,
        TALLY_EDGE_ROW,
        CLUSTERED,
        CURVED,
        SHINY,
        VERTEX_COLORED,
        UNLIT,
        DOUBLE_SIDED,
        TRANSPARENT,
        BLENDED,
        COSINE,
        HEMISPHERE,
        SPOT,
        DIRECTIONAL,
        DISTANT,
        TEXEL_COLUMNS,
        TEXEL_ROWS,
        MAPPED_UNSHADOWED,
        UNSHADOWED,
        NEAR_UNSHADOWED,
        NEAR_SHADOWED,
        JOINTED,
        SHADOWED,
        MAPPED_SHADOWED,
        NO_PART,
        ADDS,
        TAKES_AWAY,
        REPLACES,
        OCTAHEDRAL,
        PARABOLIC,
        CUBE,
        AGX,
        ACES,
        NO_CURVE,
        HISTOGRAM_BINS,
        NONE
    ) + &format!(
        "const MIN_ALPHA = {:?};\nconst CORE = {CORE:?};\nconst OWN_CLAMP = {OWN_CLAMP:?};\nconst MAX_CLAMP = {MAX_CLAMP:?};\n\
         const RECTANGLE_NEAR = {near:?};\nconst RECTANGLE_FAR = {far:?};\nconst RECTANGLE_SPREAD = {:?};\n\
         const LOBE_SLOPE = {LOBE_SLOPE:?};\nconst FIRST_LOBE_ALPHA = {:?};\n\
         const LEAST_SOLID_ANGLE = {:?};\nconst MIRROR_LEAST = {:?};\nconst MIRROR_REST = {:?};\nconst MIRROR_LEAST_FRESNEL = {:?};\n\
         const RAY_OFFSET_BY_ROUNDING = {:?};\n",
        brdf::MIN_ALPHA,
        SPREAD,
        PrefilteredEnvironment::FIRST_ALPHA,
        brdf::LEAST_SOLID_ANGLE,
        brdf::MIRROR_LEAST,
        brdf::MIRROR_REST,
        brdf::MIRROR_LEAST_FRESNEL,
        8.0 * f32::EPSILON,
    )
}
