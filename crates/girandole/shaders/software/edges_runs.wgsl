// edges.wgsl with a run of neighbouring pixels an invocation, which share first samples and mostly a material: half the
// loads, for devices that execute invocations one after another.

@compute @workgroup_size(WORKGROUP)
fn interpolate_edges(@builtin(global_invocation_id) invocation: vec3u) {
  let last = last_point();
  let start = vec2u(EDGE_RUN * invocation.x, invocation.y);
  if start.x > last.x || !is_drawn(start.x) || !has_row(start.y) { return; }
  let side = side_of(shift_of_sample());
  var diffuse = NO_DIFFUSE_MATERIAL;
  var unresolved = 0u; // a bit each
  var left = column_at(vec2i(start) + vec2i(min(side.x, 0), 0), side);
  for (var x = start.x; x < min(start.x + EDGE_RUN, last.x + 1u); x++) {
    let right = column_at(vec2i(i32(x) + max(side.x, 0), i32(start.y)), side);
    if !interpolate_edge(vec2u(x, start.y), left, right, &diffuse) { unresolved |= 1u << (x - start.x); }
    left = right;
  }
  if unresolved == 0u { return; }
  var slot = reserve_candidates(countOneBits(unresolved));
  for (; unresolved != 0u; unresolved &= unresolved - 1u) {
    candidates.pixels[slot] = pack_candidate(start + vec2u(firstTrailingBit(unresolved), 0u));
    slot++;
  }
}

@compute @workgroup_size(WORKGROUP)
fn resolve_first_samples(@builtin(global_invocation_id) invocation: vec3u) {
  let start = vec2u(EDGE_RUN * invocation.x, invocation.y);
  if start.x >= frame.size.x || !is_drawn(start.x) || !has_row(start.y) { return; }
  var diffuse = NO_DIFFUSE_MATERIAL;
  for (var x = start.x; x < min(start.x + EDGE_RUN, frame.size.x); x++) {
    resolve_first_sample(vec2u(x, start.y), &diffuse);
  }
}
