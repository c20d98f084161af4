// Light maps: look-up. A pass that uses it binds `light_lists` and `light_maps`.

fn list_vector(at: u32) -> vec4f {
  return bitcast<vec4f>(vec4u(light_lists[at], light_lists[at + 1u], light_lists[at + 2u], light_lists[at + 3u]));
}

// The light map at a point, texel centres on the leaf's border.
fn mapped_irradiance(record: u32, position: vec3f) -> vec3f {
  let p = vec4f(position, 1.0);
  let at = clamp(vec2f(dot(p, list_vector(record + 1u)), dot(p, list_vector(record + 5u))), vec2f(0.0), vec2f(f32(SIDE - 1u)));
  let cell = min(vec2u(at), vec2u(SIDE - 2u));
  let f = at - vec2f(cell);
  let first = light_lists[record] + cell.y * SIDE + cell.x;
  return mix(mix(light_maps[first].xyz, light_maps[first + 1u].xyz, f.x),
    mix(light_maps[first + SIDE].xyz, light_maps[first + SIDE + 1u].xyz, f.x), f.y);
}
