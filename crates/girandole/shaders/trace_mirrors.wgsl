// Sends a ray from each pixel that shows something smooth, as a mirror reflects it: from what the camera sees, then from where the rays
// before ended. Where one ends becomes a pixel of a visibility buffer like the camera's.

@group(2) @binding(0) var triangle_ids: texture_2d<u32>;
@group(2) @binding(1) var<storage, read> triangle_surfaces: array<u32>;
@group(2) @binding(4) var next_triangle_ids: texture_storage_2d<r32uint, write>;
@group(2) @binding(5) var next_surface_ids: texture_storage_2d<rg32uint, write>;
@group(2) @binding(6) var next_hits: texture_storage_2d<rgba32uint, write>;

// Ray `frame.batch` of the pixel's sample.
@compute @workgroup_size(TILE, TILE)
fn trace_mirrors(@builtin(global_invocation_id) invocation: vec3u) {
  let pixel = vec2u(invocation.x, invocation.y + frame.band.x);
  if pixel.x >= frame.size.x || !is_drawn(pixel.x) || pixel.y >= frame.band.y { return; }
  let at = mirror_image_at(pixel);
  let id = textureLoad(triangle_ids, pixel, 0).x;
  var origin = vec3f(0.0);
  var direction = vec3f(0.0);
  var left = vec3f(0.0);
  var alpha = 0.0;
  var surface_id = 0u;
  if id > 0u {
    let m = materials[triangles[id - 1u].material];
    let hit = with_coordinates(pixel, hit_at(pixel, id - 1u));
    let r = reflection(hit, m);
    let normal = shading_normal(hit, m);
    let cosine = dot(normal, hit.wo);
    let share = mirror_share(r, cosine);
    left = mirror_fresnel(r, cosine) * share;
    alpha = r.alpha;
    surface_id = triangle_surfaces[id - 1u];
    direction = reflect(-hit.wo, normal);
    // Bent normals may point a ray into the surface.
    let height = dot(direction, hit.geometric_normal);
    direction = normalize(direction + hit.geometric_normal * max(0.01 - height, 0.0) * 2.0);
    let offset = max(frame.ray_offset, RAY_OFFSET_BY_ROUNDING * max(abs(hit.position.x), max(abs(hit.position.y), abs(hit.position.z))));
    origin = hit.position + hit.geometric_normal * offset;
  }
  // A first ray brings all of it: what the surface makes of that comes at the end.
  if frame.batch > 0u { left *= mirror_image[at + 1u].xyz; }
  let is_known = frame.sample > 0u && frame.batch == 0u && alpha >= WIDE_ALPHA && mirror_image[at + 3u].w == f32(surface_id);
  let is_sent = any(left > vec3f(0.0)) && !is_known;
  var ended = RayHit(0.0, NONE, 0.0, 0.0);
  if is_sent { ended = trace_ray(origin, direction, MAX_CLAMP, id - 1u, false); }
  let weight = select(left, vec3f(1.0), frame.batch == 0u);
  var image = vec4f(0.0);
  if frame.batch > 0u { image = mirror_image[at]; } else { image.w = select(0.0, f32(surface_id), is_sent); }
  var end_id = 0u;
  var surface = vec2u(0u);
  var end = origin + direction * frame.far;
  if is_sent && ended.triangle == NONE { image += vec4f(weight * environment_along(direction, alpha), 0.0); }
  if is_sent && ended.triangle != NONE {
    let material = triangles[ended.triangle].material;
    end = origin + direction * ended.t;
    let t = triangles[ended.triangle].vertices;
    let a = vertices[t.x].position;
    let faces = dot(cross(vertices[t.y].position - a, vertices[t.z].position - a), direction) < 0.0;
    // Backs of single-sided surfaces are black.
    if faces || (materials[material].flags & DOUBLE_SIDED) != 0u {
      end_id = ended.triangle + 1u;
      surface = vec2u(triangle_surfaces[ended.triangle], material);
    }
  }
  mirror_image[at] = image;
  mirror_image[at + 1u] = vec4f(weight, 0.0);
  textureStore(next_triangle_ids, pixel, vec4u(end_id));
  textureStore(next_surface_ids, pixel, vec4u(surface, 0u, 0u));
  textureStore(next_hits, pixel, vec4u(bitcast<vec3u>(end), pack_direction(direction)));
}
