// The second half of sorting: points to their places.

@group(2) @binding(0) var<storage, read> points: array<vec4u>; // pixel, leaf, place among the leaf's points
@group(2) @binding(1) var<storage, read_write> queue: array<u32>; // points, chunks, spare; first chunks, chunks, points
@group(2) @binding(2) var<uniform> plan: Plan;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) invocation: vec3u) {
  if invocation.x >= queue[0] { return; }
  let point = points[invocation.x];
  queue[plan.sorted_at + queue[16u + point.y] * CHUNK + point.z] = point.x;
}
