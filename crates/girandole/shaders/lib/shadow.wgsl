// Shadow look-up: is the light seen from `position`, whose geometric normal `ng` faces it?
//
// A map holds distances along the directions of texel centres. The receiver's own plane is therefore compared where
// the texel's centre sees it, not where `position` does: for a plane the comparison is exact at any slope, so the
// only bias needed is that of rounding: of distances (SLACK) and of texels' directions (FOOTPRINT, a fraction of a texel's
// footprint along the normal). Where the centre's ray passes beyond `position` towards another surface, the
// nearer of the two distances counts, lest the wall behind a floor darken the floor's last row of texels.

override FILTER: u32; // percentage-closer filter: width in texels, 0 = the nearest texel

const SLACK = 2e-5;
// The same for parallel light, as a share of the scene's extent: of a large site it is to be thinner than a roof.
const PARALLEL_SLACK = 2e-6;
const FOOTPRINT = 0.002;
// Blockers farther than this share of the distance in front of the receiver block without a slope-corrected test.
const NEARBY = 0.95;
// The same for parallel light, in texels.
const CLOSE = 4.0;
// What remains in hollows of finely tessellated surfaces at most, in texels' footprints: as much as the surface bends, and never more.
const HOLLOW = 0.2;
const PARALLEL_HOLLOW = 0.35;
// Second differences of depths, as a share of them, that are rounding: those of a plane.
const STRAIGHT = 1e-5;
// Where light grazes, the allowances for rounding are no more than this share of the distance.
const GRAZING = 0.1;

const LIT = 1u;
const DARK = 0u;
const AMBIGUOUS = 2u; // the slope-corrected test decides

// A receiver as a light's map sees it.
struct Receiver {
  uv: vec2f, // its position in the map's square
  normal: vec3f, // geometric, in light space
  height: f32, // distance of its plane to the light, > 0; for parallel light: depth in units of the scene's radius
  slope: f32, // height / norm of its position; for parallel light: units of depth in a unit across
}

// `height` is that of the light over the receiver's plane.
fn receiver(light: Light, position: vec3f, ng: vec3f, height: f32) -> Receiver {
  let d = position - light.position;
  let bitangent = cross(light.normal, light.tangent);
  let p = vec3f(dot(d, light.tangent), dot(d, bitangent), dot(d, light.normal));
  let normal = vec3f(dot(ng, light.tangent), dot(ng, bitangent), dot(ng, light.normal));
  if is_parallel(light) {
    let uv = shown_at(parallel_map_of(light), p.xy * light.scale) * 0.5 + 0.5;
    return Receiver(uv, normal, p.z * light.offset, light.offset / light.scale);
  }
  let inverse = 1.0 / norm(p);
  return Receiver(encode(p * inverse), normal, height, height * inverse);
}

fn is_parallel(light: Light) -> bool {
  return !ONLY_COSINE_LIGHTS && light.profile >= DIRECTIONAL;
}

fn parallel_map_of(light: Light) -> ParallelMap { return parallel_map(light.rectangle.z); }

// Parallel light: the width of a texel there, as a share of that of what the map shows.
fn texel_width(light: Light, uv: vec2f) -> f32 {
  return map_texel(light) * spacing_at(parallel_map_of(light), uv * 2.0 - 1.0);
}

fn texel_of(light: Light, uv: vec2f) -> vec2u {
  return min(vec2u(uv * map_size(light)), vec2u(u32(map_size(light)) - 1u));
}

fn centre_of(light: Light, texel: vec2u) -> vec2f {
  return (vec2f(texel) + 0.5) * map_texel(light);
}

// Column, row and page of a map's texel.
fn in_atlas(light: Light, texel: vec2u) -> vec3u {
  return vec3u(map_origin(light) + texel, map_page(light));
}

fn stored_at(light: Light, texel: vec2u) -> f32 {
  let at = in_atlas(light, texel);
  return atlas_at(at.xy, at.z);
}

// Parallel rays: depth is linear. That of the receiver, of its plane at a texel's centre, what both may be wrong by, and
// the width of a texel.
struct PlaneDepth { here: f32, at_centre: f32, allowance: f32, texel: f32 }

fn plane_depth(light: Light, r: Receiver, centre: vec2f) -> PlaneDepth {
  let flat = max(-r.normal.z, 1e-3);
  let map = parallel_map_of(light);
  let across = 0.5 * (place_shown(map, centre * 2.0 - 1.0) - place_shown(map, r.uv * 2.0 - 1.0));
  let shift = dot(r.normal.xy, across) / flat * r.slope;
  let here = 1.0 - r.height * 0.5;
  let texel = texel_width(light, centre) * r.slope;
  return PlaneDepth(here, here - shift, PARALLEL_SLACK + 0.5 * FOOTPRINT * texel / flat, texel);
}

