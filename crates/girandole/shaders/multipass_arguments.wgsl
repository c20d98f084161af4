// Multipass shading: how many points each element has this time, and where its vertices begin in the one draw of all.

@group(2) @binding(0) var<storage, read> point_queue: array<u32>;
@group(2) @binding(1) var<storage, read_write> elements: array<u32>; // see lib/elements.wgsl
@group(2) @binding(2) var<storage, read_write> draw_arguments: array<u32>; // of the draw
@group(2) @binding(3) var<uniform> offsets: BufferOffsets;
@group(2) @binding(4) var<uniform> multipass: MultipassParams;

var<workgroup> before: array<u32, 256>;

@compute @workgroup_size(256)
fn multipass_arguments(@builtin(local_invocation_id) lane: vec3u) {
  let share = (multipass.elements + 255u) / 256u;
  let first = min(lane.x * share, multipass.elements);
  let end = min(first + share, multipass.elements);
  var sum = 0u;
  for (var e = first; e < end; e++) {
    let element = e * ELEMENT_WORDS;
    let members = elements[element];
    var chunks = 0u;
    for (var i = members; i < members + 2u * elements[element + 1u]; i += 2u) {
      let leaf = elements[i];
      elements[i + 1u] = chunks;
      let next = point_queue[FIRSTS + min(leaf + 1u, offsets.leaves - 1u)];
      chunks += select(point_queue[1], next, leaf + 1u < offsets.leaves) - point_queue[FIRSTS + leaf];
    }
    elements[element + 4u] = CHUNK * chunks;
    sum += CHUNK * chunks * ((elements[element + 3u] + multipass.lights_per_pass - 1u) / multipass.lights_per_pass);
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
    next += elements[element + 4u] * ((elements[element + 3u] + multipass.lights_per_pass - 1u) / multipass.lights_per_pass);
  }
  if lane.x == 255u {
    draw_arguments[0] = next;
    draw_arguments[1] = 1u;
    draw_arguments[2] = 0u;
    draw_arguments[3] = 0u;
  }
}
