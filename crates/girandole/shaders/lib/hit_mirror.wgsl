// Where the rays of pixels meet triangles: mirrored ones, whose ends are known (trace_mirrors.wgsl).

@group(2) @binding(31) var mirror_hits: texture_2d<u32>;

fn hit_at(pixel: vec2u, triangle: u32) -> Hit {
  let words = textureLoad(mirror_hits, pixel, 0);
  let direction = unpack_direction(words.w);
  let t = triangles[triangle];
  let p0 = vertices[t.vertices.x].position;
  let e1 = vertices[t.vertices.y].position - p0;
  let e2 = vertices[t.vertices.z].position - p0;
  let b = barycentric(direction, p0 - bitcast<vec3f>(words.xyz), e1, e2);
  var hit: Hit;
  hit.triangle = triangle;
  hit.u = b.x;
  hit.v = b.y;
  hit.position = p0 + e1 * b.x + e2 * b.y;
  hit.wo = -direction;
  let normal = normalize(cross(e1, e2));
  hit.side = select(-1.0, 1.0, dot(normal, hit.wo) >= 0.0);
  hit.geometric_normal = normal * hit.side;
  return hit;
}

// Adds what varies from vertex to vertex. A pixel covers about as much as it would cover if the camera saw it without a mirror.
fn with_coordinates(pixel: vec2u, h: Hit) -> Hit {
  var hit = h;
  if !HAS_TEXTURES { return hit; }
  let t = triangles[hit.triangle];
  let a = vertices[t.vertices.x];
  let b = vertices[t.vertices.y];
  let c = vertices[t.vertices.z];
  let e1 = b.position - a.position;
  let e2 = c.position - a.position;
  let away = select(distance(hit.position, frame.eye), 1.0, frame.orthographic != 0u);
  let width = 2.0 * frame.half_height / f32(frame.size.y) * away / sqrt(f32(frame.samples));
  let cosine = max(dot(hit.geometric_normal, hit.wo), 0.05);
  let flat = hit.wo - hit.geometric_normal * dot(hit.geometric_normal, hit.wo);
  let along = select(normalize(e1), normalize(flat), dot(flat, flat) > 1e-8);
  let x = weights_along(along * (width / cosine), e1, e2);
  let y = weights_along(cross(hit.geometric_normal, along) * width, e1, e2);
  let first = array<vec2f, 2>(a.uv0, vec2f(a.u1, a.v1));
  let d1 = array<vec2f, 2>(b.uv0 - a.uv0, vec2f(b.u1 - a.u1, b.v1 - a.v1));
  let d2 = array<vec2f, 2>(c.uv0 - a.uv0, vec2f(c.u1 - a.u1, c.v1 - a.v1));
  hit.color = vertex_color(a) * (1.0 - hit.u - hit.v) + vertex_color(b) * hit.u + vertex_color(c) * hit.v;
  for (var i = 0u; i < 2u; i++) {
    hit.uv[i] = first[i] + d1[i] * hit.u + d2[i] * hit.v;
    hit.uv_dx[i] = d1[i] * x.x + d2[i] * x.y;
    hit.uv_dy[i] = d1[i] * y.x + d2[i] * y.y;
  }
  return hit;
}

// By how much the weights of corners 1 and 2 change along a vector in a triangle's plane.
fn weights_along(v: vec3f, e1: vec3f, e2: vec3f) -> vec2f {
  let normal = cross(e1, e2);
  return vec2f(dot(cross(v, e2), normal), dot(cross(e1, v), normal)) / dot(normal, normal);
}
