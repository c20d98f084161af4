// Tests the candidates of `refine.wgsl`, see lib/test_candidate.wgsl. Those on curved surfaces are tested apart, as they
// need far more work.

@group(2) @binding(9) var<storage, read> candidates: Candidates;

@compute @workgroup_size(WORKGROUP)
fn test_flat_candidates(@builtin(global_invocation_id) invocation: vec3u) {
  if invocation.x < candidates.flat_count { test_flat_candidate(invocation.x); }
}

@compute @workgroup_size(WORKGROUP)
fn test_curved_candidates(@builtin(global_invocation_id) invocation: vec3u) {
  if invocation.x < candidates.curved_count { test_curved_candidate(invocation.x); }
}
