// The second half of sorting where points are many: each to its place.

@group(2) @binding(0) var<storage, read_write> shade_list: array<atomic<u32>>; // how many points, points of each leaf, points
@group(2) @binding(1) var<storage, read_write> point_queue: array<u32>; // how many points and chunks; first chunks, chunks, points
@group(2) @binding(2) var<uniform> offsets: BufferOffsets;

@compute @workgroup_size(64)
fn scatter_points(@builtin(global_invocation_id) invocation: vec3u) {
  if invocation.x < point_queue[0] { scatter_point(invocation.x); }
}
