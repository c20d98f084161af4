// Rasterises triangles that are small in an octahedral map, one an invocation: its edges' signs at the texels' centres in its
// box (Pineda 1988), and the nearest depth of each texel by an atomic maximum.
@group(2) @binding(3) var<storage, read> positions: array<f32>;
@group(2) @binding(4) var<storage, read> pieces: array<u32>; // face | (piece << 3)
@group(2) @binding(5) var<storage, read> texels: array<MapTexel>;
@group(2) @binding(6) var<storage, read_write> nearest: array<atomic<u32>>; // depths' bits, 0 where nothing is

override CLUSTER: u32; // triangles in a piece

// Corners lie on a grid of this many steps a texel, as in the rasterisers of devices: then triangles that share an edge leave
// no gap.
const STEPS: i32 = 256;
const HALF: i32 = 128;
const SHIFT: vec2u = vec2u(8u);
// By how many steps triangles are enlarged, lest there be gaps to those that the device rasterises.
const MARGIN: i32 = 1;

// Adds to a part what blocks at a texel of its map.
fn add(part: RefreshedPart, texel: vec2u, depth: f32) {
  let at = texel - part.first;
  atomicMax(&nearest[part.nearest + at.y * (part.end.x - part.first.x) + at.x], bitcast<u32>(depth));
}

struct Corner { place: vec2i, inverse: f32 }

fn projected_corner(light: Light, signs: vec2f, index: u32) -> Corner {
  let i = 3u * index;
  let uv_w = octahedral_face(light_space(light, vec3f(positions[i], positions[i + 1u], positions[i + 2u])), signs);
  let inverse = 1.0 / uv_w.z;
  return Corner(vec2i(round(uv_w.xy * inverse * map_size(light) * f32(STEPS))), inverse);
}

// Twice the area of a triangle with an edge from `a` to `b`, in steps, at the first centre; and what it changes by from one
// column and row to the next.
fn edge(a: vec2i, b: vec2i, center: vec2i) -> vec3i {
  let d = b - a;
  let to = center - a;
  return vec3i(d.x * to.y - d.y * to.x, -d.y * STEPS, d.x * STEPS);
}

fn rasterize(part: RefreshedPart, light: Light, piece: u32, triangle: u32) {
  let signs = octahedral_signs(piece & 7u);
  let index = ((piece >> 3u) * CLUSTER + triangle) * 3u;
  let a = projected_corner(light, signs, index);
  var b = projected_corner(light, signs, index + 1u);
  var c = projected_corner(light, signs, index + 2u);
  let low = min(a.place, min(b.place, c.place)) - MARGIN;
  let high = max(a.place, max(b.place, c.place)) + MARGIN;
  // Centres lie half a texel from whole ones.
  let first = max((low + (HALF - 1)) >> SHIFT, vec2i(part.first));
  let end = min(((high - HALF) >> SHIFT) + 1, vec2i(part.end));
  if any(first >= end) { return; }
  let ab = b.place - a.place;
  let ac = c.place - a.place;
  var twice_area = ab.x * ac.y - ab.y * ac.x;
  if twice_area == 0 { return; }
  if twice_area < 0 {
    let other = b;
    b = c;
    c = other;
    twice_area = -twice_area;
  }
  let center = first * STEPS + HALF;
  let edges = array<vec3i, 3>(
    edge(b.place, c.place, center), edge(c.place, a.place, center), edge(a.place, b.place, center)
  );
  let at_first = vec3i(edges[0].x, edges[1].x, edges[2].x);
  let by_column = vec3i(edges[0].y, edges[1].y, edges[2].y);
  let by_row = vec3i(edges[0].z, edges[1].z, edges[2].z);
  let least = -MARGIN * (abs(by_column) + abs(by_row)) / STEPS;
  let inverses = vec3f(a.inverse, b.inverse, c.inverse);
  let nearest_corner = max(inverses.x, max(inverses.y, inverses.z));
  let farthest_corner = min(inverses.x, min(inverses.y, inverses.z));
  let size = i32(map_size(light));
  let face = vec2i(signs);
  let columns = u32(end.x - first.x);
  let count = columns * u32(end.y - first.y);
  var sides = at_first;
  var column = 0u;
  var row = 0u;
  // First which of 32 texels are covered, then the depths of those: of a box, few are.
  for (var start = 0u; start < count; start += 32u) {
    var covered = 0u;
    let some = min(count - start, 32u);
    for (var i = 0u; i < some; i++) {
      covered |= select(0u, 1u << i, all(sides >= least));
      column += 1u;
      sides += by_column;
      if column == columns {
        column = 0u;
        row += 1u;
        sides = at_first + by_row * i32(row);
      }
    }
    while covered != 0u {
      let texel = start + firstTrailingBit(covered);
      covered &= covered - 1u;
      // Exact for all numbers of texels that a piece may cover.
      let y = u32((f32(texel) + 0.5) / f32(columns));
      let x = texel - y * columns;
      let place = first + vec2i(i32(x), i32(y));
      let weights = vec3f(at_first + by_column * i32(x) + by_row * i32(y));
      let inverse = clamp(dot(weights, inverses) / f32(twice_area), farthest_corner, nearest_corner);
      // Whether the centre is on the face, or on its seam.
      let beyond = face * vec2i(place.x + place.y + 1 - size, place.x - place.y);
      if all(beyond >= vec2i(0)) { add(part, vec2u(place), min(NEAR * inverse, 1.0)); }
    }
  }
}

// A column of workgroups a part.
@compute @workgroup_size(WORKGROUP)
fn rasterize_pieces(
  @builtin(workgroup_id) group: vec3u,
  @builtin(num_workgroups) groups: vec3u,
  @builtin(local_invocation_id) lane: vec3u,
) {
  let part = parts[group.x];
  let light = lights[part.light];
  let first = group.y * WORKGROUP + lane.x;
  let step = groups.y * WORKGROUP;
  for (var i = part.first_piece * CLUSTER + first; i < part.end_piece * CLUSTER; i += step) {
    rasterize(part, light, pieces[i / CLUSTER], i % CLUSTER);
  }
  for (var i = part.first_texel + first; i < part.end_texel; i += step) {
    let t = texels[i];
    add(part, vec2u(t.place & 0xffffu, t.place >> 16u), t.depth);
  }
}
