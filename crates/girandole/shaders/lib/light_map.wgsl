// Light maps: look-up. A pass that uses it binds `light_maps`, and what lib/light_lists.wgsl needs.

// The light map at a point, texel centres on the leaf's border.
fn mapped_irradiance(leaf: u32, position: vec3f) -> vec3f {
  let record = leaf_record(leaf);
  let p = vec4f(position, 1.0);
  let at = clamp(vec2f(dot(p, record.texel_u), dot(p, record.texel_v)), vec2f(0.0), vec2f(f32(SIDE - 1u)));
  let cell = min(vec2u(at), vec2u(SIDE - 2u));
  let f = at - vec2f(cell);
  let first = record.light_map + cell.y * SIDE + cell.x;
  return mix(mix(light_maps[first].xyz, light_maps[first + 1u].xyz, f.x),
    mix(light_maps[first + SIDE].xyz, light_maps[first + SIDE + 1u].xyz, f.x), f.y);
}
