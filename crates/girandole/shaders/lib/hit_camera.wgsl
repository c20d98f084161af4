// Where the rays of pixels meet triangles: those of the camera.

fn hit_at(pixel: vec2u, triangle: u32) -> Hit { return hit_of_ray(triangle, pixel_ray(vec2f(pixel) + frame.offset)); }

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
