// Occluders that block wherever they are.

@group(2) @binding(6) var<storage, read_write> set_ups: array<vec4u>; // four each

fn is_cut_out(part: MapPart, s: SetUp, triangle: u32, d: Directions) -> bool { return false; }

fn is_listed(part: MapPart, s: SetUp, at: u32) -> bool {
  if at >= MAP_LISTED { return false; }
  let to = part.first_set_up + 4u * at;
  set_ups[to] = vec4u(bitcast<vec3u>(s.a), u32(s.first.x) | (u32(s.end.x) << 16u));
  set_ups[to + 1u] = vec4u(bitcast<vec3u>(s.b), u32(s.first.y) | (u32(s.end.y) << 16u));
  set_ups[to + 2u] = vec4u(bitcast<vec3u>(s.c), 0u);
  set_ups[to + 3u] = vec4u(bitcast<vec3u>(s.n), 0u);
  return true;
}
