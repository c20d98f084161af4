// Light maps (Barczak §4.3.2): for each leaf patch, the lights of its list that its map holds, without visibility.

@group(2) @binding(0) var<uniform> lights: array<Light, BATCH>;
@group(2) @binding(1) var<storage, read> light_lists: array<u32>;
@group(2) @binding(2) var<storage, read_write> light_maps: array<vec4f>;
@group(2) @binding(3) var<uniform> offsets: BufferOffsets;

fn mapped_sum(first: u32, end: u32, position: vec3f, normal: vec3f) -> vec3f {
  var sum = vec3f(0.0);
  for (var i = first; i < end; i++) {
    let light = lights[light_lists[i]];
    var to_light = light.position - position;
    if !ONLY_COSINE_LIGHTS && light.profile == DIRECTIONAL { to_light = -light.normal; }
    let cos_x = dot(normal, to_light);
    let cos_light = -dot(light.normal, to_light);
    let g = geometric_factor(light, cos_x, cos_light, dot(to_light, to_light));
    sum += light.intensity * select(0.0, g, min(cos_x, cos_light) > 0.0);
  }
  return sum;
}

// A workgroup a leaf.
@compute @workgroup_size(32)
fn bake_light_maps(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) lane: vec3u) {
  let leaf = group.y * GROUPS_PER_ROW + group.x;
  if leaf >= offsets.leaves || !has_light_map(leaf) { return; }
  let record = leaf_record(leaf);
  let range = leaf_range(leaf);
  for (var i = lane.x; i < SIDE * SIDE; i += 32u) {
    let at = vec2f(vec2u(i % SIDE, i / SIDE)) / f32(SIDE - 1u);
    let position = record.corner + record.across * at.x + record.up * at.y;
    let texel = record.light_map + i;
    var sum = vec3f(0.0);
    if frame.batch > 0u { sum = light_maps[texel].xyz; }
    sum += mapped_sum(range.mapped_unshadowed, range.unshadowed, position, record.normal);
    sum += mapped_sum(range.mapped_shadowed, range.end, position, record.normal);
    light_maps[texel] = vec4f(sum, 1.0);
  }
}
