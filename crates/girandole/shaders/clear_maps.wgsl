// Empties parts of the shadow maps of a page.
@group(2) @binding(1) var<uniform> maps: Maps;

@vertex
fn clear_maps(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> @builtin(position) vec4f {
  let part = parts[instance];
  let corner = vec2f(select(part.first, part.end, vec2<bool>((vertex & 1u) != 0u, (vertex & 2u) != 0u)));
  return vec4f(vec2f(2.0, -2.0) * corner / maps.page + vec2f(-1.0, 1.0), 0.0, 1.0);
}
