// Multipass shading (Barczak §4.3.4): each draw sums a few lights at the points of an element's receivers; the blending
// unit adds it to what earlier draws left. A point is a primitive of its own.

@group(2) @binding(0) var ids: texture_2d<u32>;
@group(2) @binding(1) var atlas: texture_depth_2d_array;
@group(2) @binding(2) var<storage, read> lights: array<Light>;
@group(2) @binding(3) var<uniform> maps: Maps;
@group(2) @binding(4) var<storage, read> queue: array<u32>;
@group(2) @binding(5) var<uniform> plan: Plan;
// Four bits a leaf and light: the part of the lists that the light is in.
@group(2) @binding(6) var<storage, read> parts: array<u32>;
// See batch.wgsl.
@group(2) @binding(7) var<storage, read> members: array<u32>;
@group(2) @binding(8) var<uniform> draw: Draw;

// What one draw sums.
struct Draw {
  first_member: u32, // in `members`
  member_count: u32,
  count: u32, // lights
  lights_in_all: u32,
  lights: array<vec4u, 8>,
}

struct Out {
  @builtin(position) position: vec4f,
  @location(0) @interpolate(flat) index: u32,
  @location(1) @interpolate(flat) leaf: u32,
}

@vertex
fn place(@builtin(vertex_index) vertex: u32) -> Out {
  // The last member with no more chunks before it than this vertex has.
  let ordinal = vertex / CHUNK;
  var low = 0u;
  var high = draw.member_count;
  while high - low > 1u {
    let middle = (low + high) / 2u;
    if members[draw.first_member + 2u * middle + 1u] <= ordinal { low = middle; } else { high = middle; }
  }
  let member = draw.first_member + 2u * low;
  let leaf = members[member];
  let chunk = queue[FIRSTS + leaf] + ordinal - members[member + 1u];
  var out: Out;
  out.position = vec4f(0.0, 0.0, -1.0, 1.0);
  out.leaf = leaf;
  if vertex % CHUNK >= (queue[plan.chunks_at + chunk] >> 24u) { return out; }
  out.index = queue[plan.sorted_at + chunk * CHUNK + vertex % CHUNK];
  // The middle of the texel of this grid.
  let pixel = vec2u(out.index % frame.size.x, out.index / frame.size.x);
  let point = vec2f((pixel + frame.step - 1u) / frame.step) + 0.5;
  let size = vec2f(grid_size(frame.step));
  out.position = vec4f(point / size * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0), 0.5, 1.0);
  return out;
}

struct Sums { @location(0) irradiance: vec4f, @location(1) second: vec4f }

fn sum_light(state: ptr<function, State>, light: Light, part: u32) {
  if part == 1u || (part == 0u && plan.light_maps == 0u) {
    add(state, light, arriving(light, (*state).shading), 1.0);
    return;
  }
  let known = select(0.0, 1.0, part == 3u && plan.light_maps != 0u);
  let look = look_at(light, (*state).shading);
  if first_sum(state, light, look, 1u, known) != 0u { second_sum(state, light); }
}

@fragment
fn shade(in: Out) -> Sums {
  let pixel = vec2u(in.index % frame.size.x, in.index / frame.size.x + frame.band.x);
  var state: State;
  state.shading = shading_at(pixel, textureLoad(ids, pixel, 0).x - 1u);
  for (var i = 0u; i < draw.count; i++) {
    let light = draw.lights[i / 4u][i % 4u];
    let nibble = in.leaf * draw.lights_in_all + light;
    let part = (parts[nibble / 8u] >> (4u * (nibble % 8u))) & 15u;
    if part < 4u { sum_light(&state, lights[light], part); }
  }
  let is_direction = CURVED && state.shading.reflection.f90 <= 0.0;
  return Sums(vec4f(state.irradiance, 0.0), vec4f(select(state.glossy, state.toward, is_direction), 0.0));
}
