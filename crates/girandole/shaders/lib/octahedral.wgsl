// core: math::octahedral.

// `q` has |x| + |y| + z = 1.
fn octahedral_encode(q: vec3f) -> vec2f {
  return vec2f(q.x + q.y, q.x - q.y) * 0.5 + 0.5;
}

// The direction of a point of the square, with |x| + |y| + z = 1.
fn octahedral_decode(uv: vec2f) -> vec3f {
  let s = uv * 2.0 - 1.0;
  let q = vec2f(s.x + s.y, s.x - s.y) * 0.5;
  return vec3f(q, 1.0 - abs(q.x) - abs(q.y));
}
