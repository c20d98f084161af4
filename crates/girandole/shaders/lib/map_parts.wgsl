// Parts of shadow maps that are drawn, and what a triangle is from there.
//
// A map is ray cast at its texels' centres. The direction `d` of a centre, times the map's size, has whole numbers for
// coordinates. A triangle with corners p, q, r relative to the light covers the centre where d lies on one side of the three
// planes through the light and its edges; there it is at n·d / n·p of the way. Nothing is projected, so that nothing has to be
// clipped, and faces of maps have no seams. Where rays are parallel, and in parabolic maps, where corners are projected as in
// the thesis, the same holds in homogeneous coordinates: p = (x, y, 1).

struct MapPart {
  position: vec3f, // of the light
  parallel: f32, // 0 for light that is not, else 1 + what `parallel_map` takes
  x: vec3f, // the map's axes in the world, for parallel light over half its width
  first_listed: u32, // of its large triangles, in `lists`
  y: vec3f,
  hidden: u32, // the word in `parts` with which bits of clusters begin: whether something static hides them from the light
  z: vec3f, // for parallel light over the diameter of the scene
  size: u32, // texels across the map
  first: vec2u, // columns and rows of the part: multiples of MAP_BLOCK
  end: vec2u,
  origin: vec2u, // of the map in its page
  page: u32,
  texels: u32, // first of its texels beside the maps
}

// Texels across a block. Faces of the octahedron and the cube meet at diagonals and sides of blocks.
const BLOCK_TEXELS = i32(MAP_BLOCK);
// Of how much of a texel triangles are enlarged for each texel of the map's width: kernels round differently, and edges that
// triangles share must not fall between them.
const ENLARGED = 1e-7;

override PARAMETERISATION: u32; // OCTAHEDRAL, PARABOLIC or CUBE
override NEAR: f32; // metres; only a unit: depth is NEAR / norm

// The parts of a batch, and the bits of clusters.
@group(2) @binding(0) var<storage, read> parts: array<vec4u>;

fn part_at(index: u32) -> MapPart {
  let at = 6u * index;
  let a = parts[at];
  let b = parts[at + 1u];
  let c = parts[at + 2u];
  let d = parts[at + 3u];
  let e = parts[at + 4u];
  let f = parts[at + 5u];
  return MapPart(bitcast<vec3f>(a.xyz), bitcast<f32>(a.w), bitcast<vec3f>(b.xyz), b.w, bitcast<vec3f>(c.xyz), c.w, bitcast<vec3f>(d.xyz), d.w,
    e.xy, e.zw, f.xy, f.z, f.w);
}

// A triangle from a light: the planes through its edges, and its depth, by direction; the texels that it may cover; whether it is
// seen other than edge-on. `room` is how far outside of the planes what it covers may lie.
struct SetUp { a: vec3f, is_seen: bool, b: vec3f, c: vec3f, n: vec3f, room: vec3f, first: vec2i, end: vec2i }

// Directions of four centres in a row.
struct Directions { x: vec4f, y: vec4f, z: vec4f }

fn is_affine(part: MapPart) -> bool {
  return part.parallel > 0.0 || PARAMETERISATION == PARABOLIC;
}

fn parallel_map_of(part: MapPart) -> ParallelMap { return parallel_map(max(part.parallel - 1.0, 0.0)); }

// `place_shown`, times the map's size, along an axis.
fn spread(map: ParallelMap, at: vec4i, size: i32) -> vec4f {
  let a = abs(vec4f(at));
  let core = vec4f(CORE * f32(size));
  let beyond = max(a - core, vec4f(0.0));
  return sign(vec4f(at)) * map.spacing * (min(a, core) + beyond / (1.0 - map.growth / f32(size) * beyond));
}

fn directions_at(part: MapPart, x: vec4i, y: vec4i) -> Directions {
  let s = i32(part.size);
  if is_affine(part) {
    let map = parallel_map_of(part);
    return Directions(spread(map, 2 * x + (1 - s), s), spread(map, 2 * y + (1 - s), s), vec4f(f32(s)));
  }
  if PARAMETERISATION == CUBE {
    let u = 4 * x + (2 - 2 * s);
    let v = 4 * y + (2 - 2 * s);
    let is_top = max(abs(u), abs(v)) <= vec4i(s);
    let is_x = abs(u) >= abs(v);
    let beyond = vec4i(2 * s) - max(abs(u), abs(v));
    let side_x = select(u, sign(u) * s, is_x);
    let side_y = select(sign(v) * s, v, is_x);
    return Directions(
      vec4f(select(side_x, u, is_top)), vec4f(select(side_y, v, is_top)), vec4f(select(beyond, vec4i(s), is_top)));
  }
  let qx = x + y + (1 - s);
  let qy = x - y;
  return Directions(vec4f(qx), vec4f(qy), vec4f(s - abs(qx) - abs(qy)));
}

fn directions(part: MapPart, x: i32, y: i32) -> Directions {
  return directions_at(part, x + vec4i(0, 1, 2, 3), vec4i(y));
}

// One rounding everywhere but where compilers fuse operations.
fn along(a: vec3f, d: Directions) -> vec4f {
  return a.x * d.x + (a.y * d.y + a.z * d.z);
}

fn enlarged(a: vec3f, size: u32) -> f32 {
  return max(abs(a.x), max(abs(a.y), abs(a.z))) * (ENLARGED * f32(size));
}

// Which of four texels in a row a triangle covers. The box counts, too: planes that are enlarged meet beyond thin tips.
fn covers(s: SetUp, d: Directions, x: i32, y: i32) -> vec4<bool> {
  let inside = min(along(s.a, d) + s.room.x, min(along(s.b, d) + s.room.y, along(s.c, d) + s.room.z));
  let column = x + vec4i(0, 1, 2, 3);
  let is_in_rows = y >= s.first.y && y < s.end.y;
  return (inside >= vec4f(0.0)) & (column >= vec4i(s.first.x)) & (column < vec4i(s.end.x)) & vec4<bool>(is_in_rows);
}

// Positive numbers are ordered like their bits.
fn depth_bits(n: vec3f, d: Directions) -> vec4u {
  return bitcast<vec4u>(clamp(along(n, d), vec4f(0.0), vec4f(1.0)));
}

// Rows of a part beside the maps begin at multiples of 64 texels: 256 bytes, as copies from buffers to textures ask for.
fn texel_of(part: MapPart, at: vec2u) -> u32 {
  let stride = (part.end.x - part.first.x + 63u) & 0xffffffc0u;
  return part.texels + (at.y - part.first.y) * stride + at.x - part.first.x;
}
