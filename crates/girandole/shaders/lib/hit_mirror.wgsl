// Where the rays of pixels meet triangles: mirrored ones, whose ends are known (trace_mirrors.wgsl).

@group(2) @binding(31) var mirror_hits: texture_2d<u32>;

fn hit_at(pixel: vec2u, triangle: u32) -> Hit {
  let words = textureLoad(mirror_hits, pixel, 0);
  return hit_of_ray(triangle, PixelRay(bitcast<vec3f>(words.xyz), unpack_direction(words.w)));
}

// As if neighbours lay close by: where rays end is not known of those that a part of a picture leaves out.
fn steps_on_plane(pixel: vec2u, step: u32, position: vec3f, normal: vec3f) -> mat2x3f { return mat2x3f(); }

// Adds what varies from vertex to vertex. A pixel covers about as much as it would cover if the camera saw it without a mirror.
fn with_coordinates(pixel: vec2u, hit: Hit) -> Hit {
  if !HAS_TEXTURES { return hit; }
  let t = triangles[hit.triangle];
  let p0 = vertices[t.vertices.x].position;
  let e1 = vertices[t.vertices.y].position - p0;
  let e2 = vertices[t.vertices.z].position - p0;
  let away = select(distance(hit.position, frame.eye), 1.0, frame.orthographic != 0u);
  let width = 2.0 * frame.half_height / f32(frame.size.y) * away / sqrt(f32(frame.samples));
  let cosine = max(dot(hit.geometric_normal, hit.wo), 0.05);
  let flat = hit.wo - hit.geometric_normal * dot(hit.geometric_normal, hit.wo);
  let along = select(normalize(e1), normalize(flat), dot(flat, flat) > 1e-8);
  let bx = weights_along(along * (width / cosine), e1, e2);
  let by = weights_along(cross(hit.geometric_normal, along) * width, e1, e2);
  return with_footprint(hit, bx, by);
}

// By how much the weights of corners 1 and 2 change along a vector in a triangle's plane.
fn weights_along(v: vec3f, e1: vec3f, e2: vec3f) -> vec2f {
  let normal = cross(e1, e2);
  return vec2f(dot(cross(v, e2), normal), dot(cross(e1, v), normal)) / dot(normal, normal);
}
