// Merges the listed triangles into the texels beside the maps, in those blocks that they touch.

@group(2) @binding(4) var<storage, read_write> nearest: array<vec4u>; // the texels, four each
@group(2) @binding(5) var<storage, read> lists: array<u32>;
@group(2) @binding(6) var<storage, read> set_ups: array<vec4u>;

// Blocks of a workgroup, as many as it has lanes.
const BLOCKS = MAP_ACROSS * MAP_ACROSS;
const WORDS = (MAP_LISTED + 31u) / 32u;
// Words of a set-up: three planes, the depth, the box.
const SET_UP = 14u;

// Triangles that touch any of the blocks, as scalars: software devices load vectors slowly.
var<workgroup> kept: array<u32, SET_UP * MAP_LISTED>;
var<workgroup> kept_count: atomic<u32>;
// Of each block and 32 such triangles: which cover some of its texels, and all.
var<workgroup> masks: array<atomic<u32>, 2u * BLOCKS * WORDS>;
// Blocks that any triangle touches.
var<workgroup> touched_blocks: array<u32, BLOCKS>;
var<workgroup> touched_count: atomic<u32>;

fn keep_plane(at: u32, plane: vec4u) {
  kept[at] = plane.x;
  kept[at + 1u] = plane.y;
  kept[at + 2u] = plane.z;
}

fn plane(at: u32) -> vec3f { return bitcast<vec3f>(vec3u(kept[at], kept[at + 1u], kept[at + 2u])); }

fn box_first(x: u32, y: u32) -> vec2i { return vec2i(vec2u(x, y) & vec2u(0xffffu)); }

fn box_end(x: u32, y: u32) -> vec2i { return vec2i(vec2u(x, y) >> vec2u(16u)); }

fn kept_at(at: u32) -> SetUp {
  let x = kept[at + 12u];
  let y = kept[at + 13u];
  return SetUp(plane(at), plane(at + 3u), plane(at + 6u), plane(at + 9u), box_first(x, y), box_end(x, y));
}

// A column of workgroups a part.
@compute @workgroup_size(WORKGROUP)
fn merge_large_triangles(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
  let part = parts[group.y];
  let across = (part.end.x - part.first.x + MAP_ACROSS * MAP_BLOCK - 1u) / (MAP_ACROSS * MAP_BLOCK);
  let low = part.first + vec2u(group.x % across, group.x / across) * (MAP_ACROSS * MAP_BLOCK);
  let count = min(lists[MAP_LISTS_HEAD + group.y], MAP_LISTED);
  if count == 0u || low.y >= part.end.y { return; }
  let words = (count + 31u) / 32u;
  for (var i = lane; i < 2u * BLOCKS * words; i += WORKGROUP) { atomicStore(&masks[i], 0u); }
  if lane == 0u {
    atomicStore(&kept_count, 0u);
    atomicStore(&touched_count, 0u);
  }
  workgroupBarrier();
  let low_block = vec2i(low / MAP_BLOCK);
  for (var triangle = lane; triangle < count; triangle += WORKGROUP) {
    let at = part.first_set_up + 4u * triangle;
    let a = set_ups[at];
    let b = set_ups[at + 1u];
    let first = max(box_first(a.w, b.w) / BLOCK_TEXELS - low_block, vec2i(0));
    let end = min((box_end(a.w, b.w) + BLOCK_TEXELS - 1) / BLOCK_TEXELS - low_block, vec2i(i32(MAP_ACROSS)));
    if all(first < end) {
      var s: SetUp;
      s.a = bitcast<vec3f>(a.xyz);
      s.b = bitcast<vec3f>(b.xyz);
      let c = set_ups[at + 2u];
      s.c = bitcast<vec3f>(c.xyz);
      s.first = box_first(a.w, b.w);
      s.end = box_end(a.w, b.w);
      var slot = NONE;
      for (var y = first.y; y < end.y; y++) {
        for (var x = first.x; x < end.x; x++) {
          let touched = touches(s, part, i32(low.x) + x * BLOCK_TEXELS, i32(low.y) + y * BLOCK_TEXELS);
          if touched != 0u {
            if slot == NONE {
              slot = atomicAdd(&kept_count, 1u);
              let to = SET_UP * slot;
              keep_plane(to, a);
              keep_plane(to + 3u, b);
              keep_plane(to + 6u, c);
              keep_plane(to + 9u, set_ups[at + 3u]);
              kept[to + 12u] = a.w;
              kept[to + 13u] = b.w;
            }
            let block = u32(y) * MAP_ACROSS + u32(x);
            atomicOr(&masks[((slot >> 5u) * BLOCKS + block) * 2u + touched - 1u], 1u << (slot & 31u));
          }
        }
      }
    }
  }
  workgroupBarrier();
  let used = (workgroupUniformLoad(&kept_count) + 31u) / 32u;
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
      let n = plane(SET_UP * (word * 32u + firstTrailingBit(whole)) + 9u);
      whole &= whole - 1u;
      of_left = max(of_left, depth_bits(n, left));
      of_right = max(of_right, depth_bits(n, right));
    }
    while some != 0u {
      let s = kept_at(SET_UP * (word * 32u + firstTrailingBit(some)));
      some &= some - 1u;
      let x = i32(at.x);
      let y = i32(at.y);
      of_left = select(of_left, max(of_left, depth_bits(s.n, left)), covers(s, left, x, y, part.size));
      of_right = select(of_right, max(of_right, depth_bits(s.n, right)), covers(s, right, x + 4, y, part.size));
    }
  }
  nearest[beside] = of_left;
  nearest[beside + 1u] = of_right;
}
