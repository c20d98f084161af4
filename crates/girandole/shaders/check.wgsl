// The places that `refine.wgsl` left open: on curved surfaces, near edges, in light that changes. Each is interpolated
// after all, or it is shaded.

@group(2) @binding(0) var ids: texture_2d<u32>;
@group(2) @binding(1) var<storage, read> receivers: array<u32>;
@group(2) @binding(2) var<storage, read_write> wanted: array<atomic<u32>>; // how many points, points of each leaf, points
@group(2) @binding(3) var<uniform> plan: Plan;
@group(2) @binding(4) var keys: texture_2d<u32>;
// The coarser grid: irradiance and key; specular radiance, or the direction of light.
@group(2) @binding(5) var coarse_light: texture_2d<f32>;
@group(2) @binding(6) var coarse_second: texture_2d<f32>;
@group(2) @binding(7) var fine_light: texture_storage_2d<rgba32float, write>;
@group(2) @binding(8) var fine_second: texture_storage_2d<rgba32float, write>;
@group(2) @binding(9) var<storage, read> open: array<u32>; // see lib/grid.wgsl
@group(2) @binding(10) var picture: texture_storage_2d<rg32uint, write>;

override CURVED: bool = false; // whether some surface is
override SPECULAR: bool = false;

// Normals of a curved surface that are interpolated between differ by less than 26 degrees, those of a normal map, which
// turn back and forth, by less than 14,
const BEND = 0.9;
const RIPPLE = 0.97;
// and one sees the other's point over itself by less than 17.
const RISE = 0.3;
// Steepest change that is interpolated where it is even, in units of the tolerance,
const STEEPEST = 5.0;
// and largest with which light goes on up to an edge.
const EVEN = 0.5;

// Key and material of the pixel at a place.
fn shown_at(at: vec2u) -> vec2u {
  return textureLoad(keys, at + vec2u(0u, frame.band.x), 0).xy;
}

// Shades all points of the grid: the coarsest one, or with a step of 1 every pixel.
@compute @workgroup_size(8, 8)
fn every(@builtin(global_invocation_id) invocation: vec3u) {
  if any(invocation.xy >= grid_size(frame.step)) { return; }
  let at = place_of(invocation.xy, frame.step);
  if shown_at(at).x != 0u { want(at); } else { textureStore(fine_light, invocation.xy, vec4f(0.0)); }
}

// A surface point whose normal counts.
struct Place { is_bent: bool, position: vec3f, geometric: vec3f, normal: vec3f, bend: f32 }

fn place_at(at: vec2u) -> Place {
  let pixel = at + vec2u(0u, frame.band.x);
  let triangle = max(textureLoad(ids, pixel, 0).x, 1u) - 1u;
  var hit = hit_at(pixel, triangle);
  let m = materials[triangles[triangle].material];
  if TEXTURES { hit = with_coordinates(pixel, hit); }
  let is_mapped = TEXTURES && m.normal_texture.texture != NONE;
  return Place(true, hit.position, hit.geometric_normal, shading_normal(hit, m), select(BEND, RIPPLE, is_mapped));
}

// What a point of the coarser grid would have a place receive; whether both lie on one surface.
struct Neighbour { irradiance: vec3f, second: vec3f, fits: bool, is_bent: bool }

fn neighbour(point: vec2i, place: Place, key: u32) -> Neighbour {
  let size = vec2i(grid_size(2u * frame.step));
  let inside = all(point >= vec2i(0)) && all(point < size);
  let at = vec2u(clamp(point, vec2i(0), size - 1));
  let light = textureLoad(coarse_light, at, 0);
  var result = Neighbour(light.xyz, vec3f(0.0), inside && u32(light.w) == key, place.is_bent);
  if place.is_bent || SPECULAR { result.second = textureLoad(coarse_second, at, 0).xyz; }
  if place.is_bent {
    // On a curved surface light comes from a direction, and the place's normal differs.
    let other = place_at(place_of(at, 2u * frame.step));
    let between = other.position - place.position;
    let rise = max(abs(dot(other.geometric, between)), abs(dot(place.geometric, between)));
    let toward = result.second;
    let cosine = dot(other.normal, toward);
    // Where all light grazes, its direction says little of what a turned surface would receive.
    result.fits = result.fits && dot(other.normal, place.normal) > place.bend && rise <= RISE * length(between)
      && cosine >= 0.1 * length(toward);
    result.irradiance *= max(dot(place.normal, toward), 0.0) / max(cosine, 1e-20);
  }
  return result;
}

// Largest difference of what two neighbours receive; 0 where one of them lies elsewhere.
fn spread(a: Neighbour, b: Neighbour) -> f32 {
  var d = abs(a.irradiance - b.irradiance);
  if SPECULAR && !a.is_bent { d = max(d, abs(a.second - b.second) * PI); }
  return select(0.0, max(d.x, max(d.y, d.z)), a.fits && b.fits);
}