// One texel: LIT, DARK or AMBIGUOUS. A light without a map lights nothing that needs it.
fn depth_test(light: Light, r: Receiver, texel: vec2u, stored: f32) -> u32 {
  return select(compared(light, r, texel, stored), DARK, light.atlas_slot == NO_MAP);
}

fn compared(light: Light, r: Receiver, texel: vec2u, stored: f32) -> u32 {
  let centre = centre_of(light, texel);
  if is_parallel(light) {
    // What is not much nearer than the plane, or farther, is left to the slope-corrected test.
    let d = plane_depth(light, r, centre);
    if abs(stored - d.at_centre) <= d.allowance { return LIT; }
    return select(AMBIGUOUS, DARK, stored > max(d.here, d.at_centre) + d.allowance + CLOSE * d.texel);
  }
  let here = max(-dot(r.normal, decode(centre)), r.slope);
  let allowance = min(FOOTPRINT * map_texel(light), GRAZING * r.slope);
  let seen = stored * r.height;
  let near = select(DARK, AMBIGUOUS, seen * NEARBY <= NEAR * r.slope);
  return select(near, LIT, seen <= NEAR * (here * (1.0 + SLACK) + allowance));
}

// The shadow test: the depth test, and a closer look where that is ambiguous, or where a joint may be between receiver and light.
fn passes_shadow_test(light: Light, r: Receiver, texel: vec2u, stored: f32, is_jointed: bool) -> bool {
  let answer = depth_test(light, r, texel, stored);
  if answer == AMBIGUOUS || (answer == LIT && is_jointed) { return is_lit_closely(light, r, texel, stored, answer == LIT); }
  return answer == LIT;
}

// Slope-corrected tests. Where what is seen is nearer than the receiver, but not by much, as at the foot of a wall or in a hollow, it need
// not be in the way. Extrapolate it by its own slope to the receiver's position: only what is still nearer there blocks.
//
// Where a wall stands on the receiver's surface (`is_jointed`), the texel's centre may see that surface, or nothing, before the wall that
// hides the receiver. What texels next to it show before the surface, towards the receiver, is therefore extrapolated. It hides the
// receiver if it is nearer there, and beyond the surface at the texel's centre, as at a joint: at other edges it is nearer at both.
fn is_lit_closely(light: Light, r: Receiver, texel: vec2u, stored: f32, is_jointed: bool) -> bool {
  if is_parallel(light) && !is_jointed {
    let d = plane_depth(light, r, centre_of(light, texel));
    if stored < min(d.here, d.at_centre) { return is_lit_beside(light, r, texel); }
  }
  let offset = (r.uv - centre_of(light, texel)) * map_size(light);
  let towards = vec2i(sign(offset));
  let at_centre = max(stored, plane_at(light, r, texel)) * (1.0 + SLACK);
  for (var i = select(0, 1, is_jointed); i < select(1, 4, is_jointed); i++) {
    let by = towards * vec2i(i & 1, i >> 1);
    let next = clamp(vec2i(texel) + by, vec2i(0), vec2i(i32(map_size(light)) - 1));
    let seen = stored_at(light, vec2u(next));
    let plane = plane_at(light, r, vec2u(next));
    if is_jointed && seen <= plane * (1.0 + SLACK) { continue; }
    let slope = slope_at(light, next, seen, seen >= plane);
    let at_receiver = seen + dot(slope.gradient, offset - vec2f(by));
    let counts = !is_jointed || seen - dot(slope.gradient, vec2f(by)) <= at_centre;
    if counts && !is_lit_behind(light, r, at_receiver, slope.bend) { return false; }
  }
  return true;
}

// The slope-corrected test for what was extrapolated to the receiver's position on a surface that bends by so much.
fn is_lit_behind(light: Light, r: Receiver, extrapolated: f32, bend: f32) -> bool {
  if is_parallel(light) {
    let footprint = texel_width(light, r.uv) / max(-r.normal.z, GRAZING) * r.slope;
    let allowance = clamp(bend, FOOTPRINT * footprint, PARALLEL_HOLLOW * footprint);
    return extrapolated <= 1.0 - r.height * 0.5 + PARALLEL_SLACK + allowance;
  }
  let hollow = clamp(bend * r.height / NEAR, FOOTPRINT * map_texel(light), HOLLOW * map_texel(light));
  return extrapolated * r.height <= NEAR * (r.slope * (1.0 + SLACK) + min(hollow, GRAZING * r.slope));
}

// A texel of parallel light that looks past the receiver's plane, as beyond the edge of a roof, tells nothing of the receiver: those
// next to it decide. It is dark where one of them shows something before the receiver's plane, and none that plane.
fn is_lit_beside(light: Light, r: Receiver, texel: vec2u) -> bool {
  let towards = vec2i(sign(r.uv - centre_of(light, texel)));
  var is_dark = false;
  for (var i = 1; i < 4; i++) {
    let next = clamp(vec2i(texel) + towards * vec2i(i & 1, i >> 1), vec2i(0), vec2i(i32(map_size(light)) - 1));
    let d = plane_depth(light, r, centre_of(light, vec2u(next)));
    let stored = stored_at(light, vec2u(next));
    if abs(stored - d.at_centre) <= d.allowance { return true; }
    if stored > d.at_centre { is_dark = true; }
  }
  return !is_dark;
}

