// Copies parts of shadow maps from the page that they are drawn in to the atlas (Rust: DeviceTuning::copy_maps).
@group(2) @binding(1) var drawn: texture_depth_2d;
@group(2) @binding(2) var atlas: texture_storage_2d_array<r32float, write>;

// A column of workgroups a part, each of which takes every so many rows: software devices, which assign each thread a run of
// workgroups, then have equal runs, and start few workgroups.
@compute @workgroup_size(TILE)
fn copy_maps(
  @builtin(workgroup_id) group: vec3u,
  @builtin(num_workgroups) groups: vec3u,
  @builtin(local_invocation_id) lane: vec3u,
) {
  let part = parts[group.x];
  for (var y = part.first.y + group.y; y < part.end.y; y += groups.y) {
    for (var x = part.first.x + lane.x; x < part.end.x; x += TILE) {
      textureStore(atlas, vec2u(x, y), part.page, vec4f(textureLoad(drawn, vec2u(x, y), 0)));
    }
  }
}