// By how much light bends at `near`: `beyond` lies as far from it as `across` on the other side.
fn bend(near: Neighbour, across: Neighbour, beyond: Neighbour) -> f32 {
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
fn check(@builtin(global_invocation_id) invocation: vec3u, @builtin(num_workgroups) groups: vec3u) {
  let count = open[3];
  var first = invocation.x;
  for (var taken = 0u; taken < select(1u, QUOTA, TAKES); taken++) {
    if TAKES { first = PLACES * atomicAdd(&wanted[CURSOR], 1u); }
    if first >= count { break; }
    for (var index = first; index < min(first + select(1u, PLACES, TAKES), count); index++) { check_place(index, false); }
  }
  if !TAKES { return; }
  if CURVED {
    let bent_count = open[BENT_HEADER + 3u];
    for (var taken = 0u; taken < QUOTA; taken++) {
      let first_bent = PLACES * atomicAdd(&wanted[BENT_CURSOR], 1u);
      if first_bent >= bent_count { break; }
      for (var index = first_bent; index < min(first_bent + PLACES, bent_count); index++) { check_place(index, true); }
    }
  }
  if atomicAdd(&wanted[LEFT], 1u) + 1u == WIDTH * groups.x {
    atomicStore(&wanted[CURSOR], 0u);
    atomicStore(&wanted[BENT_CURSOR], 0u);
    atomicStore(&wanted[LEFT], 0u);
  }
}

@compute @workgroup_size(64)
fn check_bent(@builtin(global_invocation_id) invocation: vec3u) {
  if invocation.x < open[BENT_HEADER + 3u] { check_place(invocation.x, true); }
}

// In `wanted`, for lib/take.wgsl: the next run of places, of those on curved surfaces, and how many have left.
const CURSOR = 1u;
const BENT_CURSOR = 2u;
const LEFT = 3u;

fn check_place(index: u32, is_bent: bool) {
  let packed = open[select(FIRST_PLACE + index, arrayLength(&open) - 1u - index, is_bent)];
  let at = vec2u(packed & 0xffffu, packed >> 16u);
  let wide = 2u * frame.step;
  let last = last_point();
  let shown = shown_at(at);
  let key = shown.x;
  var place: Place;
  if is_bent { place = place_at(at); }
  // Neighbours on the coarser grid; along an axis on which this place lies on it, the place itself.
  let on_grid = (at == last) | (at % wide == vec2u(0u));
  let low = select(at / wide, (at + wide - 1u) / wide, on_grid);
  let high = select(low + 1u, low, on_grid);
  let span = place_of(high, wide) - place_of(low, wide);
  let t = select(vec2f(at - place_of(low, wide)) / vec2f(max(span, vec2u(1u))), vec2f(0.0), on_grid);
  let pa = vec2i(low);
  let pb = vec2i(vec2u(high.x, low.y));
  let pc = vec2i(vec2u(low.x, high.y));
  let pd = vec2i(high);
  let a = neighbour(pa, place, key);
  let b = neighbour(pb, place, key);
  let c = neighbour(pc, place, key);
  let d = neighbour(pd, place, key);
  // Bilinear weights, of those neighbours that lie on the same surface.
  let w = vec4f((1.0 - t.x) * (1.0 - t.y), t.x * (1.0 - t.y), (1.0 - t.x) * t.y, t.x * t.y)
    * vec4f(f32(a.fits), f32(b.fits), f32(c.fits), f32(d.fits));
  let weight = dot(w, vec4f(1.0));
  let scale = 1.0 / max(weight, 1e-6);
  var value = (a.irradiance * w.x + b.irradiance * w.y + c.irradiance * w.z + d.irradiance * w.w) * scale;
  let second = (a.second * w.x + b.second * w.y + c.second * w.z + d.second * w.w) * scale;
  let range = max(max(spread(a, b), spread(c, d)),
    max(max(spread(a, c), spread(b, d)), max(spread(a, d), spread(b, c))));
  let allowed = allowed_range(value);
  let all_fit = a.fits && b.fits && c.fits && d.fits;
  // Near an edge some neighbours lie elsewhere: three of four will do where they agree, and from pixel to pixel of a
  // plane one. (The key is asked lest uniforms alone decide, see lib/tied.wgsl.)
  let may_extend = (key & BENT) == 0u && frame.tolerance > 0.0;
  let least = select(0.7, 0.2, may_extend && frame.step == 1u);
  var stands = weight > least && range <= select(0.5, 1.0, all_fit) * allowed;
  if !stands {
    let reach = select(vec2i(1), vec2i(0), on_grid);
    let a2 = neighbour(pa - reach, place, key);
    let b2 = neighbour(pb + vec2i(1, -1) * reach, place, key);
    let c2 = neighbour(pc + vec2i(-1, 1) * reach, place, key);
    let d2 = neighbour(pd + reach, place, key);
    if all_fit {
      // Light that changes evenly may be interpolated over a larger range: what counts is how it bends.
      let most = max(max(bend(a, d, a2), bend(d, a, d2)), max(bend(b, c, b2), bend(c, b, c2)));
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
  if stands && (key & SHINY) == 0u {
    let other = vec4f(second, select(0.0, 1.0, is_bent));
    if FINAL {
      let pixel = at + vec2u(0u, frame.band.x);
      textureStore(picture, pixel, pack_radiance(radiance_of(paint_of(shown.y), value, other)));
    } else {
      let point = (at + frame.step - 1u) / frame.step;
      textureStore(fine_light, point, vec4f(value, f32(key)));
      if CURVED || SPECULAR { textureStore(fine_second, point, other); }
    }
  } else {
    want(at);
  }
}
