// The candidates of `refine.wgsl`: on curved surfaces, near edges, in light that changes. Each is interpolated
// after all, or it is shaded.

@group(2) @binding(0) var triangle_ids: texture_2d<u32>;
@group(2) @binding(1) var<storage, read> receivers: array<u32>;
@group(2) @binding(2) var<storage, read_write> shade_list: array<atomic<u32>>; // how many points, points of each leaf, points
@group(2) @binding(3) var<uniform> offsets: BufferOffsets;
@group(2) @binding(4) var surface_ids: texture_2d<u32>;
// The coarser grid: irradiance and surface_id; specular radiance, or the direction of light.
@group(2) @binding(5) var coarse_irradiance: texture_2d<f32>;
@group(2) @binding(6) var coarse_directional: texture_2d<f32>;
@group(2) @binding(7) var fine_irradiance: texture_storage_2d<rgba32float, write>;
@group(2) @binding(8) var fine_directional: texture_storage_2d<rgba32float, write>;
@group(2) @binding(9) var<storage, read> candidates: array<u32>; // see lib/grid.wgsl
@group(2) @binding(10) var picture: texture_storage_2d<rg32uint, write>;

override HAS_CURVED: bool = false; // whether some surface is
override HAS_SPECULAR: bool = false;

// Normals of a curved surface that are interpolated between differ by less than 26 degrees, those of a normal map, which
// turn back and forth, by less than 14,
const MIN_NORMAL_COSINE = 0.9;
const MIN_NORMAL_COSINE_MAPPED = 0.97;
// and one sees the other's point over itself by less than 17.
const RISE = 0.3;
// Steepest change that is interpolated where it is even, in units of the tolerance,
const STEEPEST = 5.0;
// and largest with which light goes on up to an edge.
const EVEN = 0.5;

// Key and material of the pixel at a place.
fn shown_at(at: vec2u) -> vec2u {
  return textureLoad(surface_ids, at + vec2u(0u, frame.band.x), 0).xy;
}

// Shades all points of the grid: the coarsest one, or with a step of 1 append_all_points pixel.
@compute @workgroup_size(8, 8)
fn append_all_points(@builtin(global_invocation_id) invocation: vec3u) {
  if any(invocation.xy >= grid_size(frame.step)) { return; }
  let at = pixel_of_point(invocation.xy, frame.step);
  if shown_at(at).x != 0u { append_point(at); } else { textureStore(fine_irradiance, invocation.xy, vec4f(0.0)); }
}

// A surface point whose normal counts.
struct CurvedPoint { is_curved: bool, position: vec3f, geometric: vec3f, normal: vec3f, min_normal_cosine: f32 }

fn curved_point_at(at: vec2u) -> CurvedPoint {
  let pixel = at + vec2u(0u, frame.band.x);
  let triangle = max(textureLoad(triangle_ids, pixel, 0).x, 1u) - 1u;
  var hit = hit_at(pixel, triangle);
  let m = materials[triangles[triangle].material];
  if HAS_TEXTURES { hit = with_coordinates(pixel, hit); }
  let is_mapped = HAS_TEXTURES && m.normal_texture.texture != NONE;
  return CurvedPoint(true, hit.position, hit.geometric_normal, shading_normal(hit, m), select(MIN_NORMAL_COSINE, MIN_NORMAL_COSINE_MAPPED, is_mapped));
}

// What a point of the coarser grid would have a place receive; whether both lie on one surface.
struct Neighbour { irradiance: vec3f, directional: vec3f, fits: bool, is_curved: bool }

fn neighbour(point: vec2i, place: CurvedPoint, surface_id: u32) -> Neighbour {
  let size = vec2i(grid_size(2u * frame.step));
  let inside = all(point >= vec2i(0)) && all(point < size);
  let at = vec2u(clamp(point, vec2i(0), size - 1));
  let light = textureLoad(coarse_irradiance, at, 0);
  var result = Neighbour(light.xyz, vec3f(0.0), inside && u32(light.w) == surface_id, place.is_curved);
  if place.is_curved || HAS_SPECULAR { result.directional = textureLoad(coarse_directional, at, 0).xyz; }
  if place.is_curved {
    // On a curved surface light comes from a direction, and the place's normal differs.
    let other = curved_point_at(pixel_of_point(at, 2u * frame.step));
    let between = other.position - place.position;
    let rise = max(abs(dot(other.geometric, between)), abs(dot(place.geometric, between)));
    let light_direction = result.directional;
    let cosine = dot(other.normal, light_direction);
    // Where all light grazes, its direction says little of what a turned surface would receive.
    result.fits = result.fits && dot(other.normal, place.normal) > place.min_normal_cosine && rise <= RISE * length(between)
      && cosine >= 0.1 * length(light_direction);
    result.irradiance *= max(dot(place.normal, light_direction), 0.0) / max(cosine, 1e-20);
  }
  return result;
}

