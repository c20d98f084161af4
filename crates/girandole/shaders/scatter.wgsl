// The second half of sorting where points are many: each to its place.

@group(2) @binding(0) var<storage, read_write> wanted: array<atomic<u32>>; // how many points, points of each leaf, points
@group(2) @binding(1) var<storage, read_write> queue: array<u32>; // how many points and chunks; first chunks, chunks, points
@group(2) @binding(2) var<uniform> plan: Plan;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) invocation: vec3u) {
  if invocation.x < queue[0] { put_in_order(invocation.x); }
}
