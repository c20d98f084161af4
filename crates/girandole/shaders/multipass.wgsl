// Multipass shading (Barczak §4.3.4): each pass sums a few lights at the points of an element's receivers; the blending
// unit adds it to what earlier passes left. A point is a primitive of its own.

@group(2) @binding(0) var triangle_ids: texture_2d<u32>;
@group(2) @binding(2) var<storage, read> lights: array<Light>;
@group(2) @binding(3) var<uniform> maps: Maps;
@group(2) @binding(4) var<storage, read> point_queue: array<u32>;
@group(2) @binding(5) var<uniform> offsets: BufferOffsets;
// Four bits a leaf and light: the part of the light_lists that the light is in.
@group(2) @binding(6) var<storage, read> parts: array<u32>;
@group(2) @binding(7) var<storage, read> elements: array<u32>; // see lib/elements.wgsl
@group(2) @binding(8) var<uniform> multipass: MultipassParams;

struct Out {
  @builtin(position) position: vec4f,
  @location(0) @interpolate(flat) index: u32,
  @location(1) @interpolate(flat) leaf: u32,
  @location(2) @interpolate(flat) lights: vec2u, // where they are in `elements`, and how many
}

// The last of `count` entries, `stride` words apart, with no more than `value` in its word.
fn last_below(first: u32, stride: u32, count: u32, value: u32) -> u32 {
  var low = 0u;
  var high = count;
  while high - low > 1u {
    let middle = (low + high) / 2u;
    if elements[first + stride * middle] <= value { low = middle; } else { high = middle; }
  }
  return low;
}

// One draw holds all passes of all elements, one after another; each vertex is a point of one pass.
@vertex
fn project_point(@builtin(vertex_index) vertex: u32) -> Out {
  let element = ELEMENT_WORDS * last_below(5u, ELEMENT_WORDS, multipass.elements, vertex);
  let in_element = vertex - elements[element + 5u];
  let in_a_pass = max(elements[element + 4u], 1u);
  let pass_ = in_element / in_a_pass;
  let in_pass = in_element % in_a_pass;
  // The last member with no more chunks before it than this vertex has.
  let first = elements[element];
  let member = first + 2u * last_below(first + 1u, 2u, elements[element + 1u], in_pass / CHUNK);
  let leaf = elements[member];
  let chunk = point_queue[FIRSTS + leaf] + in_pass / CHUNK - elements[member + 1u];
  var out: Out;
  out.position = vec4f(0.0, 0.0, -1.0, 1.0);
  out.leaf = leaf;
  let skipped = pass_ * multipass.lights_per_pass;
  out.lights = vec2u(elements[element + 2u] + skipped, min(elements[element + 3u] - skipped, multipass.lights_per_pass));
  if in_pass % CHUNK >= (point_queue[offsets.chunks_at + chunk] >> 24u) { return out; }
  out.index = point_queue[offsets.sorted_at + chunk * CHUNK + in_pass % CHUNK];
  // The middle of the texel of this grid.
  let pixel = vec2u(out.index % frame.size.x, out.index / frame.size.x);
  let point = vec2f((pixel + frame.step - 1u) / frame.step) + 0.5;
  let size = vec2f(grid_size(frame.step));
  out.position = vec4f(point / size * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0), 0.5, 1.0);
  return out;
}

struct Sums { @location(0) irradiance: vec4f, @location(1) second: vec4f }

fn sum_light(state: ptr<function, PointSums>, light: Light, part: u32) {
  if part == 1u || (part == 0u && offsets.light_maps == 0u) {
    add(state, light, arriving(light, (*state).shading), 1.0);
    return;
  }
  let counted = select(0.0, 1.0, part == 3u && offsets.light_maps != 0u);
  let shadow_texel = shadow_texel_of(light, (*state).shading);
  if add_depth_tested(state, light, shadow_texel, shadow_lookup(shadow_texel), 1u, counted) != 0u { add_slope_corrected(state, light); }
}

@fragment
fn sum_lights(in: Out) -> Sums {
  let pixel = vec2u(in.index % frame.size.x, in.index / frame.size.x + frame.band.x);
  var state: PointSums;
  state.shading = shading_at(pixel, textureLoad(triangle_ids, pixel, 0).x - 1u);
  for (var i = 0u; i < in.lights.y; i++) {
    let light = elements[in.lights.x + i];
    let nibble = in.leaf * multipass.lights_in_all + light;
    let part = (parts[nibble / 8u] >> (4u * (nibble % 8u))) & 15u;
    if part < 4u { sum_light(&state, lights[light], part); }
  }
  let is_direction = HAS_CURVED && state.shading.reflection.f90 <= 0.0;
  return Sums(vec4f(state.irradiance, 0.0), vec4f(select(state.specular, state.light_direction, is_direction), 0.0));
}
