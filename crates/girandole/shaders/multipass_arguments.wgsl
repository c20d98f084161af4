// Multipass shading: how many points each element has in this grid, and where its vertices begin in the one draw of all.

@group(2) @binding(0) var<storage, read> point_queue: PointQueue;
@group(2) @binding(1) var<storage, read_write> elements: array<u32>; // see lib/multipass_params.wgsl
@group(2) @binding(2) var<storage, read_write> draw_arguments: DrawArguments;
@group(2) @binding(3) var<uniform> offsets: BufferOffsets;
@group(2) @binding(4) var<uniform> multipass: MultipassParams;

struct DrawArguments { vertex_count: u32, instance_count: u32, first_vertex: u32, first_instance: u32 }

// Vertices of all passes of an element.
fn vertices_of(e: Element) -> u32 {
  return e.vertices * ((e.light_count + multipass.lights_per_pass - 1u) / multipass.lights_per_pass);
}

// One workgroup, in which each lane has a run of elements.
@compute @workgroup_size(SCAN_LANES)
fn multipass_arguments(@builtin(local_invocation_id) lane: vec3u) {
  let run = (multipass.elements + SCAN_LANES - 1u) / SCAN_LANES;
  let first = min(lane.x * run, multipass.elements);
  let end = min(first + run, multipass.elements);
  var sum = 0u;
  for (var i = first; i < end; i++) {
    var element = element_at(i * ELEMENT_WORDS);
    var chunks = 0u;
    for (var m = 0u; m < element.member_count; m++) {
      let at = element.members_at + m * MEMBER_WORDS;
      let leaf = member_at(at).leaf;
      set_member(at, Member(leaf, chunks));
      chunks += point_queue.words[offsets.leaves + leaf];
    }
    element.vertices = CHUNK * chunks;
    set_element(i * ELEMENT_WORDS, element);
    sum += vertices_of(element);
  }
  let total = inclusive_scan(lane.x, sum);
  var next = total - sum;
  for (var i = first; i < end; i++) {
    var element = element_at(i * ELEMENT_WORDS);
    element.first_vertex = next;
    set_element(i * ELEMENT_WORDS, element);
    next += vertices_of(element);
  }
  if lane.x + 1u == SCAN_LANES { draw_arguments = DrawArguments(next, 1u, 0u, 0u); }
}
