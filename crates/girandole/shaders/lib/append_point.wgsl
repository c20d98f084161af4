// Appends a point to the list of those to shade. A pass that uses it binds `shade_list`.

// `at` is relative to the band.
fn append_point(at: vec2u) {
  let pixel = at + vec2u(0u, frame.band.x);
  let leaf = leaf_of(pixel, textureLoad(triangle_ids, pixel, 0).x);
  let rank = atomicAdd(&shade_list.words[leaf], 1u);
  let slot = offsets.points_at + SHADE_POINT_WORDS * atomicAdd(&shade_list.points, 1u);
  set_shade_point(slot, ShadePoint(at.y * frame.size.x + at.x, leaf, rank));
}
