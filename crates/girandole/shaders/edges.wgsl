// Anti-aliasing, see lib/edge_sample.wgsl: a pixel an invocation.

@compute @workgroup_size(WORKGROUP)
fn interpolate_edges(@builtin(global_invocation_id) invocation: vec3u) {
  let at = invocation.xy;
  if at.x > last_point().x || !is_drawn(at.x) || !has_row(at.y) { return; }
  let side = side_of(shift_of_sample());
  let left = column_at(vec2i(at) + vec2i(min(side.x, 0), 0), side);
  let right = column_at(vec2i(at) + vec2i(max(side.x, 0), 0), side);
  var diffuse = NO_DIFFUSE_MATERIAL;
  if !interpolate_edge(at, left, right, &diffuse) { candidates.pixels[reserve_candidates(1u)] = pack_candidate(at); }
}

@compute @workgroup_size(WORKGROUP)
fn resolve_first_samples(@builtin(global_invocation_id) invocation: vec3u) {
  if invocation.x >= frame.size.x || !is_drawn(invocation.x) || !has_row(invocation.y) { return; }
  var diffuse = NO_DIFFUSE_MATERIAL;
  resolve_first_sample(invocation.xy, &diffuse);
}
