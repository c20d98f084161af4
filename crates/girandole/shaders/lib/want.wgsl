// Puts a point on the list of those to shade. A pass that uses it binds `wanted`.

// `at` is relative to the band.
fn want(at: vec2u) {
  let pixel = at + vec2u(0u, frame.band.x);
  let leaf = leaf_of(pixel, textureLoad(ids, pixel, 0).x);
  let slot = plan.points_at + POINT_WORDS * atomicAdd(&wanted[0], 1u);
  atomicStore(&wanted[slot], at.y * frame.size.x + at.x);
  atomicStore(&wanted[slot + 1u], leaf);
  atomicStore(&wanted[slot + 2u], atomicAdd(&wanted[COUNTS + leaf], 1u));
}
