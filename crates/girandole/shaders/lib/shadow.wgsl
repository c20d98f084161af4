// Shadow look-up: is the light seen from `position`, whose geometric normal `ng` faces it?
//
// A map holds distances along the directions of texel centres. The receiver's own plane is therefore compared where
// the texel's centre sees it, not where `position` does: for a plane the comparison is exact at any slope, so the
// only bias needed is that of rounding (SLACK) and of the rasteriser's snapping of corners (FOOTPRINT, a fraction of a
// texel's footprint along the normal). Where the centre's ray passes beyond `position` towards another surface, the
// nearer of the two distances counts, lest the wall behind a floor darken the floor's last row of texels.

override FILTER: u32; // percentage-closer filter: width in texels, 0 = the nearest texel

const SLACK = 2e-5;
const FOOTPRINT = 0.02;
// Blockers farther than this share of the distance in front of the receiver block without a second look.
const NEARBY = 0.7;
// What remains in hollows of finely tessellated surfaces, in units of FOOTPRINT.
const HOLLOW = 10.0;
// Where light grazes, the allowances for rounding are no more than this share of the distance.
const GRAZING = 0.1;

// One texel's answer: `a` is the receiver's normal in light space, `height` = −dot(a, p) > 0 its plane's distance to
// the light, `slope` = height / norm(p), `uv` the receiver's place in the square.
fn is_lit(light: Light, texel: vec2u, uv: vec2f, a: vec3f, height: f32, slope: f32) -> bool {
  let centre = (vec2f(texel) + 0.5) / light.map_size;
  let stored = textureLoad(atlas, light.map_origin + texel, light.map_page, 0);
  let here = max(-dot(a, decode(centre)), slope);
  let allowance = NEAR * FOOTPRINT / light.map_size;
  let most = NEAR * GRAZING * slope;
  if stored * height <= NEAR * here * (1.0 + SLACK) + min(allowance, most) { return true; }
  if stored * height * NEARBY > NEAR * slope { return false; }
  // What is seen there is nearer, but not by much: at the foot of a wall or in a hollow it need not be in the way.
  // Carry its own slope over to the receiver's place: only what is still nearer there blocks.
  let origin = vec2i(texel);
  let gradient = vec2f(
    gradient_along(light, origin, vec2i(1, 0), stored),
    gradient_along(light, origin, vec2i(0, 1), stored));
  let carried = stored + dot(gradient, (uv - centre) * light.map_size);
  return carried * height <= NEAR * slope * (1.0 + SLACK) + min(HOLLOW * allowance, most);
}

// Change a texel of stored depth along one axis, on the surface that `stored` belongs to: of the two sides, the one
// that continues more nearly straight.
fn gradient_along(light: Light, at: vec2i, axis: vec2i, stored: f32) -> f32 {
  let ahead = at_texel(light, at + axis);
  let behind = at_texel(light, at - axis);
  let bend_ahead = abs(at_texel(light, at + 2 * axis) - 2.0 * ahead + stored);
  let bend_behind = abs(at_texel(light, at - 2 * axis) - 2.0 * behind + stored);
  return select(stored - behind, ahead - stored, bend_ahead < bend_behind);
}

fn at_texel(light: Light, texel: vec2i) -> f32 {
  let inside = clamp(texel, vec2i(0), vec2i(i32(light.map_size) - 1));
  return textureLoad(atlas, light.map_origin + vec2u(inside), light.map_page, 0);
}

// The same for a directional light: parallel rays, depth linear. `p` is in units of the scene's radius.
fn is_lit_parallel(light: Light, texel: vec2u, a: vec3f, p: vec3f) -> bool {
  let centre = (vec2f(texel) + 0.5) / light.map_size * 2.0 - 1.0;
  let stored = textureLoad(atlas, light.map_origin + texel, light.map_page, 0);
  let shift = dot(a.xy, centre - p.xy) / max(-a.z, 1e-3);
  let depth = 1.0 - (p.z + min(shift, 0.0)) * 0.5;
  return stored <= depth + (SLACK + FOOTPRINT * 2.0 / (light.map_size * max(-a.z, 1e-3)));
}

// Share of the light that arrives: 0 or 1, or between the two with a filter.
fn visibility(light: Light, position: vec3f, ng: vec3f) -> f32 {
  let d = position - light.position;
  let bitangent = cross(light.normal, light.tangent);
  var p = vec3f(dot(d, light.tangent), dot(d, bitangent), dot(d, light.normal));
  let a = vec3f(dot(ng, light.tangent), dot(ng, bitangent), dot(ng, light.normal));
  let last = u32(light.map_size) - 1u;
  if light.profile == DIRECTIONAL {
    p *= light.scale;
    let uv = p.xy * 0.5 + 0.5;
    if FILTER == 0u { return select(0.0, 1.0, is_lit_parallel(light, min(vec2u(uv * light.map_size), vec2u(last)), a, p)); }
    return filtered(light, uv, a, p, 0.0, 0.0);
  }
  let height = -dot(a, p);
  let slope = height / norm(p);
  let uv = encode(p);
  if FILTER == 0u {
    return select(0.0, 1.0, is_lit(light, min(vec2u(uv * light.map_size), vec2u(last)), uv, a, height, slope));
  }
  return filtered(light, uv, a, p, height, slope);
}

// Percentage-closer filtering (Reeves et al. 1987): a box of FILTER texels about `uv`, its ends weighted by their
// share, never beyond the map's border.
fn filtered(light: Light, uv: vec2f, a: vec3f, p: vec3f, height: f32, slope: f32) -> f32 {
  let corner = uv * light.map_size - 0.5 * f32(FILTER);
  let first = floor(corner);
  let f = corner - first;
  let last = i32(light.map_size) - 1;
  var lit = 0.0;
  var sum = 0.0;
  for (var y = 0u; y <= FILTER; y++) {
    let wy = select(select(1.0, f.y, y == FILTER), 1.0 - f.y, y == 0u);
    for (var x = 0u; x <= FILTER; x++) {
      let at = vec2i(first) + vec2i(i32(x), i32(y));
      if any(at < vec2i(0)) || any(at > vec2i(last)) { continue; }
      let texel = vec2u(at);
      if light.profile != DIRECTIONAL && !is_mapped((vec2f(texel) + 0.5) / light.map_size) { continue; }
      let weight = wy * select(select(1.0, f.x, x == FILTER), 1.0 - f.x, x == 0u);
      sum += weight;
      var seen = false;
      if light.profile == DIRECTIONAL { seen = is_lit_parallel(light, texel, a, p); }
      else { seen = is_lit(light, texel, uv, a, height, slope); }
      lit += select(0.0, weight, seen);
    }
  }
  return select(1.0, lit / sum, sum > 0.0);
}
