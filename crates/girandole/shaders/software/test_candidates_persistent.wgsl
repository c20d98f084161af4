// test_candidates.wgsl with a work queue, see workgroups_persistent.wgsl. `prefix_sum.wgsl` rewinds the queue.

@group(2) @binding(9) var<storage, read> candidates: Candidates;

const RUN = 8u; // candidates that are fetched at once: neighbours share what they read

@compute @workgroup_size(PERSISTENT_WIDTH)
fn test_flat_candidates() {
  let count = candidates.flat_count;
  for (var item = 0u; item < MAX_ITEMS; item++) {
    let first = RUN * atomicAdd(&shade_list.next_flat, 1u);
    if first >= count { break; }
    for (var index = first; index < min(first + RUN, count); index++) { test_flat_candidate(index); }
  }
}

@compute @workgroup_size(PERSISTENT_WIDTH)
fn test_curved_candidates() {
  let count = candidates.curved_count;
  for (var item = 0u; item < MAX_ITEMS; item++) {
    let first = RUN * atomicAdd(&shade_list.next_curved, 1u);
    if first >= count { break; }
    for (var index = first; index < min(first + RUN, count); index++) { test_curved_candidate(index); }
  }
}
