// Sorts the points to shade by leaf in their shading order, in chunks of one leaf each (a counting sort): this pass sums counts, and
// `scatter_points.wgsl` moves the points. Their order within a leaf depends on the scheduling of invocations and does not
// matter: each point is summed by itself.

@group(2) @binding(0) var<storage, read_write> shade_list: ShadeList;
@group(2) @binding(1) var<storage, read_write> point_queue: PointQueue;
@group(2) @binding(2) var<storage, read_write> dispatch_arguments: DispatchArguments;
@group(2) @binding(3) var<storage, read_write> tally: array<u32>; // points of each grid and leaf
@group(2) @binding(4) var<uniform> offsets: BufferOffsets;
@group(2) @binding(5) var<storage, read_write> candidates: Candidates;
@group(2) @binding(6) var<storage, read> shading_order: array<u32>; // leaves, those with lists of equal length together

// Rust: layout::DispatchArguments. Workgroups in x, y, z.
struct DispatchArguments {
  scatter_points: vec4u,
  shade_points: vec4u,
  shade_points_cooperative: vec4u,
  chunks: vec4u, // an invocation each
}

fn chunks_of(points: u32) -> u32 { return (points + CHUNK - 1u) / CHUNK; }

// One workgroup, in which each lane has a run of leaves.
@compute @workgroup_size(SCAN_LANES)
fn prefix_sum(@builtin(local_invocation_id) lane: vec3u) {
  let run = (offsets.leaves + SCAN_LANES - 1u) / SCAN_LANES;
  let first = min(lane.x * run, offsets.leaves);
  let end = min(first + run, offsets.leaves);
  var chunks = 0u;
  for (var i = first; i < end; i++) { chunks += chunks_of(atomicLoad(&shade_list.words[shading_order[i]])); }
  let sum = inclusive_scan(lane.x, chunks);

  // Where the chunks of each leaf begin.
  let row = select(firstTrailingBit(frame.step), TALLY_EDGE_ROW, frame.sample > 0u);
  var next = sum - chunks;
  for (var i = first; i < end; i++) {
    let leaf = shading_order[i];
    let count = atomicLoad(&shade_list.words[leaf]);
    tally[row * offsets.leaves + leaf] += count;
    point_queue.words[leaf] = next;
    point_queue.words[offsets.leaves + leaf] = chunks_of(count);
    next += chunks_of(count);
  }
  if lane.x + 1u < SCAN_LANES { return; }

  // Nothing is listed for the next grid yet.
  let points = atomicLoad(&shade_list.points);
  atomicStore(&shade_list.points, 0u);
  atomicStore(&shade_list.next_flat, 0u);
  atomicStore(&shade_list.next_curved, 0u);
  candidates.flat_workgroups = 0u;
  candidates.flat_workgroups_y = 1u;
  candidates.flat_workgroups_z = 1u;
  candidates.flat_count = 0u;
  candidates.curved_workgroups = 0u;
  candidates.curved_workgroups_y = 1u;
  candidates.curved_workgroups_z = 1u;
  candidates.curved_count = 0u;

  point_queue.points = points;
  point_queue.chunks = next;
  dispatch_arguments.scatter_points = vec4u((points + WORKGROUP - 1u) / WORKGROUP, 1u, 1u, 0u);
  dispatch_arguments.shade_points = vec4u(workgroups_of(next), 1u, 1u, 0u);
  let in_group = WORKGROUP / LANES;
  let groups = (CHUNK * next + in_group - 1u) / in_group;
  dispatch_arguments.shade_points_cooperative
    = vec4u(min(groups, GROUPS_PER_ROW), (groups + GROUPS_PER_ROW - 1u) / GROUPS_PER_ROW, 1u, 0u);
  dispatch_arguments.chunks = vec4u((next + WORKGROUP - 1u) / WORKGROUP, 1u, 1u, 0u);
}
