// Shows the picture on the caller's target.

struct Display {
  size: vec2u,
  exposure: f32, // stops
  automatic: u32,
}

@group(2) @binding(0) var<uniform> display: Display;
@group(2) @binding(1) var picture: texture_2d<u32>;
@group(2) @binding(2) var<storage, read> automatic: array<f32>;

override COVERAGE: bool = false; // whether the target keeps what it shows where the scene does not
override ENCODE: bool; // whether the target wants sRGB values rather than linear ones

struct Out { @builtin(position) position: vec4f, @location(0) @interpolate(flat) exposure: f32 }

@vertex
fn fullscreen(@builtin(vertex_index) i: u32) -> Out {
  let stops = select(display.exposure, automatic[0], display.automatic != 0u);
  return Out(vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0), exp2(stops));
}

@fragment
fn show(in: Out) -> @location(0) vec4f {
  let pixel = min(vec2u(in.position.xy), display.size - 1u);
  let words = textureLoad(picture, pixel, 0).xy;
  var radiance = unpack_radiance(words);
  var coverage = 1.0;
  if COVERAGE {
    // What is blended with the target is the radiance of the part that shows the scene.
    coverage = coverage_of(words);
    radiance /= max(coverage, 0.25);
  }
  let shown = tone_curve(radiance * in.exposure);
  if !ENCODE { return vec4f(shown, coverage); }
  return vec4f(srgb_encode(shown.x), srgb_encode(shown.y), srgb_encode(shown.z), coverage);
}
