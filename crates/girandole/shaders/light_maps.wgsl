// Light maps (Barczak §4.3.2): for each leaf patch, the lights of its list that its map holds, without visibility. A workgroup adds
// to one leaf's map, and takes away, what changed of a batch of lights (Rust: scene::light_maps). Sums are integers in units of
// the map's own, so that no order and no history of changes matters.

@group(2) @binding(0) var<uniform> lights: array<Light, BATCH>;
@group(2) @binding(1) var<storage, read> light_lists: array<u32>;
@group(2) @binding(2) var<storage, read_write> light_maps: array<vec4f>;
@group(2) @binding(3) var<uniform> offsets: BufferOffsets;
@group(2) @binding(4) var<storage, read_write> sums: array<vec4i>;
@group(2) @binding(5) var<storage, read> updates: array<LightMapUpdate>;
@group(2) @binding(6) var<storage, read> changes: array<u32>; // indices in the batch, with TAKEN_AWAY

struct LightMapUpdate {
  leaf: u32,
  first: u32, // in `changes`
  end: u32,
  is_void: u32, // whether nothing counts of what the map holds
  units: f32, // of sums, in 1 W/m²
}

fn irradiance(light: Light, position: vec3f, normal: vec3f) -> vec3f {
  var to_light = light.position - position;
  if !ONLY_COSINE_LIGHTS && light.profile == DIRECTIONAL { to_light = -light.normal; }
  let cos_x = dot(normal, to_light);
  let cos_light = -dot(light.normal, to_light);
  let g = geometric_factor(light, cos_x, cos_light, dot(to_light, to_light));
  return light.intensity * select(0.0, g, min(cos_x, cos_light) > 0.0);
}

@compute @workgroup_size(32)
fn update_light_maps(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) lane: vec3u) {
  let index = group.y * GROUPS_PER_ROW + group.x;
  if index >= arrayLength(&updates) { return; }
  let update = updates[index];
  let record = leaf_record(update.leaf);
  for (var i = lane.x; i < SIDE * SIDE; i += 32u) {
    let at = vec2f(vec2u(i % SIDE, i / SIDE)) / f32(SIDE - 1u);
    let position = record.corner + record.across * at.x + record.up * at.y;
    let texel = record.light_map + i;
    var sum = vec3i(0);
    if update.is_void == 0u { sum = sums[texel].xyz; }
    for (var c = update.first; c < update.end; c++) {
      let light = lights[changes[c] & ~TAKEN_AWAY];
      let share = vec3i(round(irradiance(light, position, record.normal) * update.units));
      sum += select(share, -share, (changes[c] & TAKEN_AWAY) != 0u);
    }
    sums[texel] = vec4i(sum, 0);
    light_maps[texel] = vec4f(vec3f(sum) / update.units, 1.0);
  }
}
