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
  // By a ray that is spread over the lobe, relative to one that is not, and how many of those lie about it, 1/sr.
  var reflected = vec3f(1.0);
  var density = 0.0;
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
    if is_spread(r) {
      let spread = spread_over_lobe(r, normal, hit.wo, random_at(pixel));
      direction = spread.direction;
      reflected = spread.weight;
      density = spread.density;
      left *= reflected;
      alpha = 0.0;
    }
    // Bent normals may point a ray into the surface.
    let height = dot(direction, hit.geometric_normal);
    direction = normalize(direction + hit.geometric_normal * max(0.01 - height, 0.0) * 2.0);
    let offset = max(frame.ray_offset, RAY_OFFSET_BY_ROUNDING * max(abs(hit.position.x), max(abs(hit.position.y), abs(hit.position.z))));
    origin = hit.position + hit.geometric_normal * offset;
  }
  // A first ray brings all of it: what the surface makes of that comes at the end.
  let batch = branch_value(frame.batch, pixel.x);
  let is_further_sample = branch_value(frame.sample, pixel.x) > 0u;
  if batch > 0u { left *= mirror_image[at + 1u].xyz; }
  // A lobe that is narrower than two pixels shows edges, which further samples smooth.
  let is_wide = alpha >= max(WIDE_ALPHA, 4.0 * frame.half_height / f32(frame.size.y));
  let is_known = is_further_sample && batch == 0u && is_wide && mirror_image[at + 3u].w == f32(surface_id);
  let is_sent = any(left > vec3f(0.0)) && !is_known;
  var ended = RayHit(0.0, NONE, 0.0, 0.0);
  if is_sent { ended = trace_ray(origin, direction, MAX_CLAMP, id - 1u, false); }
  var weight = select(left, reflected, batch == 0u);
  // What light samples bring of a direction that is met by chance.
  var solid_angle = frame.sample_solid_angle;
  var image = vec4f(0.0);
  if batch > 0u { image = mirror_image[at]; } else { image.w = select(0.0, f32(surface_id), is_sent); }
  var end_id = 0u;
  var surface = vec2u(0u);
  var end = origin + direction * frame.far;
  if is_sent && ended.triangle != NONE {
    let material = triangles[ended.triangle].material;
    end = origin + direction * ended.t;
    let t = triangles[ended.triangle].vertices;
    let a = vertices[t.x].position;
    let cosine = dot(normalize(cross(vertices[t.y].position - a, vertices[t.z].position - a)), direction);
    solid_angle = frame.sample_area * abs(cosine) / max(ended.t * ended.t, 1e-12);
    // Backs of single-sided surfaces are black.
    if cosine < 0.0 || (materials[material].flags & DOUBLE_SIDED) != 0u {
      end_id = ended.triangle + 1u;
      surface = vec2u(triangle_surfaces[ended.triangle], material);
    }
  }
  if density > 0.0 { weight *= 1.0 - samples_weight(density, solid_angle); }
  if is_sent && ended.triangle == NONE { image += vec4f(weight * environment_along(direction, alpha), 0.0); }
  mirror_image[at] = image;
  mirror_image[at + 1u] = vec4f(weight, 0.0);
  textureStore(next_triangle_ids, pixel, vec4u(end_id));
  textureStore(next_surface_ids, pixel, vec4u(surface, 0u, 0u));
  textureStore(next_hits, pixel, vec4u(bitcast<vec3u>(end), pack_direction(direction)));
}

struct SpreadRay { direction: vec3f, weight: vec3f, density: f32 }

// A direction of the lobe, by a facet that is seen from `wo` (Heitz 2018), and its weight: what is reflected, over Schlick's Fresnel for the
// normal.
fn spread_over_lobe(r: Reflection, normal: vec3f, wo: vec3f, random: vec2f) -> SpreadRay {
  let side = select(vec3f(0.0, 1.0, 0.0), vec3f(1.0, 0.0, 0.0), abs(normal.y) > abs(normal.x));
  let tangent = normalize(cross(side, normal));
  let bitangent = cross(normal, tangent);
  let nv = max(dot(wo, normal), 1e-4);
  let stretched = normalize(vec3f(r.alpha * dot(wo, tangent), r.alpha * dot(wo, bitangent), nv));
  let across = select(vec3f(1.0, 0.0, 0.0), normalize(vec3f(-stretched.y, stretched.x, 0.0)), stretched.z < 0.9999);
  let radius = sqrt(random.x);
  let angle = 2.0 * PI * random.y;
  let x = radius * cos(angle);
  let y = mix(sqrt(1.0 - x * x), radius * sin(angle), 0.5 + 0.5 * stretched.z);
  let facet = x * across + y * cross(stretched, across) + sqrt(max(1.0 - x * x - y * y, 0.0)) * stretched;
  let h = normalize(vec3f(r.alpha * facet.xy, max(facet.z, 1e-6)));
  let direction = reflect(-wo, tangent * h.x + bitangent * h.y + normal * h.z);
  let nl = dot(direction, normal);
  // Shadowing and masking, over masking alone.
  let seen = 1.0 + smith_lambda(nv, r.alpha);
  let share = select(0.0, seen / (seen + smith_lambda(nl, r.alpha)), nl > 0.0);
  let fresnel = mirror_fresnel(r, dot(wo, normalize(wo + direction))) / max(mirror_fresnel(r, nv), vec3f(1e-6));
  return SpreadRay(direction, fresnel * share, lobe_density(normal, wo, direction, r.alpha));
}

// Two numbers of a pixel's ray: by the R2 sequence from set to set (Roberts 2018), from other ones in each pixel.
fn random_at(pixel: vec2u) -> vec2f {
  var state = (pixel.y * frame.size.x + pixel.x) * 747796405u + (frame.batch * 16u + frame.sample) * 2891336453u + 1u;
  var start = vec2f(0.0);
  for (var i = 0u; i < 2u; i++) {
    state = state * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    start[i] = f32(((word >> 22u) ^ word) >> 8u) / 16777216.0;
  }
  return fract(start + f32(frame.light_set) * vec2f(0.7548776662, 0.5698402910));
}
