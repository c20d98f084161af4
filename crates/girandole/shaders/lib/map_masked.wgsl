// Alpha-masked occluders.

// Any texel may be cut out.
const MOST_TOUCHED = 1u;

// How far inside the three planes a direction lies is how much of each corner's opposite edge it has: barycentric coordinates.
fn is_cut_out(part: MapPart, s: SetUp, triangle: u32, d: Directions) -> bool {
  let t = triangles[occluders[corner_at(triangle)].w];
  let m = materials[t.material];
  var alpha = m.alpha;
  if m.base_color_texture.texture != NONE {
    let weights = max(vec3f(along(s.b, d).x, along(s.c, d).x, along(s.a, d).x), vec3f(0.0));
    let uv = mask_uv(t.vertices.x, m) * weights.x + mask_uv(t.vertices.y, m) * weights.y + mask_uv(t.vertices.z, m) * weights.z;
    let sum = weights.x + weights.y + weights.z;
    alpha *= sample_texture(m.base_color_texture, uv / sum, vec2f(0.0), vec2f(0.0)).w;
  }
  return alpha < m.alpha_cutoff;
}

fn mask_uv(vertex: u32, m: Material) -> vec2f {
  let v = vertices[vertex];
  return select(v.uv0, vec2f(v.u1, v.v1), (m.base_color_texture.uv_set & 1u) == 1u);
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
