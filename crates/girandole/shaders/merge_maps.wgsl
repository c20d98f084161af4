// Merges what `rasterize_pieces` found with what else parts of shadow maps show.
@group(2) @binding(3) var<storage, read> nearest: array<u32>;
@group(2) @binding(4) var still: texture_2d_array<f32>; // what does not move
@group(2) @binding(5) var atlas: texture_storage_2d_array<r32float, read_write>;

override IS_DRAWN: bool; // whether all else was drawn into the atlas just now; else it is what does not move

// A column of workgroups a part, as in `copy_maps`.
@compute @workgroup_size(TILE)
fn merge_maps(
  @builtin(workgroup_id) group: vec3u,
  @builtin(num_workgroups) groups: vec3u,
  @builtin(local_invocation_id) lane: vec3u,
) {
  let part = parts[group.x];
  let light = lights[part.light];
  let origin = map_origin(light);
  let page = map_page(light);
  let columns = part.end.x - part.first.x;
  for (var y = part.first.y + group.y; y < part.end.y; y += groups.y) {
    let row = part.nearest + (y - part.first.y) * columns;
    for (var x = part.first.x + lane.x; x < part.end.x; x += TILE) {
      let texel = origin + vec2u(x, y);
      var depth = bitcast<f32>(nearest[row + x - part.first.x]);
      if IS_DRAWN {
        if depth <= textureLoad(atlas, texel, page).x { continue; }
      } else {
        depth = max(depth, textureLoad(still, texel, page, 0).x);
      }
      textureStore(atlas, texel, page, vec4f(depth));
    }
  }
}
