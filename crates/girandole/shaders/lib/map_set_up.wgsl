// Occluders as the parts of shadow maps see them.
//
// `occluders` begins with a sphere about each cluster. Then come three corners for each of its CLUSTER triangles, with the triangle's
// index in `triangles`.

struct Occluders {
  clusters: u32,
  first_pair: u32, // in `lists`
  slices: u32, // of MAP_SLICE blocks each, of the largest part
}

@group(2) @binding(1) var<storage, read> occluders: array<vec4u>;
@group(2) @binding(2) var<uniform> batch: Occluders;

override CLUSTER: u32;

// Triangles whose boxes have more texels go to the list of their part.
const SMALL = 128;
// How far beside its texels rounding may put what a map shows, texels.
const MARGIN = 0.01;
const SQRT_3 = 1.7320508;

fn light_space(part: MapPart, point: vec3f) -> vec3f {
  let d = point - part.position;
  return vec3f(dot(d, part.x), dot(d, part.y), dot(d, part.z));
}

// Where a point in light space is shown, as multiples of half the map's size about its middle.
fn place(p: vec3f) -> vec2f {
  if PARAMETERISATION == CUBE {
    let a = abs(p);
    if p.z >= max(a.x, a.y) { return 0.5 * p.xy / p.z; }
    if a.x >= a.y { return vec2f(sign(p.x) * (1.0 - 0.5 * p.z / a.x), 0.5 * p.y / a.x); }
    return vec2f(0.5 * p.x / a.y, sign(p.y) * (1.0 - 0.5 * p.z / a.y));
  }
  let w = abs(p.x) + abs(p.y) + p.z;
  return vec2f(p.x + p.y, p.x - p.y) / w;
}

// On which face of the cube.
fn cube_face(p: vec3f) -> u32 {
  let a = abs(p);
  if p.z >= max(a.x, a.y) { return 0u; }
  if a.x >= a.y { return select(1u, 2u, p.x > 0.0); }
  return select(3u, 4u, p.y > 0.0);
}

// Homogeneous coordinates, and the depth there.
fn projected(part: MapPart, p: vec3f) -> vec4f {
  if part.parallel > 0.0 { return vec4f(p.xy, 1.0, 1.0 - p.z); }
  let w = length(p);
  return vec4f(p.xy / max(w + p.z, 1e-3 * w), 1.0, min(NEAR / w, 1.0));
}

struct Box { low: vec2f, high: vec2f }

// Of a triangle of which no edge crosses from one face to another.
fn box_of(p: vec3f, q: vec3f, r: vec3f) -> Box {
  let a = place(p);
  let b = place(q);
  let c = place(r);
  return Box(min(a, min(b, c)), max(a, max(b, c)));
}

fn is_on_one_face(p: vec3f, q: vec3f, r: vec3f) -> bool {
  let least = min(p, min(q, r));
  let most = max(p, max(q, r));
  if PARAMETERISATION == CUBE {
    let face = cube_face(p);
    return least.z > 0.0 && face == cube_face(q) && face == cube_face(r);
  }
  return least.z > 0.0 && least.x * most.x >= 0.0 && least.y * most.y >= 0.0;
}

// Of any triangle before the light's plane, as a whole or in part.
fn box_of_bent(p: vec3f, q: vec3f, r: vec3f) -> Box {
  if PARAMETERISATION == CUBE { return Box(vec2f(-1.0), vec2f(1.0)); }
  var box = Box(vec2f(2.0), vec2f(-2.0));
  var from_point = r;
  var to_point = p;
  // Where edges cross the plane; what is left of the triangle before it has one edge more, in the plane.
  var in_plane: array<vec3f, 2>;
  var crossings = 0u;
  for (var edge = 0; edge < 4; edge++) {
    let is_in_plane = edge == 3;
    if is_in_plane {
      if crossings == 0u { break; }
      from_point = in_plane[0];
      to_point = in_plane[1];
    }
    let t = clamp(from_point.z / (from_point.z - to_point.z), 0.0, 1.0);
    let crossing = vec3f(mix(from_point.xy, to_point.xy, t), 0.0);
    let is_before = vec2<bool>(from_point.z > 0.0 || is_in_plane, to_point.z > 0.0 || is_in_plane);
    if any(is_before) {
      let a = select(crossing, from_point, is_before.x);
      let b = select(crossing, to_point, is_before.y);
      // It has corners where it crosses from one face to another.
      let at = vec4f(0.0, 1.0, a.xy / (a.xy - b.xy));
      for (var i = 0; i < 4; i++) {
        if at[i] >= 0.0 && at[i] <= 1.0 {
          let shown = place(mix(a, b, at[i]));
          box = Box(min(box.low, shown), max(box.high, shown));
        }
      }
    }
    if is_before.x != is_before.y {
      in_plane[crossings & 1u] = crossing;
      crossings++;
    }
    let next = select(r, q, edge == 0);
    from_point = to_point;
    to_point = next;
  }
  return box;
}

fn corner_at(triangle: u32) -> u32 { return batch.clusters + 3u * triangle; }

// A triangle in light space; where maps show it in homogeneous coordinates, in those, with its depths.
struct Corners { p: vec3f, q: vec3f, r: vec3f, depths: vec3f, is_before: bool }

