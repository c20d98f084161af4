// Where things are in buffers of words (Rust: gpu_scene/receivers/mod.rs, points/lists.rs).

struct BufferOffsets {
  grids_at: u32, // in `receivers`: grids of patches
  cells_at: u32, // in `receivers`: cells of the grids
  leaves: u32, // how many
  batches: u32, // of lights
  ranges_at: u32, // in `light_lists`: a range for each leaf and batch
  chunks_at: u32, // in `point_queue`: chunks
  sorted_at: u32, // in `point_queue`: points in order of leaves
  points_at: u32, // in `shade_list`: points
  light_maps: u32, // whether unshadowed light is read from light maps
  padding_a: u32,
  padding_b: u32,
  padding_c: u32,
}
