// Rasterises triangles that are large on parts of shadow maps and had no room in a list, by the cluster.

@group(2) @binding(5) var<storage, read> lists: array<u32>;

// Set-ups of triangles, and their indices.
var<workgroup> kept: array<SetUp, MAP_KEPT>;
var<workgroup> kept_triangles: array<u32, MAP_KEPT>;
var<workgroup> kept_count: atomic<u32>;

@compute @workgroup_size(WORKGROUP)
fn large_triangles(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
  let pair = group.y * GROUPS_PER_ROW + group.x;
  if pair >= lists[PAIRS] { return; }
  let part_and_cluster = lists[batch.first_pair + pair];
  let part = part_at(part_and_cluster / batch.clusters);
  if lane == 0u { atomicStore(&kept_count, 0u); }
  workgroupBarrier();
  // A lane each sets one up; then all rasterise one after the other.
  if lane < CLUSTER {
    let triangle = part_and_cluster % batch.clusters * CLUSTER + lane;
    let s = set_up(part, triangle);
    let size = s.end - s.first;
    if size.x * size.y > SMALL {
      let slot = atomicAdd(&kept_count, 1u);
      kept[slot] = s;
      kept_triangles[slot] = triangle;
    }
  }
  workgroupBarrier();
  let count = workgroupUniformLoad(&kept_count);
  for (var slot = 0u; slot < count; slot++) {
    let s = kept[slot];
    let first = s.first / BLOCK_TEXELS;
    let columns = u32((s.end.x + BLOCK_TEXELS - 1) / BLOCK_TEXELS - first.x);
    let blocks = columns * u32((s.end.y + BLOCK_TEXELS - 1) / BLOCK_TEXELS - first.y);
    for (var block = group.z * MAP_SLICE + lane; block < min(blocks, (group.z + 1u) * MAP_SLICE); block += WORKGROUP) {
      let corner = (first + vec2i(i32(block % columns), i32(block / columns))) * BLOCK_TEXELS;
      for (var is_touched = touches(s, part, corner.x, corner.y) != 0u; is_touched; is_touched = false) {
        rasterize_block(part, s, kept_triangles[slot], corner);
      }
    }
  }
}

fn rasterize_block(part: MapPart, s: SetUp, triangle: u32, corner: vec2i) {
  for (var row = corner.y; row < corner.y + BLOCK_TEXELS; row++) {
    var covered = covered_bits(part, s, corner.x, row) | (covered_bits(part, s, corner.x + 4, row) << 4u);
    while covered != 0u {
      add(part, s, triangle, corner.x + i32(firstTrailingBit(covered)), row);
      covered &= covered - 1u;
    }
  }
}
