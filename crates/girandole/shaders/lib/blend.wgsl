// Interpolation of a further sample between the first samples of pixels. A pass that uses it binds `first_irradiance` and
// `first_directional`, and what `lib/samples.wgsl` needs.

override WRITES_RADIANCE: bool = false; // whether points are the picture's pixels, and their radiance is stored

struct Blend { irradiance: vec3f, directional: vec4f, weight: f32 }

// A pixel's first sample.
struct FirstSample { irradiance: vec4f, directional: vec4f }

const NO_SURFACE = -1.0; // beyond the picture, in place of a surface id

fn first_sample_at(at: vec2i) -> FirstSample {
  let last = vec2i(last_point());
  let inside = all(at >= vec2i(0)) && all(at <= last);
  let clamped = vec2u(clamp(at, vec2i(0), last));
  var first = FirstSample(textureLoad(first_irradiance, clamped, 0), vec4f(0.0));
  if HAS_SPECULAR { first.directional = textureLoad(first_directional, clamped, 0); }
  if !inside { first.irradiance.w = NO_SURFACE; }
  return first;
}

// Adds a first sample to the blend if it lies on the surface.
fn add_first_sample(blend: ptr<function, Blend>, first: FirstSample, surface_id: u32, weight: f32) {
  if first.irradiance.w != f32(surface_id) { return; }
  (*blend).irradiance += first.irradiance.xyz * weight;
  if HAS_SPECULAR { (*blend).directional += first.directional * weight; }
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

// Writes a sample, given its pixel's surface id and material; neighbours mostly share a material. Where there is no
// surface it is black.
fn store_blend(at: vec2u, surface: vec2u, blend: Blend, diffuse: ptr<function, DiffuseMaterial>) {
  // Where there is no surface there may be no weight.
  let weight = max(blend.weight, 1e-6);
  let irradiance = blend.irradiance / weight;
  let directional = blend.directional / weight;
  if WRITES_RADIANCE {
    if surface.y != (*diffuse).material { *diffuse = diffuse_material(surface.y); }
    let radiance = select(vec3f(0.0), radiance_of(*diffuse, irradiance, directional), surface.x != 0u);
    add_sample(at + vec2u(0u, frame.band.x), radiance, surface.x != 0u);
  } else {
    textureStore(fine_irradiance, at, select(vec4f(0.0), vec4f(irradiance, f32(surface.x)), surface.x != 0u));
    if HAS_SPECULAR { textureStore(fine_directional, at, directional); }
  }
}
