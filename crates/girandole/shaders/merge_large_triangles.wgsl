// Merges the listed triangles into the texels beside the maps, in those blocks that they touch.

@group(2) @binding(4) var<storage, read_write> nearest: array<vec4u>; // the texels, four each
@group(2) @binding(5) var<storage, read> lists: array<u32>;
@group(2) @binding(6) var<storage, read> set_ups: array<vec4u>;

// Blocks of a workgroup.
const BLOCKS = 64u;

// Triangles that touch any of the blocks, as scalars: software devices load vectors slowly.
var<workgroup> planes: array<f32, 1536>; // twelve each
var<workgroup> plane_count: atomic<u32>;
// Of each block and 32 such triangles: which cover some of its texels, and all.
var<workgroup> masks: array<atomic<u32>, 512>;
// Blocks that any triangle touches.
var<workgroup> touched_blocks: array<u32, BLOCKS>;
var<workgroup> touched_count: atomic<u32>;

fn keep(slot: u32, s: SetUp, n: vec3f) {
  let at = 12u * slot;
  planes[at] = s.a.x; planes[at + 1u] = s.a.y; planes[at + 2u] = s.a.z;
  planes[at + 3u] = s.b.x; planes[at + 4u] = s.b.y; planes[at + 5u] = s.b.z;
  planes[at + 6u] = s.c.x; planes[at + 7u] = s.c.y; planes[at + 8u] = s.c.z;
  planes[at + 9u] = n.x; planes[at + 10u] = n.y; planes[at + 11u] = n.z;
}

fn plane(at: u32) -> vec3f { return vec3f(planes[at], planes[at + 1u], planes[at + 2u]); }

// A column of workgroups a part.
@compute @workgroup_size(WORKGROUP)
fn merge_large_triangles(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
  let part = parts[group.y];
  let across = (part.end.x - part.first.x + MAP_ACROSS * MAP_BLOCK - 1u) / (MAP_ACROSS * MAP_BLOCK);
  let low = part.first + vec2u(group.x % across, group.x / across) * (MAP_ACROSS * MAP_BLOCK);
  let count = min(lists[LISTS_HEAD + group.y], CAPACITY);
  if count == 0u || low.y >= part.end.y { return; }
  let words = (count + 31u) / 32u;
  for (var i = lane; i < 2u * BLOCKS * words; i += WORKGROUP) { atomicStore(&masks[i], 0u); }
  if lane == 0u {
    atomicStore(&plane_count, 0u);
    atomicStore(&touched_count, 0u);
  }
  workgroupBarrier();
  let low_block = vec2i(low / MAP_BLOCK);
  for (var triangle = lane; triangle < count; triangle += WORKGROUP) {
    let at = part.first_set_up + 4u * triangle;
    let a = set_ups[at];
    let b = set_ups[at + 1u];
    let first = max(vec2i(vec2u(a.w, b.w) & vec2u(0xffffu)) / BLOCK_TEXELS - low_block, vec2i(0));
    let end = min((vec2i(vec2u(a.w, b.w) >> vec2u(16u)) + BLOCK_TEXELS - 1) / BLOCK_TEXELS - low_block, vec2i(i32(MAP_ACROSS)));
    if all(first < end) {
      var s: SetUp;
      s.a = bitcast<vec3f>(a.xyz);
      s.b = bitcast<vec3f>(b.xyz);
      s.c = bitcast<vec3f>(set_ups[at + 2u].xyz);
      var slot = NONE;
      for (var y = first.y; y < end.y; y++) {
        for (var x = first.x; x < end.x; x++) {
          let touched = touches(s, part, i32(low.x) + x * BLOCK_TEXELS, i32(low.y) + y * BLOCK_TEXELS);
          if touched != 0u {
            if slot == NONE {
              slot = atomicAdd(&plane_count, 1u);
              keep(slot, s, bitcast<vec3f>(set_ups[at + 3u].xyz));
            }
            let block = u32(y) * MAP_ACROSS + u32(x);
            atomicOr(&masks[((slot >> 5u) * BLOCKS + block) * 2u + touched - 1u], 1u << (slot & 31u));
          }
        }
      }
    }
  }
  workgroupBarrier();
  let used = (workgroupUniformLoad(&plane_count) + 31u) / 32u;
  var any_touches = 0u;
  for (var word = 0u; word < used; word++) {
    let mask = (word * BLOCKS + lane) * 2u;
    any_touches |= atomicLoad(&masks[mask]) | atomicLoad(&masks[mask + 1u]);
  }
  if any_touches != 0u { touched_blocks[atomicAdd(&touched_count, 1u)] = lane; }
  workgroupBarrier();
  let touched = workgroupUniformLoad(&touched_count);
  for (var i = lane / MAP_BLOCK; i < touched; i += WORKGROUP / MAP_BLOCK) {
    let block = touched_blocks[i];
    merge_row(part, low + vec2u(block % MAP_ACROSS, block / MAP_ACROSS) * MAP_BLOCK + vec2u(0u, lane % MAP_BLOCK), block, used);
  }
}

// A row of a block.
fn merge_row(part: MapPart, at: vec2u, block: u32, words: u32) {
  if any(at >= part.end) { return; }
  let left = directions(part, i32(at.x), i32(at.y));
  let right = directions(part, i32(at.x) + 4, i32(at.y));
  let beside = texel_of(part, at) / 4u;
  var of_left = nearest[beside];
  var of_right = nearest[beside + 1u];
  for (var word = 0u; word < words; word++) {
    let mask = (word * BLOCKS + block) * 2u;
    var some = atomicLoad(&masks[mask]);
    var whole = atomicLoad(&masks[mask + 1u]);
    while whole != 0u {
      let index = 12u * (word * 32u + firstTrailingBit(whole));
      whole &= whole - 1u;
      let n = plane(index + 9u);
      of_left = max(of_left, depth_bits(n, left));
      of_right = max(of_right, depth_bits(n, right));
    }
    while some != 0u {
      let index = 12u * (word * 32u + firstTrailingBit(some));
      some &= some - 1u;
      let a = plane(index);
      let b = plane(index + 3u);
      let c = plane(index + 6u);
      let n = plane(index + 9u);
      of_left = select(of_left, max(of_left, depth_bits(n, left)), inside(a, b, c, left, part.size) >= vec4f(0.0));
      of_right = select(of_right, max(of_right, depth_bits(n, right)), inside(a, b, c, right, part.size) >= vec4f(0.0));
    }
  }
  nearest[beside] = of_left;
  nearest[beside + 1u] = of_right;
}
