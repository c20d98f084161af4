// Sorts the points to shade by their leaf receivers, in chunks of one leaf each (a counting sort). Their order within
// a leaf depends on chance and does not matter: each point is summed by itself.

@group(2) @binding(0) var<storage, read_write> shade_list: array<atomic<u32>>; // how many points, points of each leaf, points
@group(2) @binding(1) var<storage, read_write> point_queue: array<u32>; // how many points and chunks; first chunks, chunks, points
@group(2) @binding(2) var<storage, read_write> dispatch_arguments: array<u32>; // of the dispatches that sort and that shade
@group(2) @binding(3) var<storage, read_write> tally: array<u32>; // points of each level and leaf
@group(2) @binding(4) var<uniform> offsets: BufferOffsets;
@group(2) @binding(5) var<storage, read_write> candidates: array<u32>; // see lib/grid.wgsl

override SCATTERS: bool = false; // whether points are few: then this pass brings them to their places as well

const LANES = 256u;
const EXTRA_ROW = 4u; // of the tally: further samples of pixels at edges

var<workgroup> chunks_before: array<u32, 256>;
var<workgroup> points_in_all: u32;

// One group: where the chunks of each leaf begin.
@compute @workgroup_size(256)
fn prefix_sum(@builtin(local_invocation_id) lane: vec3u) {
  let share = (offsets.leaves + LANES - 1u) / LANES;
  let first = min(lane.x * share, offsets.leaves);
  let end = min(first + share, offsets.leaves);
  var chunks = 0u;
  for (var leaf = first; leaf < end; leaf++) { chunks += (atomicLoad(&shade_list[COUNTS + leaf]) + CHUNK - 1u) / CHUNK; }
  chunks_before[lane.x] = chunks;
  workgroupBarrier();
  for (var reach = 1u; reach < LANES; reach *= 2u) {
    var sum = chunks_before[lane.x];
    if lane.x >= reach { sum += chunks_before[lane.x - reach]; }
    workgroupBarrier();
    chunks_before[lane.x] = sum;
    workgroupBarrier();
  }
  let row = select(firstTrailingBit(frame.step), EXTRA_ROW, frame.sample > 0u);
  var next = chunks_before[lane.x] - chunks;
  for (var leaf = first; leaf < end; leaf++) {
    let count = atomicLoad(&shade_list[COUNTS + leaf]);
    tally[row * offsets.leaves + leaf] += count;
    point_queue[FIRSTS + leaf] = next;
    next += (count + CHUNK - 1u) / CHUNK;
  }
  if lane.x == LANES - 1u {
    for (var header = 0u; header <= CURVED_HEADER; header += CURVED_HEADER) {
      candidates[header] = 0u;
      candidates[header + 1u] = 1u;
      candidates[header + 2u] = 1u;
      candidates[header + 3u] = 0u;
    }
    let points = atomicLoad(&shade_list[0]);
    atomicStore(&shade_list[0], 0u);
    point_queue[0] = points;
    point_queue[1] = next;
    dispatch_arguments[0] = (points + 63u) / 64u;
    dispatch_arguments[1] = 1u;
    dispatch_arguments[2] = 1u;
    dispatch_arguments[4] = workgroups_of(next, 1u);
    dispatch_arguments[5] = 1u;
    dispatch_arguments[6] = 1u;
    // 16 lanes a point, in rows of workgroups.
    let groups = (CHUNK * next + 3u) / 4u;
    dispatch_arguments[8] = min(groups, 32768u);
    dispatch_arguments[9] = (groups + 32767u) / 32768u;
    dispatch_arguments[10] = 1u;
    // An invocation for each chunk.
    dispatch_arguments[12] = (next + 63u) / 64u;
    dispatch_arguments[13] = 1u;
    dispatch_arguments[14] = 1u;
    points_in_all = points;
  }
  if SCATTERS {
    storageBarrier();
    let points = workgroupUniformLoad(&points_in_all);
    for (var point = lane.x; point < points; point += LANES) { scatter_point(point); }
  }
}
