// Further samples of a pixel: what they receive is what the first sample of this pixel or of a neighbour received, if
// that lies on the same surface. Only where none does, at the edges of geometry, a sample is shaded by itself.

@group(2) @binding(0) var ids: texture_2d<u32>;
@group(2) @binding(1) var<storage, read> receivers: array<u32>;
@group(2) @binding(2) var<storage, read_write> wanted: array<atomic<u32>>; // how many points, points of each leaf, points
@group(2) @binding(3) var<uniform> plan: Plan;
@group(2) @binding(4) var keys: texture_2d<u32>;
// The first sample's: irradiance and key; specular radiance, or the direction of light.
@group(2) @binding(5) var first_light: texture_2d<f32>;
@group(2) @binding(6) var first_second: texture_2d<f32>;
@group(2) @binding(7) var sample_light: texture_storage_2d<rgba32float, write>;
@group(2) @binding(8) var sample_second: texture_storage_2d<rgba32float, write>;

override CURVED: bool = false;
override SPECULAR: bool = false;

// Steps to the neighbours, the nearest first, for a sample in the lower right of its pixel.
const NEAREST = array<vec2i, 8>(vec2i(1, 0), vec2i(0, 1), vec2i(1, 1), vec2i(-1, 0), vec2i(0, -1), vec2i(1, -1), vec2i(-1, 1), vec2i(-1, -1));

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) invocation: vec3u) {
  let at = invocation.xy;
  if any(at > last_point()) { return; }
  let key = textureLoad(keys, at + vec2u(0u, frame.band.x), 0).x;
  var light = textureLoad(first_light, at, 0);
  var source = at;
  if key == 0u {
    textureStore(sample_light, at, vec4f(0.0));
    return;
  }
  var found = u32(light.w) == key;
  if !found {
    // The nearest ones first: on the side to which this sample lies.
    let side = vec2i(select(vec2f(-1.0), vec2f(1.0), frame.offset > vec2f(0.5)));
    for (var i = 0u; i < 8u && !found; i++) {
      let neighbour = vec2i(at) + NEAREST[i] * side;
      if any(neighbour < vec2i(0)) || any(neighbour > vec2i(last_point())) { continue; }
      let other = textureLoad(first_light, vec2u(neighbour), 0);
      if u32(other.w) == key {
        light = other;
        source = vec2u(neighbour);
        found = true;
      }
    }
  }
  if found && (key & SHINY) == 0u {
    textureStore(sample_light, at, light);
    if CURVED || SPECULAR { textureStore(sample_second, at, textureLoad(first_second, source, 0)); }
  } else {
    want(at);
  }
}
