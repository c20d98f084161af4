// Light maps (Barczak §4.3.2): for each leaf patch, the lights of its list that its map holds, without visibility.

@group(2) @binding(0) var<uniform> lights: array<Light, 512>;
@group(2) @binding(1) var<storage, read> light_lists: array<u32>;
@group(2) @binding(2) var<storage, read_write> light_maps: array<vec4f>;
@group(2) @binding(3) var<uniform> offsets: BufferOffsets;

fn list_vector(at: u32) -> vec3f {
  return bitcast<vec3f>(vec3u(light_lists[at], light_lists[at + 1u], light_lists[at + 2u]));
}

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

// A group for each leaf.
@compute @workgroup_size(32)
fn bake_light_maps(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) lane: vec3u) {
  let leaf = group.y * 32768u + group.x;
  if leaf >= offsets.leaves { return; }
  let record = leaf * LEAF_WORDS;
  let map = light_lists[record];
  if map == NO_MAP { return; }
  let range = offsets.ranges_at + (leaf * offsets.batches + frame.batch) * RANGE;
  for (var i = lane.x; i < SIDE * SIDE; i += 32u) {
    let at = vec2f(vec2u(i % SIDE, i / SIDE)) / f32(SIDE - 1u);
    let position = list_vector(record + 9u) + list_vector(record + 12u) * at.x + list_vector(record + 15u) * at.y;
    let normal = list_vector(record + 18u);
    var sum = vec3f(0.0);
    if frame.batch > 0u { sum = light_maps[map + i].xyz; }
    sum += mapped_sum(light_lists[range], light_lists[range + 1u], position, normal);
    sum += mapped_sum(light_lists[range + 3u], light_lists[range + 4u], position, normal);
    light_maps[map + i] = vec4f(sum, 1.0);
  }
}
