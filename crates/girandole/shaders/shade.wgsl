// Naive shading: every pixel of the band sums every light of the batch, each with its shadow map. Sums are kept in
// order of lights, in groups of GROUP, so the size of batches (whole groups) and bands changes nothing.
//
// Software adapters execute both sides of every branch; only loops jump. So the rare second look at a shadow map is
// put off to a loop of its own at the end of each group, and what a scene does not need is not compiled in.

override SPECULAR: bool; // whether any material has a specular lobe

@group(2) @binding(0) var ids: texture_2d<u32>;
@group(2) @binding(1) var atlas: texture_depth_2d_array;
// A batch of lights: uniform buffers are by far the quickest to read where neighbours read the same.
@group(2) @binding(2) var<uniform> lights: array<Light, 512>;
// Two elements a pixel: irradiance, specular radiance.
@group(2) @binding(3) var<storage, read_write> sums: array<vec4f>;
@group(2) @binding(4) var<uniform> maps: Maps;

const GROUP = 128u;

// What a pixel needs for every light.
struct Shading {
  position: vec3f,
  ng: vec3f, // geometric normal, on the side that is seen
  ns: vec3f, // shading normal
  wo: vec3f,
  reflection: Reflection,
}

// Light that would arrive if nothing stood in its way.
struct Arriving {
  g: f32, // geometric factor, 0 where the pair does not face each other
  to_light: vec3f, // m; of parallel light, a unit vector
  height: f32, // of the light over the receiver's plane
}

fn arriving(light: Light, s: Shading) -> Arriving {
  var to_light = light.position - s.position;
  if !PLAIN && light.profile == DIRECTIONAL { to_light = -light.normal; }
  let cos_x = dot(s.ns, to_light);
  let cos_light = -dot(light.normal, to_light);
  let height = dot(s.ng, to_light);
  let faces = min(min(cos_x, cos_light), height) > 0.0;
  let g = geometric_factor(light, cos_x, cos_light, dot(to_light, to_light));
  return Arriving(select(0.0, g, faces), to_light, height);
}

fn specular(light: Light, a: Arriving, s: Shading) -> vec3f {
  let r = s.reflection;
  return light.intensity * (a.g * specular_brdf(s.ns, s.wo, normalize(a.to_light), r.f0, r.f90, r.alpha));
}

// A pixel and its sums so far.
struct State {
  shading: Shading,
  irradiance: vec3f,
  glossy: vec3f,
  doubtful: vec4u, // lights of the group that want a second look, a bit each
  is_surface: bool,
}

fn begin(pixel: vec2u) -> State {
  var state: State;
  let inside = pixel.x < frame.size.x && pixel.y < frame.band.y;
  let id = select(0u, textureLoad(ids, min(pixel, frame.size - 1u), 0).x, inside);
  state.is_surface = id > 0u;
  if !state.is_surface { return state; }
  if frame.first_light > 0u {
    let index = 2u * band_index(pixel);
    state.irradiance = sums[index].xyz;
    state.glossy = sums[index + 1u].xyz;
  }
  var hit = hit_at(pixel, id - 1u);
  let m = materials[triangles[hit.triangle].material];
  if has_textures(m) { hit = with_coordinates(pixel, hit); }
  state.shading = Shading(hit.position, hit.geometric_normal, shading_normal(hit, m), hit.wo, Reflection());
  if SPECULAR { state.shading.reflection = reflection(hit, m); }
  return state;
}

fn end(pixel: vec2u, state: State) {
  if !state.is_surface { return; }
  let index = 2u * band_index(pixel);
  sums[index] = vec4f(state.irradiance, 0.0);
  sums[index + 1u] = vec4f(state.glossy, 0.0);
}

fn add(state: ptr<function, State>, light: Light, a: Arriving, seen: f32) {
  (*state).irradiance += light.intensity * (a.g * seen);
  if SPECULAR {
    if (*state).shading.reflection.f90 > 0.0 && a.g * seen > 0.0 {
      (*state).glossy += specular(light, a, (*state).shading) * seen;
    }
  }
}

// Adds a light with what its map says at first look; the bit of one that wants a second look.
fn first_sum(state: ptr<function, State>, light: Light, bit: u32) -> u32 {
  let a = arriving(light, (*state).shading);
  let r = receiver(light, (*state).shading.position, (*state).shading.ng, a.height);
  if FILTER > 0u {
    if a.g > 0.0 { add(state, light, a, filtered(light, r)); }
    return 0u;
  }
  let texel = texel_of(light, r.uv);
  let look = first_look(light, r, texel, stored_at(light, texel));
  add(state, light, a, select(0.0, 1.0, look == LIT));
  return select(0u, bit, look == DOUBTFUL && a.g > 0.0);
}

fn second_sum(state: ptr<function, State>, first: u32) {
  while any((*state).doubtful != vec4u(0u)) {
    let d = (*state).doubtful;
    let word = select(select(select(3u, 2u, d.z != 0u), 1u, d.y != 0u), 0u, d.x != 0u);
    let bits = d[word];
    (*state).doubtful[word] = bits & (bits - 1u);
    let light = lights[first + 32u * word + firstTrailingBit(bits) - frame.first_light];
    let a = arriving(light, (*state).shading);
    let r = receiver(light, (*state).shading.position, (*state).shading.ng, a.height);
    let texel = texel_of(light, r.uv);
    add(state, light, a, select(0.0, 1.0, second_look(light, r, texel, stored_at(light, texel))));
  }
}

// An invocation shades two pixels, one above the other: lights are read once for both.
@compute @workgroup_size(8, 4)
fn main(@builtin(global_invocation_id) invocation: vec3u) {
  let upper_pixel = vec2u(invocation.x, 2u * invocation.y + frame.band.x);
  let lower_pixel = upper_pixel + vec2u(0u, 1u);
  var upper = begin(upper_pixel);
  var lower = begin(lower_pixel);
  if !upper.is_surface && !lower.is_surface { return; }
  for (var first = frame.first_light; first < frame.end_light; first += GROUP) {
    for (var word = 0u; word < 4u; word++) {
      let start = first + 32u * word;
      let end = min(start + 32u, frame.end_light);
      var upper_bits = 0u;
      var lower_bits = 0u;
      for (var i = start; i < end; i++) {
        let light = lights[i - frame.first_light];
        let bit = 1u << (i - start);
        upper_bits |= first_sum(&upper, light, bit);
        lower_bits |= first_sum(&lower, light, bit);
      }
      upper.doubtful[word] = upper_bits;
      lower.doubtful[word] = lower_bits;
    }
    second_sum(&upper, first);
    second_sum(&lower, first);
  }
  end(upper_pixel, upper);
  end(lower_pixel, lower);
}
