// Where the rays of pixels meet triangles: those of the camera.

fn hit_at(pixel: vec2u, triangle: u32) -> Hit {
  let t = triangles[triangle];
  let p0 = vertices[t.vertices.x].position;
  let e1 = vertices[t.vertices.y].position - p0;
  let e2 = vertices[t.vertices.z].position - p0;
  let at = vec2f(pixel) + frame.offset;
  let ray = pixel_ray(at);
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

// Adds what varies from vertex to vertex. Derivatives of texture coordinates: the neighbouring pixels' rays meet the same
// plane.
fn with_coordinates(pixel: vec2u, h: Hit) -> Hit {
  var hit = h;
  if !HAS_TEXTURES { return hit; }
  let t = triangles[hit.triangle];
  let a = vertices[t.vertices.x];
  let b = vertices[t.vertices.y];
  let c = vertices[t.vertices.z];
  let e1 = b.position - a.position;
  let e2 = c.position - a.position;
  let at = vec2f(pixel) + frame.offset;
  let step = 1.0 / sqrt(f32(frame.samples));
  let x = pixel_ray(at + vec2f(step, 0.0));
  let y = pixel_ray(at + vec2f(0.0, step));
  let bx = barycentric(x.direction, a.position - x.origin, e1, e2) - vec2f(hit.u, hit.v);
  let by = barycentric(y.direction, a.position - y.origin, e1, e2) - vec2f(hit.u, hit.v);
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
