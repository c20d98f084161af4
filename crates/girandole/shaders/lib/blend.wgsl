// What the first samples of pixels give a further one. A pass that uses it binds `first_light` and `first_second`, and
// what `lib/samples.wgsl` wants.

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

// Where this sample lies from its pixel's first one, which is the one next to the pixel's centre.
fn shift_of_sample() -> vec2f {
  let n = u32(sqrt(f32(frame.samples)) + 0.5);
  return frame.offset - (f32((n - 1u) / 2u) + 0.5) / f32(n);
}

fn side_of(shift: vec2f) -> vec2i {
  return vec2i(select(vec2f(-1.0), vec2f(1.0), shift >= vec2f(0.0)));
}

// Writes a sample, given its pixel's key and material.
fn store_blend(at: vec2u, shown: vec2u, blend: Blend) {
  let light = blend.light / blend.weight;
  let second = blend.second / blend.weight;
  if FINAL {
    add_sample(at + vec2u(0u, frame.band.x), radiance_of(paint_of(shown.y), light, second));
  } else {
    textureStore(fine_light, at, vec4f(light, f32(shown.x)));
    if SPECULAR { textureStore(fine_second, at, second); }
  }
}
