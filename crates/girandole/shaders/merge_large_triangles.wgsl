// Merges the listed triangles into the texels beside the maps, in those blocks that they touch.

@group(2) @binding(4) var<storage, read_write> nearest: array<vec4u>; // the texels, four each
@group(2) @binding(5) var<storage, read> lists: array<u32>;

override MAP_LANES: u32; // of a workgroup

// Blocks of a workgroup.
const BLOCKS = MAP_ACROSS * MAP_ACROSS;
const WORDS = (MAP_KEPT + 31u) / 32u;
// Set-ups of triangles.
var<workgroup> kept: array<SetUp, MAP_KEPT>;
// Listed triangles that are looked at between two barriers.
const SCANNED = 384u;
// Of those, where the ones are whose boxes touch the workgroup's blocks.
var<workgroup> found: array<u32, SCANNED>;
var<workgroup> found_count: atomic<u32>;
// Of each block and 32 triangles that are kept: which cover some of its texels, and all.
var<workgroup> masks: array<atomic<u32>, 2u * BLOCKS * WORDS>;
// Blocks that any triangle touches.
var<workgroup> touched_blocks: array<u32, BLOCKS>;
var<workgroup> touched_count: atomic<u32>;

// A column of workgroups a part.
@compute @workgroup_size(MAP_LANES)
fn merge_large_triangles(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
  let part = part_at(group.y);
  let across = (part.end.x - part.first.x + MAP_ACROSS * MAP_BLOCK - 1u) / (MAP_ACROSS * MAP_BLOCK);
  let low = part.first + vec2u(group.x % across, group.x / across) * (MAP_ACROSS * MAP_BLOCK);
  let count = min(lists[MAP_LISTS_HEAD + group.y], listed_room(part));
  if count == 0u || low.y >= part.end.y { return; }
  for (var start = 0u; start < count; start += SCANNED) {
    if lane == 0u { atomicStore(&found_count, 0u); }
    workgroupBarrier();
    for (var i = start + lane; i < min(start + SCANNED, count); i += MAP_LANES) {
      let at = part.first_listed + LISTED_WORDS * i;
      let x = lists[at + 1u];
      let y = lists[at + 2u];
      let high = vec2i(low + MAP_ACROSS * MAP_BLOCK);
      if all(box_first(x, y) < high) && all(box_end(x, y) > vec2i(low)) {
        found[atomicAdd(&found_count, 1u)] = at;
      }
    }
    workgroupBarrier();
    let some = workgroupUniformLoad(&found_count);
    for (var first = 0u; first < some; first += MAP_KEPT) {
      merge(part, low, lane, first, min(some - first, MAP_KEPT));
    }
  }
}

