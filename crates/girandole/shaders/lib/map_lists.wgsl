// What triangles that are large on a part of a map leave to the passes after theirs.
//
// `lists`: workgroups in x, y and z for `large_map_triangles` (indirect arguments), and how many pairs it has; then how many large
// triangles each part has; then those, as far as there is room, from `first_listed` of the part: triangle, columns, rows of its box; then the
// pairs, part · clusters + cluster, of what had none.

override MOST_LISTED: u32;

const PAIRS = 3u;

// Large triangles of a part that there is room for.
fn listed_room(part: MapPart) -> u32 {
  let size = part.end - part.first;
  return min(size.x * size.y / MAP_LISTED, MOST_LISTED);
}

// Whether a triangle may cover a texel of a block: none (0), some (1), all of them (2). Its functions are linear on a block, or on
// either side of a diagonal. What rounds differently within the block is left to the texels' own tests, so that whatever looks at a
// triangle, by blocks or not, finds the same to the bit.
fn touches(s: SetUp, part: MapPart, x: i32, y: i32) -> u32 {
  let d = directions_at(part, x + vec4i(0, 7, 0, 7), y + vec4i(0, 0, 7, 7));
  let a = along(s.a, d);
  let b = along(s.b, d);
  let c = along(s.c, d);
  let most = max(max(vec3f(a.x, b.x, c.x), vec3f(a.y, b.y, c.y)), max(vec3f(a.z, b.z, c.z), vec3f(a.w, b.w, c.w)));
  let least = min(min(vec3f(a.x, b.x, c.x), vec3f(a.y, b.y, c.y)), min(vec3f(a.z, b.z, c.z), vec3f(a.w, b.w, c.w)));
  let corner = vec2i(x, y);
  let is_in_box = all(corner >= s.first) && all(corner + BLOCK_TEXELS <= s.end);
  let is_whole = is_in_box && all(least >= WHOLE * s.room);
  return select(0u, select(1u, MOST_TOUCHED, is_whole), all(most >= -NEVER * s.room));
}

// Twice the rounding of a product of three, 2.4e-7 of its largest terms, less and more than what triangles are enlarged by.
const WHOLE = 4.0;
const NEVER = 6.0;

// Columns or rows from a first one to before the last, in a word.
fn packed_range(first: i32, end: i32) -> u32 { return u32(first) | (u32(end) << 16u); }

fn box_first(x: u32, y: u32) -> vec2i { return vec2i(vec2u(x, y) & vec2u(0xffffu)); }

fn box_end(x: u32, y: u32) -> vec2i { return vec2i(vec2u(x, y) >> vec2u(16u)); }
