// The environment as surfaces reflect it (core: scene::PrefilteredEnvironment).

// Each half as wide as the one before, with lobes twice as wide.
@group(2) @binding(20) var reflected_maps: texture_2d<f32>;
@group(2) @binding(21) var albedo_table: texture_2d<f32>; // core: brdf::albedo_table

// What a share of the environment's own maps adds to a pixel's triangle.
fn reflected_environment(pixel: vec2u, triangle: u32, share: f32) -> vec3f {
  if share <= 0.0 { return vec3f(0.0); }
  let m = materials[triangles[triangle].material];
  let hit = with_coordinates(pixel, hit_at(pixel, triangle));
  let r = reflection(hit, m);
  let normal = shading_normal(hit, m);
  let albedo = directional_albedo(dot(normal, hit.wo), r.alpha);
  let direction = reflect(-hit.wo, normal);
  let step = 1.0 / sqrt(f32(frame.samples));
  var x = vec3f(0.0);
  var y = vec3f(0.0);
  for (var i = 0u; i < 2u; i++) {
    x = y;
    y = reflected_beside(pixel, hit, m, select(vec2f(0.0, step), vec2f(step, 0.0), i == 0u)) - direction;
  }
  return reflected_from(direction, footprint_alpha(r.alpha, x, y)) * (r.f0 * albedo.x + r.f90 * albedo.y) * share;
}

// What a mirror shows beside a hit, where the neighbouring ray meets the same triangle's plane.
fn reflected_beside(pixel: vec2u, hit: Hit, m: Material, shift: vec2f) -> vec3f {
  let t = triangles[hit.triangle];
  let p0 = vertices[t.vertices.x].position;
  let ray = pixel_ray(vec2f(pixel) + frame.offset + shift);
  let b = barycentric(ray.direction, p0 - ray.origin, vertices[t.vertices.y].position - p0, vertices[t.vertices.z].position - p0);
  var beside = hit;
  beside.u = b.x;
  beside.v = b.y;
  return reflect(normalize(ray.direction), shading_normal(beside, m));
}

// core: Environment::reflected.
fn reflected_from(direction: vec3f, alpha: f32) -> vec3f {
  let last = textureNumLevels(reflected_maps) - 1u;
  var level = 0u;
  var low = 0.0;
  var high = FIRST_LOBE_ALPHA;
  while level < last && alpha >= high {
    level++;
    low = high;
    high *= 2.0;
  }
  let share = clamp((alpha * alpha - low * low) / (high * high - low * low), 0.0, 1.0);
  let place = place_of(direction);
  var sharp = vec3f(0.0);
  var blurred = vec3f(0.0);
  for (var i = 0u; i < 2u; i++) {
    sharp = blurred;
    blurred = reflected_at(place, min(level + i, last));
  }
  return mix(sharp, blurred, share) * frame.environment.x;
}

fn reflected_at(place: vec2f, level: u32) -> vec3f {
  // Mesa's software driver takes the size of one lane's level for that of all.
  let size = vec2i(textureDimensions(reflected_maps) >> vec2u(level));
  let at = place * vec2f(size) - 0.5;
  let low = vec2i(floor(at));
  let f = at - floor(at);
  let above = mix(reflected_texel(low, size, level), reflected_texel(low + vec2i(1, 0), size, level), f.x);
  let below = mix(reflected_texel(low + vec2i(0, 1), size, level), reflected_texel(low + vec2i(1, 1), size, level), f.x);
  return mix(above, below, f.y);
}

fn reflected_texel(at: vec2i, size: vec2i, level: u32) -> vec3f {
  return textureLoad(reflected_maps, vec2i((at.x + size.x) % size.x, clamp(at.y, 0, size.y - 1)), level).xyz;
}

// core: brdf::directional_albedo.
fn directional_albedo(cosine: f32, alpha: f32) -> vec2f {
  let size = vec2f(textureDimensions(albedo_table));
  let at = clamp(vec2f(cosine, sqrt(alpha)), vec2f(0.0), vec2f(1.0)) * (size - 1.0);
  let low = min(floor(at), size - 2.0);
  let i = vec2u(low);
  let f = at - low;
  let upper = mix(textureLoad(albedo_table, i, 0), textureLoad(albedo_table, i + vec2u(1u, 0u), 0), f.x);
  let lower = mix(textureLoad(albedo_table, i + vec2u(0u, 1u), 0), textureLoad(albedo_table, i + 1u, 0), f.x);
  return mix(upper, lower, f.y).xy;
}

// The environment as a mirrored ray sees it that leaves the scene.
fn environment_along(direction: vec3f, alpha: f32) -> vec3f { return reflected_from(direction, alpha); }

// What a share of the environment's own maps adds to a point of which no neighbours are known.
fn environment_of(hit: Hit, m: Material, share: f32) -> vec3f {
  if share <= 0.0 { return vec3f(0.0); }
  let r = reflection(hit, m);
  let normal = shading_normal(hit, m);
  let albedo = directional_albedo(dot(normal, hit.wo), r.alpha);
  return reflected_from(reflect(-hit.wo, normal), r.alpha) * (r.f0 * albedo.x + r.f90 * albedo.y) * share;
}
