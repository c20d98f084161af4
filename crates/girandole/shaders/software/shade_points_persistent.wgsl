// shade_points.wgsl with a work queue, see workgroups_persistent.wgsl.

@group(2) @binding(5) var<storage, read_write> point_queue: PointQueue;

@compute @workgroup_size(PERSISTENT_WIDTH)
fn shade_points(@builtin(num_workgroups) workgroups: vec3u) {
  for (var item = 0u; item < MAX_ITEMS; item++) {
    let chunk = atomicAdd(&point_queue.next_chunk, 1u);
    if chunk >= point_queue.chunks { break; }
    shade_chunk(chunk);
  }
  // The last invocation to finish rewinds the queue for the next batch of lights.
  if atomicAdd(&point_queue.finished, 1u) + 1u == PERSISTENT_WIDTH * workgroups.x {
    atomicStore(&point_queue.next_chunk, 0u);
    atomicStore(&point_queue.finished, 0u);
  }
}
