// Further samples of a pixel: what they receive is interpolated between the first samples of this pixel and of its
// neighbours on their side, those that lie on the same surface. Where none does, `behind.wgsl` decides.

@group(2) @binding(0) var keys: texture_2d<u32>;
// The first sample's: irradiance and key; specular radiance, or the direction of light.
@group(2) @binding(1) var first_light: texture_2d<f32>;
@group(2) @binding(2) var first_second: texture_2d<f32>;
// This sample's; with FINAL the picture.
@group(2) @binding(3) var fine_light: texture_storage_2d<rgba32float, write>;
@group(2) @binding(4) var fine_second: texture_storage_2d<rgba32float, write>;
@group(2) @binding(5) var<storage, read_write> sums: array<vec4f>;
@group(2) @binding(6) var<storage, read_write> open: array<atomic<u32>>; // see lib/grid.wgsl

override SPECULAR: bool = false;

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
  let shift = shift_of_sample();
  let side = side_of(shift);
  let t = abs(shift);
  let here = vec2i(at);
  var blend: Blend;
  add_first(&blend, here, key, (1.0 - t.x) * (1.0 - t.y));
  add_first(&blend, here + vec2i(side.x, 0), key, t.x * (1.0 - t.y));
  add_first(&blend, here + vec2i(0, side.y), key, (1.0 - t.x) * t.y);
  add_first(&blend, here + side, key, t.x * t.y);
  if blend.weight > 0.0 && (key & SHINY) == 0u {
    store_blend(at, shown, blend);
  } else {
    let slot = atomicAdd(&open[3], 1u);
    atomicMax(&open[0], workgroups_of(slot + 1u));
    atomicStore(&open[FIRST_PLACE + slot], at.y << 16u | at.x);
  }
}
