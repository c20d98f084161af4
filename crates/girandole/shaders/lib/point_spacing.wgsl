// How far the points of a grid lie apart on a leaf receiver. A pass that uses it needs lib/light_lists.wgsl, and lib/grid.wgsl.
//
// Leaves are as small as what lights them changes. Where neighbours on a grid lie far apart for their leaf, as on a floor that is seen far
// away, light may come and go between them, and that they receive the same says nothing. What a grid holds of a point beside its
// irradiance says so, see lib/grid.wgsl.

// Of a leaf's width or height, along which its patch is split, times the tolerance.
const MAX_SPACING = 3.5;

fn is_far_on(record: LeafRecord, between: vec3f) -> bool {
  let texels = abs(vec2f(dot(record.texel_u.xyz, between), dot(record.texel_v.xyz, between)));
  // Where the whole patch is small, its size says nothing of its light.
  let split = select(vec2f(0.0), texels, (vec2u(record.split) & vec2u(1u, 2u)) != vec2u(0u));
  return max(split.x, split.y) > MAX_SPACING * frame.tolerance * f32(SIDE - 1u);
}

// What a grid holds of the surface at a point.
fn spaced_surface_id(surface_id: u32, pixel: vec2u, position: vec3f, normal: vec3f, leaf: u32) -> f32 {
  let id = f32(surface_id);
  if branch_value(frame.step, pixel.x) == 1u { return id; }
  let record = leaf_record(leaf);
  if record.split == 0u { return id; }
  let steps = steps_on_plane(pixel, frame.step, position, normal);
  return grid_surface_id(surface_id, vec2<bool>(is_far_on(record, steps[0]), is_far_on(record, steps[1])));
}
