// Where things are in the buffers of visibility determination (Rust: receivers.rs, selection.rs).

struct BufferOffsets {
  grids_at: u32, // in `receivers`: grids of patches, 16 words each
  cells_at: u32, // in `receivers`: cells of the grids, a leaf each
  leaves: u32,
  batches: u32, // of lights
  ranges_at: u32, // in `light_lists`: RANGE words for each leaf and batch
  chunks_at: u32, // in `point_queue`: chunks
  sorted_at: u32, // in `point_queue`: points in order of leaves
  points_at: u32, // in `shade_list`: points
  light_maps: u32, // whether lights that are not shadowed are taken from light maps
  padding_a: u32,
  padding_b: u32,
  padding_c: u32,
}

const LEAF_WORDS = 24u; // a leaf's record in `light_lists`
const RANGE = 5u; // bounds of the four kinds of lights of a leaf and batch
const CHUNK = 2u; // points of one leaf that are shaded together
const SIDE = 9u; // texels across a light map
const NO_MAP = 0xffffffffu;
const COUNTS = 16u; // in `shade_list`: points of each leaf, after how many there are in all
const POINT_WORDS = 3u; // pixel, leaf, place among the leaf's points
const FIRSTS = 16u; // in `point_queue`: first chunk of each leaf, after the numbers of points and of chunks
