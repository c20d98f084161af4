// From a pixel of the visibility buffer to the surface that it shows (core: Geometry::surface).

override HAS_TEXTURES: bool = true; // whether any material has textures or vertices' colours

struct Hit {
  triangle: u32, // index
  u: f32, // weights of corners 1 and 2
  v: f32,
  position: vec3f,
  wo: vec3f, // unit, towards the eye
  geometric_normal: vec3f, // unit, on the side that is seen
  side: f32, // −1 where the back is seen
  color: vec3f, // of the vertices
  uv: array<vec2f, 2>,
  uv_dx: array<vec2f, 2>,
  uv_dy: array<vec2f, 2>,
}

// Weights of corners 1 and 2 where a ray meets the triangle's plane; `a` is relative to the ray's origin.
fn barycentric(direction: vec3f, a: vec3f, e1: vec3f, e2: vec3f) -> vec2f {
  let p = cross(direction, e2);
  let inverse = 1.0 / dot(e1, p);
  let q = cross(-a, e1);
  return vec2f(dot(-a, p) * inverse, dot(direction, q) * inverse);
}

// Where a ray meets a triangle's plane; any point of it will do for its origin.
fn hit_of_ray(triangle: u32, ray: PixelRay) -> Hit {
  let t = triangles[triangle];
  let p0 = vertices[t.vertices.x].position;
  let e1 = vertices[t.vertices.y].position - p0;
  let e2 = vertices[t.vertices.z].position - p0;
  let b = barycentric(ray.direction, p0 - ray.origin, e1, e2);
  var hit: Hit;
  hit.triangle = triangle;
  hit.u = b.x;
  hit.v = b.y;
  hit.position = p0 + e1 * b.x + e2 * b.y;
  hit.wo = -normalize(ray.direction);
  let normal = normalize(cross(e1, e2));
  hit.side = select(-1.0, 1.0, dot(normal, hit.wo) >= 0.0);
  hit.geometric_normal = normal * hit.side;
  return hit;
}

// Adds what varies from vertex to vertex, given how the weights of corners 1 and 2 change from pixel to pixel in x and in y.
fn with_footprint(h: Hit, bx: vec2f, by: vec2f) -> Hit {
  var hit = h;
  let t = triangles[hit.triangle];
  let a = vertices[t.vertices.x];
  let b = vertices[t.vertices.y];
  let c = vertices[t.vertices.z];
  let first = array<vec2f, 2>(a.uv0, vec2f(a.u1, a.v1));
  let d1 = array<vec2f, 2>(b.uv0 - a.uv0, vec2f(b.u1 - a.u1, b.v1 - a.v1));
  let d2 = array<vec2f, 2>(c.uv0 - a.uv0, vec2f(c.u1 - a.u1, c.v1 - a.v1));
  hit.color = vertex_color(a) * (1.0 - hit.u - hit.v) + vertex_color(b) * hit.u + vertex_color(c) * hit.v;
  for (var i = 0u; i < 2u; i++) {
    hit.uv[i] = first[i] + d1[i] * hit.u + d2[i] * hit.v;
    hit.uv_dx[i] = d1[i] * bx.x + d2[i] * bx.y;
    hit.uv_dy[i] = d1[i] * by.x + d2[i] * by.y;
  }
  return hit;
}

fn vertex_color(v: Vertex) -> vec3f {
  return vec3f(unpack2x16unorm(v.color.x), unpack2x16unorm(v.color.y).x);
}

fn sample_at(use_: TextureUse, hit: Hit) -> vec4f {
  if !HAS_TEXTURES || use_.texture == NONE { return vec4f(1.0); }
  let chosen = use_.uv_set & 1u;
  return sample_texture(use_, hit.uv[chosen], hit.uv_dx[chosen], hit.uv_dy[chosen]);
}

// What vertices' colours make of a material with these flags.
fn vertex_tint(hit: Hit, m: Material, flags: u32) -> vec3f {
  if !HAS_TEXTURES || (m.flags & flags) != flags { return vec3f(1.0); }
  return hit.color;
}

fn emission_factor(hit: Hit, m: Material) -> vec3f {
  let texel = sample_at(m.emission_texture, hit);
  // What is unlit has its base colour here.
  let opacity = select(1.0, m.alpha * texel.w, (m.flags & (UNLIT | BLENDED)) == (UNLIT | BLENDED));
  return texel.xyz * opacity * vertex_tint(hit, m, VERTEX_COLORED | UNLIT);
}

// Whether a material is not the same all over a triangle.
fn varies(m: Material) -> bool {
  if HAS_TEXTURES && (m.flags & VERTEX_COLORED) != 0u { return true; }
  return HAS_TEXTURES && (m.base_color_texture.texture & m.metallic_roughness_texture.texture & m.specular_texture.texture
    & m.specular_color_texture.texture & m.normal_texture.texture & m.emission_texture.texture
    & m.transmission_texture.texture) != NONE;
}

fn shading_normal(hit: Hit, m: Material) -> vec3f {
  let t = triangles[hit.triangle];
  let a = vertices[t.vertices.x];
  let b = vertices[t.vertices.y];
  let c = vertices[t.vertices.z];
  let w = 1.0 - hit.u - hit.v;
  let sum = a.normal * w + b.normal * hit.u + c.normal * hit.v;
  var normal = select(hit.geometric_normal * hit.side, normalize(sum), dot(sum, sum) > 1e-12);
  if HAS_TEXTURES && m.normal_texture.texture != NONE {
    let texel = sample_at(m.normal_texture, hit).xyz * 2.0 - 1.0;
    let tangent = a.tangent * w + b.tangent * hit.u + c.tangent * hit.v;
    let flat = tangent.xyz - normal * dot(normal, tangent.xyz);
    let along = select(vec3f(0.0), normalize(flat), dot(flat, flat) > 1e-12);
    let across = cross(normal, along) * select(1.0, -1.0, tangent.w < 0.0);
    let mapped = along * (texel.x * m.normal_scale) + across * (texel.y * m.normal_scale) + normal * texel.z;
    if dot(mapped, mapped) > 1e-12 { normal = normalize(mapped); }
  }
  return normal * hit.side;
}
