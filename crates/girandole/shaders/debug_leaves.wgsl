// Debug view: each leaf receiver in its colour, a little darker where the surface turns away.

@group(2) @binding(0) var triangle_ids: texture_2d<u32>;
@group(2) @binding(1) var<storage, read> receivers: array<u32>;
@group(2) @binding(2) var<storage, read> colors: array<vec4f>;
@group(2) @binding(3) var<uniform> offsets: BufferOffsets;
@group(2) @binding(4) var picture: texture_storage_2d<rg32uint, write>;

@compute @workgroup_size(TILE, TILE)
fn show_leaves(@builtin(global_invocation_id) invocation: vec3u) {
  let pixel = vec2u(invocation.x, invocation.y + frame.band.x);
  if pixel.x >= frame.size.x || pixel.y >= frame.band.y { return; }
  let id = textureLoad(triangle_ids, pixel, 0).x;
  if id == 0u {
    textureStore(picture, pixel, pack_radiance(vec3f(0.0)));
    return;
  }
  let hit = hit_at(pixel, id - 1u);
  let facing = dot(hit.geometric_normal, hit.wo);
  textureStore(picture, pixel, pack_radiance(colors[leaf_of(pixel, id)].xyz * (0.6 + 0.4 * facing)));
}
