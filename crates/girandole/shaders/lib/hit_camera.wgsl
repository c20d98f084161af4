// Where the rays of pixels meet triangles: those of the camera.

fn hit_at(pixel: vec2u, triangle: u32) -> Hit { return hit_of_ray(triangle, pixel_ray(vec2f(pixel) + frame.offset)); }

// From a position to where the plane through it is seen so many pixels to the right, and so many below.
fn steps_on_plane(pixel: vec2u, step: u32, position: vec3f, normal: vec3f) -> mat2x3f {
  return mat2x3f(place_on_plane(pixel + vec2u(step, 0u), position, normal) - position,
    place_on_plane(pixel + vec2u(0u, step), position, normal) - position);
}

// Where a pixel shows the plane through a position.
fn place_on_plane(pixel: vec2u, position: vec3f, normal: vec3f) -> vec3f {
  let ray = pixel_ray(vec2f(pixel) + frame.offset);
  let cosine = dot(ray.direction, normal);
  let t = dot(position - ray.origin, normal) / select(cosine, -1e-6, cosine == 0.0);
  // Beyond the horizon it is as far as can be.
  return select(vec3f(1e9), ray.origin + ray.direction * t, t > 0.0);
}

// Adds what varies from vertex to vertex. Derivatives of texture coordinates: the neighbouring pixels' rays meet the same
// plane.
fn with_coordinates(pixel: vec2u, hit: Hit) -> Hit {
  if !HAS_TEXTURES { return hit; }
  let t = triangles[hit.triangle];
  let p0 = vertices[t.vertices.x].position;
  let e1 = vertices[t.vertices.y].position - p0;
  let e2 = vertices[t.vertices.z].position - p0;
  let at = vec2f(pixel) + frame.offset;
  let step = 1.0 / sqrt(f32(frame.samples));
  let x = pixel_ray(at + vec2f(step, 0.0));
  let y = pixel_ray(at + vec2f(0.0, step));
  let weights = vec2f(hit.u, hit.v);
  let bx = barycentric(x.direction, p0 - x.origin, e1, e2) - weights;
  let by = barycentric(y.direction, p0 - y.origin, e1, e2) - weights;
  return with_footprint(hit, bx, by);
}
