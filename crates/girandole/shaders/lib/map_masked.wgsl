// Alpha-masked occluders.

// Any texel may be cut out.
const MOST_TOUCHED = 1u;

// How far inside the three planes a direction lies is how much of each corner's opposite edge it has: barycentric coordinates.
fn is_cut_out(part: MapPart, s: SetUp, triangle: u32, d: Directions) -> bool {
  let id = occluders[corner_at(triangle)].w;
  let m = materials[triangles[id].material];
  let weights = max(vec3f(along(s.b, d).x, along(s.c, d).x, along(s.a, d).x), vec3f(0.0));
  return mask_alpha(id, m, weights / (weights.x + weights.y + weights.z)) < m.alpha_cutoff;
}

// Of four texels in a row that a triangle covers, those where it is not cut out.
fn uncut(part: MapPart, s: SetUp, triangle: u32, d: Directions, covered: vec4<bool>) -> vec4<bool> {
  var result = covered;
  for (var i = 0; i < 4; i++) {
    if covered[i] {
      result[i] = !is_cut_out(part, s, triangle, Directions(vec4f(d.x[i]), vec4f(d.y[i]), vec4f(d.z[i])));
    }
  }
  return result;
}
