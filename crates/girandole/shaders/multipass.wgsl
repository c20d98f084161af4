// Multipass shading (Barczak §4.3.4): each pass sums a few lights at the points of an element's receivers; the blending
// unit adds it to the sums of earlier passes. A point is a primitive of its own.

@group(2) @binding(0) var triangle_ids: texture_2d<u32>;
@group(2) @binding(2) var<storage, read> lights: array<Light>;
@group(2) @binding(3) var<uniform> maps: Maps;
@group(2) @binding(4) var<storage, read> point_queue: PointQueue;
@group(2) @binding(5) var<uniform> offsets: BufferOffsets;
// Four bits a leaf and light: the part of the leaf's list that the light is in.
@group(2) @binding(6) var<storage, read> parts: array<u32>;
@group(2) @binding(7) var<storage, read> elements: array<u32>; // see lib/multipass_params.wgsl
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
  let element = element_at(ELEMENT_WORDS * last_below(ELEMENT_FIRST_VERTEX, ELEMENT_WORDS, multipass.elements, vertex));
  let in_element = vertex - element.first_vertex;
  let vertices_per_pass = max(element.vertices, 1u);
  let pass_index = in_element / vertices_per_pass;
  let in_pass = in_element % vertices_per_pass;
  // The last member with no more chunks before it than this vertex has.
  let before = element.members_at + MEMBER_CHUNKS_BEFORE;
  let member_index = last_below(before, MEMBER_WORDS, element.member_count, in_pass / CHUNK);
  let member = member_at(element.members_at + MEMBER_WORDS * member_index);
  let leaf = member.leaf;
  let chunk = point_queue.words[leaf] + in_pass / CHUNK - member.chunks_before;
  var out: Out;
  out.position = vec4f(0.0, 0.0, -1.0, 1.0);
  out.leaf = leaf;
  let skipped = pass_index * multipass.lights_per_pass;
  out.lights = vec2u(element.lights_at + skipped, min(element.light_count - skipped, multipass.lights_per_pass));
  if in_pass % CHUNK >= chunk_points(point_queue.words[offsets.chunks_at + chunk]) { return out; }
  out.index = point_queue.words[offsets.sorted_at + chunk * CHUNK + in_pass % CHUNK];
  // The middle of the texel of this grid.
  let pixel = vec2u(out.index % frame.size.x, out.index / frame.size.x);
  let point = vec2f((pixel + frame.step - 1u) / frame.step) + 0.5;
  let size = vec2f(grid_size(frame.step));
  out.position = vec4f(point / size * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0), 0.5, 1.0);
  return out;
}

struct Sums { @location(0) irradiance: vec4f, @location(1) directional: vec4f }

fn part_of(leaf: u32, light: u32) -> u32 {
  let nibble = leaf * multipass.lights_in_all + light;
  return (parts[nibble / 8u] >> (4u * (nibble % 8u))) & 15u;
}

fn sum_light(sums: ptr<function, PointSums>, light: Light, part: u32) {
  if part == UNSHADOWED || (part == MAPPED_UNSHADOWED && offsets.light_maps == 0u) {
    add(sums, light, arriving(light, (*sums).shading), 1.0);
    return;
  }
  let counted = select(0.0, 1.0, part == MAPPED_SHADOWED && offsets.light_maps != 0u);
  let texel = shadow_texel_of(light, (*sums).shading);
  if add_depth_tested(sums, light, texel, shadow_lookup(texel), 1u, counted) != 0u { add_slope_corrected(sums, light); }
}

@fragment
fn sum_lights(in: Out) -> Sums {
  let pixel = vec2u(in.index % frame.size.x, in.index / frame.size.x + frame.band.x);
  var sums: PointSums;
  sums.shading = shading_at(pixel, textureLoad(triangle_ids, pixel, 0).x - 1u);
  for (var first = in.lights.x; first < in.lights.x + in.lights.y; first += 32u) {
    let end = min(first + 32u, in.lights.x + in.lights.y);
    var near = 0u;
    for (var i = first; i < end; i++) {
      let part = part_of(in.leaf, elements[i]);
      let is_near = part >= NEAR_UNSHADOWED && part <= JOINTED;
      near |= select(0u, 1u << (i - first), is_near);
      if part < NO_PART && !is_near { sum_light(&sums, lights[elements[i]], part); }
    }
    while near != 0u {
      let light = elements[first + firstTrailingBit(near)];
      near &= near - 1u;
      let part = part_of(in.leaf, light);
      add_in_full(&sums, lights[light], part != NEAR_UNSHADOWED, part == JOINTED);
    }
  }
  let is_direction = HAS_CURVED && sums.shading.reflection.f90 <= 0.0;
  return Sums(vec4f(sums.irradiance, 0.0), vec4f(select(sums.specular, sums.light_direction, is_direction), sums.seen_weight));
}
