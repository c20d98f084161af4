// How far the points of a grid lie apart on a leaf receiver. A pass that uses it needs lib/light_lists.wgsl.
//
// Leaves are as small as what lights them changes. Where neighbours on a grid lie far apart for their leaf, as on a floor
// that is seen far away, light may come and go between them, and that they receive the same says nothing. Their surface
// ids are negative in the grid: `test_candidate.wgsl` does not interpolate between them.

// Of a leaf's width or height, along which its patch is split.
const MAX_SPACING = 0.5;

fn spacing_on(record: LeafRecord, between: vec3f) -> f32 {
  let texels = abs(vec2f(dot(record.texel_u.xyz, between), dot(record.texel_v.xyz, between)));
  // Where the whole patch is small, its size says nothing of its light.
  let split = select(vec2f(0.0), texels, (vec2u(record.split) & vec2u(1u, 2u)) != vec2u(0u));
  return max(split.x, split.y) / f32(SIDE - 1u);
}

// The id of the surface that a point of the grid shows, negative where its neighbours are far away.
fn spaced_surface_id(surface_id: u32, pixel: vec2u, triangle: u32, leaf: u32) -> f32 {
  let id = f32(surface_id);
  if frame.step == 1u { return id; }
  let record = leaf_record(leaf);
  let last = vec2u(frame.size.x - 1u, frame.last_row);
  let position = hit_at(pixel, triangle).position;
  let across = hit_at(vec2u(min(pixel.x + frame.step, last.x), pixel.y), triangle).position - position;
  let down = hit_at(vec2u(pixel.x, min(pixel.y + frame.step, last.y)), triangle).position - position;
  return select(id, -id, max(spacing_on(record, across), spacing_on(record, down)) > MAX_SPACING);
}
