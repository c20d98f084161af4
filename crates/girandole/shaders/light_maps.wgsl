// Light maps (Barczak §4.3.2): for each leaf patch, the lights of its list that its map holds, without visibility. A workgroup adds
// to one leaf's map, and takes away, what changed of a batch of lights (Rust: scene::light_maps). Sums are integers of 64 bits in
// units of the map's own, so that no order and no history of changes matters.

@group(2) @binding(0) var<uniform> lights: array<Light, BATCH>;
@group(2) @binding(1) var<storage, read> light_lists: array<u32>;
@group(2) @binding(2) var<storage, read_write> light_maps: array<vec4f>;
@group(2) @binding(3) var<uniform> offsets: BufferOffsets;
@group(2) @binding(4) var<storage, read_write> sums: array<array<u32, 6>>; // low words of three channels, then high ones
@group(2) @binding(5) var<storage, read> updates: array<LightMapUpdate>;
@group(2) @binding(6) var<storage, read> changes: array<u32>; // indices in the batch; all of an update have TAKEN_AWAY, or none

struct LightMapUpdate {
  leaf: u32,
  first: u32, // in `changes`
  end: u32,
  is_void: u32, // whether nothing counts of what the map holds
  units: f32, // of sums, in 1 W/m²
}

fn irradiance(light: Light, position: vec3f, normal: vec3f) -> vec3f {
  var to_light = light.position - position;
  if !ONLY_COSINE_LIGHTS && light.profile >= DIRECTIONAL { to_light = -light.normal; }
  let cos_x = dot(normal, to_light);
  let cos_light = -dot(light.normal, to_light);
  let r2 = dot(to_light, to_light);
  let g = geometric_factor(light, cos_x, sent_along(light, to_light, cos_light, r2), r2);
  return light.intensity * select(0.0, g, min(cos_x, cos_light) > 0.0);
}

// Integers of 64 bits.
struct Share {
  low: vec3u,
  high: vec3u,
}

const WORD = 4294967296.0;

// Once rounded, no operation loses a bit.
fn in_units(irradiance: vec3f, units: f32) -> Share {
  let rounded = round(irradiance * units);
  let high = floor(rounded / WORD);
  return Share(vec3u(rounded - high * WORD), vec3u(high));
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
    var low = vec3u(0u);
    var high = vec3u(0u);
    for (var c = update.first; c < update.end; c++) {
      let light = lights[changes[c] & ~TAKEN_AWAY];
      let share = in_units(irradiance(light, position, record.normal), update.units);
      low += share.low;
      high += share.high + vec3u(low < share.low);
    }
    if update.is_void == 0u {
      let held = sums[texel];
      let held_low = vec3u(held[0], held[1], held[2]);
      let held_high = vec3u(held[3], held[4], held[5]);
      if (changes[update.first] & TAKEN_AWAY) != 0u {
        high = held_high - high - vec3u(held_low < low);
        low = held_low - low;
      } else {
        low += held_low;
        high += held_high + vec3u(low < held_low);
      }
    }
    sums[texel] = array<u32, 6>(low.x, low.y, low.z, high.x, high.y, high.z);
    light_maps[texel] = vec4f((vec3f(high) * WORD + vec3f(low)) / update.units, 1.0);
  }
}
