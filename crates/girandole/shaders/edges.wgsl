// Further samples of a pixel: what they receive is interpolated between the first samples of this pixel and of its
// neighbours on their side, those that lie on the same surface. Only where none does, at the edges of geometry, a sample
// is shaded by itself.

@group(2) @binding(0) var ids: texture_2d<u32>;
@group(2) @binding(1) var<storage, read> receivers: array<u32>;
@group(2) @binding(2) var<storage, read_write> wanted: array<atomic<u32>>; // how many points, points of each leaf, points
@group(2) @binding(3) var<uniform> plan: Plan;
@group(2) @binding(4) var keys: texture_2d<u32>;
// The first sample's: irradiance and key; specular radiance, or the direction of light.
@group(2) @binding(5) var first_light: texture_2d<f32>;
@group(2) @binding(6) var first_second: texture_2d<f32>;
// This sample's; with FINAL the picture.
@group(2) @binding(7) var fine_light: texture_storage_2d<rgba32float, write>;
@group(2) @binding(8) var fine_second: texture_storage_2d<rgba32float, write>;
@group(2) @binding(9) var<storage, read_write> sums: array<vec4f>;

override SPECULAR: bool = false;

struct Blend { light: vec3f, second: vec4f, weight: f32 }

// Adds the first sample of a pixel to the blend if it lies on the surface.
fn add_first(blend: ptr<function, Blend>, at: vec2i, key: u32, weight: f32) {
  if any(at < vec2i(0)) || any(at > vec2i(last_point())) { return; }
  let light = textureLoad(first_light, vec2u(at), 0);
  if u32(light.w) != key { return; }
  (*blend).light += light.xyz * weight;
  if SPECULAR { (*blend).second += textureLoad(first_second, vec2u(at), 0) * weight; }
  (*blend).weight += weight;
}

// Along rows, so that stores fill whole pages.
@compute @workgroup_size(64, 1)
fn main(@builtin(global_invocation_id) invocation: vec3u) {
  let at = invocation.xy;
  if any(at > last_point()) { return; }
  let pixel = at + vec2u(0u, frame.band.x);
  // The row below the band is the next band's.
  if FINAL && pixel.y >= frame.band.y { return; }
  let shown = textureLoad(keys, pixel, 0).xy;
  let key = shown.x;
  if key == 0u {
    if FINAL { add_sample(pixel, vec4f(0.0)); } else { textureStore(fine_light, at, vec4f(0.0)); }
    return;
  }
  // Where this sample lies from its pixel's first one, which is the one next to the pixel's centre.
  let n = u32(sqrt(f32(frame.samples)) + 0.5);
  let shift = frame.offset - (f32((n - 1u) / 2u) + 0.5) / f32(n);
  let side = vec2i(select(vec2f(-1.0), vec2f(1.0), shift >= vec2f(0.0)));
  let t = abs(shift);
  let here = vec2i(at);
  var blend: Blend;
  add_first(&blend, here, key, (1.0 - t.x) * (1.0 - t.y));
  add_first(&blend, here + vec2i(side.x, 0), key, t.x * (1.0 - t.y));
  add_first(&blend, here + vec2i(0, side.y), key, (1.0 - t.x) * t.y);
  add_first(&blend, here + side, key, t.x * t.y);
  // At an edge, one of the other neighbours may have seen the surface.
  for (var i = 0u; i < 5u && blend.weight <= 0.0; i++) { add_first(&blend, here + BEHIND[i] * side, key, 1.0); }
  if blend.weight > 0.0 && (key & SHINY) == 0u {
    let light = blend.light / blend.weight;
    let second = blend.second / blend.weight;
    if FINAL {
      add_sample(pixel, radiance_of(paint_of(shown.y), light, second));
    } else {
      textureStore(fine_light, at, vec4f(light, f32(key)));
      if SPECULAR { textureStore(fine_second, at, second); }
    }
  } else {
    want(at);
  }
}

// Steps to the neighbours on the other sides, the nearest first.
const BEHIND = array<vec2i, 5>(vec2i(-1, 0), vec2i(0, -1), vec2i(1, -1), vec2i(-1, 1), vec2i(-1, -1));
