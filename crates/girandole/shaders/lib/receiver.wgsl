// From a pixel to its leaf receiver. A pass that uses it binds `receivers`, `triangle_ids` and `offsets`. `receivers` holds
// words: for each triangle the index of its grid, or its leaf with CLUSTERED; the grids of patches as `ReceiverGrid`; the
// leaf of each of their cells.

// The leaf that a point of a triangle belongs to (core: Receivers::leaf_at).
fn leaf_at(triangle: u32, position: vec3f, front: bool) -> u32 {
  let receiver = receivers[triangle];
  let is_clustered = (receiver & CLUSTERED) != 0u;
  let grid = receiver_grid_at(select(offsets.grids_at + RECEIVER_GRID_WORDS * receiver, 0u, is_clustered));
  let d = position - grid.origin;
  let along = vec2f(dot(d, grid.axis_u), dot(d, grid.axis_v));
  let cell = min(vec2u(max(along, vec2f(0.0))), vec2u(grid.columns, grid.rows) - 1u);
  let side = select(grid.back, grid.front, front);
  if is_clustered { return receiver & ~CLUSTERED; }
  return receivers[offsets.cells_at + side + cell.y * grid.columns + cell.x];
}

// The leaf that a pixel shows; `id` is that of its triangle, plus one.
fn leaf_of(pixel: vec2u, id: u32) -> u32 {
  let hit = hit_at(pixel, id - 1u);
  return leaf_at(id - 1u, hit.position, hit.side > 0.0);
}
