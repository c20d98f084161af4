// Multipass shading: how many points each element has this time, and where its vertices begin in the one draw of all.

@group(2) @binding(0) var<storage, read> queue: array<u32>;
@group(2) @binding(1) var<storage, read_write> elements: array<u32>; // see lib/elements.wgsl
@group(2) @binding(2) var<storage, read_write> arguments: array<u32>; // of the draw
@group(2) @binding(3) var<uniform> plan: Plan;
@group(2) @binding(4) var<uniform> passes: Passes;

var<workgroup> before: array<u32, 256>;

@compute @workgroup_size(256)
fn main(@builtin(local_invocation_id) lane: vec3u) {
  let share = (passes.elements + 255u) / 256u;
  let first = min(lane.x * share, passes.elements);
  let end = min(first + share, passes.elements);
  var sum = 0u;
  for (var e = first; e < end; e++) {
    let element = e * ELEMENT_WORDS;
    let members = elements[element];
    var chunks = 0u;
    for (var i = members; i < members + 2u * elements[element + 1u]; i += 2u) {
      let leaf = elements[i];
      elements[i + 1u] = chunks;
      let next = queue[FIRSTS + min(leaf + 1u, plan.leaves - 1u)];
      chunks += select(queue[1], next, leaf + 1u < plan.leaves) - queue[FIRSTS + leaf];
    }
    elements[element + 4u] = CHUNK * chunks;
    sum += CHUNK * chunks * ((elements[element + 3u] + passes.lights_per_pass - 1u) / passes.lights_per_pass);
  }
  before[lane.x] = sum;
  workgroupBarrier();
  for (var reach = 1u; reach < 256u; reach *= 2u) {
    var total = before[lane.x];
    if lane.x >= reach { total += before[lane.x - reach]; }
    workgroupBarrier();
    before[lane.x] = total;
    workgroupBarrier();
  }
  var next = before[lane.x] - sum;
  for (var e = first; e < end; e++) {
    let element = e * ELEMENT_WORDS;
    elements[element + 5u] = next;
    next += elements[element + 4u] * ((elements[element + 3u] + passes.lights_per_pass - 1u) / passes.lights_per_pass);
  }
  if lane.x == 255u {
    arguments[0] = next;
    arguments[1] = 1u;
    arguments[2] = 0u;
    arguments[3] = 0u;
  }
}
