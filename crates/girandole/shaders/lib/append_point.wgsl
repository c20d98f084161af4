// Puts a point on the list of those to shade. A pass that uses it binds `shade_list`.

// `at` is relative to the band.
fn append_point(at: vec2u) {
  let pixel = at + vec2u(0u, frame.band.x);
  let leaf = leaf_of(pixel, textureLoad(triangle_ids, pixel, 0).x);
  let slot = offsets.points_at + POINT_WORDS * atomicAdd(&shade_list[0], 1u);
  atomicStore(&shade_list[slot], at.y * frame.size.x + at.x);
  atomicStore(&shade_list[slot + 1u], leaf);
  atomicStore(&shade_list[slot + 2u], atomicAdd(&shade_list[COUNTS + leaf], 1u));
}
