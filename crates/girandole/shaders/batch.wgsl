// Multipass shading: how many points the receivers of each element have this time, one after another; so an element is
// one draw, and its vertices find their points.

@group(2) @binding(0) var<storage, read> queue: array<u32>;
// For each element where its members are, and how many (2 words); for each member its leaf, and the chunks before its.
@group(2) @binding(1) var<storage, read_write> members: array<u32>;
@group(2) @binding(2) var<storage, read_write> draws: array<u32>; // arguments of indirect draws, 4 words an element
@group(2) @binding(3) var<uniform> plan: Plan;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) invocation: vec3u) {
  let element = invocation.x;
  if 4u * element >= arrayLength(&draws) { return; }
  let first = members[2u * element];
  let count = members[2u * element + 1u];
  var chunks = 0u;
  for (var i = first; i < first + 2u * count; i += 2u) {
    let leaf = members[i];
    members[i + 1u] = chunks;
    let end = select(queue[1], queue[FIRSTS + min(leaf + 1u, plan.leaves - 1u)], leaf + 1u < plan.leaves);
    chunks += end - queue[FIRSTS + leaf];
  }
  draws[4u * element] = CHUNK * chunks;
  draws[4u * element + 1u] = 1u;
  draws[4u * element + 2u] = 0u;
  draws[4u * element + 3u] = 0u;
}