// So many of what was found.
fn merge(part: MapPart, low: vec2u, lane: u32, first: u32, count: u32) {
  let words = (count + 31u) / 32u;
  for (var i = lane; i < 2u * BLOCKS * words; i += MAP_LANES) { atomicStore(&masks[i], 0u); }
  if lane == 0u { atomicStore(&touched_count, 0u); }
  workgroupBarrier();
  for (var slot = lane; slot < count; slot += MAP_LANES) {
    let at = found[first + slot];
    var s = planes(part, corners(part, lists[at]));
    s.first = box_first(lists[at + 1u], lists[at + 2u]);
    s.end = box_end(lists[at + 1u], lists[at + 2u]);
    kept[slot] = s;
    let first_block = vec2u(max(s.first - vec2i(low), vec2i(0))) / MAP_BLOCK;
    let end_block = min((vec2u(s.end - vec2i(low)) + MAP_BLOCK - 1u) / MAP_BLOCK, vec2u(MAP_ACROSS));
    for (var y = first_block.y; y < end_block.y; y++) {
      for (var x = first_block.x; x < end_block.x; x++) {
        let touched = touches(s, part, i32(low.x + x * MAP_BLOCK), i32(low.y + y * MAP_BLOCK));
        if touched != 0u {
          let mask = ((slot / 32u) * BLOCKS + y * MAP_ACROSS + x) * 2u + touched - 1u;
          atomicOr(&masks[mask], 1u << (slot & 31u));
        }
      }
    }
  }
  workgroupBarrier();
  for (var block = lane; block < BLOCKS; block += MAP_LANES) {
    var any_touches = 0u;
    for (var word = 0u; word < words; word++) {
      let mask = (word * BLOCKS + block) * 2u;
      any_touches |= atomicLoad(&masks[mask]) | atomicLoad(&masks[mask + 1u]);
    }
    if any_touches != 0u { touched_blocks[atomicAdd(&touched_count, 1u)] = block; }
  }
  workgroupBarrier();
  let touched = workgroupUniformLoad(&touched_count);
  for (var i = lane / LANES_PER_BLOCK; i < touched; i += MAP_LANES / LANES_PER_BLOCK) {
    let block = touched_blocks[i];
    let at = low + vec2u(block % MAP_ACROSS, block / MAP_ACROSS) * MAP_BLOCK + vec2u(0u, lane % LANES_PER_BLOCK);
    merge_rows(part, at, block, first, words);
  }
  // Other lanes may have these blocks next.
  storageBarrier();
  workgroupBarrier();
}

// Two rows of a block, so that what lanes load of a triangle serves sixteen texels.
const LANES_PER_BLOCK = MAP_BLOCK / 2u;

fn merge_rows(part: MapPart, at: vec2u, block: u32, first: u32, words: u32) {
  if any(at >= part.end) { return; }
  var upper = row_at(part, at);
  var lower = row_at(part, at + vec2u(0u, LANES_PER_BLOCK));
  for (var word = 0u; word < words; word++) {
    let mask = (word * BLOCKS + block) * 2u;
    var some = atomicLoad(&masks[mask]);
    var whole = atomicLoad(&masks[mask + 1u]);
    while whole != 0u {
      let n = kept[word * 32u + firstTrailingBit(whole)].n;
      whole &= whole - 1u;
      add_whole(&upper, n);
      add_whole(&lower, n);
    }
    while some != 0u {
      let slot = word * 32u + firstTrailingBit(some);
      some &= some - 1u;
      let s = kept[slot];
      let triangle = lists[found[first + slot]];
      add_some(&upper, part, s, triangle);
      add_some(&lower, part, s, triangle);
    }
  }
  write(upper);
  write(lower);
}

// A row of a block: its texels, four and four, and where they are beside the maps.
struct Row { at: vec2i, left: Directions, right: Directions, of_left: vec4u, of_right: vec4u, beside: u32 }

fn row_at(part: MapPart, at: vec2u) -> Row {
  let x = i32(at.x);
  let y = i32(at.y);
  let beside = texel_of(part, at) / 4u;
  return Row(
    vec2i(at), directions(part, x, y), directions(part, x + 4, y), nearest[beside], nearest[beside + 1u], beside);
}

fn add_whole(row: ptr<function, Row>, n: vec3f) {
  (*row).of_left = max((*row).of_left, depth_bits(n, (*row).left));
  (*row).of_right = max((*row).of_right, depth_bits(n, (*row).right));
}

fn add_some(row: ptr<function, Row>, part: MapPart, s: SetUp, triangle: u32) {
  let at = (*row).at;
  let left = (*row).left;
  let right = (*row).right;
  let is_left = uncut(part, s, triangle, left, covers(s, left, at.x, at.y));
  let is_right = uncut(part, s, triangle, right, covers(s, right, at.x + 4, at.y));
  (*row).of_left = select((*row).of_left, max((*row).of_left, depth_bits(s.n, left)), is_left);
  (*row).of_right = select((*row).of_right, max((*row).of_right, depth_bits(s.n, right)), is_right);
}

fn write(row: Row) {
  nearest[row.beside] = row.of_left;
  nearest[row.beside + 1u] = row.of_right;
}