// What a texel would store that saw the receiver's plane.
fn plane_at(light: Light, r: Receiver, texel: vec2u) -> f32 {
  let centre = centre_of(light, texel);
  if is_parallel(light) { return plane_depth(light, r, centre).at_centre; }
  return NEAR * max(-dot(r.normal, decode(centre)), 0.0) / r.height;
}

// Change of stored depth a texel on the surface that `stored` belongs to, and by how much that bends about the texel: what is extrapolated
// may be wrong by that. A surface that is straight and before the receiver's plane is not the receiver's own.
struct Slope { gradient: vec2f, bend: f32 }

// Of four axes the two along which the surface is straightest: in a corner of walls it reaches two texels along few.
fn slope_at(light: Light, at: vec2i, stored: f32, is_before: bool) -> Slope {
  let level = straighter(along_axis(light, at, vec2i(1, 0), stored), along_axis(light, at, vec2i(0, 1), stored));
  let diagonal = straighter(along_axis(light, at, vec2i(1, 1), stored), along_axis(light, at, vec2i(1, -1), stored));
  let swapped = diagonal.a.w < level.a.w;
  let a = select(level.a, diagonal.a, swapped);
  let second = select(level.b, diagonal.b, swapped);
  let third = select(diagonal.a, level.a, swapped);
  let b = select(second, third, vec4<bool>(third.w < second.w));
  let gradient = vec2f(a.z * b.y - b.z * a.y, a.x * b.z - b.x * a.z) / (a.x * b.y - b.x * a.y);
  let is_straight = b.w <= STRAIGHT * stored && is_before;
  let bend = max(level.bend, diagonal.bend) - STRAIGHT * stored;
  return Slope(gradient, select(bend, 0.0, is_straight));
}

// Axes, with the change along them and its second difference; the straighter one first. `bend` is the larger second difference across
// the texel itself.
struct AxisPair { a: vec4f, b: vec4f, bend: f32 }

fn straighter(a: Axis, b: Axis) -> AxisPair {
  let bend = max(a.bend, b.bend);
  if b.along.w < a.along.w { return AxisPair(b.along, a.along, bend); }
  return AxisPair(a.along, b.along, bend);
}

struct Axis { along: vec4f, bend: f32 }

// Of the two sides of an axis, the one that continues more nearly straight.
fn along_axis(light: Light, at: vec2i, axis: vec2i, stored: f32) -> Axis {
  let ahead = at_texel(light, at + axis);
  let behind = at_texel(light, at - axis);
  let curvature_ahead = abs(at_texel(light, at + 2 * axis) - 2.0 * ahead + stored);
  let curvature_behind = abs(at_texel(light, at - 2 * axis) - 2.0 * behind + stored);
  let is_ahead = curvature_ahead < curvature_behind;
  let change = select(stored - behind, ahead - stored, is_ahead);
  return Axis(vec4f(vec2f(axis), change, min(curvature_ahead, curvature_behind)), abs(ahead - 2.0 * stored + behind));
}

fn at_texel(light: Light, texel: vec2i) -> f32 {
  return stored_at(light, vec2u(clamp(texel, vec2i(0), vec2i(i32(map_size(light)) - 1))));
}

// Percentage-closer filtering (Reeves et al. 1987): a box of FILTER texels about the receiver's position, its ends
// weighted by their share, never beyond the map's border.
fn filtered(light: Light, r: Receiver) -> f32 {
  let corner = r.uv * map_size(light) - 0.5 * f32(FILTER);
  let first = floor(corner);
  let f = corner - first;
  let last = i32(map_size(light)) - 1;
  var lit = 0.0;
  var sum = 0.0;
  for (var y = 0u; y <= FILTER; y++) {
    let wy = select(select(1.0, f.y, y == FILTER), 1.0 - f.y, y == 0u);
    for (var x = 0u; x <= FILTER; x++) {
      let at = vec2i(first) + vec2i(i32(x), i32(y));
      if any(at < vec2i(0)) || any(at > vec2i(last)) { continue; }
      let texel = vec2u(at);
      if !is_parallel(light) && !is_mapped(centre_of(light, texel)) { continue; }
      let weight = wy * select(select(1.0, f.x, x == FILTER), 1.0 - f.x, x == 0u);
      sum += weight;
      if passes_shadow_test(light, r, texel, stored_at(light, texel), false) { lit += weight; }
    }
  }
  return select(1.0, lit / sum, sum > 0.0);
}