// Largest difference of what two neighbours receive; 0 where one of them lies elsewhere.
fn spread(a: Neighbour, b: Neighbour) -> f32 {
  var d = abs(a.irradiance - b.irradiance);
  if HAS_SPECULAR && !a.is_curved { d = max(d, abs(a.directional - b.directional) * PI); }
  return select(0.0, max(d.x, max(d.y, d.z)), a.fits && b.fits);
}

// By how much light bends at `near`: `beyond` lies as far from it as `across` on the other side.
fn second_difference(near: Neighbour, across: Neighbour, beyond: Neighbour) -> f32 {
  let d = abs(beyond.irradiance - 2.0 * near.irradiance + across.irradiance);
  return select(spread(near, across), max(d.x, max(d.y, d.z)), beyond.fits);
}

// Whether light changes little towards `near`, or that lies elsewhere.
fn is_even(near: Neighbour, beyond: Neighbour, allowed: f32) -> bool {
  return !near.fits || (beyond.fits && spread(near, beyond) <= allowed);
}

// Places on curved surfaces have loops or a dispatch of their own: where both sides of a branch are executed, others would
// spend most of their time on what these need.

@compute @workgroup_size(WIDTH)
fn test_candidates(@builtin(global_invocation_id) invocation: vec3u, @builtin(num_workgroups) groups: vec3u) {
  let count = candidates[3];
  var first = invocation.x;
  for (var taken = 0u; taken < select(1u, MAX_ITEMS, PERSISTENT_THREADS); taken++) {
    if PERSISTENT_THREADS { first = CANDIDATE_RUN * atomicAdd(&shade_list[NEXT_ITEM], 1u); }
    if first >= count { break; }
    for (var index = first; index < min(first + select(1u, CANDIDATE_RUN, PERSISTENT_THREADS), count); index++) { test_candidate(index, false); }
  }
  if !PERSISTENT_THREADS { return; }
  if HAS_CURVED {
    let curved_count = candidates[CURVED_HEADER + 3u];
    for (var taken = 0u; taken < MAX_ITEMS; taken++) {
      let first_curved = CANDIDATE_RUN * atomicAdd(&shade_list[NEXT_CURVED_ITEM], 1u);
      if first_curved >= curved_count { break; }
      for (var index = first_curved; index < min(first_curved + CANDIDATE_RUN, curved_count); index++) { test_candidate(index, true); }
    }
  }
  if atomicAdd(&shade_list[DONE], 1u) + 1u == WIDTH * groups.x {
    atomicStore(&shade_list[NEXT_ITEM], 0u);
    atomicStore(&shade_list[NEXT_CURVED_ITEM], 0u);
    atomicStore(&shade_list[DONE], 0u);
  }
}

@compute @workgroup_size(64)
fn test_curved_candidates(@builtin(global_invocation_id) invocation: vec3u) {
  if invocation.x < candidates[CURVED_HEADER + 3u] { test_candidate(invocation.x, true); }
}

// In `shade_list`, for lib/work_queue.wgsl: the next run of places, of those on curved surfaces, and how many have left.
const NEXT_ITEM = 1u;
const NEXT_CURVED_ITEM = 2u;
const DONE = 3u;

