// From a pixel to its leaf receiver. A pass that uses it binds `receivers`, `triangle_ids` and `offsets`.

const CLUSTERED = 0x80000000u;

fn grid_vector(at: u32) -> vec3f {
  return bitcast<vec3f>(vec3u(receivers[at], receivers[at + 1u], receivers[at + 2u]));
}

// The leaf that a point of a triangle belongs to (core: Receivers::leaf_at).
fn leaf_at(triangle: u32, position: vec3f, front: bool) -> u32 {
  let receiver = receivers[triangle];
  let grid = select(offsets.grids_at + 16u * receiver, 0u, (receiver & CLUSTERED) != 0u);
  let d = position - grid_vector(grid);
  let size = vec2u(receivers[grid + 3u], receivers[grid + 7u]);
  let along = vec2f(dot(d, grid_vector(grid + 4u)), dot(d, grid_vector(grid + 8u)));
  let cell = min(vec2u(max(along, vec2f(0.0))), size - 1u);
  let side = select(receivers[grid + 12u], receivers[grid + 11u], front);
  if (receiver & CLUSTERED) != 0u { return receiver & ~CLUSTERED; }
  return receivers[offsets.cells_at + side + cell.y * size.x + cell.x];
}

// The leaf that a pixel shows; `id` is that of its triangle, plus one.
fn leaf_of(pixel: vec2u, id: u32) -> u32 {
  let hit = hit_at(pixel, id - 1u);
  return leaf_at(id - 1u, hit.position, hit.side > 0.0);
}
