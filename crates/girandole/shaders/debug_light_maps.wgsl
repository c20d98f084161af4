// Debug view: what light maps hold; receivers without one are black.

@group(2) @binding(0) var<storage, read> surfaces: array<vec4u>;
@group(2) @binding(1) var<storage, read> lists: array<u32>;
@group(2) @binding(2) var<storage, read> light_maps: array<vec4f>;
@group(2) @binding(3) var radiance: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) invocation: vec3u) {
  let pixel = vec2u(invocation.x, invocation.y + frame.band.x);
  if pixel.x >= frame.size.x || pixel.y >= frame.band.y { return; }
  let surface = surfaces[band_index(pixel)];
  let record = (surface.z & LEAF) * LEAF_WORDS;
  var light = vec3f(0.0);
  if surface.x != 0u && lists[record] != NO_MAP {
    light = mapped_irradiance(record, position_at(pixel, bitcast<f32>(surface.x)));
  }
  textureStore(radiance, pixel, vec4f(light / (1.0 + max(light.x, max(light.y, light.z))), 1.0));
}