fn test_candidate(index: u32, is_curved: bool) {
  let packed = candidates[select(FIRST_CANDIDATE + index, arrayLength(&candidates) - 1u - index, is_curved)];
  let at = vec2u(packed & 0xffffu, packed >> 16u);
  let wide = 2u * frame.step;
  let last = last_point();
  let shown = shown_at(at);
  let surface_id = shown.x;
  var place: CurvedPoint;
  if is_curved { place = curved_point_at(at); }
  // Neighbours on the coarser grid; along an axis on which this place lies on it, the place itself.
  let on_grid = (at == last) | (at % wide == vec2u(0u));
  let low = select(at / wide, (at + wide - 1u) / wide, on_grid);
  let high = select(low + 1u, low, on_grid);
  let span = pixel_of_point(high, wide) - pixel_of_point(low, wide);
  let t = select(vec2f(at - pixel_of_point(low, wide)) / vec2f(max(span, vec2u(1u))), vec2f(0.0), on_grid);
  let pa = vec2i(low);
  let pb = vec2i(vec2u(high.x, low.y));
  let pc = vec2i(vec2u(low.x, high.y));
  let pd = vec2i(high);
  let a = neighbour(pa, place, surface_id);
  let b = neighbour(pb, place, surface_id);
  let c = neighbour(pc, place, surface_id);
  let d = neighbour(pd, place, surface_id);
  // Bilinear weights, of those neighbours that lie on the same surface.
  let w = vec4f((1.0 - t.x) * (1.0 - t.y), t.x * (1.0 - t.y), (1.0 - t.x) * t.y, t.x * t.y)
    * vec4f(f32(a.fits), f32(b.fits), f32(c.fits), f32(d.fits));
  let weight = dot(w, vec4f(1.0));
  let scale = 1.0 / max(weight, 1e-6);
  var value = (a.irradiance * w.x + b.irradiance * w.y + c.irradiance * w.z + d.irradiance * w.w) * scale;
  let directional = (a.directional * w.x + b.directional * w.y + c.directional * w.z + d.directional * w.w) * scale;
  let range = max(max(spread(a, b), spread(c, d)),
    max(max(spread(a, c), spread(b, d)), max(spread(a, d), spread(b, c))));
  let allowed = allowed_range(value);
  let all_fit = a.fits && b.fits && c.fits && d.fits;
  // Near an edge some neighbours lie elsewhere: three of four will do where they agree, and from pixel to pixel of a
  // plane one. (The surface id is tested lest uniforms alone decide, see lib/non_uniform.wgsl.)
  let may_extend = (surface_id & CURVED) == 0u && frame.tolerance > 0.0;
  let least = select(0.7, 0.2, may_extend && frame.step == 1u);
  var stands = weight > least && range <= select(0.5, 1.0, all_fit) * allowed;
  if !stands {
    let reach = select(vec2i(1), vec2i(0), on_grid);
    let a2 = neighbour(pa - reach, place, surface_id);
    let b2 = neighbour(pb + vec2i(1, -1) * reach, place, surface_id);
    let c2 = neighbour(pc + vec2i(-1, 1) * reach, place, surface_id);
    let d2 = neighbour(pd + reach, place, surface_id);
    if all_fit {
      // Light that changes evenly may be interpolated over a larger range: what counts is how it bends.
      let most = max(max(second_difference(a, d, a2), second_difference(d, a, d2)), max(second_difference(b, c, b2), second_difference(c, b, c2)));
      stands = range <= STEEPEST * allowed && most <= allowed;
    } else if may_extend {
      // On a plane, light that is even up to an edge goes on there.
      let even = EVEN * allowed;
      stands = weight > 0.2 && range <= even && is_even(a, a2, even) && is_even(b, b2, even)
        && is_even(c, c2, even) && is_even(d, d2, even);
      value += (w.x * (a.irradiance - a2.irradiance) + w.y * (b.irradiance - b2.irradiance)
        + w.z * (c.irradiance - c2.irradiance) + w.w * (d.irradiance - d2.irradiance)) * (0.5 * scale);
    }
  }
  if stands && (surface_id & SHINY) == 0u {
    let other = vec4f(directional, select(0.0, 1.0, is_curved));
    if WRITES_RADIANCE {
      let pixel = at + vec2u(0u, frame.band.x);
      textureStore(picture, pixel, pack_radiance(radiance_of(diffuse_material(shown.y), value, other)));
    } else {
      let point = (at + frame.step - 1u) / frame.step;
      textureStore(fine_irradiance, point, vec4f(value, f32(surface_id)));
      if HAS_CURVED || HAS_SPECULAR { textureStore(fine_directional, point, other); }
    }
  } else {
    append_point(at);
  }
}
