// Where a direction lies in maps of the environment, in [0, 1] from the left and from the top.

const TAU = 6.28318530717959;

fn place_of(direction: vec3f) -> vec2f {
  let d = in_map(direction);
  let u = atan2(d.x, -d.z) / TAU + 0.5;
  return vec2f(u - floor(u), acos(clamp(d.y, -1.0, 1.0)) * 2.0 / TAU);
}

// A direction as maps have it.
fn in_map(direction: vec3f) -> vec3f {
  let c = cos(frame.environment.y);
  let s = sin(frame.environment.y);
  return vec3f(direction.x * c - direction.z * s, direction.y, direction.x * s + direction.z * c);
}
