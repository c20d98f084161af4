// Copies parts of shadow maps from the page that they are drawn in to the atlas (Rust: DeviceTuning::copy_maps).
@group(2) @binding(1) var drawn: texture_depth_2d;
@group(2) @binding(2) var atlas: texture_storage_2d_array<r32float, write>;

// A workgroup a tile of a part.
@compute @workgroup_size(TILE, TILE)
fn copy_maps(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) lane: vec3u) {
  let part = parts[group.y];
  let columns = (part.end.x - part.first.x + TILE - 1u) / TILE;
  let texel = part.first + vec2u(group.x % columns, group.x / columns) * TILE + lane.xy;
  if all(texel < part.end) {
    textureStore(atlas, texel, part.page, vec4f(textureLoad(drawn, texel, 0)));
  }
}
