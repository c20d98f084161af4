// Adds mirror images to the picture, each blurred as far as its surface's lobe is wide where the mirrored ray ended: a mean over what the
// pixels about it show, weighted by what of it the lobe reflects to this one.

@group(2) @binding(0) var triangle_ids: texture_2d<u32>;
@group(2) @binding(1) var surface_ids: texture_2d<u32>;
@group(2) @binding(2) var first_hits: texture_2d<u32>;
@group(2) @binding(4) var picture: texture_2d<u32>;
@group(2) @binding(5) var with_mirrors: texture_storage_2d<rg32uint, write>;

// Pixels that are looked at about one, for each pixel of the lobe's radius, and at most.
const TAPS_PER_RADIUS = 4.0;
const MOST_TAPS = 64.0;
// Of a lobe's half vectors, in units of alpha: how far pixels are looked at, and how far apart they may be in pixels at most.
const LOBE_REACH = 1.5;
const MOST_RADIUS = 96.0;

// What the ray of a pixel's first sample brought.
fn image_at(pixel: vec2u) -> vec4f { return mirror_image[mirror_image_at(pixel) + select(3u, 0u, frame.sample == 0u)]; }

fn end_at(pixel: vec2u) -> vec3f { return bitcast<vec3f>(textureLoad(first_hits, pixel, 0).xyz); }

// Whether a pixel of the band is on the same surface and sent a ray.
fn is_beside(pixel: vec2i, surface_id: u32) -> bool {
  if pixel.x < 0 || pixel.y < i32(frame.band.x) || pixel.x >= i32(frame.size.x) || pixel.y >= i32(frame.band.y) { return false; }
  return image_at(vec2u(pixel)).w == f32(surface_id);
}

// The squared tangent of the angle between the normal and the half vector of `wo` and the direction to where a pixel's ray ended.
fn slope2_of(pixel: vec2u, position: vec3f, normal: vec3f, wo: vec3f) -> f32 {
  let h = normalize(end_at(pixel) - position) + wo;
  let along = dot(h, normal);
  return max(dot(h, h) / max(along * along, 1e-12) - 1.0, 0.0);
}

// Pixels from this one to where the lobe has fallen off, in x or y.
fn radius_along(pixel: vec2u, step: vec2i, surface_id: u32, position: vec3f, normal: vec3f, wo: vec3f, alpha: f32) -> f32 {
  var slope2 = 0.0;
  for (var side = -1; side <= 1; side += 2) {
    let beside = vec2i(pixel) + step * side;
    if is_beside(beside, surface_id) { slope2 = max(slope2, slope2_of(vec2u(beside), position, normal, wo)); }
  }
  return min(LOBE_REACH * alpha / sqrt(max(slope2, 1e-12)), MOST_RADIUS);
}

@compute @workgroup_size(TILE, TILE)
fn blur_mirrors(@builtin(global_invocation_id) invocation: vec3u) {
  let pixel = vec2u(invocation.x, invocation.y + frame.band.x);
  if pixel.x >= frame.size.x || pixel.y >= frame.band.y { return; }
  let at = mirror_image_at(pixel);
  let is_further_sample = branch_value(frame.sample, pixel.x) > 0u;
  var sum = vec4f(0.0);
  if is_further_sample { sum = mirror_image[at + 2u]; }
  let own = mirror_image[at];
  let id = textureLoad(triangle_ids, pixel, 0).x;
  if id > 0u {
    let surface_id = textureLoad(surface_ids, pixel, 0).x;
    let m = materials[triangles[id - 1u].material];
    let hit = with_coordinates(pixel, hit_at(pixel, id - 1u));
    let r = reflection(hit, m);
    let normal = shading_normal(hit, m);
    let cosine = dot(normal, hit.wo);
    let reflected = mirror_fresnel(r, cosine) * mirror_share(r, cosine);
    var blurred = vec4f(own.xyz, select(0.0, 1.0, own.w > 0.0));
    if any(reflected > vec3f(0.0)) && r.alpha >= WIDE_ALPHA && !is_spread(r) {
      let radius = vec2f(
        radius_along(pixel, vec2i(1, 0), surface_id, hit.position, normal, hit.wo, r.alpha),
        radius_along(pixel, vec2i(0, 1), surface_id, hit.position, normal, hit.wo, r.alpha),
      );
      let a2 = r.alpha * r.alpha;
      // A first sample has its own ray; further ones take that of the first for it, if it sent one.
      if is_further_sample && is_beside(vec2i(pixel), surface_id) { blurred += vec4f(image_at(pixel).xyz, 1.0); }
      let taps = u32(clamp(TAPS_PER_RADIUS * max(radius.x, radius.y), 0.0, MOST_TAPS));
      for (var i = 0u; i < taps; i++) {
        // Vogel's spiral.
        let angle = 2.39996323 * f32(i);
        let away = sqrt((f32(i) + 0.5) / f32(taps));
        let beside = vec2i(floor(vec2f(pixel) + 0.5 + radius * away * vec2f(cos(angle), sin(angle))));
        if !is_beside(beside, surface_id) || all(beside == vec2i(pixel)) { continue; }
        let slope2 = slope2_of(vec2u(beside), hit.position, normal, hit.wo);
        let tail = a2 / (slope2 + a2);
        blurred += vec4f(image_at(vec2u(beside)).xyz, 1.0) * (tail * tail);
      }
    }
    sum += vec4f(reflected * blurred.xyz / max(blurred.w, 1e-6), 0.0);
  }
  if !is_further_sample { mirror_image[at + 3u] = own; }
  mirror_image[at + 2u] = sum;
}

@compute @workgroup_size(TILE, TILE)
fn put_mirrors(@builtin(global_invocation_id) invocation: vec3u) {
  let pixel = vec2u(invocation.x, invocation.y + frame.band.x);
  if pixel.x >= frame.size.x || pixel.y >= frame.band.y { return; }
  let words = textureLoad(picture, pixel, 0).xy;
  let reflected = mirrored_at(pixel) / f32(frame.samples);
  textureStore(with_mirrors, pixel, pack_pixel(unpack_radiance(words) + reflected, coverage_of(words)));
}
