// Light space to the atlas: one face of one light's map as an ordinary projective transform.

struct Projected {
  position: vec4f,
  clip: vec4f, // negative outside of the face
}

// `uv_w` is the square's coordinates times `w`.
fn clip_position(light: Light, uv_w: vec2f, z: f32, w: f32) -> vec4f {
  let texel_w = vec2f(map_origin(light)) * w + uv_w * map_size(light);
  return vec4f(2.0 * texel_w.x / maps.page.x - w, w - 2.0 * texel_w.y / maps.page.y, z, w);
}

fn light_space(light: Light, point: vec3f) -> vec3f {
  let d = point - light.position;
  let bitangent = cross(light.normal, light.tangent);
  return vec3f(dot(d, light.tangent), dot(d, bitangent), dot(d, light.normal));
}

// Signs of x and y on a face of the octahedron.
fn octahedral_signs(face: u32) -> vec2f {
  return vec2f(select(-1.0, 1.0, (face & 1u) != 0u), select(-1.0, 1.0, (face & 2u) != 0u));
}

// The square's coordinates times `w`, and `w`: |x| + |y| + z on a face of the octahedron.
fn octahedral_face(p: vec3f, s: vec2f) -> vec3f {
  let w = s.x * p.x + s.y * p.y + p.z;
  return vec3f((vec2f(p.x + p.y, p.x - p.y) + w) * 0.5, w);
}

// Faces overlap by a quarter of a texel at seams: pixel centres lie exactly on the diagonals.
fn project(light: Light, face: u32, point: vec3f) -> Projected {
  let p = light_space(light, point);
  var out: Projected;
  if light.profile >= DIRECTIONAL {
    let s = p.xy * light.scale;
    out.position = clip_position(light, s * 0.5 + 0.5, 1.0 - p.z * light.offset * 0.5, 1.0);
    out.clip = vec4f(1.0 - s.x, 1.0 + s.x, 1.0 - s.y, 1.0 + s.y);
    return out;
  }
  if PARAMETERISATION == PARABOLIC {
    let w = length(p);
    let q = p.xy / max(w + p.z, 1e-3 * w);
    out.position = clip_position(light, q * 0.5 + 0.5, min(NEAR / w, 1.0), 1.0);
    out.clip = vec4f(p.z, 1.0, 1.0, 1.0);
    return out;
  }
  let side = select(-1.0, 1.0, (face & 1u) != 0u);
  if PARAMETERISATION == CUBE {
    var w = p.z;
    var uv_w = 0.5 * w + 0.25 * p.xy;
    if face < 2u {
      w = side * p.x;
      uv_w = vec2f(0.5 * w + side * (0.5 * w - 0.25 * p.z), 0.5 * w + 0.25 * p.y);
    } else if face < 4u {
      w = side * p.y;
      uv_w = vec2f(0.5 * w + 0.25 * p.x, 0.5 * w + side * (0.5 * w - 0.25 * p.z));
    }
    let overlap = w / map_size(light);
    out.position = clip_position(light, uv_w, NEAR, w);
    if face < 2u { out.clip = vec4f(w + p.y + overlap, w - p.y + overlap, w - p.z + overlap, p.z); }
    else if face < 4u { out.clip = vec4f(w + p.x + overlap, w - p.x + overlap, w - p.z + overlap, p.z); }
    else { out.clip = vec4f(w + p.x, w - p.x, w + p.y, w - p.y) + overlap; }
    return out;
  }
  let s = octahedral_signs(face);
  let uv_w = octahedral_face(p, s);
  let overlap = 0.25 / map_size(light) * uv_w.z;
  out.position = clip_position(light, uv_w.xy, NEAR, uv_w.z);
  out.clip = vec4f(s.x * p.x + overlap, s.y * p.y + overlap, p.z, 1.0);
  return out;
}
