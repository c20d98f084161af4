// A direction in a word: octahedral, 16 bits each.

fn pack_direction(d: vec3f) -> u32 {
  let q = d / (abs(d.x) + abs(d.y) + abs(d.z));
  let folded = (1.0 - abs(q.yx)) * select(vec2f(-1.0), vec2f(1.0), q.xy >= vec2f(0.0));
  return pack2x16snorm(select(q.xy, folded, q.z < 0.0));
}

fn unpack_direction(word: u32) -> vec3f {
  let s = unpack2x16snorm(word);
  let z = 1.0 - abs(s.x) - abs(s.y);
  let below = max(-z, 0.0);
  return normalize(vec3f(s - select(vec2f(-below), vec2f(below), s >= vec2f(0.0)), z));
}
