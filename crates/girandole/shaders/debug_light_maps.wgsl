// Debug view: what light maps hold; receivers without one are black.

@group(2) @binding(0) var triangle_ids: texture_2d<u32>;
@group(2) @binding(1) var<storage, read> receivers: array<u32>;
@group(2) @binding(2) var<storage, read> light_lists: array<u32>;
@group(2) @binding(3) var<storage, read> light_maps: array<vec4f>;
@group(2) @binding(4) var<uniform> offsets: BufferOffsets;
@group(2) @binding(5) var picture: texture_storage_2d<rg32uint, write>;

@compute @workgroup_size(TILE, TILE)
fn show_light_maps(@builtin(global_invocation_id) invocation: vec3u) {
  let pixel = vec2u(invocation.x, invocation.y + frame.band.x);
  if pixel.x >= frame.size.x || pixel.y >= frame.band.y { return; }
  let id = textureLoad(triangle_ids, pixel, 0).x;
  var light = vec3f(0.0);
  if id > 0u {
    let leaf = leaf_of(pixel, id);
    if has_light_map(leaf) { light = mapped_irradiance(leaf, hit_at(pixel, id - 1u).position); }
  }
  textureStore(picture, pixel, pack_radiance(light / (1.0 + max(light.x, max(light.y, light.z)))));
}
