// The second half of the counting sort of `prefix_sum.wgsl`: writes each point to its chunk.

@group(2) @binding(0) var<storage, read_write> shade_list: ShadeList;
@group(2) @binding(1) var<storage, read_write> point_queue: PointQueue;
@group(2) @binding(2) var<uniform> offsets: BufferOffsets;

@compute @workgroup_size(WORKGROUP)
fn scatter_points(@builtin(global_invocation_id) invocation: vec3u) {
  if invocation.x >= point_queue.points { return; }
  let point = shade_point_at(offsets.points_at + SHADE_POINT_WORDS * invocation.x);
  let first = point_queue.words[point.leaf];
  point_queue.words[offsets.sorted_at + first * CHUNK + point.rank] = point.pixel;
  // The last point of a chunk stores how many it has; the last one of a leaf sets the leaf's count back to 0, which
  // tells the others of the leaf as well that they are not the last.
  let is_last = point.rank + 1u == atomicLoad(&shade_list.words[point.leaf]);
  let in_chunk = point.rank % CHUNK + 1u;
  if is_last || in_chunk == CHUNK {
    point_queue.words[offsets.chunks_at + first + point.rank / CHUNK] = pack_chunk(point.leaf, in_chunk);
  }
  if is_last { atomicStore(&shade_list.words[point.leaf], 0u); }
}
