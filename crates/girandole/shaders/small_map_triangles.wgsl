// Rasterises triangles that are small on parts of shadow maps, a lane each; lists those that are large.

@group(2) @binding(5) var<storage, read_write> lists: array<atomic<u32>>;

override MAP_LANES: u32; // of a workgroup

var<workgroup> wanted: array<u32, MAP_CLUSTERS>;
var<workgroup> wanted_count: atomic<u32>;
// Whether triangles of a wanted cluster are left to `large_map_triangles`.
var<workgroup> is_left: array<atomic<u32>, MAP_CLUSTERS>;

fn rasterize(part: MapPart, s: SetUp, triangle: u32) {
  let size = s.end - s.first;
  // First which of eight quadruples of texels are covered, then the depths of those: of a box, few are.
  let columns = u32(size.x + 3) / 4u;
  let count = columns * u32(size.y);
  var x = s.first.x;
  var y = s.first.y;
  for (var start = 0u; start < count; start += 8u) {
    var covered = 0u;
    for (var i = 0u; i < min(count - start, 8u); i++) {
      covered |= covered_bits(part, s, x, y) << (4u * i);
      x += 4;
      if x >= s.end.x {
        x = s.first.x;
        y++;
      }
    }
    for (; covered != 0u; covered &= covered - 1u) {
      let bit = firstTrailingBit(covered);
      let quadruple = start + bit / 4u;
      let row = u32((f32(quadruple) + 0.5) / f32(columns));
      add(part, s, triangle, s.first.x + i32((quadruple - row * columns) * 4u + (bit & 3u)), s.first.y + i32(row));
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
