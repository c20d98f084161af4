// The texels of the parts beside the maps: the nearest of what covers each, as the bits of its depth. A maximum is the same in
// whatever order.

@group(2) @binding(4) var<storage, read_write> nearest: array<atomic<u32>>;

fn add(part: MapPart, s: SetUp, triangle: u32, x: i32, y: i32) {
  let d = directions(part, x, y);
  if !is_cut_out(part, s, triangle, d) {
    atomicMax(&nearest[texel_of(part, vec2u(vec2i(x, y)))], depth_bits(s.n, d).x);
  }
}

// Which of four texels in a row a triangle covers, as bits.
fn covered_bits(part: MapPart, s: SetUp, x: i32, y: i32) -> u32 {
  let bits = select(vec4u(0u), vec4u(1u, 2u, 4u, 8u), covers(s, directions(part, x, y), x, y));
  return bits.x | bits.y | bits.z | bits.w;
}
