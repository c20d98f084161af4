// What the first samples of pixels give a further one. A pass that uses it binds `first_light` and `first_second`, and
// what `lib/samples.wgsl` wants.

struct Blend { light: vec3f, second: vec4f, weight: f32 }

// A pixel's first sample.
struct First { light: vec4f, second: vec4f }

const NOWHERE = -1.0; // in place of a key

fn first_at(at: vec2i) -> First {
  let last = vec2i(last_point());
  let inside = all(at >= vec2i(0)) && all(at <= last);
  let place = vec2u(clamp(at, vec2i(0), last));
  var first = First(textureLoad(first_light, place, 0), vec4f(0.0));
  if SPECULAR { first.second = textureLoad(first_second, place, 0); }
  if !inside { first.light.w = NOWHERE; }
  return first;
}

// Adds a first sample to the blend if it lies on the surface.
fn add_first(blend: ptr<function, Blend>, first: First, key: u32, weight: f32) {
  if first.light.w != f32(key) { return; }
  (*blend).light += first.light.xyz * weight;
  if SPECULAR { (*blend).second += first.second * weight; }
  (*blend).weight += weight;
}

// Where this sample lies from its pixel's first one, which is the one next to the pixel's centre.
fn shift_of_sample() -> vec2f {
  let n = u32(sqrt(f32(frame.samples)) + 0.5);
  return frame.offset - (f32((n - 1u) / 2u) + 0.5) / f32(n);
}

fn side_of(shift: vec2f) -> vec2i {
  return vec2i(select(vec2f(-1.0), vec2f(1.0), shift >= vec2f(0.0)));
}

// Writes a sample, given its pixel's key and material; neighbours mostly share their paint. Where there is no surface it
// is black.
fn store_blend(at: vec2u, shown: vec2u, blend: Blend, paint: ptr<function, Paint>) {
  // Where there is no surface there may be no weight.
  let weight = max(blend.weight, 1e-6);
  let light = blend.light / weight;
  let second = blend.second / weight;
  if FINAL {
    while shown.y != (*paint).material { *paint = paint_of(shown.y); }
    let radiance = select(vec3f(0.0), radiance_of(*paint, light, second), shown.x != 0u);
    add_sample(at + vec2u(0u, frame.band.x), radiance);
  } else {
    textureStore(fine_light, at, select(vec4f(0.0), vec4f(light, f32(shown.x)), shown.x != 0u));
    if SPECULAR { textureStore(fine_second, at, second); }
  }
}