// By its index among the clusters'.
fn corners(part: MapPart, triangle: u32) -> Corners {
  let at = corner_at(triangle);
  let p = light_space(part, bitcast<vec3f>(occluders[at].xyz));
  let q = light_space(part, bitcast<vec3f>(occluders[at + 1u].xyz));
  let r = light_space(part, bitcast<vec3f>(occluders[at + 2u].xyz));
  let is_before = max(p.z, max(q.z, r.z)) > 0.0 || part.parallel > 0.0;
  if is_affine(part) {
    let a = projected(part, p);
    let b = projected(part, q);
    let c = projected(part, r);
    return Corners(a.xyz, b.xyz, c.xyz, vec3f(a.w, b.w, c.w), is_before);
  }
  return Corners(p, q, r, vec3f(0.0), is_before);
}

// The planes of a triangle; none of them where it is seen edge-on.
fn planes(part: MapPart, c: Corners) -> SetUp {
  let pq = c.q - c.p;
  let qr = c.r - c.q;
  let rp = c.p - c.r;
  let across = cross(rp, pq);
  let volume = dot(across, c.p);
  let side = sign(volume);
  var s: SetUp;
  // (p + q) × (q − p) = 2 p × q, and exactly the opposite for the other triangle at this edge.
  s.a = cross(c.p + c.q, pq) * side;
  s.b = cross(c.q + c.r, qr) * side;
  s.c = cross(c.r + c.p, rp) * side;
  s.room = vec3f(enlarged(s.a, part.size), enlarged(s.b, part.size), enlarged(s.c, part.size));
  s.is_seen = volume != 0.0;
  let size = f32(part.size);
  if is_affine(part) {
    let bent = cross(c.r, c.p) * (c.depths.y - c.depths.x) + cross(c.p, c.q) * (c.depths.z - c.depths.x);
    s.n = (bent / volume + vec3f(0.0, 0.0, c.depths.x)) / size;
  } else {
    s.n = across * (NEAR / (volume * size));
  }
  return s;
}

// What of a part a triangle may cover, and its planes; `end` is `first` where that is nothing.
fn set_up(part: MapPart, triangle: u32) -> SetUp {
  let c = corners(part, triangle);
  var box: Box;
  if is_affine(part) {
    let map = parallel_map_of(part);
    box = Box(
      shown_at(map, min(c.p.xy, min(c.q.xy, c.r.xy))), shown_at(map, max(c.p.xy, max(c.q.xy, c.r.xy))));
  } else {
    box = box_of(c.p, c.q, c.r);
    // Few do; loops are jumped over where no lane does, which software devices do not do with branches.
    for (var is_bent = c.is_before && !is_on_one_face(c.p, c.q, c.r); is_bent; is_bent = false) {
      box = box_of_bent(c.p, c.q, c.r);
    }
  }
  let size = f32(part.size);
  let half = 0.5 * size;
  let low = ceil(clamp(box.low * half + (half - 0.5 - MARGIN), vec2f(-1.0), vec2f(size)));
  let high = floor(clamp(box.high * half + (half - 0.5 + MARGIN), vec2f(-1.0), vec2f(size)));
  let first = max(vec2i(low), vec2i(part.first));
  let end = min(vec2i(high) + 1, vec2i(part.end));
  var s: SetUp;
  // Most triangles end here: their planes are found only for the others.
  for (var is_found = false; c.is_before && all(first < end) && !is_found; is_found = true) {
    s = planes(part, c);
    if s.is_seen {
      s.first = first;
      s.end = end;
    }
  }
  return s;
}

// Whether triangles of a cluster may cover texels of a part.
fn may_cover(part: MapPart, cluster: u32) -> bool {
  let sphere = bitcast<vec4f>(occluders[cluster]);
  let p = light_space(part, sphere.xyz);
  let half = 0.5 * f32(part.size);
  var box: Box;
  if part.parallel > 0.0 {
    let reach = vec2f(length(part.x), length(part.y)) * sphere.w;
    let map = parallel_map_of(part);
    box = Box(shown_at(map, p.xy - reach), shown_at(map, p.xy + reach));
  } else {
    if p.z + sphere.w <= 0.0 { return false; }
    if PARAMETERISATION != OCTAHEDRAL { return true; }
    let w = abs(p.x) + abs(p.y) + p.z;
    let least = w - sphere.w * SQRT_3;
    if min(abs(p.x), abs(p.y)) <= sphere.w || least <= 0.0 || p.z <= sphere.w { return true; }
    // Of a place u / w on a face the gradient is (U − place W) / w, and |U − place W|² = 2 − 2 place (U·W) + 3 place².
    let middle = vec2f(p.x + p.y, p.x - p.y) / w;
    let s = sign(p.xy);
    let reach = (sphere.w / least) * sqrt((middle * 3.0 - 2.0 * vec2f(s.x + s.y, s.x - s.y)) * middle + 2.0);
    box = Box(middle - reach, middle + reach);
  }
  let low = box.low * half + (half - 0.5 - MARGIN);
  let high = box.high * half + (half - 0.5 + MARGIN);
  let count = floor(high) - ceil(low) + 1.0;
  return all(count >= vec2f(1.0)) && all(high >= vec2f(part.first)) && all(low < vec2f(part.end));
}

// Bits of the 32 clusters from a multiple of that on.
fn hidden_bits(part: MapPart, first: u32) -> u32 {
  let word = part.hidden + first / 32u;
  return parts[word / 4u][word % 4u];
}

fn is_hidden(part: MapPart, cluster: u32) -> bool { return ((hidden_bits(part, cluster) >> (cluster % 32u)) & 1u) != 0u; }

// The same of the MAP_CLUSTERS from a multiple of that on, if there are so many.
fn are_hidden(part: MapPart, first: u32) -> bool {
  return first + MAP_CLUSTERS <= batch.clusters && (hidden_bits(part, first) & hidden_bits(part, first + 32u)) == 0xffffffffu;
}
