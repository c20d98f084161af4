// The parameterisations of a hemisphere: light space to the map's square and back. In each, `1 / norm(p)` is what the
// map stores (times NEAR), and `decode` returns the direction of norm 1, so `p = norm(p) · decode(uv)`.

override PARAMETERISATION: u32; // OCTAHEDRAL, PARABOLIC or CUBE
override NEAR: f32; // metres; only a unit: depth is NEAR / norm

fn norm(p: vec3f) -> f32 {
  if PARAMETERISATION == PARABOLIC { return length(p); }
  if PARAMETERISATION == CUBE { return max(p.z, max(abs(p.x), abs(p.y))); }
  return abs(p.x) + abs(p.y) + p.z;
}

// `p` has norm 1.
fn encode(p: vec3f) -> vec2f {
  if PARAMETERISATION == PARABOLIC { return p.xy / (1.0 + p.z) * 0.5 + 0.5; }
  if PARAMETERISATION == CUBE { return cube_encode(p); }
  return octahedral_encode(p);
}

fn decode(uv: vec2f) -> vec3f {
  if PARAMETERISATION == PARABOLIC {
    let q = uv * 2.0 - 1.0;
    return vec3f(2.0 * q, 1.0 - dot(q, q)) / (1.0 + dot(q, q));
  }
  if PARAMETERISATION == CUBE { return cube_decode(uv); }
  return octahedral_decode(uv);
}

// Half a cube unfolded to a cross: the top face is the middle quarter, the four half sides lie around it.
fn cube_encode(p: vec3f) -> vec2f {
  let a = abs(p);
  if p.z >= max(a.x, a.y) { return 0.5 + 0.25 * p.xy; }
  if a.x >= a.y { return vec2f(0.5 + sign(p.x) * (0.5 - 0.25 * p.z), 0.5 + 0.25 * p.y); }
  return vec2f(0.5 + 0.25 * p.x, 0.5 + sign(p.y) * (0.5 - 0.25 * p.z));
}

fn cube_decode(uv: vec2f) -> vec3f {
  let c = (uv - 0.5) * 4.0; // top face: within ±1; sides reach to ±2
  let a = abs(c);
  if max(a.x, a.y) <= 1.0 { return vec3f(c, 1.0); }
  if a.x >= a.y { return vec3f(sign(c.x), c.y, 2.0 - a.x); }
  return vec3f(c.x, sign(c.y), 2.0 - a.y);
}

// Whether a point of the square belongs to the map at all.
fn is_mapped(uv: vec2f) -> bool {
  if PARAMETERISATION == PARABOLIC { return dot(uv * 2.0 - 1.0, uv * 2.0 - 1.0) <= 1.0; }
  if PARAMETERISATION == CUBE { return min(abs(uv.x - 0.5), abs(uv.y - 0.5)) <= 0.25; }
  return true;
}
