// Light maps (Barczak §4.3.2): for each leaf patch, the lights of its list that its map holds, without visibility. A workgroup adds
// to one leaf's map, and takes away, what changed of a batch of lights (Rust: gpu_scene::light_maps). Sums are integers of 64 bits in
// units of the map's own, so that no order and no history of changes matters.

@group(2) @binding(0) var<uniform> lights: array<Light, BATCH>;
@group(2) @binding(1) var<storage, read> light_lists: array<u32>;
@group(2) @binding(2) var<storage, read_write> light_maps: array<vec4f>;
@group(2) @binding(3) var<uniform> offsets: BufferOffsets;
@group(2) @binding(4) var<storage, read_write> sums: array<array<u32, 6>>; // low words of three channels, then high ones
@group(2) @binding(5) var<storage, read> updates: array<LightMapUpdate>;
@group(2) @binding(6) var<storage, read> changes: array<u32>; // indices in the batch, two a word

struct LightMapUpdate {
  leaf: u32,
  first: u32, // among the indices in `changes`
  end: u32,
  kind: u32, // ADDS, TAKES_AWAY, or REPLACES what the map holds
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
const MAP_LANES = SIDE * SIDE / 3u;

// Once rounded, no operation loses a bit.
fn in_units(irradiance: vec3f, units: f32) -> Share {
  let rounded = round(irradiance * units);
  let high = floor(rounded / WORD);
  return Share(vec3u(rounded - high * WORD), vec3u(high));
}

fn plus(a: Share, b: Share) -> Share {
  let low = a.low + b.low;
  return Share(low, a.high + b.high + vec3u(low < b.low));
}

fn minus(a: Share, b: Share) -> Share {
  return Share(a.low - b.low, a.high - b.high - vec3u(a.low < b.low));
}

fn texel_position(record: LeafRecord, i: u32) -> vec3f {
  let at = vec2f(vec2u(i % SIDE, i / SIDE)) / f32(SIDE - 1u);
  return record.corner + record.across * at.x + record.up * at.y;
}

fn store(update: LightMapUpdate, texel: u32, change: Share) {
  var sum = change;
  if update.kind != REPLACES {
    let held = sums[texel];
    let before = Share(vec3u(held[0], held[1], held[2]), vec3u(held[3], held[4], held[5]));
    if update.kind == TAKES_AWAY { sum = minus(before, change); } else { sum = plus(before, change); }
  }
  sums[texel] = array<u32, 6>(sum.low.x, sum.low.y, sum.low.z, sum.high.x, sum.high.y, sum.high.z);
  light_maps[texel] = vec4f((vec3f(sum.high) * WORD + vec3f(sum.low)) / update.units, 1.0);
}

// Each lane has three texels of the map, for one load of a light.
@compute @workgroup_size(MAP_LANES)
fn update_light_maps(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) lane: vec3u) {
  let index = group.y * GROUPS_PER_ROW + group.x;
  if index >= arrayLength(&updates) { return; }
  let update = updates[index];
  let record = leaf_record(update.leaf);
  let texels = lane.x + vec3u(0u, MAP_LANES, 2u * MAP_LANES);
  let positions = array<vec3f, 3>(
    texel_position(record, texels.x), texel_position(record, texels.y), texel_position(record, texels.z));
  let nothing = Share(vec3u(0u), vec3u(0u));
  var a = nothing;
  var b = nothing;
  var c = nothing;
  for (var i = update.first; i < update.end; i++) {
    let light = lights[changes[i / 2u] >> (i % 2u * 16u) & 0xffffu];
    a = plus(a, in_units(irradiance(light, positions[0], record.normal), update.units));
    b = plus(b, in_units(irradiance(light, positions[1], record.normal), update.units));
    c = plus(c, in_units(irradiance(light, positions[2], record.normal), update.units));
  }
  store(update, record.light_map + texels.x, a);
  store(update, record.light_map + texels.y, b);
  store(update, record.light_map + texels.z, c);
}
