// The texels of the parts beside the maps: the nearest of what covers each, as the bits of its depth. A maximum is the same in
// whatever order.

@group(2) @binding(4) var<storage, read_write> nearest: array<atomic<u32>>;

fn add(part: MapPart, s: SetUp, triangle: u32, x: i32, y: i32) {
  let d = directions(part, x, y);
  if !is_cut_out(part, s, triangle, d) {
    atomicMax(&nearest[texel_of(part, vec2u(vec2i(x, y)))], depth_bits(s.n, d).x);
  }
}
