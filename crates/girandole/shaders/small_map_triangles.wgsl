// Rasterises triangles that are small on parts of shadow maps, a lane each; lists those that are large.

@group(2) @binding(5) var<storage, read_write> lists: array<atomic<u32>>;

override MAP_LANES: u32; // of a workgroup

var<workgroup> wanted: array<u32, MAP_CLUSTERS>;
var<workgroup> wanted_count: atomic<u32>;
// Whether triangles of a wanted cluster are left to `large_map_triangles`.
var<workgroup> is_left: array<atomic<u32>, MAP_CLUSTERS>;

fn rasterize(part: MapPart, s: SetUp, triangle: u32) {
  for (var y = s.first.y; y < s.end.y; y++) {
    for (var x = s.first.x; x < s.end.x; x += 4) {
      for (var covered = covered_bits(part, s, x, y); covered != 0u; covered &= covered - 1u) {
        add(part, s, triangle, x + i32(firstTrailingBit(covered)), y);
      }
    }
  }
}

// A column of workgroups a part.
@compute @workgroup_size(MAP_LANES)
fn small_triangles(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
  let part = part_at(group.y);
  let first = group.x * MAP_CLUSTERS;
  if are_hidden(part, first) { return; }
  if lane == 0u { atomicStore(&wanted_count, 0u); }
  for (var i = lane; i < MAP_CLUSTERS; i += MAP_LANES) { atomicStore(&is_left[i], 0u); }
  workgroupBarrier();
  for (var cluster = first + lane; cluster < min(first + MAP_CLUSTERS, batch.clusters); cluster += MAP_LANES) {
    for (var is_seen = !is_hidden(part, cluster); is_seen; is_seen = false) {
      if may_cover(part, cluster) { wanted[atomicAdd(&wanted_count, 1u)] = cluster; }
    }
  }
  workgroupBarrier();
  let count = workgroupUniformLoad(&wanted_count);
  for (var i = lane; i < count * CLUSTER; i += MAP_LANES) {
    let index = i / CLUSTER;
    let triangle = wanted[index] * CLUSTER + i % CLUSTER;
    let s = set_up(part, triangle);
    let size = s.end - s.first;
    let texel_count = size.x * size.y;
    for (var is_large = texel_count > SMALL; is_large; is_large = false) {
      let at = atomicAdd(&lists[MAP_LISTS_HEAD + group.y], 1u);
      if at < listed_room(part) {
        let to = part.first_listed + LISTED_WORDS * at;
        atomicStore(&lists[to], triangle);
        atomicStore(&lists[to + 1u], packed_range(s.first.x, s.end.x));
        atomicStore(&lists[to + 2u], packed_range(s.first.y, s.end.y));
      } else {
        atomicStore(&is_left[index], 1u);
      }
    }
    for (var is_small = texel_count > 0 && texel_count <= SMALL; is_small; is_small = false) {
      rasterize(part, s, triangle);
    }
  }
  workgroupBarrier();
  for (var i = lane; i < count; i += MAP_LANES) {
    if atomicLoad(&is_left[i]) == 0u { continue; }
    let pair = atomicAdd(&lists[PAIRS], 1u);
    atomicStore(&lists[batch.first_pair + pair], group.y * batch.clusters + wanted[i]);
    atomicMax(&lists[0], min(pair + 1u, GROUPS_PER_ROW));
    atomicMax(&lists[1], pair / GROUPS_PER_ROW + 1u);
    atomicMax(&lists[2], batch.slices);
  }
}
